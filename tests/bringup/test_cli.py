"""Exit codes and the shape of errors: one line on stderr, no traceback, the documented status."""

from __future__ import annotations

import json
import subprocess
import sys

import click
import pytest

from gearsim_bringup import cli
from gearsim_bringup.ui import JobFailedError, plain
from gearsim_io.bags import BagError
from gearsim_io.errors import EnvironmentLackError, InputError
from gearsim_sim.scenario import scenario_names

COMMANDS = sorted(cli.COMMANDS)


def gearsim(*words: str, cwd=None) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "gearsim_bringup.cli", *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False, cwd=cwd)


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (
            InputError("a.yaml", "speed", -1, "a speed above 0 Hz"),
            2,
            "a.yaml: speed: got -1, expected a speed",
        ),
        (EnvironmentLackError("no compiler", "apt-get install g++"), 3, "apt-get install g++"),
        (JobFailedError("the simulator ended early"), 1, "the simulator ended early"),
        (OSError(28, "No space left on device"), 1, "No space left on device"),
        (PermissionError(13, "Permission denied", "/x/y"), 1, "gearsim: /x/y: Permission denied"),
        (BagError("x.png: the viewer drew nothing"), 1, "gearsim: x.png: the viewer drew nothing"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (click.UsageError("no such option"), 2, "no such option"),
        (RuntimeError("surprise"), 1, "unexpected RuntimeError: surprise"),
    ],
)
def test_every_kind_of_error_is_one_line_with_its_code(error, code, words, monkeypatch, capsys, tmp_path):
    def fail(*_args: object, **_kwargs: object) -> None:
        raise error

    monkeypatch.setenv("GEARSIM_STATE", str(tmp_path))
    monkeypatch.setattr(cli.app, "main", fail)
    assert cli.main([]) == code
    printed = capsys.readouterr()
    assert printed.out == ""
    assert words in printed.err
    assert len(printed.err.strip().splitlines()) == 1
    assert "Traceback" not in printed.err
    assert ("crash.txt" in printed.err) == (words == "unexpected RuntimeError: surprise")


def test_unforeseen_error_leaves_its_traceback_in_a_file(monkeypatch, tmp_path):
    def fail(*_args: object, **_kwargs: object) -> None:
        raise RuntimeError("surprise")

    monkeypatch.setenv("GEARSIM_STATE", str(tmp_path))
    monkeypatch.setattr(cli.app, "main", fail)
    cli.main([])
    assert "in fail" in (tmp_path / "log" / "crash.txt").read_text()


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_each_command_has_an_example(name, capsys):
    assert cli.main([name, "--help"]) == 0
    page = capsys.readouterr().out
    assert f"gearsim {name}" in page
    assert "Example" in page


def test_help_names_every_command(capsys):
    assert cli.main(["--help"]) == 0
    page = capsys.readouterr().out
    for name in (*COMMANDS, "test", "doctor"):
        assert name in page


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("nonsense",), "No such command"),
        (("simulate",), "SCENARIO"),
        (("simulate", "healthy", "--seconds", "minus", "--out", "x"), "seconds"),
        (("simulate", "no_such", "--seconds", "1", "--out", "x"), "no_such"),
        (("diagnose", "no_such.mat", "--machine", "mfpt"), "no_such.mat"),
        (("info", "no_such_bag"), "no_such_bag"),
        (("recover", "no_such_bag"), "no_such_bag"),
    ],
)
def test_bad_usage_is_one_line_and_status_2(words, expected, tmp_path):
    done = gearsim(*words, cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert expected in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert done.stdout == ""
    assert list(tmp_path.iterdir()) == []


def test_scenarios_are_listed_with_a_line_each(capsys):
    assert cli.main(["scenarios"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(scenario_names())
    assert all(len(line.split()) > 3 for line in lines)
    assert cli.main(["scenarios", "Crack", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["scenarios"]
    assert {"gear_tooth_crack", "planetary_crack", "planetary_hunting"} == {one["name"] for one in found}
    assert "root crack" in found[0]["description"]
    assert cli.main(["scenarios", "zebra"]) == 2
    assert "got zebra" in capsys.readouterr().err


def test_json_never_holds_nan():
    import numpy as np

    text = json.dumps(plain({"a": float("nan"), "b": (np.float64(2.0), np.inf), "c": np.arange(2)}))
    assert text == '{"a": null, "b": [2.0, null], "c": [0, 1]}'
