"""Model parameters that a scenario replaces."""

import pytest

from gearsim_io.errors import InputError
from gearsim_sim.params import load_parallel_params
from gearsim_sim.params.overrides import override


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
