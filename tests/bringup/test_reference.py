"""The reference of parameters says what the program checks, and docs/parameters.md is that reference."""

from pathlib import Path
from typing import Annotated, Literal

import pytest

from gearsim_bringup.fault_places import scenarios_of
from gearsim_bringup.gallery.cases import faults_of
from gearsim_bringup.reference import Parameter, parameters, table
from gearsim_bringup.reference_page import markdown, sections
from gearsim_io.errors import InputError
from gearsim_io.quantities import Si, Strict, validate
from gearsim_sim.model.faults import REGISTRY
from gearsim_sim.scenario import load_scenario, scenario_names

PAGE = Path(__file__).parents[2] / "docs" / "parameters.md"


class Inner(Strict):
    mass: Annotated[float, Si("kg", gt=0, le=5)]
    """Of the small part,
    in kilograms."""


class Outer(Strict):
    kind: Literal["a", "b"] = "a"
    length: Annotated[float, Si("m", ge=0)] | None = None
    """How long."""
    parts: dict[str, Inner]
    rows: tuple[Inner, ...] = ()


def test_parameters_tell_unit_range_default_and_meaning():
    assert list(parameters(Outer)) == [
        Parameter("kind", "", "a, b", "a", ""),
        Parameter("length", "m", ">= 0", "none", "How long."),
        Parameter("parts.<name>.mass", "kg", "> 0 and <= 5", "required", "Of the small part, in kilograms."),
        Parameter("rows[].mass", "kg", "> 0 and <= 5", "required", "Of the small part, in kilograms."),
    ]


def test_the_range_is_what_validation_accepts():
    with pytest.raises(InputError, match="<= 5"):
        validate(Outer, {"parts": {"one": {"mass": "6 kg"}}}, "here")


def test_a_bar_in_a_text_does_not_break_the_table():
    row = table([Parameter("x", "", "", "", "this | that")]).splitlines()[-1]
    assert row.replace("\\|", "").count("|") == 6


def test_every_fault_and_kind_of_machine_is_there():
    names = {one.name for one in sections()}
    assert set(REGISTRY) | {"scenario", "parallel_shaft", "planetary", "bearing_rig"} == names


def test_every_parameter_has_a_meaning():
    silent = [f"{one.name}: {row.name}" for one in sections() for row in one.rows if not row.meaning]
    assert not silent


def test_numbers_of_shipped_machines_have_sources():
    for one in sections():
        for machine, name, value, source in one.values:
            assert value, (machine, name)
            assert source, (machine, name)


def test_a_kind_tells_where_it_can_be_how_great_and_what_shows_it():
    (section,) = sections("outer_race_spall")
    places = {place.machine: place for place in section.places}
    rig = places["unsw_parallel"]
    assert rig.models == ("lpm22", "lpm34", "cb146", "cb182")
    assert rig.components == ("bearing_1", "bearing_2", "bearing_3", "bearing_4")
    limits = dict(rig.limits)
    assert set(limits) == {"width_m", "depth_m", "row"}
    assert limits["width_m"].startswith("less than 7.12 mm")
    assert (limits["depth_m"], limits["row"]) == ("no upper limit", "1 to 2")
    # Planets have bearings only where a scenario says so.
    changed = places["unsw_planetary as in scenario planetary_bearing"]
    assert changed.components == ("planet_1_bearing", "planet_2_bearing", "planet_3_bearing")
    text = markdown([section], whole=False)
    assert (
        "| unsw_parallel | lpm22, lpm34, cb146, cb182 | bearing_1, bearing_2, bearing_3, bearing_4 "
        "| `width_m` less" in text
    )
    assert "Shown by: `cage_slip`, `casing_outer`, `demo`, " in text
    assert section.content()["places"][0]["limits"]["row"] == "1 to 1"


@pytest.mark.parametrize("kind", REGISTRY.values(), ids=REGISTRY)
def test_the_named_scenarios_have_the_fault(kind):
    names = scenarios_of(kind)
    assert names
    for name in names:
        assert kind.name in {fault.kind for fault in faults_of(load_scenario(name))}
    if kind.name in scenario_names():
        assert names[0] == kind.name


def test_unknown_sections_are_named():
    with pytest.raises(InputError, match="did you mean gear_wear"):
        sections("gear_waer")


def test_the_page_in_docs_is_up_to_date():
    assert PAGE.read_text(encoding="utf-8") == markdown(sections(), whole=True), (
        "./gearsim parameters --out docs/parameters.md"
    )
