"""`./gearsim test`: what pytest is called with, and the exit codes."""

from __future__ import annotations

from pathlib import Path

import pytest

from gearsim_setup.run_tests import EXIT_CODES, arguments


def test_workers_follow_the_cores_within_reason(tmp_path: Path) -> None:
    assert [arguments([], tmp_path, cores)[1] for cores in (1, 2, 4, 64)] == ["1", "2", "4", "4"]


def test_paths_are_meant_from_where_they_were_typed(tmp_path: Path) -> None:
    (tmp_path / "test_a.py").write_text("")
    given = ["test_a.py::test_x", "test_b.py", "-k", "test_a", "--maxfail=1"]
    assert arguments(given, tmp_path, 2)[4:] == [f"{tmp_path}/test_a.py::test_x", *given[1:]]


def test_a_persons_own_options_come_last_and_win(tmp_path: Path) -> None:
    assert arguments(["-n", "0"], tmp_path, 2) == ["-n", "2", "--dist", "loadgroup", "-n", "0"]


def test_exit_codes_are_those_of_every_other_command() -> None:
    codes = {name: EXIT_CODES[int(code)] for name, code in pytest.ExitCode.__members__.items()}
    special = {"OK": 0, "INTERRUPTED": 130, "USAGE_ERROR": 2, "NO_TESTS_COLLECTED": 2}
    assert codes == {name: special.get(name, 1) for name in codes}
