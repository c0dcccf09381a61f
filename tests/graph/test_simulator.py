"""The simulator node as a real process over DDS."""

import signal
import time

import numpy as np
import pytest

from gearsim_io import qos
from gearsim_io.batches import EncoderBatch, SampleBatch, TachoBatch
from gearsim_io.messages import from_msg, stamp_ns
from gearsim_sim.events import Clear, FaultSpec, Inject, SetOperatingPoint
from gearsim_sim.scenario import load_scenario
from gearsim_sim.simulation import simulate

pytestmark = pytest.mark.graph

MODULE = "gearsim_sim.nodes.simulator"
T0_NS = 1_700_000_000_000_000_000


class Listener:
    """Keeps all that a simulator says."""

    def __init__(self, domain, *, late=False):
        self.domain = domain
        self.node = domain.node("listener")
        self.batches = []
        self.arrivals = []
        self.machines = []
        self.truths = []
        self.clocks = []
        self.statuses = []
        self.clients = {}
        if not late:
            for topic in (qos.ACCEL, qos.TACHO, qos.ENCODER):
                qos.create_subscription(self.node, topic, self._on_batch)
        qos.create_subscription(self.node, qos.MACHINE_INFO, self.machines.append)
        qos.create_subscription(self.node, qos.GROUND_TRUTH, self.truths.append)
        qos.create_subscription(self.node, qos.CLOCK, self.clocks.append)
        qos.create_subscription(self.node, qos.DIAGNOSTICS, self._on_diagnostics)

    def _on_batch(self, msg):
        self.batches.append(from_msg(msg))
        self.arrivals.append(time.time_ns())

    def _on_diagnostics(self, msg):
        self.statuses += list(msg.status)

    @property
    def samples(self):
        return [batch for batch in self.batches if isinstance(batch, SampleBatch)]

    @property
    def seconds(self):
        samples = self.samples
        return samples[-1].end_sample / samples[-1].sample_rate_hz if samples else 0.0

    def spin(self, until, timeout_s=30.0):
        assert self.domain.spin(self.node, until, timeout_s), "waited in vain"

    def hear_out(self, process, timeout_s=60.0):
        """Listen until the process has ended and nothing more comes; its exit code."""
        self.spin(lambda: process.returncode is not None, timeout_s)
        self.domain.spin(self.node, lambda: False, 0.5)
        return process.wait()

    def call(self, service, name, /, **fields):
        if name not in self.clients:
            self.clients[name] = self.node.create_client(service, f"/gearsim/simulator/{name}")
        client = self.clients[name]
        assert client.wait_for_service(10.0)
        began = time.monotonic()
        future = client.call_async(service.Request(**fields))
        self.spin(future.done, 10.0)
        return future.result(), time.monotonic() - began


def start(domain, **parameters):
    return domain.start_node(MODULE, parameters)


def assert_contiguous(batches):
    """Every stream without a gap, from sample 0."""
    ends = {}
    for batch in batches:
        key = (type(batch), getattr(batch, "shaft", ""))
        assert batch.first_sample == ends.get(key, 0)
        ends[key] = batch.end_sample
    return ends


def assert_bitwise(live, offline):
    live_sorted = sorted(live, key=_order)
    offline_sorted = sorted(offline, key=_order)
    assert len(live_sorted) == len(offline_sorted)
    for a, b in zip(live_sorted, offline_sorted, strict=True):
        assert _order(a) == _order(b)
        assert a.t0_ns == b.t0_ns
        assert a.frame_id == b.frame_id
        assert a.sample_rate_hz == b.sample_rate_hz
        if isinstance(a, SampleBatch):
            assert (a.channels, a.unit) == (b.channels, b.unit)
            assert a.data.tobytes() == b.data.tobytes()
        elif isinstance(a, TachoBatch):
            assert (a.first_pulse, a.sample_count) == (b.first_pulse, b.sample_count)
            assert a.pulse_offsets.tobytes() == b.pulse_offsets.tobytes()
        else:
            assert (a.first_edge, a.sample_count) == (b.first_edge, b.sample_count)
            assert a.edge_offsets.tobytes() == b.edge_offsets.tobytes()


