"""The entry script as a person meets it: real processes, no network."""

from __future__ import annotations

import fcntl
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

SYSTEM_TOOLS = ("sh", "env", "cat", "grep")


def start(
    place: Path, *arguments: str, env: dict[str, str], cwd: Path | None = None
) -> subprocess.CompletedProcess:
    """Run `./gearsim` with the Python of these tests, whatever `python3` is."""
    command = [sys.executable, str(place / "gearsim"), *arguments]
    return subprocess.run(command, env=env, cwd=cwd, capture_output=True, text=True, timeout=60, check=False)


def one_line(text: str) -> str:
    lines = [line for line in text.splitlines() if line.startswith("gearsim: ")]
    assert len(lines) == 1, text
    assert "Traceback" not in text
    return lines[0]


@pytest.fixture
def bare_path(tmp_path: Path) -> str:
    """A PATH without any compiler, make or apt-get."""
    folder = tmp_path / "bare"
    folder.mkdir()
    for name in SYSTEM_TOOLS:
        found = next(path for path in (Path("/bin") / name, Path("/usr/bin") / name) if path.exists())
        (folder / name).symlink_to(found)
    return str(folder)


def test_without_a_compiler_one_line_names_it_and_the_command(
    copy: Path, plain_environment: dict[str, str], bare_path: str
) -> None:
    done = start(copy, "demo", env={**plain_environment, "PATH": bare_path})
    assert done.returncode == 3
    assert done.stdout == ""
    line = one_line(done.stderr)
    assert "no cc, c++, make" in line
    assert "mend it with: " in line
    assert "apt-get install -y --no-install-recommends build-essential" in line
    assert not (copy / ".venv").exists()


def test_a_broken_compiler_is_told_too(copy: Path, plain_environment: dict[str, str], bare_path: str) -> None:
    for name in ("cc", "c++", "make"):
        (Path(bare_path) / name).write_text("#!/bin/sh\nexit 1\n")
        (Path(bare_path) / name).chmod(0o755)
    done = start(copy, "setup", env={**plain_environment, "PATH": bare_path})
    assert done.returncode == 3
    assert "a C++ compiler that works" in one_line(done.stderr)


def test_an_old_python_is_refused_in_one_line(
    root: Path, plain_environment: dict[str, str], tmp_path: Path
) -> None:
    done = as_python(3, 9, root, {**plain_environment, "PATH": str(tmp_path)})
    assert done.returncode == 3
    line = one_line(done.stderr)
    assert "needs Python 3.11, 3.12 or 3.13" in line
    assert "GEARSIM_PYTHON=" in line


@pytest.mark.parametrize("minor", [10, 14])
def test_a_python_that_does_not_fit_hands_over_to_one_that_does(
    root: Path, plain_environment: dict[str, str], tmp_path: Path, minor: int
) -> None:
    # python3.13 is a wrapper without anything behind it, as pyenv makes them.
    for name, body in (
        ("python3.13", "exit 127"),
        ("python3.12", 'if [ "$1" = -c ]; then echo 3.12; else echo "handed over: $@"; fi'),
    ):
        (tmp_path / name).write_text(f"#!/bin/sh\n{body}\n")
        (tmp_path / name).chmod(0o755)
    done = as_python(3, minor, root, {**plain_environment, "PATH": str(tmp_path)}, "info", "a bag")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == f"handed over: {root / 'gearsim'} info a bag\n"


def as_python(major: int, minor: int, root: Path, env: dict[str, str], *arguments: str):
    """Run the entry script as if this Python were another one."""
    script = str(root / "gearsim")
    code = (
        f"import sys, runpy; sys.version_info = ({major}, {minor}, 1, 'final', 0); "
        f"sys.argv = {[script, *arguments]!r}; runpy.run_path({script!r}, run_name='__main__')"
    )
    command = [sys.executable, "-c", code]
    return subprocess.run(command, env=env, capture_output=True, text=True, timeout=60, check=False)


def test_the_entry_can_be_read_by_an_old_python(root: Path) -> None:
    import ast

    ast.parse((root / "gearsim").read_text(), feature_version=(3, 5))


