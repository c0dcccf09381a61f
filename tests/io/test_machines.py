"""Machine descriptions: what is shipped is right, what is wrong is told with file, key, value."""

from __future__ import annotations

import math
from copy import deepcopy

import pytest
from ruamel.yaml import YAML

from gearsim_io.errors import InputError
from gearsim_io.machines import load_machine, machine_file, machine_names
from gearsim_io.nameplate import PlanetaryStage
from gearsim_io.planetary import check_assembly

NAMES = (
    "cwru_drive_end",
    "gear0",
    "hit_sq",
    "mfpt",
    "sq_gearbox",
    "unsw_parallel",
    "unsw_planetary",
    "unsw_planetary_hunting",
    "wt_hss",
)


def orders(bearing):
    """BPFO, BPFI, BSF, FTF of a bearing, by the textbook."""
    slope = bearing.element_diameter_m / bearing.pitch_diameter_m * math.cos(bearing.contact_angle_rad)
    n = bearing.rolling_elements
    spin = (1 - slope**2) / slope * math.cos(bearing.contact_angle_rad) / 2
    return n / 2 * (1 - slope), n / 2 * (1 + slope), spin, (1 - slope) / 2


def test_all_names_are_shipped_and_load():
    assert set(NAMES) <= set(machine_names())
    for name in machine_names():
        machine = load_machine(name)
        assert machine.name == name
        assert machine.description
        assert machine.sources, "every number has a source"
        assert all(text.strip() for text in machine.sources.values())


@pytest.mark.parametrize(
    ("name", "bearing", "published"),
    [
        # Orders that the publishers of the data state for their bearings.
        ("mfpt", "test_bearing", (3.245, 4.755, 2.5564, 0.4056)),
        ("cwru_drive_end", "drive_end", (3.5848, 5.4152, 2.3567, 0.39828)),
        ("hit_sq", "test_bearing", (3.5848, 5.4152, 2.3567, 0.39828)),
        ("unsw_parallel", "bearing_3", (4.8904, 7.1096, 2.6112, 0.40753)),
    ],
)
def test_bearings_have_the_published_orders(name, bearing, published):
    assert orders(load_machine(name).bearing(bearing)) == pytest.approx(published, rel=8e-4)


def test_unsw_rig_as_in_the_thesis():
    machine = load_machine("unsw_parallel")
    assert [b.shaft for b in machine.bearings] == ["input", "input", "output", "output"]
    assert machine.shaft("output").ratio == 1.0
    assert machine.nominal_speed_hz == 10.0
    assert {c.name for c in machine.channels} == {f"b{n}_{axis}" for n in range(1, 5) for axis in "xy"}
    # Thesis 5.5: BPFO 48.8 Hz and BPFI 71.1 Hz at 10 Hz.
    bpfo, bpfi, *_ = orders(machine.bearing("bearing_3"))
    assert 10 * bpfo == pytest.approx(48.8, abs=0.15)
    assert 10 * bpfi == pytest.approx(71.1, abs=0.05)


def test_ratios_follow_from_the_teeth():
    machine = load_machine("sq_gearbox")
    assert machine.shaft("intermediate").ratio == pytest.approx(32 / 80)
    assert machine.shaft("output").ratio == pytest.approx(32 / 80 * 48 / 64)
    assert machine.shaft("output").nominal_speed_hz == pytest.approx(9.0)
    turbine = load_machine("wt_hss")
    assert turbine.shaft("intermediate").ratio == pytest.approx(22 / 112)
    assert math.isnan(turbine.nominal_speed_hz)


def number(value, unit="1"):
    return {"value": value, "unit": unit, "source": "test"}


GOOD = {
    "name": "toy",
    "description": "A toy",
    "nameplate": {
        "reference_shaft": "in",
        "shafts": {"in": {"nominal_speed": number(1500, "rpm")}, "out": {}},
        "gear_meshes": {
            "pair": {
                "driving_shaft": "in",
                "driven_shaft": "out",
                "driving_teeth": number(20),
                "driven_teeth": number(40),
            }
        },
        "bearings": {
            "b1": {
                "shaft": "in",
                "rolling_elements": number(9),
                "element_diameter": number(7.94, "mm"),
                "pitch_diameter": number(39.04, "mm"),
                "contact_angle": number(10, "deg"),
                "channels": ["a"],
            }
        },
        "channels": {"a": {}},
    },
}


def write(tmp_path, content, name="toy.yaml"):
    path = tmp_path / name
    with open(path, "w") as stream:
        YAML().dump(content, stream)
    return path


def changed(place, value):
    content = deepcopy(GOOD)
    *path, last = place.split("/")
    inner = content
    for key in path:
        inner = inner[key]
    if value is None:
        del inner[last]
    else:
        inner[last] = value
    return content


def test_units_become_si(tmp_path):
    machine = load_machine(write(tmp_path, GOOD))
    assert machine.nominal_speed_hz == pytest.approx(25.0)
    bearing = machine.bearing("b1")
    assert bearing.element_diameter_m == pytest.approx(7.94e-3)
    assert bearing.contact_angle_rad == pytest.approx(math.radians(10))
    assert machine.shaft("out").ratio == 0.5
    assert machine.sources["bearings.b1.pitch_diameter"] == "test"


