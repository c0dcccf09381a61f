"""Models in place of records: the same axis, the same bits, and nothing left running."""

from __future__ import annotations

import copy
import dataclasses
import functools
import multiprocessing
import os
import signal
import threading
import time

import numpy as np
import pytest
from rig_records import case_of, parallel_record, rig_record

from gearsim_io.errors import InputError
from gearsim_twin.baseline import scenario_content
from gearsim_twin.simulated import Simulator
from gearsim_twin.view import View
from gearsim_twin.workers import WorkerLostError, Workers


def level(view: View, channel: str) -> float:
    return float(np.std(view.signal(channel)))


def test_the_same_work_is_done_once_and_seeds_differ():
    case = case_of("unsw_parallel", "lpm34", parallel_record())
    with Simulator(case) as simulator:
        content = scenario_content(case, simulator.measured[0])
        (first,) = simulator.views({0: content}, seconds=1.0)
        (again,) = simulator.views({0: copy.deepcopy(content)}, seconds=1.0)
        (other,) = simulator.views({0: content}, seconds=1.0, seed=2)
        both = simulator.views({1: content, 0: content}, seconds=1.0)
    assert again is first
    assert both[1] is first
    assert first.record.seconds == 1.0
    assert first.record.channels == case.channels
    assert first.source == "tacho"
    assert not np.array_equal(other.record.data, first.record.data)
    assert "seed" in content
    assert content["seed"] == 1


def test_what_was_not_asked_for_long_is_forgotten(monkeypatch: pytest.MonkeyPatch):
    case = case_of("mfpt", "bearing5", rig_record())
    with Simulator(case) as simulator:
        content = scenario_content(case, simulator.measured[0])
        (first,) = simulator.views({0: content}, 0.2)
        monkeypatch.setattr("gearsim_twin.simulated._MOST_BYTES", 2 * first.nbytes)
        (second,) = simulator.views({0: content}, 0.2, seed=2)
        assert simulator.views({0: content}, 0.2)[0] is first  # the second is now the older one
        simulator.views({0: content}, 0.2, seed=3)
        assert simulator.views({0: content}, 0.2)[0] is first
        assert simulator.views({0: content}, 0.2, seed=2)[0] is not second


def test_what_the_simulator_refuses_is_named():
    case = case_of("mfpt", "bearing5", rig_record())
    with Simulator(case) as simulator:
        content = scenario_content(case, simulator.measured[0])
        content["parameters"] = {"radial_lode": "3 N"}
        with pytest.raises(InputError, match=r"parameters\.radial_lode"):
            simulator.views({0: content})
    with pytest.raises(InputError, match="workers"):
        Simulator(case, workers=0)


def test_without_an_angle_signal_the_measured_speed_is_the_axis():
    """A model that runs slower than assumed must show its lines at lower orders, as the record would."""
    case = case_of("mfpt", "bearing5", rig_record())
    with Simulator(case) as simulator:
        measured = simulator.measured[0]
        content = scenario_content(case, measured)
        slow = copy.deepcopy(content)
        slow["operating_point"]["speed"]["value"] *= 0.99
        steady, slower = simulator.views({0: content}) + simulator.views({0: slow})
        assert steady.speed_hz == slower.speed_hz == measured.speed_hz
        assert steady.source == measured.source
        assert not steady.record.tachos
        assert (steady.phase is None) == (measured.phase is None)
        if measured.phase is not None:
            assert slower.turns == pytest.approx(measured.speed_hz * measured.record.seconds, rel=1e-3)


