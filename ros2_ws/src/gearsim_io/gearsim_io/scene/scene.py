"""Turns messages of the rig into a rerun recording, one after the other, live or from a bag."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import rerun as rr

from gearsim_io.batches import TORQUE_UNIT
from gearsim_io.messages import from_msg, stamp_ns
from gearsim_io.scene import spectra, style
from gearsim_io.scene.canvas import Canvas
from gearsim_io.scene.waves import Outliner, cut

_PER_CHANNEL = ("rms", "kurtosis", "crest_factor")
_SNR = "_snr"
_LEAST_KURTOSIS = 1.0  # no signal has less


@dataclass(frozen=True, slots=True)
class Zoom:
    """A stretch of one channel (seconds from the stream's start) that is kept sample by sample."""

    name: str
    channel: str
    start_s: float
    end_s: float


class Scene:
    """A recording being filled.

    Parameters
    ----------
    canvas : Canvas
    points_per_s : float
        Values per second that each waveform is reduced to; infinity keeps every sample.
    zooms : sequence of Zoom
        Stretches to keep in full.
    front : str
        Channel that is drawn in colour while the others are grey; empty: all in colour.
    only_front : bool
        Leave out the waveforms and spectra of the other channels.
    zero_ns : int, optional
        Stamp that is time 0; by default that of the first signal.
    """

    def __init__(
        self,
        canvas: Canvas,
        points_per_s: float = 400.0,
        zooms: Sequence[Zoom] = (),
        front: str = "",
        only_front: bool = False,
        zero_ns: int | None = None,
    ) -> None:
        self._canvas = canvas
        self._points_per_s = points_per_s
        self._zooms = tuple(zooms)
        self._front = front
        self._only_front = only_front
        self._zero_ns = zero_ns
        self._outliner: Outliner | None = None
        self._torque_outliner: Outliner | None = None
        self._last_pulse_s: dict[str, float] = {}
        self._best: dict[str, tuple[float, float]] = {}
        self.peaks: dict[str, float] = {"accel": 0.0, "zoom": 0.0, "kurtosis": 0.0}
        self.speed_span_hz = (math.inf, -math.inf)
        self._add: dict[str, Callable[[Any], None]] = {
            "SampleBatch": self._add_samples,
            "TachoBatch": self._add_tacho,
            "Features": self._add_features,
            "Spectrum": self._add_spectrum,
            "Alarm": self._add_alarm,
            "AlarmState": self._add_alarm_state,
            "GroundTruth": self._add_truth,
        }

    @property
    def types(self) -> tuple[str, ...]:
        """Short names of the messages that have a place in the scene."""
        return tuple(self._add)

    def add(self, msg: Any) -> None:
        """Take any message of rclpy or rosbags; those without a place in the scene are left out.

        Raises
        ------
        InputError
            If a message contradicts itself.
        """
        action = self._add.get(type(msg).__name__.rsplit("__", 1)[-1])
        if action is not None:
            action(msg)

    def time_s(self, t_ns: int) -> float:
        """Seconds from the stream's start."""
        if self._zero_ns is None:
            self._zero_ns = t_ns
        return (t_ns - self._zero_ns) / 1e9

    def mark(self, name: str, t_s: float, colour: style.Rgb) -> None:
        """Draw a moment into the plots of waveform and kurtosis (once their heights are known)."""
        for root in ("accel", "kurtosis"):
            peak = self.peaks[root]
            low = -peak if root == "accel" else _LEAST_KURTOSIS
            if peak > low:
                path = style.entity("marks", root, name)
                self._canvas.line(path, f"{name}: {t_s:.2f} s", colour, width=2.0)
                self._canvas.upright(path, t_s, low, peak)

    def flush(self) -> None:
        """Send everything."""
        self._send_snr()
        self._canvas.flush()

    def _shown(self, channel: str) -> bool:
        return not self._only_front or channel == self._front

    def _colour(self, channel: str, number: int) -> style.Rgb:
        if not self._front:
            return style.other(number)
        return style.WAVEFORM if channel == self._front else style.BEHIND

    def _add_samples(self, msg: Any) -> None:
        batch = from_msg(msg)
        if batch.unit == TORQUE_UNIT:
            self._add_torque(batch)
            return
        t_s = self.time_s(batch.t0_ns)
        rate_hz = batch.sample_rate_hz
        zero_sample = batch.first_sample - t_s * rate_hz
        if self._outliner is None:
            self._outliner = Outliner(round(2 * rate_hz / self._points_per_s))
        places, values = self._outliner.push(batch.first_sample, batch.data)
        times = (places - zero_sample) / rate_hz
        for row, channel in enumerate(batch.channels):
            if self._shown(channel):
                path = style.entity("accel", channel)
                self._canvas.line(path, f"{channel} [{batch.unit}]", style.WAVEFORM)
                self._canvas.rows(path, times, values[row])
                if channel == self._front:
                    self._keep_peak("accel", values[row])
        for zoom in self._zooms:
            if zoom.channel in batch.channels:
                span = (zoom.start_s, zoom.end_s)
                times, part = cut(batch.first_sample, batch.data, rate_hz, zero_sample, span)
                path = style.entity("zoom", zoom.name)
                self._canvas.line(path, f"{zoom.channel} [{batch.unit}]", style.WAVEFORM)
                detail = part[batch.channels.index(zoom.channel)]
                self._canvas.rows(path, times, detail)
                self._keep_peak("zoom", detail)

    def _add_torque(self, batch: Any) -> None:
        """Measured torques, beside the commanded load."""
        t_s, rate_hz = self.time_s(batch.t0_ns), batch.sample_rate_hz
        if self._torque_outliner is None:
            self._torque_outliner = Outliner(round(2 * rate_hz / self._points_per_s))
        places, values = self._torque_outliner.push(batch.first_sample, batch.data)
        times = (places - batch.first_sample) / rate_hz + t_s
        for row, channel in enumerate(batch.channels):
            path = style.entity("load", channel)
            self._canvas.line(
                path, f"{channel} [{batch.unit}]", style.other(self._canvas.lines_below("load"))
            )
            self._canvas.rows(path, times, values[row])

    def _keep_peak(self, root: str, values: Any) -> None:
        self.peaks[root] = max(self.peaks[root], float(np.abs(values).max(initial=0.0)))

    def _add_tacho(self, msg: Any) -> None:
        batch = from_msg(msg)
        t_s = self.time_s(batch.t0_ns)
        times = t_s + batch.pulse_offsets / batch.sample_rate_hz
        before = self._last_pulse_s.get(batch.shaft)
        if times.size:
            self._last_pulse_s[batch.shaft] = float(times[-1])
        chain = times if before is None or before > t_s else np.concatenate([[before], times])
        steps = np.diff(chain)
        if steps.size == 0 or not np.all(steps > 0):
            return
        self._speed(
            batch.shaft, f"{batch.shaft} (tacho)", chain[1:], 1 / (steps * batch.pulses_per_revolution)
        )

    def _speed(self, name: str, label: str, times: Any, speeds_hz: Any) -> None:
        path = style.entity("speed", name)
        self._canvas.line(path, label, style.other(self._canvas.lines_below("speed")))
        self._canvas.rows(path, times, speeds_hz)
        low, high = self.speed_span_hz
        self.speed_span_hz = (min(low, float(np.min(speeds_hz))), max(high, float(np.max(speeds_hz))))

    def _add_features(self, msg: Any) -> None:
        t_s = self.time_s(stamp_ns(msg)) + msg.sample_count / msg.sample_rate
        for value in msg.values:
            if value.name in _PER_CHANNEL and math.isfinite(value.value):
                path = style.entity(value.name, msg.channel)
                number = self._canvas.lines_below(value.name)
                self._canvas.line(path, msg.channel, self._colour(msg.channel, number))
                self._canvas.value(path, t_s, value.value)
                if value.name == "kurtosis":
                    self._keep_peak("kurtosis", value.value)
            elif value.name.endswith(_SNR):
                self._add_snr(t_s, value.component, value.name.removesuffix(_SNR), value.value)
        if msg.speed_source not in ("tacho", "encoder") and math.isfinite(msg.speed):
            label = f"reference shaft ({msg.speed_source})"
            self._speed(msg.speed_source, label, np.array([t_s]), np.array([msg.speed]))

    def _add_snr(self, t_s: float, component: str, stem: str, snr_db: float) -> None:
        """Of all channels the one that shows a family best counts, for the machine and for each part.

        Messages of other nodes may come between those of a window, so each line waits for a value of
        another time: sent earlier, the best of some channels would look like a dip.
        """
        if not math.isfinite(snr_db):
            return
        label = style.family_name(stem)
        for path, name in (
            (style.entity("faults", label), label),
            (style.entity("faults_by_part", component, label), f"{label} {component}"),
        ):
            self._canvas.line(path, name, style.family(label))
            before_s, best_db = self._best.get(path, (t_s, -math.inf))
            if before_s != t_s:
                self._canvas.value(path, before_s, best_db)
                best_db = -math.inf
            self._best[path] = (t_s, max(best_db, snr_db))

    def _send_snr(self) -> None:
        for path, (t_s, snr_db) in self._best.items():
            self._canvas.value(path, t_s, snr_db)
        self._best.clear()

    def _add_spectrum(self, msg: Any) -> None:
        if not self._shown(msg.channel):
            return
        self._canvas.at(self.time_s(stamp_ns(msg)) + msg.sample_count / msg.sample_rate)
        for path, chart in spectra.bars(msg):
            self._canvas.stream.log(path, chart)

    def _add_alarm(self, msg: Any) -> None:
        t_s = self.time_s(stamp_ns(msg))
        self._canvas.at(t_s)
        word, colour, level = style.level(msg.level)
        text = f"{t_s:.2f} s  {word}: {msg.reason or describe(msg)}"
        self._canvas.stream.log("alarms", rr.TextLog(text, level=level, color=colour))

    def _add_alarm_state(self, msg: Any) -> None:
        word, colour, _ = style.level(3 if msg.stale else msg.level)
        if msg.active and not msg.stale:
            worst = max(msg.active, key=lambda alarm: alarm.level)
            more = f" and {len(msg.active) - 1} more" if len(msg.active) > 1 else ""
            word = f"{word}: {describe(worst)}{more}"
        path = style.entity("state", f"node {msg.source}")
        self._canvas.state(path, self.time_s(stamp_ns(msg)), word, colour)

    def _add_truth(self, msg: Any) -> None:
        t_s = self.time_s(stamp_ns(msg))
        words = [f"{fault.kind.replace('_', ' ')} on {fault.component}" for fault in msg.faults]
        colour = style.FAULT_RUNNING if words else style.NO_FAULT
        self._canvas.state("state/machine", t_s, ", ".join(words) or "healthy (simulated)", colour)
        if math.isfinite(msg.load):
            self._canvas.line("load/command", "load (commanded) [N m]", style.BEHIND)
            self._canvas.value("load/command", t_s, msg.load)


def describe(alarm: Any) -> str:
    """What an alarm is about, in few words."""
    if alarm.component:
        return f"{alarm.fault.replace('_', ' ')} of {alarm.component}"
    return str(alarm.reason.split(":")[0]) or str(alarm.fault.replace("_", " "))
