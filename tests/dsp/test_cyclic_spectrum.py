import numpy as np
import pytest
from bearing_signals import defect, noise, turns_of
from oracles.plain_fast_sc import fast_sc
from scipy.signal import hilbert, lfilter

from gearsim_dsp.cyclic.correlation import cyclic_spectrum
from gearsim_dsp.cyclic.slices import spectral_slices
from gearsim_dsp.spectra import welch_psd
from gearsim_dsp.speed import Phase
from gearsim_io.errors import InputError

RATE = 8192.0


def modulated(seconds, alpha_hz, depth, seed=1, phase=0.0, colour=True):
    """Noise of which the power goes as 1 + depth cos(2 pi alpha t + phase)."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds * RATE)) / RATE
    n = rng.standard_normal(t.size)
    if colour:
        n = lfilter([1.0], [1.0, -0.4, 0.5], n)
    return n * np.sqrt(1 + depth * np.cos(2 * np.pi * alpha_hz * t + phase))


def test_it_is_the_sum_over_lines_to_rounding():
    """Against a plain loop over bins and cyclic frequencies."""
    x = np.random.default_rng(2).standard_normal(3000)
    c = cyclic_spectrum(x, 1000.0, 50.0, 100.0)
    padded = round(1000.0 / c.alpha_step)
    taper = np.sin(np.pi * (np.arange(x.size) + 0.5) / x.size)
    lines = np.fft.rfft((x - x.mean()) * taper, padded)
    width = round(c.resolution_hz / c.alpha_step)
    assert c.alpha[-1] == pytest.approx(100.0, abs=c.alpha_step)
    for k, a in ((3, 0), (3, 7), (5, 200), (8, 599)):
        bins = np.arange(k * width, (k + 1) * width)
        plain = np.mean(lines[bins] * lines[bins - a].conj()) * 4 / (x.size * 1000.0)
        assert c.correlation[k, a] == pytest.approx(plain, rel=1e-9, abs=1e-15)


def test_modulated_noise_has_the_correlation_of_its_closed_form():
    """S(a, f) = S(0, f) m / 2 exp(j phase), in size and phase."""
    x = modulated(40.0, 37.0, 0.8, phase=0.7, colour=False)
    c = cyclic_spectrum(x, RATE, 64.0, 100.0)
    column = round(37.0 / c.alpha_step)
    g = c.coherence()[5:-2, column]
    # each value is a mean over `averages` lines, of which the real part has the variance 1 / (2 averages)
    error = 5 / np.sqrt(2 * c.averages * g.size)
    assert np.mean(g) == pytest.approx(0.4 * np.exp(0.7j), abs=error)
    assert np.sum(c.power) * c.resolution_hz == pytest.approx(np.var(x), rel=0.02)


def test_fast_sc_of_the_paper_and_the_cyclic_periodogram_agree():
    """Two independent estimators: a scan of short-time spectra, and scipy's cross-spectrum of shifted
    copies.
    """
    x = modulated(20.0, 37.0, 0.8, phase=0.7)
    alphas = [37.0, 91.0]
    c = cyclic_spectrum(x, RATE, 64.0, 100.0)
    scan = 2 * fast_sc(x, RATE, 128, alphas, 32)
    slices = spectral_slices(x, RATE, alphas, 64.0)
    columns = [round(alpha / c.alpha_step) for alpha in alphas]
    # bins begin where the others have lines: the mean of two bins stands at the line
    ours = 0.5 * (c.correlation[4:59, columns] + c.correlation[5:60, columns])
    power = np.mean(c.power[4:60])
    for theirs in (scan[5:60], slices.density[:, 5:60].T):
        gain = np.vdot(ours[:, 0], theirs[:, 0]) / np.vdot(ours[:, 0], ours[:, 0])
        assert gain == pytest.approx(1.0, abs=0.02)
        # at 91 Hz there is chance alone, 1 / sqrt(averages) of the power, in both
        assert np.mean(np.abs(theirs[:, 1])) < 1.5 * power / np.sqrt(c.averages)
    assert np.linalg.norm(scan[5:60, 0] - ours[:, 0]) < 0.1 * np.linalg.norm(ours[:, 0])


def test_the_sum_over_carriers_is_the_spectrum_of_the_squared_envelope():
    x = modulated(4.0, 37.0, 0.8)
    x = x - x.mean()
    c = cyclic_spectrum(x, RATE, 64.0, 100.0)
    taper = np.sin(np.pi * (np.arange(x.size) + 0.5) / x.size)
    envelope = np.abs(hilbert(x * taper, N=2 * x.size)) ** 2
    theirs = np.fft.fft(envelope)[: c.correlation.shape[1]] / x.size
    ours = np.sum(c.correlation, axis=0) * c.resolution_hz
    assert round(RATE / c.alpha_step) == 2 * x.size
    # half the line at 0 Hz and the lines beyond the last bin differ
    assert np.max(np.abs(ours - theirs)) < 2e-3 * abs(theirs[0])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_coherence_of_noise_follows_its_law(dtype):
    """1 - |g|^2 is U^(1 / (averages - 1)): mean and tails."""
    rng = np.random.default_rng(3)
    values = []
    for _ in range(12):
        x = rng.standard_normal(round(4 * RATE)).astype(dtype)
        c = cyclic_spectrum(x, RATE, 64.0, 100.0)
        values.append(c.squared_coherence()[5:-1, 40::4].ravel())
    g = np.concatenate(values)
    assert np.mean(g) * c.averages == pytest.approx(1.0, abs=0.03)
    for p in (0.1, 0.01, 0.001):
        # about 60,000 independent values; the bins' edges and the taper make the law an approximation
        assert np.mean(g > c.coherence_map().threshold(p)) == pytest.approx(p, rel=0.25)


def test_coherence_is_bounded_even_where_there_is_next_to_nothing():
    """Tones, silence between, and a deep roll-off: Cauchy and Schwarz hold."""
    t = np.arange(20_000) / RATE
    x = np.sin(2 * np.pi * 1000 * t) + 1e-6 * np.random.default_rng(4).standard_normal(t.size)
    for dtype in (np.float32, np.float64):
        c = cyclic_spectrum(x.astype(dtype), RATE, 128.0, 300.0)
        assert np.all(np.isfinite(c.squared_coherence()))
        assert c.squared_coherence().max() <= 1.0
    # and in double precision not by being cut at 1
    assert np.abs(c.coherence()).max() <= 1.0 + 1e-6


def test_the_power_is_welchs():
    x = modulated(20.0, 37.0, 0.5)
    c = cyclic_spectrum(x, RATE, 128.0, 100.0)
    psd = welch_psd(x, RATE, 8.0)
    for k in (3, 12, 20):
        low, high = k * c.resolution_hz, (k + 1) * c.resolution_hz
        assert c.power[k] * c.resolution_hz == pytest.approx(psd.power(low, high), rel=0.15)


def test_orders_follow_a_changing_speed():
    """A defect at order 4.89 while the speed rises by a quarter: sharp over orders, smeared over Hz."""
    turns = turns_of(np.array([18.0, 23.0]), 6.0, RATE)
    rng = np.random.default_rng(5)
    signal = defect(rng, turns, RATE, 4.89, slip=0.0, resonance_hz=2500.0)
    x = signal.x + noise(rng, turns.size)
    at = np.append(np.arange(0, turns.size - 1, 50), turns.size - 1)
    phase = Phase(at.astype(float), turns[at])
    c = cyclic_spectrum(x, RATE, 128.0, 12.0, phase)
    assert c.alpha_unit == "order"
    assert 0.95 < c.alpha_step * 2 * (turns[-1] - turns[0]) <= 1
    in_orders = c.squared_coherence().mean(axis=0)
    assert c.alpha[20 + np.argmax(in_orders[20:])] == pytest.approx(4.89, abs=c.alpha_step)
    in_hz = cyclic_spectrum(x, RATE, 128.0, 12.0 * 23.0).squared_coherence().mean(axis=0)
    assert in_orders[20:].max() > 5 * in_hz[20:].max()


def test_at_constant_speed_orders_are_hz_over_speed():
    x = modulated(6.0, 48.9, 0.7)
    phase = Phase(np.array([0.0, x.size - 1.0]), np.array([3.0, 3.0 + 10 * (x.size - 1) / RATE]))
    orders = cyclic_spectrum(x, RATE, 64.0, 5.0, phase)  # nearly at the end of the axis
    hz = cyclic_spectrum(x, RATE, 64.0, 300.0)
    column, other = round(4.89 / orders.alpha_step), round(48.9 / hz.alpha_step)
    left, right = orders.coherence()[8:-1, column], hz.coherence()[8:-1, other]
    # the grid of angles and that of times differ by part of a sample, and the axes by a thousandth
    np.testing.assert_allclose(np.abs(left), np.abs(right), atol=0.02)
    assert abs(np.angle(np.vdot(left, right))) < 0.02


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"samples": np.arange(100.0)}, "at least 0.188 s"),
        ({"samples": np.full(8192, 0.1)}, "a signal that varies"),
        ({"samples": np.zeros((2, 8192))}, "a vector of finite values"),
        ({"samples": np.full(8192, np.nan)}, "a vector of finite values"),
        ({"highest_alpha": 4090.0}, "at most 4032"),
        ({"highest_alpha": 0.0}, "above 0"),
        ({"resolution_hz": 4000.0}, "a quarter"),
        ({"sample_rate_hz": np.nan}, "a rate above 0"),
        ({"samples": np.arange(300_000.0), "highest_alpha": 4000.0}, "a shorter stretch"),
        ({"phase": Phase(np.array([0.0, 50.0]), np.array([0.0, 1.0]))}, "all 8192 samples"),
    ],
)
def test_wrong_input_is_told(changes, word):
    arguments = {
        "samples": np.random.default_rng(0).standard_normal(8192),
        "sample_rate_hz": RATE,
        "resolution_hz": 64.0,
        "highest_alpha": 100.0,
    }
    with pytest.raises(InputError, match=word):
        cyclic_spectrum(**(arguments | changes))
