"""Silence, constants, clipping, single spikes: every method of separation and impulsiveness bears them."""

import numpy as np
import pytest

from gearsim_dsp.band_choice import choose_band
from gearsim_dsp.impulsive.autogram import choose_by_autogram
from gearsim_dsp.impulsive.protrugram import choose_by_protrugram
from gearsim_dsp.impulsive.spectral_kurtosis import spectral_kurtosis
from gearsim_dsp.kurtogram import fast_kurtogram
from gearsim_dsp.separation.adaptive import sanc
from gearsim_dsp.separation.cepstrum import exponential_lifter, liftered, prewhitened
from gearsim_dsp.separation.deconvolution import med
from gearsim_dsp.separation.linear_prediction import ar_residual, kurtosis_by_length
from gearsim_dsp.separation.random_separation import drs
from gearsim_io.errors import InputError

N, RATE = 16_384, 10_000.0
T = np.arange(N)
SIGNALS = {
    "zeros": np.zeros(N),
    "constant": np.full(N, -3.0),
    "spike": np.where(T == 5000, 1e6, 0.0),
    "clipped sine": np.clip(10 * np.sin(0.05 * T), -1, 1),
    "integers": np.random.default_rng(0).integers(-3, 4, N),
    "tiny": 1e-150 * np.random.default_rng(1).standard_normal(N),
    "huge": 1e60 * np.random.default_rng(1).standard_normal(N),
}
SAME_LENGTH = {
    "ar": lambda x: ar_residual(x, 50),
    "drs": lambda x: drs(x, 100, 1024)[1],
    "sanc": lambda x: sanc(x, 20, 64)[1],
    "cpw": prewhitened,
    "lifter": lambda x: liftered(x, exponential_lifter(N, 50.0)),
    "med": lambda x: med(x, 20, 5).values,
}
CHOICES = {
    "kurtogram": lambda x: choose_band(x, RATE, 200.0),
    "autogram": lambda x: choose_by_autogram(x, RATE, 200.0, np.random.default_rng(0)),
    "protrugram": lambda x: choose_by_protrugram(x, RATE, 200.0, np.random.default_rng(0)),
}


@pytest.mark.parametrize("kind", SIGNALS)
@pytest.mark.parametrize("method", SAME_LENGTH)
def test_separation_gives_finite_samples(method, kind):
    x = SIGNALS[kind]
    silent = np.ptp(x) == 0
    if method == "med" and silent:
        with pytest.raises(InputError, match="varies"):
            SAME_LENGTH[method](x)
        return
    values = SAME_LENGTH[method](x)
    assert values.shape == (N,)
    assert np.all(np.isfinite(values))
    if silent and method != "lifter":
        np.testing.assert_allclose(values, 0.0, atol=1e-12)


@pytest.mark.parametrize("kind", SIGNALS)
def test_impulsiveness_is_finite(kind):
    x = np.asarray(SIGNALS[kind], dtype=np.float64)
    assert np.all(np.isfinite(spectral_kurtosis(x, RATE, 128).values))
    assert all(np.isfinite(node.kurtosis) for node in fast_kurtogram(x, RATE, 4).nodes)
    if np.ptp(x) > 0:
        assert np.all(np.isfinite(kurtosis_by_length(x, 50)))


@pytest.mark.parametrize("kind", ["zeros", "constant", "tiny", "integers"])
@pytest.mark.parametrize("method", CHOICES)
def test_no_band_is_chosen_where_nothing_repeats(method, kind):
    assert CHOICES[method](np.asarray(SIGNALS[kind], dtype=np.float64)).band is None