def _order(batch):
    kinds = (SampleBatch, TachoBatch, EncoderBatch)
    return (batch.first_sample, kinds.index(type(batch)), getattr(batch, "shaft", ""))


def test_live_equals_offline_bit_for_bit(ros_domain):
    listener = Listener(ros_domain)
    process = start(
        ros_domain,
        scenario="quick",
        end_after=2.6,
        rate_factor=2.0,
        wait_for_subscribers=1,
        publish_clock=True,
        t0_ns=T0_NS,
    )
    assert listener.hear_out(process) == 0, process.output
    assert "Traceback" not in process.output
    scenario = load_scenario("quick")
    assert_contiguous(listener.batches)
    assert_bitwise(listener.batches, list(simulate(scenario, 2.6, T0_NS)))
    # Nameplate, truth and clock tell of the same run.
    assert from_msg(listener.machines[0]).name == "unsw_parallel"
    assert [channel.name for channel in from_msg(listener.machines[0]).channels] == list(
        listener.samples[0].channels
    )
    at = scenario.events[0].at_sample
    assert [truth.sample for truth in listener.truths] == [0, at]
    assert listener.truths[0].faults == []
    assert (listener.truths[0].speed, listener.truths[0].load) == (10.0, 50.0)
    fault = listener.truths[1].faults[0]
    assert (fault.kind, fault.component, fault.since_sample) == ("outer_race_spall", "bearing_3", at)
    assert '"width_m": 0.0008' in fault.parameters
    assert stamp_ns(listener.truths[1]) == T0_NS + round(at * 1e9 / scenario.sample_rate_hz)
    ends = {b.t0_ns + round(b.sample_count * 1e9 / b.sample_rate_hz) for b in listener.samples}
    clocks = [msg.clock.sec * 10**9 + msg.clock.nanosec for msg in listener.clocks]
    assert clocks == sorted(clocks)
    assert len(clocks) > 5  # best effort: some are overwritten by the next
    assert all(min(abs(clock - end) for end in ends) <= 2 for clock in clocks)


def test_services_while_it_runs_and_replay_of_what_they_did(ros_domain):
    from gearsim_msgs.srv import ClearFault, InjectFault
    from gearsim_msgs.srv import SetOperatingPoint as SetPoint

    listener = Listener(ros_domain)
    process = start(ros_domain, scenario="quick", end_after=6.0, wait_for_subscribers=1, t0_ns=T0_NS)
    listener.spin(lambda: listener.seconds > 0.5)
    nan = float("nan")
    good = {"kind": "inner_race_spall", "component": "bearing_2", "ramp_seconds": 0.1}
    bad = [
        (SetPoint, "set_operating_point", {"speed": nan, "load": nan}, "at least one of them"),
        (SetPoint, "set_operating_point", {"speed": -3.0, "load": nan}, "speed"),
        (SetPoint, "set_operating_point", {"speed": nan, "load": 1e9}, "load"),
        (SetPoint, "set_operating_point", {"speed": 9.0, "load": nan, "ramp_seconds": -1.0}, "ramp_seconds"),
        (InjectFault, "inject_fault", good | {"kind": "rust"}, "inner_race_spall"),
        (InjectFault, "inject_fault", good | {"component": "bearing_9"}, "bearing_1"),
        (InjectFault, "inject_fault", good | {"parameters": "{"}, "a JSON object"),
        (InjectFault, "inject_fault", good | {"parameters": "[1]"}, "a JSON object"),
        (InjectFault, "inject_fault", good | {"parameters": '{"width_m": -1}'}, "width_m: got -1"),
        (InjectFault, "inject_fault", good | {"parameters": '{"colour": 1}'}, "colour"),
        (InjectFault, "inject_fault", good | {"parameters": '{"severity": "much"}'}, "severity"),
        (ClearFault, "clear_fault", {"fault_id": "nobody"}, "nobody"),
    ]
    for service, name, fields, expected in bad:
        answer, _ = listener.call(service, name, **fields)
        assert not answer.success
        assert expected in answer.message
        assert "\n" not in answer.message
    changed, _ = listener.call(SetPoint, "set_operating_point", speed=nan, load=60.0, ramp_seconds=0.5)
    injected, _ = listener.call(
        InjectFault, "inject_fault", **good, fault_id="mine", parameters='{"width_m": 1e-3, "severity": 0.5}'
    )
    assert changed.success
    assert injected.success
    assert injected.fault_id == "mine"
    listener.spin(lambda: listener.samples[-1].first_sample > injected.sample + 4000)
    cleared, _ = listener.call(ClearFault, "clear_fault", fault_id="mine", ramp_seconds=0.2)
    assert cleared.success
    assert 0 < changed.sample <= injected.sample < cleared.sample
    assert listener.hear_out(process) == 0, process.output
    scenario = load_scenario("quick")
    fault = FaultSpec("inner_race_spall", "bearing_2", {"width_m": 1e-3}, 0.5, "mine")
    events = (
        SetOperatingPoint(None, 60.0, 0.5, changed.sample),
        Inject(fault, 0.1, injected.sample),
        Clear("mine", 0.2, cleared.sample),
    )
    replay = scenario.with_events(scenario.events + events)
    assert_bitwise(listener.batches, list(simulate(replay, 6.0, T0_NS)))
    seen = {truth.sample: truth for truth in listener.truths}
    assert seen[changed.sample].load == 60.0
    assert [fault.fault_id for fault in seen[injected.sample].faults][-1] == "mine"
    assert cleared.sample + round(0.2 * scenario.sample_rate_hz) in seen