def test_an_assumed_angle_follows_the_model_where_its_speed_wavers():
    case = case_of("unsw_parallel", "lpm34", dataclasses.replace(parallel_record(), tachos=()))
    t = np.linspace(0.0, 2.0, 41)
    with Simulator(case) as simulator:
        measured = simulator.measured[0]
        assert measured.source == "estimated"
        content = scenario_content(case, measured)
        del content["operating_point"]["speed"]
        columns = {"time_s": t.tolist(), "speed_hz": wave(9.8, t).tolist()}
        content["profile"] = {"trace": {"columns": columns}}
        (view,) = simulator.views({0: content}, seconds=1.8)
    time_s, course = view.speed_course(0.1)
    mean_hz = float(np.mean(wave(9.8, np.arange(0.0, 1.8, 1e-3))))
    expected = wave(9.8, time_s) * measured.speed_hz / mean_hz
    assert np.max(np.abs(course - expected)[2:-2]) < 0.02  # of a wave of 0.1 Hz; one pulse per turn


def test_a_part_of_a_run_up_keeps_the_speed_of_the_whole():
    """Half of it is slower than its mean; that is no reason to put its lines at higher orders."""
    case = case_of("unsw_parallel", "lpm34", dataclasses.replace(parallel_record(), tachos=()))
    t = np.linspace(0.0, 2.0, 5)
    run_up = 9.8 * (0.9 + 0.1 * t)
    with Simulator(case) as simulator:
        measured = simulator.measured[0]
        content = scenario_content(case, measured)
        del content["operating_point"]["speed"]
        content["profile"] = {"trace": {"columns": {"time_s": t.tolist(), "speed_hz": run_up.tolist()}}}
        (view,) = simulator.views({0: content}, seconds=1.0)
    time_s, course = view.speed_course(0.1)
    expected = np.interp(time_s, t, run_up) * measured.speed_hz / 9.8
    # One pulse per turn; by the mean of what was simulated it would be 0.5 Hz too high.
    assert np.max(np.abs(course - expected)[2:-2]) < 0.03


def wave(mean_hz: float, time_s: np.ndarray) -> np.ndarray:
    return mean_hz * (1 + 0.01 * np.sin(2 * np.pi * time_s))


def test_workers_give_the_same_bits_and_an_interrupt_leaves_nothing_running():
    case = case_of("mfpt", "bearing5", rig_record())
    threads = set(threading.enumerate())
    two = Simulator(case, workers=2)
    one = Simulator(case, measured=two.measured)
    content = scenario_content(case, one.measured[0])
    jobs = [(0, {**content, "oversampling": 11 + k}) for k in range(3)]
    then = functools.partial(level, channel="accel")
    alone, together = one.derived(jobs, then, 0.5), two.derived(jobs, then, 0.5)
    views = two.views({0: jobs[0][1], 1: jobs[1][1]}, 0.5)
    assert two.views({0: jobs[0][1]}, 0.5)[0] is views[0]
    assert level(views[0], "accel") == alone[0]
    assert alone == together
    assert len(set(alone)) == 3
    # Hours of simulation: only one that is given up ends.
    timer = threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        two.derived(jobs, then, 40_000.0)
    assert time.monotonic() - began < 30
    timer.join()
    assert not multiprocessing.active_children()
    assert set(threading.enumerate()) <= threads


def test_a_worker_that_dies_is_told_and_ends_with_the_others():
    workers = Workers(1)
    with pytest.raises(WorkerLostError):
        workers.map(os._exit, [9])
    workers.close()
    assert not multiprocessing.active_children()


def test_a_lost_worker_is_made_up_for(monkeypatch: pytest.MonkeyPatch):
    class Dying:
        def __init__(self, _count: int) -> None: ...

        def map(self, _function: object, _arguments: object) -> list[object]:
            raise WorkerLostError("killed")

        def close(self) -> None: ...

    monkeypatch.setattr("gearsim_twin.simulated.Workers", Dying)
    case = case_of("mfpt", "bearing5", rig_record())
    with Simulator(case, workers=2) as two:
        content = scenario_content(case, two.measured[0])
        jobs = [(0, content), (1, content)]
        first, second = two.derived(jobs, functools.partial(level, channel="accel"), 0.3)
    assert first == second > 0
