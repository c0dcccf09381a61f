"""Topic names, message types and QoS profiles in one place, as plain data; rclpy only on demand."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

NAMESPACE = "/gearsim"

_INFINITE = {"sec": 9223372036, "nsec": 854775807}


@dataclass(frozen=True, slots=True)
class Qos:
    """A quality-of-service profile: history is always KEEP_LAST `depth`.

    `reliable` False is best effort; `latched` is ROS 2's transient local (late subscribers get the last).
    """

    depth: int
    reliable: bool = True
    latched: bool = False

    def to_rosbag2(self) -> dict[str, Any]:
        """The profile as rosbag2 writes it (metadata.yaml version 9 and channel metadata)."""
        return {
            "history": "keep_last",
            "depth": self.depth,
            "reliability": "reliable" if self.reliable else "best_effort",
            "durability": "transient_local" if self.latched else "volatile",
            "deadline": dict(_INFINITE),
            "lifespan": dict(_INFINITE),
            "liveliness": "automatic",
            "liveliness_lease_duration": dict(_INFINITE),
            "avoid_ros_namespace_conventions": False,
        }

    @staticmethod
    def from_rosbag2(content: dict[str, Any]) -> Qos:
        """The profile of a bag's topic, words or (up to version 8) numbers; unknown parts become defaults."""
        depth = content.get("depth", 0)
        return Qos(
            depth=int(depth) or 10,
            reliable=str(content.get("reliability", "reliable")) not in ("best_effort", "2"),
            latched=str(content.get("durability", "volatile")) in ("transient_local", "1"),
        )


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic of the rig. `name` is relative to the namespace unless it starts with a slash."""

    name: str
    type: str
    qos: Qos

    @property
    def full_name(self) -> str:
        """The name in the default namespace."""
        return self.name if self.name.startswith("/") else f"{NAMESPACE}/{self.name}"

    def of(self, source: str) -> Topic:
        """The topic of the same kind that the node `source` has for itself: `<source>/<name>`."""
        return replace(self, name=f"{source}/{self.name}")


WAVEFORM = Qos(depth=100)
RESULT = Qos(depth=50)
LATCHED = Qos(depth=1, latched=True)

ACCEL = Topic("accel", "gearsim_msgs/msg/SampleBatch", WAVEFORM)
TACHO = Topic("tacho", "gearsim_msgs/msg/TachoBatch", WAVEFORM)
TORQUE = Topic("torque", "gearsim_msgs/msg/SampleBatch", WAVEFORM)
ENCODER = Topic("encoder", "gearsim_msgs/msg/EncoderBatch", WAVEFORM)
MACHINE_INFO = Topic("machine_info", "gearsim_msgs/msg/MachineInfo", LATCHED)
GROUND_TRUTH = Topic("ground_truth", "gearsim_msgs/msg/GroundTruth", LATCHED)
FEATURES = Topic("features", "gearsim_msgs/msg/Features", RESULT)
SPECTRUM = Topic("spectrum", "gearsim_msgs/msg/Spectrum", RESULT)
ALARM = Topic("alarm", "gearsim_msgs/msg/Alarm", RESULT)
# One per judging node, `ALARM_STATE.of("envelope")`: two latched publishers of one topic hide each other.
ALARM_STATE = Topic("alarm_state", "gearsim_msgs/msg/AlarmState", LATCHED)
DIAGNOSTICS = Topic("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", Qos(depth=10))
TRENDS = Topic("trends", "gearsim_msgs/msg/Trends", RESULT)
CLOCK = Topic("/clock", "rosgraph_msgs/msg/Clock", Qos(depth=1, reliable=False))

TOPICS = (
    ACCEL,
    TACHO,
    ENCODER,
    TORQUE,
    MACHINE_INFO,
    GROUND_TRUTH,
    FEATURES,
    SPECTRUM,
    ALARM,
    ALARM_STATE.of("envelope"),
    ALARM_STATE.of("kurtosis"),
    ALARM_STATE.of("gear"),
    ALARM_STATE.of("trend"),
    TRENDS,
    DIAGNOSTICS,
)
"""What a recorder takes by default: all but /clock."""


def to_rclpy(qos: Qos) -> Any:
    """The profile as `rclpy.qos.QoSProfile`."""
    from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=qos.depth,
        reliability=ReliabilityPolicy.RELIABLE if qos.reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if qos.latched else DurabilityPolicy.VOLATILE,
    )


def message_class(type_name: str) -> Any:
    """The rclpy class of `pkg/msg/Type`; ImportError or AttributeError if it is not installed."""
    from importlib import import_module

    package, kind, short = type_name.split("/")
    return getattr(import_module(f"{package}.{kind}"), short)


def create_publisher(node: Any, topic: Topic) -> Any:
    """A publisher whose QoS users can override by the standard `qos_overrides` parameters."""
    from rclpy.qos_overriding_options import QoSOverridingOptions

    return node.create_publisher(
        message_class(topic.type),
        topic.name,
        to_rclpy(topic.qos),
        qos_overriding_options=QoSOverridingOptions.with_default_policies(),
    )


def create_subscription(node: Any, topic: Topic, callback: Any, *, raw: bool = False) -> Any:
    """A subscription whose QoS users can override; with `raw` the callback gets serialised bytes."""
    from rclpy.qos_overriding_options import QoSOverridingOptions

    return node.create_subscription(
        message_class(topic.type),
        topic.name,
        callback,
        to_rclpy(topic.qos),
        qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        raw=raw,
    )
