"""A publisher of a wrong type is named as soon as DDS knows its name, which may be after its type."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from gearsim_dsp.streams.feed import StreamWatch
from gearsim_io import qos

UNKNOWN = ("_NODE_NAMESPACE_UNKNOWN_", "_NODE_NAME_UNKNOWN_")


def test_a_stranger_is_named_once_its_name_is_known():
    pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")
    from gearsim_dsp.nodes.base import MonitorNode

    said: list[str] = []
    seen = [
        SimpleNamespace(node_namespace=UNKNOWN[0], node_name=UNKNOWN[1], topic_type="std_msgs/msg/String")
    ]
    node = SimpleNamespace(
        _inputs=[qos.TACHO],
        _watch=StreamWatch(lambda: 0.0, 3.0, said.append),
        resolve_topic_name=lambda name: name,
        get_publishers_info_by_topic=lambda _name: seen,
    )
    MonitorNode._check_types(node)
    MonitorNode._check_types(node)
    seen[0].node_namespace, seen[0].node_name = "/gearsim", "stranger"
    MonitorNode._check_types(node)
    MonitorNode._check_types(node)
    sends = "sends std_msgs/msg/String, expected gearsim_msgs/msg/TachoBatch"
    assert said == [f"tacho: a node without a name yet {sends}", f"tacho: /gearsim/stranger {sends}"]
