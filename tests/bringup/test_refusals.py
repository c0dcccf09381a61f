"""What is wrong with the input is said at once: before anything is imported that takes seconds to load."""

import json
import subprocess
import sys

import pytest

_SLOW = ("numba", "scipy.signal", "scipy.optimize", "matplotlib", "rclpy")
_PROGRAM = f"""
import json, sys
from gearsim_bringup.cli import main
code = main(sys.argv[1:])
print(json.dumps([code, [name for name in {_SLOW} if name in sys.modules]]))
"""


def _refused(*arguments):
    """Exit code, slow modules that were imported, and the words, of a run in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-c", _PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=60
    )
    code, slow = json.loads(done.stdout)
    return code, slow, done.stderr


@pytest.fixture
def files(tmp_path):
    (tmp_path / "syntax.yaml").write_text("model: [lpm34\n")
    (tmp_path / "key.yaml").write_text("operating_point: {speed: 10 Hz, laod: 5 N*m}\n")
    (tmp_path / "model.yaml").write_text("model: lpm43\noperating_point: {speed: 10 Hz, load: 5 N*m}\n")
    plate = "name: plate\nnameplate: {reference_shaft: shaft, shafts: {shaft: {}}}\n"
    (tmp_path / "plate.yaml").write_text(plate)
    (tmp_path / "taken").mkdir()
    (tmp_path / "a.csv").write_text("a\n" + "1\n2\n3\n" * 50)
    return tmp_path


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("simulate heathy --seconds 1 --out {0}/new", "did you mean healthy?"),
        ("simulate {0}/none.yaml --seconds 1 --out {0}/new", "none.yaml, expected a file that exists"),
        (
            "simulate {0}/syntax.yaml --seconds 1 --out {0}/new",
            "syntax.yaml: line 2, column 1: got the end of",
        ),
        ("simulate {0}/key.yaml --seconds 1 --out {0}/new", "did you mean load?"),
        ("simulate {0}/model.yaml --seconds 1 --out {0}/new", "did you mean lpm34?"),
        (
            "simulate quick --seconds 1 --out {0}/taken",
            "taken: got a folder that exists already, expected the",
        ),
        (
            "simulate quick --seconds 1 --out {0}/a.csv/x",
            "/a.csv is a file, expected the name of a new folder",
        ),
        ("run quick --record {0}/a.csv/x", "/a.csv is a file, expected the name of a new bag"),
        ("view {0}/taken --out {0}/a.csv/x.rrd", "/a.csv is a file, expected the name of a new file"),
        ("import {0}/a.csv --machine mfpt --out {0}/a.csv/x", "/a.csv is a file, expected the name of a new"),
        ("monitoring --out {0}/a.csv/x", "/a.csv is a file, expected the name of a folder"),
        ("run heathy", "did you mean healthy?"),
        (
            "run quick --record {0}/taken",
            "taken: got a folder that exists already, expected the name of a new",
        ),
        (
            "ensemble {0}/syntax.yaml --seconds 1 --out {0}/new",
            "syntax.yaml: line 2, column 1: got the end of",
        ),
        ("ensemble {0}/key.yaml --seconds 1 --out {0}/taken", "taken: got a folder that exists already"),
        ("diagnose {0}/nothing", "got nothing there"),
        (
            "diagnose {0}/nothing --speed 30furlong",
            "got 30furlong, expected a speed above 0 in Hz, or with",
        ),
        (
            "diagnose {0}/a.csv --machine mfpt --rate 1000 --unit g --column a --speed 1500",
            "--speed: got 1500 Hz, expected 2.5 to 250 Hz, about the nameplate's 25 Hz; 1500 rpm are 25 Hz",
        ),
        ("twin {0}/nothing --machine mfpt --model bearing5", "got nothing there"),
        ("twin {0}/taken --machine mfpt --model bearin5", "did you mean bearing5?"),
        ("twin {0}/taken --machine {0}/plate.yaml --model lpm34", "nothing can be simulated (docs/rigs.md"),
        (
            "twin {0}/taken --machine mfpt --model bearing5 --holdout {0}/taken",
            "of MEASURED once more, expected a recording that nothing is fitted to",
        ),
    ],
)
def test_bad_input_is_refused_before_the_slow_imports(files, command, words):
    code, slow, told = _refused(*command.format(files).split())
    assert code == 2
    assert words in told
    assert slow == []
