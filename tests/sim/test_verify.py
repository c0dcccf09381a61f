"""Accuracy against DOP853, order, energy and memory of every model; the whole sweep with `-m sweep`.

`.ci/run` and `./gearsim test` measure every model healthy, and of every table of the compiled loop one fault;
`./gearsim test -m sweep` measures every fault on every model (minutes).
"""

import dataclasses
import gc
import re
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from gearsim_sim.engine import Engine
from gearsim_sim.events import FaultSpec
from gearsim_sim.model.faults import REGISTRY
from gearsim_sim.model.loop_data import COLUMNS
from gearsim_sim.model.side_data import SIDE_TABLES
from gearsim_sim.verify import accuracy, energy
from gearsim_sim.verify.accuracy import HEALTHY, kinds_on, measure
from gearsim_sim.verify.energy import EnergyCase, balance
from gearsim_sim.verify.ledger import ledger
from gearsim_sim.verify.machines import SEED, model_names, params_of, plant_of
from gearsim_sim.verify.trajectory import Course, run

DOCS = Path(__file__).parents[2] / "docs"


def published():
    """(model, kind) -> error of docs/accuracy.md."""
    text = (DOCS / "accuracy.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\w+) \| (\w+) \| ([\w.]*) \| ([-+.e\d]+) \|", text, re.MULTILINE)
    return {(model, kind): float(error) for model, kind, _, error in rows}


def check(model, kind):
    """Within the limit, and near what the page says: another processor rounds otherwise, no more."""
    found = measure(model, kind)
    assert found.error < accuracy.limit(kind), found
    if kind != HEALTHY:
        # The fault acts, and what it does is right too: its effect stands far above the error.
        assert found.effect > 10 * found.error, found
    assert found.error < 2 * published()[model, kind], found


def tables_of(model, kind):
    plant = plant_of(model)
    spec = FaultSpec(kind, REGISTRY[kind].components(plant)[0])
    return {one.table for one in REGISTRY[kind].build(spec, plant, SEED).contributions}


@pytest.mark.parametrize("model", model_names())
def test_healthy_models_follow_dop853(model):
    check(model, HEALTHY)


# No fault has a pulse unless it is asked to be rectangular: a jump, which test_gear_faults measures.
TABLES = sorted({*COLUMNS, *SIDE_TABLES} - {"mesh_pulses"})


@pytest.mark.parametrize("table", TABLES)
def test_a_fault_of_each_table_follows_dop853(table):
    cases = ((model, kind) for model in model_names() for kind in kinds_on(model)[1:])
    check(*next(case for case in cases if table in tables_of(*case)))


@pytest.mark.sweep
@pytest.mark.parametrize("model", model_names())
@pytest.mark.parametrize("kind", [HEALTHY, *REGISTRY])
def test_every_fault_on_every_model_follows_dop853(model, kind):
    if kind in kinds_on(model):
        check(model, kind)


def test_the_page_tells_of_every_fault_on_every_model():
    assert set(published()) == set(accuracy.all_cases())


def test_the_scheme_keeps_its_order_with_contacts(monkeypatch):
    """Fourth order, with balls that come into contact and leave it; 32768 to 131072 steps per second."""
    monkeypatch.setattr(accuracy, "SECONDS", 0.005)
    errors = []
    for rate in (32768.0, 65536.0, 131072.0):
        monkeypatch.setattr(accuracy, "STEP_RATE_HZ", rate)
        errors.append(measure("lpm34").error)
    slope = -np.polyfit(np.log([1, 2, 4]), np.log(errors), 1)[0]
    assert 3.7 < slope < 5, (slope, errors)


@pytest.mark.parametrize("case", [EnergyCase("lpm34"), EnergyCase("lpm34", ramp=True)], ids=str)
def test_energy_is_balanced(case):
    assert balance(case).relative_residual < energy.LIMIT


@pytest.mark.parametrize("model", [name for name in model_names() if name != "lpm34"])
def test_energy_of_every_model_is_balanced(model):
    assert balance(EnergyCase(model), seconds=0.005).relative_residual < energy.LIMIT


@pytest.mark.parametrize("kind", energy.SMOOTH_KINDS)
def test_energy_with_a_smooth_fault_is_balanced(kind):
    case = next(case for case in energy.energy_cases() if case.kind == kind)
    found = balance(case, seconds=0.005)
    assert found.relative_residual < energy.LIMIT


def test_what_is_left_of_the_balance_shrinks_with_the_step():
    """From 1x to 4x by at least the third order: each ball that touches has a bent force there."""
    left = [balance(EnergyCase("lpm34"), n, 0.005).relative_residual for n in (1, 2, 4)]
    assert left[0] > 8 * left[1] > 0
    assert left[0] > 64 * left[2]


def broken_reaction(plant):
    """The damper of a bearing moves the shaft, but nothing comes back to the pedestal."""
    system = plant.system
    shaft, pedestal = system.dof("y_s3"), system.dof("y_p3")
    damping = system.damping.copy()
    damping[pedestal, pedestal] += damping[pedestal, shaft]
    damping[pedestal, shaft] = 0.0
    return dataclasses.replace(plant, system=dataclasses.replace(system, damping=damping))


def weaker_contact(plant):
    """The loop has a bearing that is not the one of the ledger."""
    seat = plant.bearings[2]
    law = dataclasses.replace(seat.law, load_factor=0.99 * seat.law.load_factor)
    seats = [*plant.bearings]
    seats[2] = dataclasses.replace(seat, law=law)
    return dataclasses.replace(plant, bearings=tuple(seats))


@pytest.mark.parametrize("spoil", [broken_reaction, weaker_contact])
def test_the_ledger_notices_what_is_wrong(spoil):
    plant = plant_of("lpm34")
    course = Course(0.005, plant.limits.speed_hz, plant.limits.load_nm)
    spoilt = run(spoil(plant), course, 4 * energy.RATE_HZ)
    assert ledger(dataclasses.replace(spoilt, plant=plant)).relative_residual > 10 * energy.LIMIT


@pytest.mark.parametrize("model", model_names())
def test_an_endless_run_needs_no_more_memory(model):
    """A million steps in 64 portions leave a fraction of one array of each portion behind (4 kB), at most.

    What does grow are Python's own stores of numbers, which are full after some hundred portions.
    """
    engine = Engine(params_of(model), SEED, 4096.0)

    def run_on(portions):
        for _ in range(portions):
            engine.advance(512)
        gc.collect()
        return tracemalloc.get_traced_memory()[0]

    tracemalloc.start()
    try:
        before = run_on(160)  # numba's lists of free numbers fill up, ever more slowly
        after = run_on(64)
    finally:
        tracemalloc.stop()
    assert after - before < 64 * 1000


@pytest.mark.parametrize("model", model_names())
def test_angles_keep_their_digits_in_long_runs(model):
    """After 2^31 steps every angle is where it has to be, to less than the angle of a step's rounding."""
    plant = plant_of(model)
    speed = 2.0  # a power of two: turns of the reference shaft are exact
    schedule = Course(1.0, speed, 0.0, turns=0.0, lead_s=0.0).schedule(plant, 2.0**-18)
    for number in range(1, 2**15 + 1):
        schedule.rebase(number * 2**16)
    turns = speed * 2.0**31 / 2**18
    for index, track in enumerate(plant.tracks):
        exact = track.offset_turns + track.rate * turns
        found = schedule.anchor_turns[index] + schedule.anchor_phases[index]
        assert found == pytest.approx(exact, abs=2e-16 * 2**15 + 4e-16 * abs(exact))
