"""Other programs beside this one: left out where they are not installed, asked in their own environment."""

import json
import subprocess
from types import SimpleNamespace

import pytest

from gearsim_bringup.bench import peers, sim
from gearsim_bringup.ui import JobFailedError, Voice
from gearsim_io.errors import EnvironmentLackError


@pytest.fixture(autouse=True)
def state(monkeypatch, tmp_path):
    monkeypatch.setenv("GEARSIM_STATE", str(tmp_path))
    return tmp_path


def installed(state, script):
    """An environment whose Python is a shell script."""
    python = state / "peers" / "bin" / "python"
    python.parent.mkdir(parents=True)
    python.write_text("#!/bin/sh\n" + script)
    python.chmod(0o755)
    (state / "peers" / "complete").write_text(peers.REQUIREMENTS.read_text())


def test_without_peers_their_figures_are_left_out_with_a_word_about_it(capsys):
    assert peers.ross_seconds_per_second() is None
    assert list(sim._ross(Voice(json_mode=False), 15.0)) == []
    assert "--peers" in capsys.readouterr().out


def test_ratios_are_to_what_the_peer_took(state):
    answer = json.dumps({"dof": 36, "constant_s": 2.0, "varying_s": 60.0})
    installed(state, f"echo 'some greeting'\necho '{answer}'\n")
    constant, varying = sim._ross(Voice(json_mode=True), 15.0)
    assert constant.value == 30.0
    assert varying.value == 900.0
    assert varying.baseline == ("ROSS 2.3.0, 36 DOF", pytest.approx(1 / 60))


def test_a_peer_that_fails_is_named(state):
    installed(state, "echo 'no such module' >&2\nexit 1\n")
    with pytest.raises(JobFailedError, match="ROSS: no such module"):
        peers.ross_seconds_per_second()


def test_installing_is_done_once_and_its_failure_told(state, monkeypatch):
    calls = []
    monkeypatch.setattr(peers.venv, "create", lambda folder, **_: folder.mkdir(parents=True, exist_ok=True))

    def run(command, **_):
        calls.append(command)
        return SimpleNamespace(returncode=len(calls) == 1, stderr="no index", stdout="")

    monkeypatch.setattr(subprocess, "run", run)
    voice = Voice(json_mode=True)
    with pytest.raises(EnvironmentLackError, match="no index"):
        peers.install(voice)
    assert not (state / "peers" / "complete").exists()
    peers.install(voice)
    peers.install(voice)
    assert len(calls) == 2
    assert str(peers.REQUIREMENTS) in calls[1]