def test_answers_while_running_as_fast_as_it_goes(ros_domain):
    from gearsim_msgs.srv import SetOperatingPoint as SetPoint

    listener = Listener(ros_domain, late=True)
    process = start(ros_domain, scenario="quick", rate_factor=0.0)
    listener.spin(lambda: listener.truths)
    waits = []
    for _ in range(20):
        answer, seconds = listener.call(SetPoint, "set_operating_point", speed=9.0, load=float("nan"))
        assert answer.success
        waits.append(seconds)
    assert np.median(waits) < 0.1, waits  # alone on the machine about 0.01
    assert process.stop(signal.SIGINT) == 0
    assert "Traceback" not in process.output


def test_a_stall_keeps_the_count(ros_domain):
    listener = Listener(ros_domain)
    process = start(ros_domain, scenario="quick", end_after=2.5, wait_for_subscribers=1)
    listener.spin(lambda: listener.seconds > 0.7)
    process.send_signal(signal.SIGSTOP)
    time.sleep(0.2)
    process.send_signal(signal.SIGCONT)
    at = len(listener.batches)
    assert listener.hear_out(process) == 0
    ends = assert_contiguous(listener.batches)
    assert set(ends.values()) == {40960}
    late = [
        (arrival - batch.t0_ns) * 1e-9 - batch.sample_count / batch.sample_rate_hz
        for arrival, batch in zip(listener.arrivals, listener.batches, strict=True)
    ]
    assert max(late[at : at + 20]) > 0.1  # the stall was there
    assert np.median(late[-50:]) < 0.1  # and is caught up: simulated time is wall time again


def test_too_much_asked_is_said_and_nothing_left_out(ros_domain):
    listener = Listener(ros_domain)
    process = start(ros_domain, scenario="quick", rate_factor=1000.0, end_after=100.0)
    warned = []

    def heard():
        warned[:] = [s for s in listener.statuses if s.level == b"\x01" and s.name == "simulator: pacing"]
        return bool(warned)

    listener.spin(heard)
    assert "cannot keep up" in warned[0].message
    assert warned[0].hardware_id == "unsw_parallel"
    assert {"lag_s", "achieved_factor"} <= {value.key for value in warned[0].values}
    assert process.stop(signal.SIGTERM) == 0
    assert "Traceback" not in process.output


