"""The demonstration: a fault grows in the live rig and is found; then a measured record goes the same way."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

from gearsim_bringup.live import MONITORS, LiveRun, Outcome, player, simulator
from gearsim_bringup.tell import Teller
from gearsim_bringup.ui import Voice
from gearsim_io import cdr, qos
from gearsim_io.bags import read_bag
from gearsim_io.datasets import data_folders, find_record
from gearsim_io.errors import EnvironmentLackError
from gearsim_io.importers import import_to_bag
from gearsim_io.new_paths import refuse_existing
from gearsim_sim.scenario import Scenario, load_scenario

REAL_RECORD, REAL_MACHINE = "mfpt/OuterRaceFault_1.mat", "mfpt"


@dataclasses.dataclass(frozen=True)
class Delivery:
    """What a bag holds of the waveforms: samples per channel, how many miss between them, last log time."""

    samples: int
    lost: int
    last_ns: int


class Demo:
    """Runs the demonstration into the new folder `out`."""

    def __init__(self, voice: Voice, out: Path) -> None:
        refuse_existing(out, "the name of a new folder")
        self._voice = voice
        self._out = out

    def run(self, seconds: float, *, real: bool) -> dict[str, Any]:
        """The rig for that many simulated seconds, then the measured record; the summary's figures."""
        self._out.mkdir(parents=True)
        summary = self._rig(seconds)
        if real:
            summary["real"] = self._real()
        return summary

    def _rig(self, seconds: float) -> dict[str, Any]:
        say, scenario = self._voice.say, load_scenario("demo")
        say(f"virtual rig, {seconds:g} s: {scenario.description}")
        teller = Teller(self._voice, scenario.sample_rate_hz)
        bag = self._out / "bag"
        custom = {"scenario": scenario.name, "seed": str(scenario.seed)}
        source = simulator("demo", end_after=seconds, rate=1.0, listeners=len(MONITORS) + 1)
        live = LiveRun(source, self._out / "log", bag, custom, None, teller.alarm, teller.truth)
        outcome = live.run()
        self._warn(outcome)
        summary = self._summary(scenario, outcome, bag, seconds)
        summary["files"] = [str(bag), *self._pictures(bag, "demo")]
        self._tell_summary(summary)
        return summary

    def _warn(self, outcome: Outcome) -> None:
        if outcome.warning:
            self._voice.say(outcome.warning)

    def _summary(self, scenario: Scenario, outcome: Outcome, bag: Path, seconds: float) -> dict[str, Any]:
        delivery = deliveries(bag)
        sent = round(seconds * scenario.sample_rate_hz)
        began_ns = outcome.seen.truths[0][0] if outcome.seen.truths else 0
        stream = "simulator: pacing"
        took_s = (delivery.last_ns - began_ns) * 1e-9
        achieved = seconds / took_s if began_ns > 0 and took_s > 0 else None
        alarm = first_alarm_after_fault(outcome, scenario)
        return {
            "simulated_seconds": seconds,
            "samples_sent": sent,
            "samples_lost": sent - delivery.samples,
            "real_time_factor": achieved,
            "pacing": outcome.seen.levels.get(stream, (0, ""))[1],
            **alarm,
        }

    def _tell_summary(self, summary: dict[str, Any]) -> None:
        say, factor = self._voice.say, summary["real_time_factor"]
        pace = "not known" if factor is None else f"{factor:.3f}"
        say()
        say(
            f"sent {summary['samples_sent']} samples of each channel, lost {summary['samples_lost']}; "
            f"real-time factor {pace}"
        )
        if summary["alarm_seconds"] is None:
            say("no alarm was raised for the fault")
        else:
            say(
                f"from injection to alarm: {summary['alarm_seconds']:.2f} s of the stream, "
                f"{summary['alarm_wall_seconds']:.2f} s on the wall clock ({summary['alarm']})"
            )
        for file in summary["files"]:
            say(f"  {file}")

    def _pictures(self, bag: Path, name: str) -> list[str]:
        """The rerun recording and, where the machine can draw, the picture."""
        from gearsim_io import rerun_export

        rrd, png = self._out / f"{name}.rrd", self._out / f"{name}.png"
        rerun_export.export(bag, rrd)
        try:
            rerun_export.png(bag, png)
        except EnvironmentLackError as lack:
            self._voice.say(f"no picture: {lack}")
            return [str(rrd)]
        return [str(rrd), str(png)]

    def _real(self) -> dict[str, Any] | None:
        say, path = self._voice.say, find_record(REAL_RECORD)
        say()
        if path is None:
            looked = ", ".join(str(folder) for folder in data_folders())
            say(f"no measured record in {looked}; get some with: ./gearsim data get mfpt")
            return None
        measured = self._out / "measured"
        ((bag, record),) = import_to_bag([path], REAL_MACHINE, measured)
        say(
            f"measured record {path.name}, played live: {record.seconds:.1f} s at "
            f"{record.sample_rate_hz:g} Hz"
        )
        teller = Teller(self._voice, record.sample_rate_hz)
        replay = self._out / "measured_judged"
        source = player(bag, rate=1.0, loop=False, listeners=len(MONITORS) + 1, signals_only=True)
        custom = {"source_file": path.name}
        outcome = LiveRun(source, self._out / "log", replay, custom, None, teller.alarm, teller.truth).run()
        self._warn(outcome)
        alarms = [message for _, message in outcome.seen.alarms if message.level > 0]
        files = [str(measured), str(replay), *self._pictures(replay, "measured")]
        if not alarms:
            say("no alarm was raised")
        for file in files:
            say(f"  {file}")
        reason = alarms[0].reason if alarms else None
        return {"record": path.name, "machine": REAL_MACHINE, "alarm": reason, "files": files}


def deliveries(bag: Path) -> Delivery:
    """What arrived of the waveforms, by the batches' running index."""
    counter, samples, last_ns = cdr.GapCounter(), 0, 0
    for message in read_bag(bag, (qos.ACCEL.full_name,)):
        place = cdr.position(message.data, message.type)
        counter.add(message.topic, message.data, message.type)
        samples += place.sample_count if place else 0
        last_ns = max(last_ns, message.t_ns)
    return Delivery(samples, counter.lost_samples, last_ns)


def first_alarm_after_fault(outcome: Outcome, scenario: Scenario) -> dict[str, Any]:
    """Time from the injection to the first alarm on the faulty component; None where there is none."""
    nothing = {"alarm_seconds": None, "alarm_wall_seconds": None, "alarm": None}
    faults = [fault for _, truth in outcome.seen.truths for fault in truth.faults]
    if not faults:
        return nothing
    fault, rate_hz = faults[0], scenario.sample_rate_hz
    start = outcome.seen.truths[0][1].header.stamp
    start_ns = start.sec * 1_000_000_000 + start.nanosec
    for received_ns, alarm in outcome.seen.alarms:
        if alarm.level > 0 and alarm.component == fault.component and alarm.sample > fault.since_sample:
            injected_ns = start_ns + fault.since_sample / rate_hz * 1e9
            return {
                "alarm_seconds": (alarm.sample - fault.since_sample) / rate_hz,
                "alarm_wall_seconds": (received_ns - injected_ns) * 1e-9,
                "alarm": alarm.reason,
            }
    return nothing