def test_help_needs_no_set_up(copy: Path, plain_environment: dict[str, str]) -> None:
    done = start(copy, "--help", env=plain_environment)
    assert (done.returncode, done.stderr) == (0, "")
    assert "./gearsim setup" in done.stdout
    assert not (copy / ".gearsim").exists()


@pytest.mark.parametrize(
    ("arguments", "variables", "code", "words"),
    [
        (("setup", "--fast"), {}, 2, "setup: got --fast, expected nothing or --again"),
        (("doctor", "--loud"), {}, 2, "doctor: got --loud, expected nothing or --json"),
        (
            ("info",),
            {"GEARSIM_PYTHON": "/nowhere/python"},
            2,
            "GEARSIM_PYTHON: got /nowhere/python, expected",
        ),
        (("info",), {"GEARSIM_ROS": "humble"}, 2, "GEARSIM_ROS: got humble, expected wheels or distribution"),
        (("info",), {"GEARSIM_ROS": "distribution"}, 2, "GEARSIM_ROS: got distribution, expected wheels"),
    ],
)
def test_wrong_usage_is_one_line_and_changes_nothing(
    copy: Path, plain_environment: dict[str, str], arguments, variables, code: int, words: str
) -> None:
    done = start(copy, *arguments, env={**plain_environment, **variables})
    assert done.returncode == code
    assert words in one_line(done.stderr)
    assert not (copy / ".venv").exists()


def test_a_path_with_a_space_is_refused_before_anything_is_made(
    copy: Path, plain_environment: dict[str, str], tmp_path: Path
) -> None:
    spaced = copy.rename(tmp_path / "my repository")
    done = start(spaced, "demo", env=plain_environment)
    assert done.returncode == 3
    assert "a colon or a space in its path" in one_line(done.stderr)
    assert not (spaced / ".gearsim").exists()


def test_doctor_tells_what_is_missing_when_nothing_is_there(
    copy: Path, plain_environment: dict[str, str]
) -> None:
    done = start(copy, "doctor", "--json", env=plain_environment)
    assert done.returncode == 3
    report = json.loads(done.stdout)
    assert report["ok"] is False
    states = {check["name"]: check for check in report["checks"]}
    assert states["virtual env"]["state"] == "missing"
    assert states["virtual env"]["mend"] == "./gearsim setup"
    assert states["python"]["state"] == "ok"
    assert {path.name for path in copy.iterdir()} == {
        "gearsim", "gearsim_setup", "requirements.lock", "requirements-ros.lock", "ros2_ws",
    }  # fmt: skip


def test_doctor_names_the_missing_compiler(
    copy: Path, plain_environment: dict[str, str], bare_path: str
) -> None:
    done = start(copy, "doctor", env={**plain_environment, "PATH": bare_path})
    assert done.returncode == 3
    assert "missing   system packages" in done.stdout
    assert "build-essential" in done.stdout


@pytest.fixture
def said(tmp_path: Path) -> Path:
    return tmp_path / "said"


def handed_over(said: Path) -> tuple[list[str], dict[str, str]]:
    arguments = said.with_suffix(".arguments").read_text().splitlines()
    lines = said.with_suffix(".environment").read_text().splitlines()
    return arguments, dict(line.split("=", 1) for line in lines if "=" in line)


