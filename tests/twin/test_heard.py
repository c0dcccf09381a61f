"""Simulated records with the noise of the sensors: what lies between the lines is not lifted any more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gearsim_dsp.spectra import welch_psd
from gearsim_twin.causes import CAUSES
from gearsim_twin.compare.chains import ChannelNuisance, Nuisance
from gearsim_twin.heard import heard
from tests.twin.chain_cases import RATE_HZ, accelerometers, context, healthy, record

DENSITY = 2e-4


def test_noise_has_the_density_of_the_floor_and_the_rest_is_as_before():
    (view,) = healthy("bearing", 1).simulated_views
    channel = view.record.channels[0]
    chain = Nuisance((ChannelNuisance(channel, 6.0, (500.0, 4000.0), (20.0, 40.0)),))
    noisy = heard(view, chain, 3)
    assert noisy.phase is view.phase
    added = noisy.signal(channel) - view.signal(channel)
    psd = welch_psd(added, view.record.sample_rate_hz, 50.0)
    for hz, db in ((200.0, 20.0), (4000.0, 40.0), (1414.2, 30.0)):
        near = np.abs(np.log2(np.maximum(psd.frequency_hz, 1.0) / hz)) < 0.15
        assert 10 * np.log10(np.mean(psd.density[near])) == pytest.approx(db, abs=1.0)
    for other in view.record.channels[1:]:
        assert np.array_equal(noisy.signal(other), view.signal(other))
    assert np.array_equal(heard(view, chain, 3).signal(channel), noisy.signal(channel))
    assert view.record.sample_rate_hz == RATE_HZ


@pytest.fixture(scope="module")
def swallowed():
    """A light mass in step with a resonance of the pedestal, under the noise of the sensor."""
    entry = {"site": "accel", "mass": "0.6 kg", "frequency": "609 Hz", "damping_ratio": 0.04}
    noisy = accelerometers(noise_density=f"{DENSITY} m/s^2/Hz^0.5")
    return context("bearing", record("bearing", 5, structure={"resonances": [entry]}, **noisy))


def test_a_mass_that_takes_a_resonance_away_is_found_beside_noise(swallowed):
    cause = CAUSES["casing_resonance"]
    floor = ChannelNuisance("accel", 0.0, (1.0,), (20 * np.log10(DENSITY),))
    beside = tuple(heard(view, Nuisance((floor,)), 3) for view in swallowed.simulated_views)
    first = cause.starts(replace(swallowed, noisy_views=beside))[0]
    assert first["frequency_hz"] == pytest.approx(609.0, rel=0.15)
    assert first["mass_kg"] == pytest.approx(0.6, rel=1.0)
    # Without the noise beside it all that lies between the lines is lifted, and no dip is seen.
    assert all(abs(one["frequency_hz"] / 609.0 - 1) > 0.15 for one in cause.starts(swallowed))
