"""Run inside the environment by `doctor`: import the program's main parts, send a message round.

Prints one JSON object: versions of the libraries, and the milliseconds that a batch took from a
publisher to a subscription of this process (null when it did not arrive).
"""

from __future__ import annotations

import json
import os
import sys
import time
from importlib.metadata import version
from typing import Any

LIBRARIES = ("numpy", "scipy", "numba", "mcap", "rosbags", "rerun-sdk")
PATIENCE_S = 10.0
SAMPLES = 4096


def round_trip_ms() -> float | None:
    """Publish batches until one arrives; milliseconds of the one that did."""
    import rclpy
    from gearsim_msgs.msg import SampleBatch
    from rclpy.executors import SingleThreadedExecutor

    arrived: list[float] = []
    rclpy.init()
    try:
        node = rclpy.create_node(f"gearsim_doctor_{os.getpid()}")
        topic = f"gearsim_doctor_{os.getpid()}"
        sent: dict[int, float] = {}

        def receive(message: Any) -> None:
            arrived.append(time.monotonic() - sent[message.first_sample])

        node.create_subscription(SampleBatch, topic, receive, 10)
        publisher = node.create_publisher(SampleBatch, topic, 10)
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        begun = time.monotonic()
        batch = SampleBatch()
        batch.data.frombytes(bytes(4 * SAMPLES))
        while not arrived and time.monotonic() - begun < PATIENCE_S:
            batch.first_sample = len(sent)
            sent[batch.first_sample] = time.monotonic()
            publisher.publish(batch)
            executor.spin_once(timeout_sec=0.2)
        node.destroy_node()
    finally:
        rclpy.try_shutdown()
    return arrived[0] * 1e3 if arrived else None


def main() -> int:
    """Print the facts."""
    import gearsim_bringup.cli  # noqa: F401

    versions = {name: version(name) for name in LIBRARIES}
    print(json.dumps({"versions": versions, "round_trip_ms": round_trip_ms()}))
    return 0


if __name__ == "__main__":
    sys.path.pop(0)
    sys.exit(main())