def test_a_standing_environment_is_entered_at_once(
    standing: Path, plain_environment: dict[str, str], said: Path, tmp_path: Path
) -> None:
    env = {**plain_environment, "SAID": str(said), "PYTHONPATH": "/my/own", "PATH": "/usr/bin:/bin"}
    done = start(standing, "run", "demo", "--seconds", "3", env=env, cwd=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    arguments, got = handed_over(said)
    assert arguments == ["-m", "gearsim_bringup.cli", "run", "demo", "--seconds", "3"]
    workspace, venv = standing / "ros2_ws", standing / ".venv"
    assert got["PATH"].split(":")[0] == str(venv / "bin")
    assert got["AMENT_PREFIX_PATH"] == f"{workspace}/install:{venv}"
    libraries = [
        f"{workspace}/install/lib",
        f"{venv}/lib",
        f"{venv}/lib/python3.12/site-packages/ros_some.libs",
    ]
    assert got["LD_LIBRARY_PATH"].split(":") == libraries
    folders = [
        f"{workspace}/src/some_program",
        f"{workspace}/install/lib/python3.12/site-packages",
        "/my/own",
    ]
    assert got["PYTHONPATH"].split(":") == folders
    assert got["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "LOCALHOST"
    assert got["_ROS_WHEELS_BOOTSTRAP_COMPLETE"] == "1"
    assert got["GEARSIM_ROOT"] == str(standing)


def test_what_the_person_set_about_discovery_stays(
    standing: Path, plain_environment: dict[str, str], said: Path
) -> None:
    own = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET", "OPENBLAS_NUM_THREADS": "8", "ROS_DOMAIN_ID": "7"}
    start(standing, "info", env={**plain_environment, **own, "SAID": str(said)})
    _, got = handed_over(said)
    assert {name: got[name] for name in own} == own


def test_the_test_command_runs_the_suite_of_this_repository(
    standing: Path, plain_environment: dict[str, str], said: Path
) -> None:
    start(standing, "test", "-k", "one", env={**plain_environment, "SAID": str(said)})
    arguments, _ = handed_over(said)
    assert arguments == [str(standing / "gearsim_setup" / "run_tests.py"), "-k", "one"]


def test_the_entry_works_through_a_link(
    standing: Path, plain_environment: dict[str, str], said: Path, tmp_path: Path
) -> None:
    (tmp_path / "gs").symlink_to(standing / "gearsim")
    command = [sys.executable, str(tmp_path / "gs"), "info"]
    subprocess.run(command, env={**plain_environment, "SAID": str(said)}, check=True, timeout=60)
    assert handed_over(said)[0] == ["-m", "gearsim_bringup.cli", "info"]


def test_another_python_on_the_path_does_not_cause_a_rebuild_but_a_wish_does(
    standing: Path, plain_environment: dict[str, str], said: Path, bare_path: str
) -> None:
    env = {**plain_environment, "SAID": str(said), "PATH": bare_path}
    assert start(standing, "info", env=env).returncode == 0
    # The Python of these tests is not the one that the environment claims to be of.
    done = start(standing, "info", env={**env, "GEARSIM_PYTHON": sys.executable})
    assert done.returncode == 3
    assert "setting up gearsim" in done.stderr


def test_nohup_holds_for_the_program_too(
    standing: Path, plain_environment: dict[str, str], said: Path
) -> None:
    command = ["nohup", sys.executable, str(standing / "gearsim"), "info"]
    env = {**plain_environment, "SAID": str(said)}
    subprocess.run(command, env=env, capture_output=True, check=True, timeout=60)
    ignored = int(said.with_suffix(".ignored").read_text().split()[1], 16)
    assert ignored & 1 << (signal.SIGHUP - 1)


def test_a_second_start_waits_for_the_first(
    standing: Path, plain_environment: dict[str, str], said: Path
) -> None:
    stamp = standing / ".gearsim" / "stamp.json"
    whole = stamp.read_text()
    stamp.unlink()
    descriptor = os.open(standing / ".gearsim" / "lock", os.O_RDWR | os.O_CREAT)
    fcntl.flock(descriptor, fcntl.LOCK_EX)
    try:
        command = [sys.executable, str(standing / "gearsim"), "info"]
        env = {**plain_environment, "SAID": str(said)}
        second = subprocess.Popen(command, env=env, stderr=subprocess.PIPE, text=True)
        assert second.stderr is not None
        assert "another start is setting up here" in second.stderr.readline()
        time.sleep(0.5)
        assert second.poll() is None
        stamp.write_text(whole)
    finally:
        os.close(descriptor)
    assert second.wait(timeout=30) == 0
    # It found everything done and did nothing itself.
    assert second.stderr.read() == ""
    assert handed_over(said)[0][-1] == "info"
    second.stderr.close()
