"""Lines of rolling elements in the spectrum itself: where they are found, and where nothing may be."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from bearing_cases import context_of, fault, record_of
from scipy.signal import lfilter

from gearsim_dsp.kinematics import fault_families
from gearsim_dsp.speed import Phase
from gearsim_io.machines import load_machine
from gearsim_twin.causes.bearing_signs import signs_of
from gearsim_twin.causes.bearing_spall_outer import BEARING_SPALL_OUTER
from gearsim_twin.causes.spalls import FAULT_NATS
from gearsim_twin.compare.passage_places import KIND, measure, places
from gearsim_twin.compare.passages import found_all, long_lines

RATE_HZ, SPEED_HZ, SECONDS, TOP_HZ = 16384.0, 25.0, 1.6, 7000.0
RESONANCE_HZ, Q = 1300.0, 13.0
MACHINE = load_machine("mfpt")
FAMILIES = [family for family in fault_families(MACHINE) if family.fault != "cage"]
OUTER, INNER = (next(f for f in FAMILIES if f.fault == fault) for fault in ("outer_race", "inner_race"))
SAMPLES = round(SECONDS * RATE_HZ)


def phase():
    """A shaft whose speed wanders by half a per cent."""
    t = np.arange(SAMPLES) / RATE_HZ
    turns = SPEED_HZ * (t + 0.005 / (2 * np.pi * 0.7) * np.sin(2 * np.pi * 0.7 * t))
    return Phase(np.arange(SAMPLES, dtype=np.float64), turns)


def ringing(order, depth=0.0):
    """Impacts at an order, each ringing in one resonance, with the rms of 1; `depth` by the shaft's turn."""
    turns = phase().turns
    passed = np.flatnonzero(np.diff(np.floor(turns * order)) > 0)
    x = np.zeros(SAMPLES)
    x[passed] = 1.0 + depth * np.cos(2 * np.pi * turns[passed])
    r, w = np.exp(-np.pi * RESONANCE_HZ / Q / RATE_HZ), 2 * np.pi * RESONANCE_HZ / RATE_HZ
    x = lfilter([1.0], [1.0, -2 * r * np.cos(w), r * r], x)
    return x / x.std()


def noise(seed, rms):
    return rms * np.random.default_rng([4, seed]).standard_normal(SAMPLES)


def found(*signals):
    lines = [long_lines(x, phase(), RATE_HZ, TOP_HZ, MACHINE) for x in signals]
    return [(family.fault, comb.order) for family, comb in found_all(lines, FAMILIES, [1.0], 1.0)]


@pytest.mark.parametrize(("family", "depth"), [(OUTER, 0.0), (INNER, 0.8)])
def test_events_lost_in_noise_are_found_by_two_records_together(family, depth):
    # 0.05 of the noise's power, half of it within 100 Hz: no envelope of a band of a kilohertz shows that.
    true = family.order * 0.9985
    pair = [ringing(true, depth) + noise(seed, 4.5) for seed in (1, 2)]
    told = found(*pair)
    assert [fault for fault, _ in told] == [family.fault]
    # Half a line at the last harmonic in the resonance.
    assert told[0][1] == pytest.approx(true, abs=0.5 / (SECONDS * SPEED_HZ) / 12)


def test_noise_shows_no_family():
    told = [found(noise(seed, 1.0), noise(seed + 100, 1.0)) for seed in range(20)]
    assert sum(map(len, told)) == 0


def test_a_tone_and_lines_of_the_shaft_are_no_passages():
    turns = phase().turns
    tone = 0.3 * np.sin(2 * np.pi * 15 * OUTER.order * turns)
    shaft = sum(0.3 * np.sin(2 * np.pi * k * turns + k * k) for k in range(1, 200))
    assert not found(*(tone + noise(20 + seed, 1.0) for seed in range(4)))
    assert not found(shaft + noise(5, 1.0))


def test_lines_of_the_clearest_family_are_no_evidence_for_another():
    assert [fault for fault, _ in found(ringing(INNER.order, 0.9) + noise(6, 0.1))] == ["inner_race"]


