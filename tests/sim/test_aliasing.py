"""What folds back into the band, against the same machine at 256 steps per sample; and the example of it.

The levels are of the power of the difference over the whole power in the band, the worst site counts.
"""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

from gearsim_sim.aliasing import TRUTH_OVERSAMPLING, accelerations, alias_level_db
from gearsim_sim.events import FaultSpec
from gearsim_sim.params import load_parallel_params

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "aliasing.py"
ROUNDED = FaultSpec("inner_race_spall", "bearing_3", {"width_m": "0.8 mm"})
RECTANGULAR = FaultSpec(
    "outer_race_spall", "bearing_3", {"width_m": "0.8 mm", "depth_m": "10 um", "geometry": "rectangular"}
)


def test_the_level_is_that_of_what_was_added():
    """A line of a thousandth of the amplitude is at -60 dB; one above the band does not count."""
    t = np.arange(4096) / 4096
    truth = np.sin(2 * np.pi * 400 * t)
    inside, outside = 1e-3 * np.sin(2 * np.pi * 901 * t), np.sin(2 * np.pi * 1990 * t)
    assert alias_level_db(truth + inside, truth) == pytest.approx(-60, abs=0.01)
    assert alias_level_db(truth + outside, truth) < -100
    both = alias_level_db(np.array([truth + inside, truth * 1.1]), np.array([truth, truth]))
    assert both == pytest.approx([-60, -20], abs=0.01)


@pytest.mark.parametrize(
    ("faults", "at_4", "at_8"),
    [((), -70, -80), ((ROUNDED,), -70, -80), ((RECTANGULAR,), -50, -50)],
    ids=["healthy", "rounded", "rectangular"],
)
def test_little_folds_back(faults, at_4, at_8):
    params = load_parallel_params()
    truth = accelerations(params, TRUTH_OVERSAMPLING, faults=faults)
    levels = [alias_level_db(accelerations(params, steps, faults=faults), truth).max() for steps in (4, 8)]
    assert levels[0] < at_4, levels
    assert levels[1] < at_8, levels


@pytest.fixture(scope="module")
def example():
    spec = importlib.util.spec_from_file_location("example_aliasing", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # where its dataclasses look for their module
    spec.loader.exec_module(module)
    return module


def test_example_shows_the_three_causes(example, tmp_path):
    unfiltered = example.unfiltered(0.1)
    exact, usual = unfiltered.levels_db().values()
    assert usual < -90
    assert exact > usual + 20  # exact, and yet worse by far
    (blind,) = example.blind_solver(0.02).levels_db().values()
    assert blind > -30
    tables = example.coarse_tables(0.02)
    nearest, linear = tables.levels_db().values()
    assert nearest > -45
    assert -60 < linear < nearest
    example.draw([unfiltered, tables], tmp_path / "aliasing.png")
    assert (tmp_path / "aliasing.png").stat().st_size > 20_000
