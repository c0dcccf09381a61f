"""The order of the steps, and a set-up that is stopped in any of them."""

from __future__ import annotations

import io
import json
from pathlib import Path

import pytest

from gearsim_setup import steps
from gearsim_setup.interpreter import Interpreter
from gearsim_setup.job import Job
from gearsim_setup.main import is_ready
from gearsim_setup.places import Places
from gearsim_setup.report import Report
from gearsim_setup.route import WHEELS
from gearsim_setup.stamp import Stamp

PYTHON = Interpreter(Path("/usr/bin/python3.12"), (3, 12, 3), Path("/usr/include/python3.12"), True)
ORDER = ["system", "venv", "wheels", "mend", "clear", "build"]


class Tools:
    """Stands for pip, venv and colcon: notes what was called, and can be cut off in the middle of one."""

    def __init__(self, places: Places, patch: pytest.MonkeyPatch) -> None:
        self.places = places
        self.calls: list[str] = []
        self.cut_off_in = ""
        patch.delenv("GEARSIM_PYTHON", raising=False)
        patch.setattr(steps.interpreter, "choose", lambda _: PYTHON)
        patch.setattr(steps.system, "provide", lambda *_: self._call("system"))
        patch.setattr(steps.wheels, "adoptable", lambda *_: False)
        patch.setattr(steps.wheels, "make_venv", lambda *_: self._call("venv", self._venv))
        patch.setattr(steps.wheels, "install", lambda *_: self._call("wheels"))
        patch.setattr(steps.workspace, "mend_wheels", lambda *_: self._call("mend"))
        patch.setattr(steps.workspace, "clear", lambda *_: self._call("clear"))
        patch.setattr(steps.workspace, "build", lambda *_: self._call("build", self._build))
        patch.setattr(steps, "_keep_rerun_quiet", lambda _: None)

    def _call(self, name: str, deed=None) -> bool:
        self.calls.append(name)
        if name == self.cut_off_in:
            raise KeyboardInterrupt
        if deed is not None:
            deed()
        return False

    def _venv(self) -> None:
        self.places.python.parent.mkdir(parents=True, exist_ok=True)
        self.places.python.write_text("")
        self.places.python.chmod(0o755)
        (self.places.venv / "pyvenv.cfg").write_text("home = /usr/bin\nversion = 3.12.3\n")

    def _build(self) -> None:
        self.places.install.mkdir(parents=True, exist_ok=True)
        (self.places.install / "setup.sh").write_text("")

    def run(self, cut_off_in: str = "") -> list[str]:
        self.calls, self.cut_off_in = [], cut_off_in
        try:
            steps.assemble(Job(self.places, WHEELS, Report(io.StringIO())))
        except KeyboardInterrupt:
            assert cut_off_in
        return self.calls


@pytest.fixture
def tools(copy: Path, monkeypatch: pytest.MonkeyPatch) -> Tools:
    return Tools(Places(copy), monkeypatch)


def test_everything_is_done_once_and_in_order(tools: Tools) -> None:
    assert tools.run() == ORDER
    assert is_ready(tools.places, WHEELS)
    assert tools.run() == ["system"]


@pytest.mark.parametrize(
    ("cut_off_in", "again"),
    [
        ("system", ORDER),
        ("venv", ORDER),
        ("wheels", ["system", "wheels", "mend", "clear", "build"]),
        ("mend", ["system", "mend", "clear", "build"]),
        ("clear", ["system", "mend", "clear", "build"]),
        ("build", ["system", "mend", "clear", "build"]),
    ],
)
def test_a_set_up_that_was_cut_off_goes_on_where_it_was(
    tools: Tools, cut_off_in: str, again: list[str]
) -> None:
    assert tools.run(cut_off_in)[-1] == cut_off_in
    assert not is_ready(tools.places, WHEELS)
    assert tools.run() == again
    assert is_ready(tools.places, WHEELS)


@pytest.mark.parametrize(
    ("name", "again"),
    [
        ("requirements.lock", ["system", "wheels", "mend", "clear", "build"]),
        ("ros2_ws/src/some_msgs/msg/One.msg", ["system", "mend", "clear", "build"]),
        ("ros2_ws/src/some_program/setup.py", ["system", "mend", "build"]),
    ],
)
def test_a_change_repeats_only_what_it_touches(tools: Tools, copy: Path, name: str, again: list[str]) -> None:
    tools.run()
    (copy / name).write_text((copy / name).read_text() + "\n")
    assert tools.run() == again


@pytest.mark.parametrize(
    ("name", "cut_off_in"),
    [
        ("requirements.lock", "wheels"),
        ("requirements.lock", "build"),
        ("ros2_ws/src/some_msgs/msg/One.msg", "build"),
        ("ros2_ws/src/some_program/setup.py", "build"),
    ],
)
def test_a_change_that_was_cut_off_is_not_forgotten_when_it_is_undone(
    tools: Tools, copy: Path, name: str, cut_off_in: str
) -> None:
    """The half-made environment must not pass for the old whole one."""
    tools.run()
    before = (copy / name).read_text()
    (copy / name).write_text(before + "# changed\n")
    tools.run(cut_off_in)
    (copy / name).write_text(before)
    assert not is_ready(tools.places, WHEELS)
    assert cut_off_in in tools.run()


def test_the_stamp_is_replaced_whole(tools: Tools, monkeypatch: pytest.MonkeyPatch) -> None:
    """Killed while it writes the stamp: the file in place is always one that can be read."""
    tools.run()
    stamp = Stamp(tools.places.stamp)

    def killed(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("gearsim_setup.stamp.os.replace", killed)
    with pytest.raises(KeyboardInterrupt):
        stamp.strike("venv")
    assert set(json.loads(tools.places.stamp.read_text())) == {"venv", "wheels", "messages", "packages"}


def test_a_broken_virtual_environment_is_made_anew(tools: Tools) -> None:
    tools.run()
    tools.places.python.unlink()
    assert tools.run() == ORDER
