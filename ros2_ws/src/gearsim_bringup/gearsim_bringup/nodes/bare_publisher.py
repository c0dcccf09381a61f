"""Publishes SampleBatch messages of the rig's size at the rig's pace and does nothing else: a baseline."""

from __future__ import annotations

import sys

import numpy as np
from rclpy.node import Node

from gearsim_io import qos
from gearsim_io.batches import SampleBatch
from gearsim_io.messages import ros_types, to_msg
from gearsim_io.nodes.run import run_node

RATE_HZ = 65536.0
CHANNELS, SAMPLES = 8, 4096


class BarePublisher(Node):
    """One message of 8 x 4096 samples every 62.5 ms."""

    def __init__(self) -> None:
        super().__init__("bare_publisher", namespace=qos.NAMESPACE)
        self._publisher = qos.create_publisher(self, qos.ACCEL)
        self._data = np.random.default_rng(1).standard_normal((CHANNELS, SAMPLES)).astype(np.float32)
        self._names = tuple(f"c{index}" for index in range(CHANNELS))
        self._types = ros_types()
        self._count = 0
        self.create_timer(SAMPLES / RATE_HZ, self._send)

    def _send(self) -> None:
        first = self._count * SAMPLES
        t_ns = self.get_clock().now().nanoseconds
        batch = SampleBatch(t_ns, RATE_HZ, first, self._names, "m/s^2", self._data, "bare")
        self._publisher.publish(to_msg(batch, self._types))
        self._count += 1


if __name__ == "__main__":
    sys.exit(run_node(BarePublisher, "bare_publisher"))