def plan_of(signals, source="tacho"):
    """Places for some records, and a way to read them."""
    record = SimpleNamespace(sample_rate_hz=RATE_HZ, channels=("a",))
    frame = SimpleNamespace(
        has_orders=True,
        machine=MACHINE,
        channels=("a",),
        top_hz=TOP_HZ,
        families=tuple(
            SimpleNamespace(
                label=f.label,
                fault=f.fault,
                order=f.order,
                sideband_order=f.sideband_order,
                tolerance=f.tolerance,
            )
            for f in FAMILIES
        ),
    )
    materials = [
        SimpleNamespace(
            view=SimpleNamespace(record=record, source=source),
            frame=frame,
            phase=phase(),
            rate_hz=RATE_HZ,
            speed_hz=SPEED_HZ,
            samples=lambda _, x=x: x,
            _kept={},
        )
        for x in signals
    ]
    return places(frame, materials), materials


def test_the_level_of_a_run_is_that_of_its_lines():
    amplitude = 0.2
    turns = phase().turns
    lines = sum(amplitude * np.cos(2 * np.pi * k * OUTER.order * turns + k * k) for k in range(11, 27))
    wanted, (material,) = plan_of([lines + noise(7, 1.0)])
    assert wanted
    # High multiples of a turn are told by marks alone.
    assert not plan_of([lines + noise(7, 1.0)], "estimated")[0]
    assert all(place.kind == KIND and place.label.endswith(OUTER.label) for place in wanted)
    levels = measure(material, wanted)
    # Four cosines, and white noise of the density 2 / rate in the bandwidth of the lines.
    expected = 4 * amplitude**2 / 2 + 2.0 / RATE_HZ * levels.bandwidth_hz
    z = (levels.level_db - 10 * np.log10(expected)) / np.hypot(levels.std_db, 0.2)
    full = levels.bandwidth_hz == levels.bandwidth_hz.max()  # runs of which no line falls on a shaft's
    assert full.sum() >= 2
    assert np.all(np.abs(z[full]) < 3.5)
    assert np.all(levels.std_db < 1.5)


def test_nothing_is_compared_where_the_model_shows_such_lines_itself():
    # What a sound bearing does hangs on its clearance; the second is a simulation without noise.
    sound = ringing(OUTER.order)
    runs = [
        {place.label.split(" x ")[0] for place in plan_of([1.5 * sound + noise(8, 1.0), share * sound])[0]}
        for share in (1e-3, 1.0)
    ]
    assert {"11", "15"} <= runs[0]  # about the resonance
    assert not {"11", "15"} & runs[1]


def in_a_hall(seed, *faults):
    """A record of the bearing rig whose noise hides what a good sensor would show."""
    record = record_of("mfpt", *faults, seed=seed, seconds=1.6)
    loud = np.random.default_rng([9, seed]).standard_normal(record.data.shape)
    return replace(record, data=record.data + np.float32(36.0) * loud.astype(np.float32))


@pytest.fixture(scope="module")
def hall():
    spall = fault("mfpt", "outer_race_spall", width_m=2.2e-4)
    return {
        "spall": context_of("mfpt", in_a_hall(11, spall), in_a_hall(12, spall)),
        "again": context_of("mfpt", in_a_hall(13, spall)),
        "sound": context_of("mfpt", in_a_hall(14), in_a_hall(15)),
    }


def test_a_spall_that_no_envelope_shows_is_guessed_and_found_again(hall):
    assert all(not signs_of(view) for view in hall["spall"].views)
    starts = BEARING_SPALL_OUTER.starts(hall["spall"])
    assert {start["component"] for start in starts} == {"test_bearing"}
    again = [hall["again"], hall["sound"]]
    told = [BEARING_SPALL_OUTER.told_again(starts[0], hall["spall"], one) for one in again]
    assert told == [FAULT_NATS, 0.0]


def test_a_sound_machine_in_a_hall_is_asked_for_no_spall(hall):
    assert BEARING_SPALL_OUTER.starts(hall["sound"]) == []
