"""The virtual rig as a node: runs a scenario in simulated time and sends what its sensors measure."""

from __future__ import annotations

import math
import sys
import time

from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter

from gearsim_io import qos
from gearsim_io.nodes.health import HealthPublisher, Level
from gearsim_io.nodes.parameters import declare_parameters
from gearsim_sim.nodes.parameters import SimulatorParameters
from gearsim_sim.nodes.publishing import RigPublisher
from gearsim_sim.nodes.services import RigServices
from gearsim_sim.pacing import Pacer, StartGate, pace_status
from gearsim_sim.simulation import Simulation

# A step of the simulation at most, so that services and parameters are answered in between.
STEP_SAMPLES = 4096
LONGEST_NAP_S, SHORTEST_NAP_S = 0.1, 1e-4
REPORT_S = 0.5
GOODBYE_S = 2.0


class Simulator(Node):
    """Paces a `Simulation` and publishes its batches."""

    def __init__(self) -> None:
        super().__init__("simulator", namespace=qos.NAMESPACE)
        given = declare_parameters(self, SimulatorParameters)
        scenario = given.load()
        self.exit_status: int | None = None
        self._given = given
        self._health = HealthPublisher(self, scenario.machine.name)
        self._health.report("pacing", Level.OK, "compiling")
        self._publisher = RigPublisher(self, clock=given.publish_clock, torque=bool(scenario.sensors.torques))
        self._simulation = Simulation(scenario)
        self._simulation.warm_up()
        self._rig_services = RigServices(self, self._simulation)
        self._pacer = Pacer(scenario.sample_rate_hz, scenario.rate_factor)
        self._end = round(given.end_after * scenario.sample_rate_hz) or math.inf
        self._started = False
        self._gate = StartGate(given.wait_for_subscribers)
        self.set_parameters([Parameter("rate_factor", value=scenario.rate_factor)])
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._take_parameters)
        # Under simulated time from elsewhere that time sets the pace; our own /clock cannot.
        follow = self.get_parameter("use_sim_time").value and not given.publish_clock
        self._pace_clock = self.get_clock() if follow else Clock(clock_type=ClockType.STEADY_TIME)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._step_timer = self.create_timer(SHORTEST_NAP_S, self._step, clock=steady)
        self._report_timer = self.create_timer(REPORT_S, self._report, clock=steady)
        if given.paused:
            self._pacer.pause(self._now_s())
        self.get_logger().info(f"scenario {scenario.name} ({scenario.source}), seed {scenario.seed}")

    def finish(self) -> None:
        """Say goodbye: what waits goes out, and what was made is told."""
        self._publisher.finish(GOODBYE_S)
        simulation, outbox = self._simulation, self._publisher.outbox
        pace = self._pacer.report(self._now_s())
        text = (
            f"{simulation.samples_sent} samples ({simulation.seconds_sent:.3f} s) in {outbox.sent} messages"
        )
        if outbox.waiting:
            self.get_logger().error(f"{outbox.waiting} messages could not be sent: {outbox.last_refusal}")
        if pace.slipped_s > 0:
            text += f", {pace.slipped_s:.1f} s behind its schedule"
        self.get_logger().info(text)

    def _step(self) -> None:
        """Make and send what is due, one batch or a part of one at most, then sleep until more is due."""
        outbox, simulation, pacer = self._publisher.outbox, self._simulation, self._pacer
        if not self._started and not self._start():
            return self._nap(LONGEST_NAP_S)
        if outbox.waiting and not outbox.flush() and outbox.full:
            return self._nap(LONGEST_NAP_S / 10)  # the middleware refuses: wait for it, lose nothing
        goal = self._goal()
        due = pacer.due(self._now_s(), goal - pacer.made)
        if due and pacer.made + due == goal:
            try:
                batches = simulation.advance(due)
            except FloatingPointError as error:
                return self._fail(str(error))
            pacer.add(due, self._now_s())
            if goal == self._end:
                batches += simulation.finish()
                self.exit_status = 0
            self._publisher.send(batches, simulation)
            goal = self._goal()
        return self._nap(pacer.seconds_until(goal, self._now_s()))

    def _fail(self, text: str) -> None:
        print(f"simulator: {text}", file=sys.stderr, flush=True)
        self._health.report("pacing", Level.ERROR, text)
        self.exit_status = 1

    def _goal(self) -> int:
        """Where the next step ends: a batch's end if that is near, the run's end in any case."""
        made, batch = self._pacer.made, self._simulation.scenario.batch_samples
        return int(min((made // batch + 1) * batch, made + STEP_SAMPLES, self._end))

    def _start(self) -> bool:
        """Begin if all that the parameters want to be there is there."""
        now_s = self._now_s()
        if now_s <= 0:
            return False  # simulated time from elsewhere that has not come yet
        if not self._gate.is_open(self._publisher.subscribers(), now_s):
            return False
        following = self._pace_clock is self.get_clock()
        wall_ns = self._pace_clock.now().nanoseconds if following else time.time_ns()
        self._simulation.t0_ns = self._given.t0_ns if self._given.t0_ns >= 0 else wall_ns
        self._publisher.start(self._simulation)
        self._pacer.start(now_s)
        self._started = True
        self._report()
        return True

    def _nap(self, seconds: float) -> None:
        self._step_timer.timer_period_ns = int(min(max(seconds, SHORTEST_NAP_S), LONGEST_NAP_S) * 1e9)
        self._step_timer.reset()

    def _now_s(self) -> float:
        return float(self._pace_clock.now().nanoseconds) * 1e-9

    def _check_parameters(self, parameters: list[Parameter]) -> SetParametersResult:
        for parameter in parameters:
            if parameter.name == "rate_factor" and parameter.value < 0:
                reason = f"rate_factor: got {parameter.value:g}, expected 0 to 1000"
                return SetParametersResult(successful=False, reason=reason)
        return SetParametersResult(successful=True)

    def _take_parameters(self, parameters: list[Parameter]) -> None:
        for parameter in parameters:
            if parameter.name == "rate_factor":
                self._pacer.set_factor(parameter.value, self._now_s())
            elif parameter.name == "paused":
                (self._pacer.pause if parameter.value else self._pacer.resume)(self._now_s())
        self._nap(0.0)

    def _report(self) -> None:
        """What /diagnostics says of the pacing and of the sending."""
        if not self._started:
            waits = "waiting for subscribers" if self._given.wait_for_subscribers else "waiting for /clock"
            return self._health.report("pacing", Level.OK, waits)
        pace = self._pacer.report(self._now_s())
        values = {
            "rate_factor": pace.wanted,
            "achieved_factor": pace.achieved,
            "lag_s": pace.lag_s,
            "slipped_s": pace.slipped_s,
            "simulated_s": self._simulation.seconds_sent,
            "samples": self._simulation.samples_sent,
        }
        level, text = pace_status(pace, paused=self._pacer.paused)
        self._health.report("pacing", level, text, values)
        outbox = self._publisher.outbox
        level = Level.WARN if outbox.waiting else Level.OK
        if outbox.full:
            level = Level.ERROR
        text = f"the middleware refuses: {outbox.last_refusal}" if outbox.waiting else "sending"
        values = {"sent": outbox.sent, "waiting": outbox.waiting, "refused": outbox.refused}
        return self._health.report("stream", level, text, values)


make_node = Simulator
