"""System packages: what counts as there, and what is done or said about what is not."""

from __future__ import annotations

import io
import os
import shutil
from pathlib import Path

import pytest

from gearsim_setup import system
from gearsim_setup.interpreter import Interpreter, probe
from gearsim_setup.job import Job
from gearsim_setup.places import Places
from gearsim_setup.problems import LackProblem
from gearsim_setup.report import Report
from gearsim_setup.route import WHEELS

NOWHERE = Path("/nowhere")


@pytest.fixture
def apt(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A made-up apt-get that we may call; it notes its calls in the file that is returned."""
    calls = tmp_path / "calls"
    tools = tmp_path / "tools"
    tools.mkdir()
    (tools / "apt-get").write_text(
        f'#!/bin/sh\necho "$@" >> {calls}\n'
        'case "$*" in *"install"*"$REFUSED"*) echo "E: nothing"; exit 100;; esac\n'
    )
    (tools / "apt-get").chmod(0o755)
    monkeypatch.setenv("PATH", f"{tools}:{os.environ['PATH']}")
    monkeypatch.setenv("REFUSED", "-none-")
    monkeypatch.delenv("GEARSIM_APT", raising=False)
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    return calls


@pytest.fixture
def job(copy: Path) -> Job:
    return Job(Places(copy), WHEELS, Report(io.StringIO()))


def debian(**facts) -> Interpreter:
    whole = {"executable": Path("/usr/bin/python3.12"), "include": NOWHERE, "has_ensurepip": True}
    return Interpreter(**{**whole, "version": (3, 12, 3), **facts})


def test_the_python_of_these_tests_has_what_it_needs() -> None:
    import sys

    python = probe(sys.executable)
    assert python.version == sys.version_info[:3]
    assert not python.executable.is_symlink()
    if shutil.which("c++") and (python.include / "Python.h").is_file():
        assert system.compiles(python)


@pytest.mark.usefixtures("apt")
def test_a_compiler_without_headers_does_not_count() -> None:
    lacks = system.lacking(debian())
    assert [lack.package for lack in lacks if "headers" in lack.what] == ["python3.12-dev"]
    assert not system.compiles(debian())


@pytest.mark.usefixtures("apt")
def test_debian_packs_ensurepip_apart() -> None:
    assert "python3.12-venv" in [lack.package for lack in system.lacking(debian(has_ensurepip=False))]


def test_a_python_from_elsewhere_is_not_mended_with_apt(apt: Path, job: Job) -> None:
    python = debian(executable=Path("/opt/mine/bin/python3.12"))
    with pytest.raises(
        LackProblem, match=r"the C headers of Python 3\.12 .*mend it with: a complete Python 3\.12"
    ):
        system.provide(job, python)
    assert not apt.exists()


def test_what_is_missing_is_installed_where_we_may(
    apt: Path, job: Job, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        system, "lacking", lambda _: [system.Lack("x", "build-essential"), system.Lack("y", "y-dev")]
    )
    monkeypatch.setattr(system, "has_vulkan", lambda: False)
    assert system.provide(job, debian())
    calls = apt.read_text().splitlines()
    assert calls[0].endswith(" update")
    assert calls[1].endswith(" install -y --no-install-recommends build-essential y-dev")
    assert calls[3].endswith(" install -y --no-install-recommends mesa-vulkan-drivers")


def test_pictures_alone_never_stop_the_set_up(apt: Path, job: Job, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(system, "lacking", lambda _: [])
    monkeypatch.setattr(system, "has_vulkan", lambda: False)
    monkeypatch.setenv("REFUSED", "mesa-vulkan-drivers")
    assert system.provide(job, debian())
    assert "mesa-vulkan-drivers" in apt.read_text()


@pytest.mark.usefixtures("apt")
def test_a_refused_package_is_told_with_the_reason(job: Job, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(system, "lacking", lambda _: [system.Lack("x", "build-essential")])
    monkeypatch.setenv("REFUSED", "build-essential")
    message = r"could not install build-essential \(E: nothing\); mend it with: apt-get install"
    with pytest.raises(LackProblem, match=message):
        system.provide(job, debian())


def test_nothing_is_installed_where_it_is_forbidden(
    apt: Path, job: Job, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GEARSIM_APT", "0")
    monkeypatch.setattr(system, "has_vulkan", lambda: False)
    monkeypatch.setattr(system, "lacking", lambda _: [])
    assert not system.provide(job, debian())
    monkeypatch.setattr(system, "lacking", lambda _: [system.Lack("no compiler", "build-essential")])
    with pytest.raises(LackProblem, match=r"missing: no compiler; mend it with: apt-get install -y"):
        system.provide(job, debian())
    assert not apt.exists()


def test_without_root_sudo_must_need_no_password(apt: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    sudo = apt.parent / "tools" / "sudo"
    sudo.write_text("#!/bin/sh\nexit 1\n")
    sudo.chmod(0o755)
    assert system.apt_prefix() is None
    assert system.apt_command(["a"]).startswith("sudo apt-get install ")
    sudo.write_text('#!/bin/sh\n[ "$1" = -n ]\n')
    assert system.apt_prefix() == ["sudo", "-n"]


def test_a_vulkan_driver_is_one_that_is_registered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("VK_DRIVER_FILES", "VK_ICD_FILENAMES"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(system, "VULKAN_FOLDERS", (str(tmp_path),))
    assert not system.has_vulkan()
    (tmp_path / "lvp_icd.x86_64.json").write_text("{}")
    assert system.has_vulkan()
    monkeypatch.setenv("VK_DRIVER_FILES", "/nowhere.json")
    assert not system.has_vulkan()
