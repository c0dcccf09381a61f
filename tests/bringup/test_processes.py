"""Node processes are started with ROS arguments and all ended, whatever happens."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest

from gearsim_bringup.processes import Graph, NodeSpec

STUBBORN = """
import signal, sys, time
signal.signal(signal.SIGINT, signal.SIG_IGN)
print("up", *sys.argv[1:], flush=True)
time.sleep(60)
"""
OBEDIENT = STUBBORN.replace("signal.SIG_IGN", "lambda *_: sys.exit(0)")


def module(folder: Path, name: str, text: str) -> dict[str, str]:
    (folder / f"{name}.py").write_text(text)
    return {**os.environ, "PYTHONPATH": str(folder)}


def alive(pid: int) -> bool:
    return Path(f"/proc/{pid}").exists()


def wait_for(text: str, log: Path) -> None:
    for _ in range(100):
        if text in log.read_text():
            return
        time.sleep(0.05)
    pytest.fail(f"{log} never said {text!r}")


def test_parameters_reach_the_node_in_ros_syntax():
    spec = NodeSpec(
        "a", "m", {"rate": 1.0, "bag": "it's", "loop": True, "topics": ["x", "y"]}, {"accel": "b"}
    )
    words = spec.command()[3:]
    assert words == [
        *("--ros-args", "-r", "__ns:=/gearsim"),
        *("-p", "rate:=1.0", "-p", "bag:='it''s'", "-p", "loop:=true", "-p", "topics:=['x', 'y']"),
        *("-r", "accel:=b"),
    ]


def test_processes_end_with_the_context_even_after_an_error(tmp_path):
    environment = module(tmp_path, "obedient", OBEDIENT)
    graph = Graph(tmp_path / "log", environment)

    def fail() -> None:
        with graph:
            process = graph.start(NodeSpec("one", "obedient"))
            wait_for("up", process.log)
            raise RuntimeError("on the way")

    with pytest.raises(RuntimeError, match="on the way"):
        fail()
    assert [p.returncode() for p in graph.processes] == [0]
    assert not alive(graph.processes[0].pid)


def test_a_node_that_ignores_the_first_signal_is_told_again(tmp_path, monkeypatch):
    steps = ((signal.SIGINT, 0.3), (signal.SIGTERM, 5.0))
    monkeypatch.setattr("gearsim_bringup.processes._STOP_STEPS", steps)
    with Graph(tmp_path, module(tmp_path, "stubborn", STUBBORN)) as graph:
        process = graph.start(NodeSpec("one", "stubborn"))
        wait_for("up", process.log)
    assert process.returncode() == -signal.SIGTERM


def test_a_failed_node_is_noticed_with_its_last_words(tmp_path):
    environment = module(tmp_path, "failing", "import sys\nprint('first')\nsys.exit('disk full')\n")
    with Graph(tmp_path, environment) as graph:
        process = graph.start(NodeSpec("one", "failing"))
        process.wait(10)
        assert graph.failed() is process
        assert process.last_words() == "disk full"
