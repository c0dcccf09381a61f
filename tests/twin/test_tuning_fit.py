"""The tuning is found where a step along the slopes of the nominal model leads nowhere."""

from __future__ import annotations

import numpy as np
import pytest
import toy_rig
from toy_rig import LOADS, PLACES, SAMPLING_DB, NoNuisance, levels, places_features, yard_of

from gearsim_twin.causes.prior import LogNormal
from gearsim_twin.fit import fit_tuning
from gearsim_twin.model import Model
from gearsim_twin.tuning import Setting, Tuning
from gearsim_twin.workbench import Workbench

# A resonance known to a fourth of its frequency and 0.25 octaves wide: from the nominal one the measured one,
# two standard deviations off, is hardly to be seen.
WIDE = Tuning(
    (
        Setting("mesh", LogNormal(1.0, 1.1), (("mesh", 1.0, "1"),)),
        Setting("resonance", LogNormal(1.0, 1.25), (("resonance", 1.0, "1"),)),
    )
)


@pytest.fixture
def high(monkeypatch):
    """Its peak stands 36 dB over the rest."""
    bump = toy_rig.bump
    monkeypatch.setattr(toy_rig, "bump", lambda hz, octaves: 3.0 * bump(hz, octaves))


def bench_of(resonance, seed):
    rng = np.random.default_rng(seed)
    truth = {"resonance": {"value": resonance}}
    measured = tuple(
        places_features(
            PLACES,
            levels({"load": load, "parameters": truth}) + SAMPLING_DB * rng.standard_normal(len(PLACES)),
            SAMPLING_DB,
        )
        for load in (*LOADS, *LOADS)
    )

    def run(jobs):
        return [places_features(PLACES, levels(content), 0.5 * SAMPLING_DB) for _, content in jobs]

    nominal = tuple({"load": load} for load in (*LOADS, *LOADS))
    return Workbench(measured, nominal, (0, 1), run, NoNuisance())


@pytest.mark.usefixtures("high")
@pytest.mark.parametrize("resonance", [0.64, 0.9, 1.1, 1.56])
def test_a_resonance_far_from_where_it_was_thought_is_found(resonance):
    bench = bench_of(resonance, 5)
    tuned = fit_tuning(bench, yard_of(bench), Model(WIDE, WIDE.nominal))
    found = WIDE.settings[1].prior.value(float(tuned.at[1]))
    # The places lie 0.2 octaves apart; 3 % is 0.04. Steps along the first slopes alone end 10 to 40 % off.
    assert found == pytest.approx(resonance, rel=0.03)


@pytest.mark.usefixtures("high")
def test_a_model_that_tells_the_records_is_not_looked_around():
    bench = bench_of(1.0, 5)
    fit_tuning(bench, yard_of(bench), Model(WIDE, WIDE.nominal))
    # The nominal model, one beside it for each knob, and a step of two lengths at most, of two records.
    assert bench.simulations <= 2 * 5
