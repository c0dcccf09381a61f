"""`./gearsim test`: what pytest is called with, and the exit codes."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from gearsim_setup.run_tests import arguments, exit_code

ROOT = Path(__file__).resolve().parents[2]


def test_workers_follow_the_cores_within_reason(tmp_path: Path) -> None:
    assert [arguments([], tmp_path, cores)[1] for cores in (1, 2, 4, 64)] == ["1", "2", "4", "4"]


def test_paths_are_meant_from_where_they_were_typed(tmp_path: Path) -> None:
    (tmp_path / "test_a.py").write_text("")
    given = ["test_a.py::test_x", "test_b.py", "-k", "test_a", "--maxfail=1"]
    assert arguments(given, tmp_path, 2)[4:] == [f"{tmp_path}/test_a.py::test_x", *given[1:]]


def test_a_persons_own_options_come_last_and_win(tmp_path: Path) -> None:
    assert arguments(["-n", "0"], tmp_path, 2) == ["-n", "2", "--dist", "loadgroup", "-n", "0"]


def test_exit_codes_are_those_of_every_other_command() -> None:
    codes = {name: exit_code(int(code), pressed=True) for name, code in pytest.ExitCode.__members__.items()}
    special = {"OK": 0, "INTERRUPTED": 130, "USAGE_ERROR": 2, "NO_TESTS_COLLECTED": 2}
    assert codes == {name: special.get(name, 1) for name in codes}


@pytest.mark.parametrize("workers", ["0", "1"])
def test_a_run_that_stops_at_a_failure_failed_and_was_not_interrupted(tmp_path: Path, workers: str) -> None:
    (tmp_path / "test_bad.py").write_text(
        "def test_bad():\n    assert False\n\n\ndef test_good():\n    pass\n"
    )
    assert run(tmp_path, "-x", "-n", workers).wait(timeout=60) == 1


def test_ctrl_c_is_an_interruption(tmp_path: Path) -> None:
    (tmp_path / "test_long.py").write_text(
        "import time\n\n\ndef test_long():\n    open('on', 'w'); time.sleep(60)\n"
    )
    process = run(tmp_path, "-n", "0")
    end = time.monotonic() + 30
    while not (tmp_path / "on").exists() and time.monotonic() < end:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=30) == 130


def run(place: Path, *options: str) -> subprocess.Popen:
    """`./gearsim test` in a repository of one test file."""
    (place / "gearsim_setup").mkdir()
    shutil.copy2(ROOT / "gearsim_setup" / "run_tests.py", place / "gearsim_setup")
    (place / "pytest.ini").write_text("[pytest]\n")
    command = [
        sys.executable,
        str(place / "gearsim_setup" / "run_tests.py"),
        "-p",
        "no:cacheprovider",
        *options,
    ]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
