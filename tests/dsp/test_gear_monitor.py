"""The gear monitor: indicators by synchronous average, judged against the healthy machine."""

from __future__ import annotations

import gc
import math
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from gearsim_dsp.alarms import AlarmSettings
from gearsim_dsp.results import Level
from gearsim_dsp.speed import Phase
from gearsim_dsp.streams.assembler import WindowSettings
from gearsim_dsp.streams.gear_monitor import GearMonitor, GearSettings
from gearsim_dsp.streams.gear_window import analyse_wheels, places_of, thinned
from gearsim_dsp.streams.report import AlarmedMonitor
from gearsim_io.errors import InputError
from gearsim_io.machines import load_machine
from gearsim_io.nameplate import Channel, GearMesh, Machine, Shaft
from gearsim_io.record import PulseTrain, Record

RATE_HZ, SPEED_HZ, TEETH = 8192.0, 20.0, 20
RATIO = 20 / 31
MACHINE = Machine(
    name="gear_rig",
    description="",
    reference_shaft="input",
    shafts=(Shaft("input", 1.0, SPEED_HZ), Shaft("output", RATIO, SPEED_HZ * RATIO)),
    gear_meshes=(GearMesh("gears", "input", "output", 20, 31),),
    channels=(Channel("a"), Channel("b")),
    tacho_shafts=("input",),
)
SETTINGS = GearSettings(WindowSettings(window_s=1.0, hop_s=0.5), learn_s=40.0)


