"""What the simulator sends: batches, nameplate, truth and clock, through an outbox that loses nothing."""

from __future__ import annotations

from collections.abc import Iterable

from rclpy.duration import Duration
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.node import Node
from rclpy.time import Time

from gearsim_io import qos
from gearsim_io.batches import EncoderBatch, SampleBatch, TachoBatch, TorqueBatch
from gearsim_io.messages import ros_types, to_msg
from gearsim_sim.outbox import Outbox
from gearsim_sim.simulation import Batch, Simulation


class RigPublisher:
    """All topics of the simulator.

    Parameters
    ----------
    node : rclpy.node.Node
    clock : bool
        Publish /clock too.
    torque : bool
        Publish torques too.
    """

    def __init__(self, node: Node, *, clock: bool, torque: bool = False) -> None:
        self._types = ros_types()
        self._waveforms = {
            SampleBatch: qos.create_publisher(node, qos.ACCEL),
            TachoBatch: qos.create_publisher(node, qos.TACHO),
            EncoderBatch: qos.create_publisher(node, qos.ENCODER),
        }
        if torque:
            self._waveforms[TorqueBatch] = qos.create_publisher(node, qos.TORQUE)
        self._machine = qos.create_publisher(node, qos.MACHINE_INFO)
        self._truth = qos.create_publisher(node, qos.GROUND_TRUTH)
        self._clock = qos.create_publisher(node, qos.CLOCK) if clock else None
        self.outbox = Outbox(_rclpy.RCLError)
        self._truth_upto = -1

    def subscribers(self) -> tuple[int, ...]:
        """Subscriptions of accel, tacho and encoder (and torque, if it is sent)."""
        return tuple(publisher.get_subscription_count() for publisher in self._waveforms.values())

    def start(self, simulation: Simulation) -> None:
        """Send the nameplate, and the truth at sample 0."""
        machine = to_msg(simulation.machine, self._types, t_ns=simulation.t0_ns)
        self.outbox.put(self._machine.publish, machine)
        self.outbox.put(self._truth.publish, to_msg(simulation.truth(0), self._types))
        self._truth_upto = 0
        self.outbox.flush()

    def send(self, batches: Iterable[Batch], simulation: Simulation) -> None:
        """Send batches, and after them the truth where it changed within them, and the clock."""
        for batch in batches:
            self.outbox.put(self._waveforms[type(batch)].publish, to_msg(batch, self._types))
        upto = simulation.samples_sent - 1
        for truth in simulation.truths(self._truth_upto, upto):
            self.outbox.put(self._truth.publish, to_msg(truth, self._types))
        self._truth_upto = max(self._truth_upto, upto)
        self.outbox.flush()
        if self._clock is not None:
            self._send_clock(simulation.t0_ns + round(simulation.seconds_sent * 1e9))

    def finish(self, seconds: float) -> None:
        """Send what waits and see that it has arrived, as long as that takes less than `seconds`."""
        self.outbox.flush()
        for publisher in (*self._waveforms.values(), self._truth):
            publisher.wait_for_all_acked(Duration(seconds=seconds))

    def _send_clock(self, t_ns: int) -> None:
        from rosgraph_msgs.msg import Clock

        assert self._clock is not None
        try:
            self._clock.publish(Clock(clock=Time(nanoseconds=t_ns).to_msg()))
        except _rclpy.RCLError:
            return  # best effort: the next batch brings a newer time
