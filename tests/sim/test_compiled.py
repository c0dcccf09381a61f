"""Compiled code finds a place to be kept, or does without one."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from gearsim_sim.integrate import compiled

SOURCES = Path(compiled.__file__).parents[2]


@pytest.fixture(autouse=True)
def fresh():
    compiled.cache_folder.cache_clear()
    yield
    compiled.cache_folder.cache_clear()


def test_cache_lies_in_the_users_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    folder = compiled.cache_folder()
    assert folder is not None
    assert folder.parent == tmp_path / "gearsim"
    assert SOURCES not in folder.parents  # an installation that cannot be written to is no obstacle


def test_cache_moves_to_the_temporary_folder_or_is_given_up(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", "/dev/null/nowhere")
    monkeypatch.setattr(compiled.tempfile, "gettempdir", lambda: str(tmp_path))
    folder = compiled.cache_folder()
    assert folder is not None
    assert tmp_path in folder.parents
    compiled.cache_folder.cache_clear()
    monkeypatch.setattr(compiled.tempfile, "gettempdir", lambda: "/dev/null/nowhere")
    assert compiled.cache_folder() is None

    @compiled.compiled
    def twice(x: float) -> float:
        return 2 * x

    assert twice(21.0) == 42.0


def test_a_folder_open_to_others_is_not_trusted(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    (tmp_path / "gearsim").mkdir()
    (tmp_path / "gearsim").chmod(0o777)
    folder = compiled.cache_folder()
    assert folder is None or tmp_path not in folder.parents


def test_compiled_code_is_found_again_by_another_process(tmp_path):
    """The second process loads what the first has compiled, and gets the same bits."""
    script = (
        "from gearsim_sim.integrate.decimate import decimate, padded_taps\n"
        "import numpy as np\n"
        "signal, out = np.arange(2 * 500.0).reshape(2, 500), np.zeros((2, 3))\n"
        "decimate(signal, 0, padded_taps(4), 4, out, 0, 3)\n"
        "print(sum(decimate.stats.cache_hits.values()), out.tobytes().hex())\n"
    )
    path = os.pathsep.join(dict.fromkeys(entry for entry in sys.path if entry))
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path), "PYTHONPATH": path}
    results = [
        subprocess.run(
            [sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=True
        ).stdout.split()
        for _ in range(2)
    ]
    assert [result[0] for result in results] == ["0", "1"]
    assert results[0][1] == results[1][1]
