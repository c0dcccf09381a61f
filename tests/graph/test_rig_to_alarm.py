"""The simulated rig and the monitors in one process: spalls are named soon, a sound rig is left alone."""

from __future__ import annotations

import pytest

from gearsim_dsp.results import Level
from gearsim_dsp.streams.envelope_monitor import EnvelopeMonitor
from gearsim_dsp.streams.kurtosis_monitor import KurtosisMonitor
from gearsim_dsp.streams.report import AlarmedMonitor
from gearsim_sim.scenario import load_scenario
from gearsim_sim.simulation import Simulation


def outcomes(scenario, seconds, makers=(EnvelopeMonitor,), batch=4096):
    """Outcomes of each monitor over so many seconds of a scenario, and the sample rate."""
    simulation = Simulation(load_scenario(scenario))
    monitors = [AlarmedMonitor(make(simulation.machine)) for make in makers]
    found = [[] for _ in monitors]
    rate_hz, sent = float("inf"), 0
    while sent == 0 or sent < seconds * rate_hz:
        for item in simulation.advance(batch):
            rate_hz = item.sample_rate_hz
            for monitor, out in zip(monitors, found, strict=True):
                out += monitor.push(item)
        sent += batch
    return (found[0] if len(found) == 1 else found), rate_hz


def raised(found):
    return [alarm for o in found for alarm in o.alarms]


@pytest.mark.parametrize(
    ("scenario", "at_s", "component", "fault", "order"),
    [
        ("demo", 8.0, "bearing_3", "outer_race", 4.8904),
        ("inner_race", 0.0, "bearing_2", "inner_race", 7.1096),
        ("quick", 2.0, "bearing_3", "outer_race", 4.8904),
    ],
)
def test_an_injected_spall_is_named_within_three_seconds(scenario, at_s, component, fault, order):
    found, rate_hz = outcomes(scenario, at_s + 4.0)
    alarms = raised(found)
    first = alarms[0]
    assert (first.component, first.fault) == (component, fault)
    # the window that decides ends with this sample; there is none before the first two windows
    assert at_s < first.sample / rate_hz < max(at_s, 0.5) + 3.0
    assert {(a.component, a.fault) for a in alarms} == {(component, fault)}
    assert alarms[-1].level == Level.ERROR
    assert first.found_order == pytest.approx(order, rel=0.003)


def test_two_faults_are_told_apart():
    found, _ = outcomes("two_faults", 9.0)
    assert [(a.component, a.fault) for a in raised(found)] == [
        ("bearing_1", "outer_race"),
        ("bearing_4", "inner_race"),
    ]
    assert len(found[-1].present.active) == 2


def test_a_fault_is_held_while_the_rig_speeds_up():
    found, _ = outcomes("speed_ramp", 8.0)
    assert {(a.component, a.fault) for a in raised(found)} == {("bearing_3", "outer_race")}
    speeds = [f.speed_hz for o in found for f in o.report.features]
    assert max(speeds) > 1.5 * min(speeds)
    assert found[-1].present.level == Level.ERROR


def test_a_sound_rig_raises_nothing():
    """Ten minutes with several seeds were run once (docs/alarms.md); this is the size for every day."""
    found, _ = outcomes("healthy", 24.0, (EnvelopeMonitor, KurtosisMonitor))
    for out in found:
        assert len(out) >= 44
        assert raised(out) == []
