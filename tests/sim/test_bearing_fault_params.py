"""What faults of bearings refuse, and what they work out from the machine."""

import pytest

from gearsim_io.errors import InputError
from gearsim_sim.events import FaultSpec
from gearsim_sim.model.bearing_loads import bearing_loads
from gearsim_sim.model.faults import REGISTRY
from gearsim_sim.model.oil_film import Film, film_rate
from gearsim_sim.model.plants import make_plant
from gearsim_sim.params import load_parallel_params

NAME = "bearing_3"


@pytest.fixture(scope="module")
def plant():
    return make_plant(load_parallel_params(), 1)


@pytest.mark.parametrize(
    ("kind", "given", "field"),
    [
        ("outer_race_spall", {"width_m": "12 mm"}, "width_m"),
        ("inner_race_spall", {"row": 3}, "row"),
        ("rolling_element_spall", {"width_m": "4 mm"}, "width_m"),
        ("rolling_element_spall", {"ball": 13}, "ball"),
        ("wide_spall", {"length_m": "150 mm"}, "length_m"),
        ("wide_spall", {"length_m": "0.5 mm", "depth_m": "50 um"}, "depth_m"),
        ("extended_roughness", {"length_m": "150 mm"}, "length_m"),
        ("extended_roughness", {"length_m": "3 mm", "wall_m": "2 mm"}, "wall_m"),
        ("extended_roughness", {"cutoff_m": "1 m"}, "cutoff_m"),
        ("extended_roughness", {"roughness_m": "1 m"}, "roughness_m"),
        ("ball_waviness", {"row": 7}, "row"),
        ("race_waviness", {"orders": [3, 4], "amplitudes_m": [1e-6]}, "amplitudes_m"),
        ("race_waviness", {"orders": [3000], "amplitudes_m": [1e-6]}, "orders"),
        ("ball_waviness", {"orders": [], "amplitudes_m": []}, "amplitudes_m"),
        ("off_size_ball", {"difference_m": 0.0}, "difference_m"),
        ("bearing_clearance", {"growth_m": "5 mm"}, "growth_m"),
        ("bearing_preload", {"axial_n": "100 N"}, "axial_n"),
        ("bearing_preload", {"tightening_m": 0.0}, "tightening_m"),
        ("cage_slip", {"slip": 0.6}, "slip"),
        ("cage_slip", {"pocket_play_rad": 0.5}, "pocket_play_rad"),
        ("cage_slip", {"slip": 0.0, "jitter_rad": 0.0, "pocket_play_rad": 0.0}, "slip"),
        ("oil_film", {"viscosity_pa_s": 0.0}, "viscosity_pa_s"),
    ],
)
def test_what_cannot_be_is_refused(plant, kind, given, field):
    with pytest.raises(InputError) as error:
        REGISTRY[kind].build(FaultSpec(kind, NAME, given), plant)
    assert error.value.field == field


def test_bearings_share_the_tooth_force_and_the_weight(plant):
    loads = bearing_loads(plant)
    assert loads[:2].sum() + loads[2:].sum() == pytest.approx(2 * 50 / 0.0463, rel=0.05)


def test_film_rate_is_zero_in_the_steady_film():
    """The sign of the loop's film: thick films close under load."""
    film = Film(1e-6, 0.67, 15, 1e-5, 0.0)
    assert film_rate(film, 1e-6, 1e-6, 1.0) == pytest.approx(0.0, abs=1e-9)
    assert film_rate(film, 2e-6, 1e-6, 1.0) < 0
