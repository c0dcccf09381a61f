"""A source in the test's process, and ears on everything that nodes say."""

from __future__ import annotations

import sys
import time
from pathlib import Path

from gearsim_io import qos

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "dsp"))
from rig_stream import RATE_HZ, machine


class Rig:
    """A source in the test's process, and ears on everything that the diagnostic nodes say."""

    def __init__(self, domain):
        from gearsim_io.messages import ros_types, to_msg

        self.domain, self.types, self.to_msg = domain, ros_types(), to_msg
        self.node = domain.node("feeder")
        topics = (qos.ACCEL, qos.TACHO, qos.MACHINE_INFO)
        self.out = {topic.name: qos.create_publisher(self.node, topic) for topic in topics}
        self.heard = {}

    def hear(self, topic, key=None):
        heard = self.heard.setdefault(key or topic.name, [])
        qos.create_subscription(self.node, topic, heard.append)
        return heard

    def until(self, condition, timeout_s=60.0):
        assert self.domain.spin(self.node, condition, timeout_s), "it did not happen in time"

    def connected(self, nodes=1):
        self.until(lambda: all(pub.get_subscription_count() >= nodes for pub in self.out.values()))

    def nameplate(self, plate=None):
        self.out[qos.MACHINE_INFO.name].publish(self.to_msg(plate or machine(), self.types, 0))

    def send(self, batch):
        kind = type(batch).__name__
        topic = qos.ACCEL if kind == "SampleBatch" else qos.TACHO
        self.out[topic.name].publish(self.to_msg(batch, self.types))

    def play(self, batches, times_real=8.0):
        start = time.monotonic()
        batches = list(batches)
        for batch in batches:
            due = start + (batch.end_sample - batches[0].first_sample) / RATE_HZ / times_real
            self.until(lambda due=due: time.monotonic() >= due)
            self.send(batch)

    def status(self, task):
        """Level and message of the latest status of a task, with its key-values."""
        for array in reversed(self.heard["/diagnostics"]):
            for status in array.status:
                if status.name == task:
                    return status.level[0], status.message, {v.key: v.value for v in status.values}
        return None, "", {}
