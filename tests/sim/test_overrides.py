"""Model parameters that a scenario replaces."""

import math

import pytest

from gearsim_io.errors import InputError
from gearsim_sim.model.plants import make_plant
from gearsim_sim.models import parameters
from gearsim_sim.params import load_parallel_params
from gearsim_sim.params.overrides import override
from gearsim_sim.scenario import load_scenario


def test_numbers_of_the_model_are_replaced_and_nothing_else():
    plain = load_parallel_params("unsw_parallel")
    changed = load_parallel_params(
        "unsw_parallel",
        {
            "pedestal.mass": "10000 g",
            "seats.bearing_2.damping": {"value": 900, "unit": "N*s/m"},
            "mesh.harmonics": 5,
        },
        "my.yaml",
    )
    assert changed.model.pedestal.mass_kg == pytest.approx(10.0)
    assert changed.model.seats["bearing_2"].damping_ns_per_m == 900
    assert changed.model.mesh.harmonics == 5
    assert changed.model.pedestal.stiffness_n_per_m == plain.model.pedestal.stiffness_n_per_m
    assert changed.model.seats["bearing_1"] == plain.model.seats["bearing_1"]
    assert load_parallel_params("unsw_parallel").model == plain.model


def test_the_section_itself_stays_as_it_is():
    section = {"pedestal": {"mass": {"value": 1, "unit": "kg", "source": "x"}}}
    changed = override(section, {"pedestal.mass": "2 kg"}, "my.yaml")
    assert changed["pedestal"]["mass"]["value"] == "2"
    assert section["pedestal"]["mass"]["value"] == 1


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        (
            "pedestal.mas",
            "10 kg",
            "my.yaml: parameters.pedestal.mas: got mas, expected one of damping, mass, ",
        ),
        ("pedestal", "10 kg", "my.yaml: parameters.pedestal: got 10 kg, expected one of damping, "),
        ("pedestal.mass.value", 1, "expected no further name, as this is a number already"),
        ("pedestal.mass", "10 m", "pedestal.mass: "),
        ("pedestal.mass", "-1 kg", "expected a number in kg, > 0"),
        ("pedestal.mass", 10, "(the unit is missing)"),
        ("kind", "x", "my.yaml: parameters.kind: got x, expected the name of a number"),
    ],
)
def test_bad_overrides(name, value, message):
    with pytest.raises(InputError) as caught:
        load_parallel_params("unsw_parallel", {name: value}, "my.yaml")
    assert message in str(caught.value)
    assert str(caught.value).startswith("my.yaml")


def test_a_bearing_is_built_otherwise_than_the_nameplate_says():
    name = "nameplate.bearings.bearing_3"
    changes = {
        f"{name}.element_diameter": "7.5 mm",
        f"{name}.contact_angle": {"value": 10, "unit": "deg"},
        "nameplate.bearings.bearing_1.rolling_elements": 11,
        "pedestal.mass": "10 kg",
    }
    built = load_parallel_params("unsw_parallel", changes, "my.yaml")
    third, first = built.bearings[2], built.bearings[0]
    assert third.element_diameter_m == pytest.approx(7.5e-3)
    assert third.contact_angle_rad == pytest.approx(math.radians(10))
    assert third.pitch_diameter_m == pytest.approx(38.5e-3)
    assert first.rolling_elements == 11
    assert built.model.pedestal.mass_kg == 10
    assert built.bearings[1] == load_parallel_params("unsw_parallel").bearings[1]


def test_the_cage_turns_as_the_bearing_is_built_and_the_nameplate_stays():
    changes = {"nameplate.bearings.test_bearing.element_diameter": "7 mm"}
    scenario = load_scenario("mfpt_outer", {"parameters": changes})
    (seat,) = make_plant(parameters(scenario), 1).bearings
    plate = scenario.machine.bearing("test_bearing")
    assert seat.law.cage_rate(1.0) == pytest.approx(0.5 * (1 - 7e-3 / plate.pitch_diameter_m))
    assert plate.element_diameter_m == pytest.approx(0.235 * 25.4e-3)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("nameplate.bearings.bearing_3.element_diameter", "-1 mm", "expected a number in m, > 0"),
        ("nameplate.bearings.bearing_3.element_diameter", 3, "(the unit is missing)"),
        ("nameplate.bearings.bearing_3.bore", "1 mm", "got bore, expected one of the keys contact_angle, "),
        (
            "nameplate.bearings.bearing_9.element_diameter",
            "7 mm",
            "got bearing_9, expected one of ",
        ),
        ("nameplate.bearings.bearing_3.rolling_elements", 11.5, "expected a whole number"),
        ("nameplate.bearings.bearing_3.rolling_elements", 40, "expected at most "),
        ("nameplate.shafts.input", "1 Hz", "expected nameplate.bearings.<bearing>."),
    ],
)
def test_bearings_that_cannot_be_built(name, value, message):
    with pytest.raises(InputError) as caught:
        make_plant(load_parallel_params("unsw_parallel", {name: value}, "my.yaml"), 1)
    assert message in str(caught.value)