def test_parameters_live_and_late_subscribers(ros_domain):
    from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
    from rcl_interfaces.srv import DescribeParameters, SetParameters

    listener = Listener(ros_domain)
    process = start(ros_domain, scenario="quick", wait_for_subscribers=1)
    listener.spin(lambda: listener.seconds > 1.0)

    def set_parameter(name, value):
        kind = ParameterType.PARAMETER_BOOL if isinstance(value, bool) else ParameterType.PARAMETER_DOUBLE
        field = "bool_value" if isinstance(value, bool) else "double_value"
        parameter = Parameter(name=name, value=ParameterValue(type=kind, **{field: value}))
        return listener.call(SetParameters, "set_parameters", parameters=[parameter])[0].results[0]

    assert not set_parameter("rate_factor", 2000.0).successful
    assert "expected 0 to 1000" in set_parameter("rate_factor", -1.0).reason
    assert not set_parameter("seed", True).successful
    assert set_parameter("paused", True).successful
    ros_domain.spin(listener.node, lambda: False, 0.3)
    stood = listener.seconds
    ros_domain.spin(listener.node, lambda: False, 0.5)
    assert listener.seconds == stood
    assert set_parameter("rate_factor", 4.0).successful
    assert set_parameter("paused", False).successful
    began = time.monotonic()
    listener.spin(lambda: listener.seconds > stood + 4.0)
    assert 0.8 < time.monotonic() - began < 3.0
    assert_contiguous(listener.batches)
    described, _ = listener.call(DescribeParameters, "describe_parameters", names=["rate_factor", "scenario"])
    rate, name = described.descriptors
    assert rate.description
    assert rate.floating_point_range[0].to_value == 1000.0
    assert name.read_only

    late = Listener(ros_domain, late=True)
    late.spin(lambda: late.truths and late.machines)
    assert late.truths[0].sample == 2 * 16384  # the fault that began before it subscribed
    assert late.truths[0].faults[0].component == "bearing_3"
    assert process.stop(signal.SIGINT) == 0


def test_simulated_time_from_elsewhere_sets_the_pace(ros_domain):
    from rosgraph_msgs.msg import Clock

    listener = Listener(ros_domain)
    clock = qos.create_publisher(listener.node, qos.CLOCK)
    process = start(ros_domain, scenario="quick", use_sim_time=True)
    listener.spin(lambda: clock.get_subscription_count() > 0)
    now_s = 5000.0
    while listener.seconds < 1.0 and now_s < 5030.0:
        now_s += 0.05
        msg = Clock()
        msg.clock.sec, msg.clock.nanosec = int(now_s), int(now_s % 1 * 1e9)
        clock.publish(msg)
        ros_domain.spin(listener.node, lambda: False, 0.02)
    ros_domain.spin(listener.node, lambda: False, 0.3)
    first = listener.samples[0]
    assert 5000 <= first.t0_ns * 1e-9 < 5030
    assert listener.seconds == pytest.approx(now_s - first.t0_ns * 1e-9, abs=0.15)
    stood = listener.seconds
    ros_domain.spin(listener.node, lambda: False, 0.4)
    assert listener.seconds == stood
    assert process.stop(signal.SIGTERM) == 0


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"scenario": "nope"}, "simulator: scenario: got nope, expected one of added_structure"),
        ({"scenario": "quick", "batch_samples": 3}, "batch_samples: got 3, expected"),
        ({"scenario": "quick", "end_after": -1.0}, "end_after"),
        ({"rate_factor": "fast"}, "rate_factor: got 'fast', expected a number"),
    ],
)
def test_bad_parameters_give_one_line(ros_domain, parameters, message):
    process = start(ros_domain, **parameters)
    assert process.wait() == 2
    assert message in process.output
    assert len([line for line in process.lines if line.strip()]) == 1, process.output


@pytest.mark.parametrize("after_s", [0.3, 0.9, 1.8, 3.0])
def test_ctrl_c_at_any_time(ros_domain, after_s):
    process = start(ros_domain, scenario="healthy")
    time.sleep(after_s)
    assert process.stop(signal.SIGINT) in (0, -signal.SIGINT)
    assert "Traceback" not in process.output