def record(seconds, seed=1, fault_at_s=math.inf, on=1.0, depth=0.6, unbalance_at_s=math.inf, run_out=0.0):
    """A mesh with a pickup on two channels; from `fault_at_s` on one tooth of the shaft at `on` is soft."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    turns = SPEED_HZ * t
    mesh = sum(np.cos(2 * np.pi * TEETH * k * turns + k) / k for k in (1, 2, 3))
    mesh *= 1 + 0.1 * np.cos(2 * np.pi * turns) + run_out * np.cos(2 * np.pi * turns)
    angle = np.mod(on * turns - 0.3 + 0.5, 1.0) - 0.5
    dip = depth * np.exp(-0.5 * (angle * TEETH / 1.2) ** 2)
    mesh *= 1 - np.where(t >= fault_at_s, dip, 0.0)
    shaft = np.where(t >= unbalance_at_s, 1.0, 0.1) * np.cos(2 * np.pi * turns)
    data = np.stack([mesh + shaft, 0.5 * mesh + shaft]) + 0.3 * rng.standard_normal((2, t.size))
    pulses = np.arange(0.0, seconds, 1 / SPEED_HZ) * RATE_HZ
    tacho = PulseTrain("input", 1.0, pulses[(pulses > 0) & (pulses < t.size)])
    return Record(RATE_HZ, ("a", "b"), "m/s^2", data.astype(np.float32), (tacho,), machine="gear_rig")


def noise(seconds):
    """Nothing that turns, and no tacho."""
    data = np.random.default_rng(4).standard_normal((2, round(seconds * RATE_HZ))).astype(np.float32)
    return Record(RATE_HZ, ("a", "b"), "m/s^2", data, (), machine="gear_rig")


def run(rec, machine=MACHINE, settings=SETTINGS, monitor=None):
    watch = monitor or AlarmedMonitor(
        GearMonitor(machine, settings), AlarmSettings(raise_windows=3, of_windows=4)
    )
    outcomes = [o for batch in rec.batches(1024) for o in watch.push(batch)]
    return watch, outcomes, [a for o in outcomes for a in o.alarms]


def test_a_soft_tooth_is_told_with_its_gear_its_place_and_in_plain_words():
    watch, outcomes, alarms = run(record(60.0, fault_at_s=50.0))
    assert watch.monitor.keeper.words == "learnt from 40 s"
    assert {a.component for a in alarms} == {"gears.pinion"}
    first = alarms[0]
    assert 50.0 < first.t_ns / 1e9 < 50.0 + 3 * 0.5 + 1.0
    assert first.reason.startswith("gears.pinion: one tooth stands out, at 0.")
    assert "where the healthy machine has" in first.reason
    place = float(first.reason.split("stands out, at ")[1].split(" ")[0])
    assert place == pytest.approx(0.3, abs=0.06)  # about a tooth
    rows = {(v.component, v.name): v.value for v in outcomes[-1].report.features[0].values}
    assert rows["gears.pinion", "fm4"] > 4.5
    assert rows["gears.gear", "fm4"] < 4.0
    assert rows["input", "shaft_order_1"] == pytest.approx(0.1, abs=0.05)


def test_a_tooth_of_the_other_gear_is_told_by_its_own_average():
    _, _, alarms = run(record(60.0, fault_at_s=50.0, on=RATIO, depth=0.9))
    assert alarms
    assert {a.component for a in alarms} == {"gears.gear"}


def test_a_line_of_the_shaft_is_told_as_such():
    _, _, alarms = run(record(60.0, unbalance_at_s=50.0))
    assert {a.component for a in alarms} == {"input"}
    assert alarms[0].reason.startswith("input: the line at 1 times the shaft's speed has grown")


@pytest.mark.parametrize("seed", [1, 2])
def test_a_sound_machine_raises_nothing(seed):
    watch, _, alarms = run(record(80.0, seed=seed))
    assert alarms == []
    assert watch.present.level == Level.OK
    assert not watch.present.stale


def test_without_a_tacho_the_angle_is_followed_in_the_vibration():
    machine = replace(MACHINE, tacho_shafts=())
    settings = GearSettings(WindowSettings(window_s=2.0, hop_s=1.0), learn_s=15.0)
    watch, outcomes, alarms = run(replace(record(25.0, fault_at_s=20.0), tachos=()), machine, settings)
    assert not watch.present.stale
    assert {f.speed_source for f in outcomes[-1].report.features} == {"estimated"}
    assert {a.component for a in alarms} == {"gears.pinion"}


def test_before_anything_is_learnt_it_says_so():
    watch, outcomes, _ = run(record(10.0))
    assert watch.present.stale
    assert watch.present.note.startswith("no baseline to judge by: it is being learnt")
    assert outcomes[0].report.features
    assert not any(o.report.judged for o in outcomes)


def test_output_does_not_depend_on_the_size_of_batches():
    rec = record(12.0)

    def told(size):
        watch = AlarmedMonitor(GearMonitor(MACHINE, SETTINGS))
        return [repr(o.report.features) for b in rec.batches(size) for o in watch.push(b)]

    assert told(512) == told(3000)


@pytest.mark.parametrize(
    ("machine", "rec", "words"),
    [
        (replace(MACHINE, gear_meshes=()), record(5.0), "lists no gears"),
        (replace(MACHINE, tacho_shafts=()), noise(5.0), "no angle of the shafts in this window"),
        (
            replace(
                MACHINE,
                shafts=(Shaft("input", 1.0, SPEED_HZ), Shaft("output", 0.1, 2.0)),
                gear_meshes=(GearMesh("gears", "input", "output", 20, 200),),
            ),
            record(5.0),
            "shaft output: turns in a window: got 2.0, expected 8 or more; a longer window_s helps",
        ),
    ],
)
def test_what_cannot_be_judged_is_told_with_the_reason(machine, rec, words):
    watch, outcomes, _ = run(rec, machine)
    assert outcomes
    assert words in watch.present.note


def test_wheels_on_shafts_of_one_speed_share_a_name():
    places = places_of(load_machine("unsw_parallel"))
    assert [(p.label, p.wheels.label) for p in places] == [("input or output", "gears.pinion or gears.gear")]
    assert [p.wheels.names for p in places_of(MACHINE)] == [("gears.gear",), ("gears.pinion",)]
    planetary = load_machine("unsw_planetary")
    stage = planetary.planetary_stages[0]
    (place,) = [p for p in places_of(planetary) if p.wheels and stage.name in p.wheels.names]
    assert stage.carrier_shaft in place.shafts
    assert stage.ring_teeth in place.wheels.teeth


def test_thinning_keeps_the_mesh_and_its_harmonics():
    rate = 65536.0
    t = np.arange(round(2 * rate)) / rate
    phase = Phase(np.array([0.0, t.size - 1.0]), np.array([0.0, SPEED_HZ * t[-1]]))
    x = sum(np.cos(2 * np.pi * TEETH * SPEED_HZ * k * t) for k in (1, 8))
    few, angle = thinned(x.astype(np.float32), rate, phase, MACHINE, SPEED_HZ)
    assert few.size == t.size // 4
    pinion = next(p for p in places_of(MACHINE) if p.ratio == 1.0)
    result = analyse_wheels(few, angle, pinion, "m/s^2")
    assert result.values["mesh_level"][0] == pytest.approx(1.0, rel=0.01)  # two cosines: RMS 1
    with pytest.raises(InputError, match="8 or more"):
        analyse_wheels(few[:1000], Phase(angle.samples[:2] * 0.1, angle.turns[:2] * 0.1), pinion, "1")


def test_channels_that_are_broken_are_left_out():
    rec = record(5.0)
    data = rec.data.copy()
    data[1, :] = 0.25
    _, outcomes, _ = run(replace(rec, data=data))
    assert {f.channel for o in outcomes for f in o.report.features} == {"a"}
    assert any("b" in issue.channel for issue in outcomes[0].report.quality)


def test_a_baseline_that_was_stored_is_used_at_once():
    learnt, _, _ = run(record(45.0))
    again = AlarmedMonitor(
        GearMonitor(MACHINE, SETTINGS, baseline=learnt.monitor.keeper.baseline),
        AlarmSettings(raise_windows=3, of_windows=4),
    )
    _, outcomes, alarms = run(record(8.0, seed=9, fault_at_s=0.0), monitor=again)
    assert {a.component for a in alarms} == {"gears.pinion"}
    values = {(v.component, v.name): v.value for v in outcomes[-1].report.features[0].values}
    assert values["gears.pinion", "na4"] > 2 * values["gears.pinion", "fm4"]  # level counts beside shape


def test_memory_does_not_grow_with_the_length_of_the_stream():
    watch = AlarmedMonitor(GearMonitor(MACHINE, GearSettings(SETTINGS.window, learn_s=10.0)))
    held = []
    gc.collect()
    tracemalloc.start()
    try:
        for k, batch in enumerate(record(60.0).batches(1024)):
            watch.push(batch)
            if k in (480, 950):  # at 30 and at 59 s; each second has 8 batches of samples and 8 of the tacho
                gc.collect()
                held.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    assert len(held) == 2
    # Half a minute of samples would be 1.9 MB; free lists of small objects settle at some tens of kB.
    assert held[1] - held[0] < 100_000