@pytest.mark.parametrize(
    ("place", "value", "field", "words"),
    [
        ("name", None, "name", "this key"),
        ("color", "red", "color", "one of the keys"),
        ("nameplate/shafts", {}, "nameplate.shafts", "at least 1"),
        ("nameplate/reference_shaft", "motor", "nameplate.reference_shaft", "one of the shafts in, out"),
        ("nameplate/bearings/b1/shaft", "x", "nameplate.bearings.b1.shaft", "one of the shafts in, out"),
        (
            "nameplate/bearings/b1/channels",
            ["z"],
            "b1.channels (entry 1 of 1)",
            "channels a",
        ),
        ("nameplate/bearings/b1/rolling_elements", number(2), "rolling_elements", ">= 3"),
        ("nameplate/bearings/b1/rolling_elements", number(9.5), "rolling_elements", "a whole number"),
        ("nameplate/bearings/b1/rolling_elements", number(16), "rolling_elements", "fit on a pitch circle"),
        (
            "nameplate/bearings/b1/element_diameter",
            number(50, "mm"),
            "element_diameter",
            "less than the pitch",
        ),
        ("nameplate/bearings/b1/element_diameter", number(7.94, "kg"), "element_diameter", "not kg"),
        ("nameplate/bearings/b1/element_diameter", 0.00794, "element_diameter", "source"),
        ("nameplate/bearings/b1/pitch_diameter", {"value": 39, "unit": "mm"}, "pitch_diameter", "source"),
        ("nameplate/bearings/b1/pitch_diameter", number(-1, "mm"), "pitch_diameter", "> 0"),
        ("nameplate/bearings/b1/contact_angle", number(95, "deg"), "contact_angle", "< 1.57"),
        ("nameplate/gear_meshes/pair/driven_shaft", "in", "gear_meshes.pair.driven_shaft", "another shaft"),
        ("nameplate/gear_meshes/pair/driven_teeth", number(0), "driven_teeth", ">= 1"),
        (
            "nameplate/gear_meshes/pair/driven_shaft",
            "no",
            "gear_meshes.pair.driven_shaft",
            "one of the shafts",
        ),
        ("nameplate/shafts/out", {"ratio": number(0.4)}, "nameplate.shafts.out.ratio", "0.5, by the teeth"),
        ("nameplate/shafts/in", {"ratio": number(2)}, "nameplate.shafts.in.ratio", "the reference shaft"),
        ("nameplate/shafts/lost", {}, "nameplate.shafts.lost.ratio", "no gear mesh joins"),
        ("nameplate/shafts/in", {"nominal_speed": number(-5, "Hz")}, "nominal_speed", "> 0"),
        ("nameplate/tacho_shafts", ["x"], "nameplate.tacho_shafts (entry 1 of 1)", "one of the shafts"),
        ("nameplate/encoder_shafts", ["x"], "nameplate.encoder_shafts (entry 1 of 1)", "one of the shafts"),
        ("nameplate/speed_tolerance", number(1.5), "speed_tolerance", "< 1"),
    ],
)
def test_bad_descriptions_are_named(tmp_path, place, value, field, words):
    path = write(tmp_path, changed(place, value))
    with pytest.raises(InputError) as caught:
        load_machine(path)
    message = str(caught.value)
    assert str(path) in message
    assert field in message
    assert words in message
    assert "\n" not in message


def test_unreadable_files_are_named(tmp_path):
    broken = tmp_path / "broken.yaml"
    broken.write_text("name: [")
    with pytest.raises(InputError, match=r"broken.yaml: line 1, column 8: got the end of the file"):
        load_machine(broken)
    listed = tmp_path / "list.yaml"
    listed.write_text("- 1\n- 2\n")
    with pytest.raises(InputError, match="a mapping"):
        load_machine(listed)
    with pytest.raises(InputError, match="one of cwru_drive_end"):
        machine_file("no_such_machine")
    with pytest.raises(InputError, match=r"no_such\.yaml"):
        machine_file(tmp_path / "no_such.yaml")


PLANETARY = {
    "name": "toy",
    "nameplate": {
        "reference_shaft": "c",
        "shafts": {"c": {"nominal_speed": number(2, "Hz")}, "s": {}, "p": {}},
        "planetary_stages": {
            "stage": {
                "carrier_shaft": "c",
                "sun_shaft": "s",
                "planet_shaft": "p",
                "input_member": "carrier",
                "sun_teeth": number(40),
                "ring_teeth": number(80),
                "planet_teeth": number(20),
                "planets": number(3),
            }
        },
    },
}


def degrees(*angles):
    return [number(angle, "deg") for angle in angles]


def planetary(tmp_path, **changes):
    content = deepcopy(PLANETARY)
    content["nameplate"]["planetary_stages"]["stage"].update(changes)
    path = tmp_path / "toy.yaml"
    YAML().dump(content, path)
    return load_machine(path)


