"""Running tools: their output kept, nothing of them left behind, the lock outliving a killed set-up."""

from __future__ import annotations

import fcntl
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from gearsim_setup.command import ask, last_lines, run_logged


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def wait_until(condition, limit_s: float = 10.0) -> bool:
    end = time.monotonic() + limit_s
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.02)
    return False


def test_output_goes_to_the_log_and_line_by_line_to_us(tmp_path: Path) -> None:
    lines: list[str] = []
    log = tmp_path / "deep" / "x.log"
    code = run_logged(
        ["sh", "-c", "echo one; echo two >&2; exit 3"], log=log, env=os.environ, on_line=lines.append
    )
    assert code == 3
    assert sorted(lines) == ["one", "two"]
    assert log.read_text().startswith("$ sh -c")
    run_logged(["sh", "-c", "echo Error: the second"], log=log, env=os.environ)
    assert last_lines(log) == "Error: the second"


def test_a_tool_that_is_not_there_is_no_crash(tmp_path: Path) -> None:
    log = tmp_path / "x.log"
    assert run_logged(["/nowhere/tool"], log=log, env=os.environ) == 127
    assert "No such file" in last_lines(log)
    assert ask(["/nowhere/tool"]) is None
    assert ask(["sh", "-c", "echo a; exit 1"]) is None
    assert ask(["sleep", "5"], timeout_s=0.1) is None


def test_an_interruption_stops_the_tool_and_all_it_started(tmp_path: Path) -> None:
    """As colcon starts cmake, make and compilers: the grandchildren must go too, even stubborn ones."""
    script = f"trap '' TERM; sleep 60 & echo $! > {tmp_path}/grandchild; echo ready; wait; sleep 60"
    code = (
        "import os; from pathlib import Path; from gearsim_setup import command; command.GRACE_S = 0.3\n"
        f"log = Path({str(tmp_path)!r}) / 'x.log'\n"
        f"command.run_logged(['sh', '-c', {script!r}], log=log, env=os.environ, "
        "on_line=lambda line: print(line, flush=True))"
    )
    env = {**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parents[2])}
    command = [sys.executable, "-c", code]
    pipe = subprocess.PIPE
    parent = subprocess.Popen(command, env=env, stdout=pipe, stderr=subprocess.DEVNULL, text=True)
    assert parent.stdout is not None
    assert parent.stdout.readline() == "ready\n"
    grandchild = int((tmp_path / "grandchild").read_text())
    assert alive(grandchild)
    parent.send_signal(signal.SIGINT)
    parent.wait(timeout=20)
    parent.stdout.close()
    assert wait_until(lambda: not alive(grandchild))


def test_the_lock_is_held_until_the_orphan_of_a_killed_set_up_has_ended(tmp_path: Path) -> None:
    lock = tmp_path / "lock"
    code = (
        "import fcntl, os; from pathlib import Path; from gearsim_setup.command import run_logged\n"
        f"lock = os.open({str(lock)!r}, os.O_RDWR | os.O_CREAT); fcntl.flock(lock, fcntl.LOCK_EX)\n"
        f"log = Path({str(tmp_path)!r}) / 'x.log'\n"
        "run_logged(['sh', '-c', 'echo $$; exec sleep 2'], log=log, env=os.environ, "
        "keep_open=(lock,), on_line=lambda line: print(line, flush=True))"
    )
    env = {**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parents[2])}
    parent = subprocess.Popen([sys.executable, "-c", code], env=env, stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    orphan = int(parent.stdout.readline())
    parent.kill()
    parent.wait(timeout=10)
    parent.stdout.close()
    assert alive(orphan)
    with lock.open("r+") as mine:
        with pytest.raises(BlockingIOError):
            fcntl.flock(mine, fcntl.LOCK_EX | fcntl.LOCK_NB)
        fcntl.flock(mine, fcntl.LOCK_EX)
    assert wait_until(lambda: not alive(orphan))
