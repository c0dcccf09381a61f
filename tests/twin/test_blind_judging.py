"""The judge of the blind tests sees the records and nothing else, and that is checked."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from blind import judging
from blind.rigs import RIGS

WATCHED = Path(judging.__file__).with_name("watched.py")


def test_no_word_of_the_tests_is_in_the_judges_surroundings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BLIND_TRUTH", "unbalance")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(judging.TESTS / "twin"), "/some/package"]))
    found = judging.environment(tmp_path / "log")
    assert "BLIND_TRUTH" not in found
    assert found["PYTHONPATH"] == "/some/package"


def test_opened_files_are_written_down_also_those_of_its_processes(tmp_path: Path) -> None:
    secret, log = tmp_path / "truth" / "truth.json", tmp_path / "log"
    secret.parent.mkdir()
    secret.write_text("{}", encoding="utf-8")
    log.touch()
    # A stand-in for the program, which lets a process of its own read the truth.
    code = (
        "import os, runpy\n"
        f"runpy.run_path({str(WATCHED)!r})\n"
        "child = os.fork()\n"
        "if child == 0:\n"
        f"    open({str(secret)!r}).close(); os._exit(0)\n"
        "os.waitpid(child, 0)\n"
    )
    subprocess.run([sys.executable, "-c", code], env=judging.environment(log), check=True)
    opened = log.read_text(encoding="utf-8").splitlines()
    assert judging.forbidden(opened, [tmp_path / "truth"]) == [str(secret)]
    assert judging.forbidden(opened, [tmp_path / "elsewhere"]) == []


def test_a_judge_that_peeks_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    secret = tmp_path / "truth"
    secret.mkdir()

    def peeking(*given: Any) -> tuple[str, str, int]:
        Path(given[2]["GEARSIM_WATCH"]).write_text(str(secret / "truth.json"), encoding="utf-8")
        return "{}", "", 0

    monkeypatch.setattr(judging, "_run", peeking)
    with pytest.raises(judging.PeekedError, match=r"truth\.json"):
        judging.judge([tmp_path / "a", tmp_path / "b"], RIGS["bearing"], [secret])


def test_the_tests_own_folder_is_forbidden() -> None:
    sizes = str(judging.TESTS / "twin" / "blind" / "sizes.json")
    assert judging.forbidden([sizes, str(WATCHED)], [judging.TESTS]) == [sizes]


def test_a_judge_that_cannot_is_told_with_its_last_words(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / f"{name}.csv").write_text("time,accel\n0,1\n", encoding="utf-8")
    judged = judging.judge([tmp_path / "a.csv", tmp_path / "b.csv"], RIGS["bearing"], [], limit_s=120.0)
    assert judged.verdict is None
    assert judged.said.startswith("exit code 2")
    assert judged.wall_s > 0
