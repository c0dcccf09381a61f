"""Shows the live rig in rerun: in a file, in a viewer that runs already, or in one opened here."""

from __future__ import annotations

import math
import socket
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from gearsim_io import qos
from gearsim_io.errors import EnvironmentLackError, InputError
from gearsim_io.messages import from_msg
from gearsim_io.nodes.health import HealthPublisher, Level
from gearsim_io.nodes.parameters import declare_parameters, parameter
from gearsim_io.rerun_export import APPLICATION, start_viewer

try:
    import rerun as rr

    from gearsim_io.scene import Canvas, Focus, Scene, blueprint
except ImportError:
    rr = None

LIVE_CHUNK_ROWS = 512
FLUSH_S = 1.0
END_S = 5.0
SOURCES = ("envelope", "kurtosis", "gear", "trend")


@dataclass(frozen=True)
class ViewerParameters:
    """What a user may set; one of `out`, `connect` and `window` must be."""

    out: str = parameter("", "file of the recording (.rrd), must not exist")
    connect: str = parameter("", "viewer that runs already, such as rerun+http://127.0.0.1:9876/proxy")
    window: bool = parameter(False, "open a viewer on this screen (it listens on the local host only)")
    points_per_s: float = parameter(400.0, "values per second that a waveform is reduced to", 10.0, 1e6)


class Viewer(Node):
    """Hands every message of the rig to the scene."""

    def __init__(self) -> None:
        super().__init__("viewer", namespace=qos.NAMESPACE)
        if rr is None:
            raise EnvironmentLackError("rerun is not installed", "pip install rerun-sdk")
        given = declare_parameters(self, ViewerParameters)
        self._window: subprocess.Popen[bytes] | None = None
        self._home = tempfile.TemporaryDirectory(prefix="gearsim-rerun-")
        self._stream = rr.RecordingStream(APPLICATION)
        self._stream.set_sinks(*self._sinks(given))
        self._scene = Scene(Canvas(self._stream, LIVE_CHUNK_ROWS), given.points_per_s)
        self._arranged: Focus | None = None
        self._nominal_hz = math.nan
        self._messages = self._refused = 0
        self._health = HealthPublisher(self)
        listened = (qos.ACCEL, qos.TACHO, qos.TORQUE, qos.FEATURES, qos.SPECTRUM, qos.ALARM, qos.GROUND_TRUTH)
        for topic in (*listened, *(qos.ALARM_STATE.of(source) for source in SOURCES)):
            qos.create_subscription(self, topic, self._on_message)
        qos.create_subscription(self, qos.MACHINE_INFO, self._on_machine)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._flushing = self.create_timer(FLUSH_S, self._flush, clock=steady)
        self.get_logger().info("showing the rig in rerun")

    def _sinks(self, given: ViewerParameters) -> list[Any]:
        sinks: list[Any] = []
        if given.out:
            path = Path(given.out)
            if path.suffix != ".rrd" or path.exists():
                raise InputError("parameter of node viewer", "out", given.out, "the name of a new .rrd file")
            sinks.append(rr.FileSink(path))
        if given.connect:
            sinks.append(rr.GrpcSink(given.connect))
        if given.window:
            port = _free_port()
            self._window = start_viewer(Path(self._home.name), port)
            sinks.append(rr.GrpcSink(f"rerun+http://127.0.0.1:{port}/proxy"))
        if not sinks:
            raise InputError("parameter of node viewer", "out, connect, window", "none", "at least one")
        return sinks

    def _on_message(self, msg: Any) -> None:
        try:
            self._scene.add(msg)
            self._messages += 1
            if hasattr(msg, "channel_names"):
                self._arrange(msg)
        except InputError as error:
            self._refused += 1
            self.get_logger().warning(str(error), throttle_duration_sec=5.0)

    def _on_machine(self, msg: Any) -> None:
        try:
            machine = from_msg(msg)
        except InputError as error:
            self.get_logger().warning(str(error))
            return
        self._nominal_hz = machine.nominal_speed_hz
        text = f"## {machine.name}\n\n{machine.description}\n\nlive\n"
        self._stream.log("summary", rr.TextDocument(text, media_type="text/markdown"), static=True)

    def _arrange(self, msg: Any) -> None:
        """The channels are known from the first samples on, the speed from the nameplate."""
        channels = tuple(msg.channel_names)
        span = (0.8 * self._nominal_hz, 1.2 * self._nominal_hz)
        focus = Focus(channels[0], channels, speed_span_hz=span, unit=msg.unit, coloured=False)
        if str(focus) != str(self._arranged):  # NaN is not equal to itself
            self._arranged = focus
            rr.send_blueprint(blueprint(focus), recording=self._stream)

    def _flush(self) -> None:
        self._scene.flush()
        level = Level.WARN if self._refused else Level.OK
        text = f"{self._refused} messages were refused" if self._refused else "drawing"
        self._health.report("drawing", level, text, {"messages": self._messages, "refused": self._refused})

    def finish(self) -> None:
        """Bring everything into the recording; close a window opened here."""
        self._scene.flush()
        self._stream.disconnect()
        if self._window is not None:
            self._window.terminate()
            try:
                self._window.wait(END_S)
            except subprocess.TimeoutExpired:
                self._window.kill()
        self._home.cleanup()


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


make_node = Viewer
