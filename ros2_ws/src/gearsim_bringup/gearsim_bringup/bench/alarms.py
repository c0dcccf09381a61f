"""Alarms on the simulated rig, by the live monitors offline: how soon after a fault, how often without."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

from gearsim_bringup.bench.figure import Figure, Goal
from gearsim_bringup.ui import Voice
from gearsim_dsp.results import Alarm
from gearsim_dsp.streams.envelope_monitor import EnvelopeMonitor
from gearsim_dsp.streams.kurtosis_monitor import KurtosisMonitor
from gearsim_dsp.streams.report import AlarmedMonitor
from gearsim_io.batches import TorqueBatch
from gearsim_sim.scenario import Scenario, load_scenario
from gearsim_sim.simulation import simulate

SEEDS = (1, 2, 3, 4, 5)
AFTER_S, FAULT_S = 6.0, 8.0
HEALTHY_S = 600.0


def measure(voice: Voice) -> Iterator[Figure]:
    """Latency of the demo's spall over several seeds (worst), and false alarms in ten healthy minutes."""
    worst = 0.0
    for seed in SEEDS:
        scenario = dataclasses.replace(load_scenario("demo"), seed=seed)
        alarms = _alarms(voice, scenario, FAULT_S + AFTER_S)
        fault = FAULT_S * scenario.sample_rate_hz
        component = scenario.events[0].fault.component  # type: ignore[union-attr]
        samples = [alarm.sample for alarm in alarms if alarm.component == component and alarm.sample > fault]
        worst = max(worst, (min(samples) - fault) / scenario.sample_rate_hz if samples else float("inf"))
    yield Figure("alarm.latency_s", worst, "s", Goal("<", 3.0))
    alarms = _alarms(voice, load_scenario("healthy"), HEALTHY_S)
    yield Figure("alarm.false_in_10_min", float(len(alarms)), "alarms", Goal("<=", 0))


def _alarms(voice: Voice, scenario: Scenario, seconds: float) -> list[Alarm]:
    monitors = [
        AlarmedMonitor(EnvelopeMonitor(scenario.machine)),
        AlarmedMonitor(KurtosisMonitor(scenario.machine)),
    ]
    found: list[Alarm] = []
    with voice.progress() as bar:
        task = bar.add_task(f"{scenario.name}, seed {scenario.seed}", total=seconds)
        for batch in simulate(scenario, seconds):
            if isinstance(batch, TorqueBatch):
                continue
            for monitor in monitors:
                outcomes = monitor.push(batch)
                found += [alarm for outcome in outcomes for alarm in outcome.alarms if alarm.level > 0]
            bar.update(task, completed=batch.first_sample / scenario.sample_rate_hz)
    return found