def test_planetary_speeds_as_in_thesis_table_7_3(tmp_path):
    """Carrier 1, sun 3, planet -3 in space, which is -4 against the carrier."""
    machine = planetary(tmp_path)
    speeds = machine.planetary_stages[0].member_ratios()
    assert speeds == {"carrier": 1.0, "ring": 0.0, "sun": 3.0, "planet": -4.0}
    assert speeds["planet"] + speeds["carrier"] == -3.0
    assert machine.shaft("s").ratio == 3.0
    assert machine.shaft("p").ratio == 4.0


@pytest.mark.parametrize(
    ("still", "source", "expected"),
    [
        ("sun", "ring", {"carrier": 80 / 120}),  # Z_r / (Z_s + Z_r)
        ("carrier", "sun", {"ring": -40 / 80}),  # a plain train, reversed
        ("ring", "sun", {"carrier": 40 / 120}),
    ],
)
def test_any_member_may_stand_still(tmp_path, still, source, expected):
    shafts = {"carrier_shaft": "c", "sun_shaft": "s", "ring_shaft": "s"}
    shafts[f"{still}_shaft"] = ""
    free = [key for key in shafts if shafts[key] and not key.startswith(source)]
    shafts[f"{source}_shaft"], shafts[free[0]] = "c", "s"
    machine = planetary(tmp_path, input_member=source, **shafts)
    speeds = machine.planetary_stages[0].member_ratios()
    for member, ratio in expected.items():
        assert speeds[member] == pytest.approx(ratio)
    for name in ("sun", "ring"):  # the meshes roll without slip on the carrier
        own = speeds[name] - speeds["carrier"]
        teeth = getattr(machine.planetary_stages[0], f"{name}_teeth")
        assert abs(own * teeth) == pytest.approx(abs(speeds["planet"]) * 20)


@pytest.mark.parametrize(
    ("changes", "field", "expected"),
    [
        ({"ring_teeth": number(82)}, "ring_teeth", "80, the sun's teeth"),
        ({"planets": number(7)}, "planet_angles", "multiples of 360/120"),
        ({"planets": number(10)}, "planets", "at most 8"),
        ({"planet_angles": degrees(0, 121, 240)}, "planet_angles", "120 or 123"),
        ({"planet_angles": degrees(0, 30, 240)}, "planets", "clear of each other"),
        ({"planet_angles": [number(0, "deg")]}, "planet_angles", "3 angles"),
        ({"ring_shaft": "p"}, "stage", "exactly one"),
        ({"input_member": "ring"}, "input_member", "has a shaft"),
        ({"sun_shaft": "x"}, "sun_shaft", "one of the shafts"),
    ],
)  # fmt: skip
def test_stages_that_cannot_be_put_together_are_refused(tmp_path, changes, field, expected):
    with pytest.raises(InputError) as error:
        planetary(tmp_path, **changes)
    assert field in error.value.field
    assert expected in error.value.expected


def test_uneven_positions_on_the_least_mesh_angle_are_accepted(tmp_path):
    stage = planetary(tmp_path, planet_angles=degrees(0, 117, 240)).planetary_stages[0]
    assert stage.planet_angles_rad == pytest.approx([0, math.radians(117), math.radians(240)])


def test_the_hunting_design_has_no_common_factors():
    (stage,) = load_machine("unsw_planetary_hunting").planetary_stages
    teeth = (stage.sun_teeth, stage.planet_teeth, stage.ring_teeth)
    assert [math.gcd(a, b) for a, b in zip(teeth, teeth[1:] + teeth[:1], strict=True)] == [1, 1, 1]
    usual = load_machine("unsw_planetary").planetary_stages[0]
    assert stage.sun_teeth + stage.planet_teeth == usual.sun_teeth + usual.planet_teeth


def test_hunting_planets_stand_where_their_teeth_fit():
    """41/20/81 cannot be spaced equally by three; 120 deg is refused with the place beside it that fits."""

    def check(sun, ring, angles):
        stage = PlanetaryStage(
            name="stage",
            carrier_shaft="carrier",
            sun_shaft="sun",
            ring_shaft="",
            planet_shaft="planet",
            input_member="carrier",
            sun_teeth=sun,
            ring_teeth=ring,
            planet_teeth=20,
            planet_angles_rad=tuple(angles),
        )
        check_assembly(stage, "machine", "stage")

    thirds = [2 * math.pi * k / 3 for k in range(3)]
    check(40, 80, thirds)
    with pytest.raises(InputError, match="81, the sun's teeth") as error:
        check(41, 80, thirds)
    assert error.value.field == "stage.ring_teeth"
    with pytest.raises(InputError, match=r"120\.984 deg for planet 2"):
        check(41, 81, thirds)
    check(41, 81, [0.0, 2 * math.pi * 41 / 122, 2 * math.pi * 81 / 122])
    with pytest.raises(InputError, match="clear of each other"):
        check(40, 80, [2 * math.pi * k / 10 for k in range(10)])
