"""Orders of gears and planets: against the thesis, counting by steps, and the simulator's geometry."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gearsim_dsp.gear_kinematics import gear_wheels, hunting_orders, wheel_families
from gearsim_dsp.planet_kinematics import (
    carrier_sidebands,
    hunting_turns,
    mesh_phases,
    planet_families,
    planetary_orders,
    ring_to_sun_turn,
)
from gearsim_io.errors import InputError
from gearsim_io.machines import load_machine
from gearsim_sim.model.planet_geometry import RING, SUN, make_geometry
from gearsim_sim.params import load_planetary_params

RIG = load_machine("unsw_planetary")
STAGE = RIG.planetary_stages[0]
HUNTING = load_machine("unsw_planetary_hunting").planetary_stages[0]


def test_frequencies_of_table_7_4():
    """At 6 Hz of the input shaft; printed with 2.13 Hz of the carrier, rounded."""
    orders = planetary_orders(RIG, STAGE)
    hz = 6.0 / RIG.shaft("input").ratio
    spur = next(w for w in gear_wheels(RIG) if w.component == "first_stage.pinion")
    assert hz * spur.mesh_order == pytest.approx(192)
    assert hz * orders.carrier == pytest.approx(2.13, abs=0.005)
    # 2.13 Hz is rounded by up to 0.005 Hz, which the teeth multiply.
    assert hz * orders.mesh == pytest.approx(170.4, abs=0.4)
    assert hz * orders.sun == pytest.approx(6.39, abs=0.015)
    assert hz * orders.planet_pass == pytest.approx(6.39, abs=0.015)
    assert hz * orders.planet == pytest.approx(6.39, abs=0.015)  # (7.3)
    assert hz * orders.planet_spin == pytest.approx(8.52, abs=0.02)  # (7.5)


def test_impulses_per_carrier_turn_of_the_thesis():
    """Section 7.9: eight for a cracked planet tooth, four for a spall; sun and ring meet three planets."""
    turns = {(f.component, f.fault): f.per_carrier_turn for f in planet_families(RIG)}
    assert turns["planet_2", "planet_tooth_crack"] == pytest.approx(8)
    assert turns["planet_2", "planet_tooth_spall"] == pytest.approx(4)
    assert turns["sun", "gear_tooth_crack"] == pytest.approx(6)
    assert turns["ring", "gear_tooth_spall"] == pytest.approx(3)
    assert turns["sun", "gear_wear"] == 0
    families = {(f.component, f.fault): f for f in planet_families(RIG)}
    assert families["planet_1", "planet_tooth_crack"].wander_order == pytest.approx(1)
    assert families["sun", "gear_tooth_crack"].wander_order == pytest.approx(3)
    assert families["ring", "gear_tooth_crack"].wander_order == 0


MEMBERS = ("carrier", "sun", "ring")


def stage_with(fixed, driver):
    shafts = {f"{m}_shaft": "" if m == fixed else m for m in MEMBERS}
    return replace(HUNTING, input_member=driver, **shafts)


@pytest.mark.parametrize(("fixed", "driver"), [(f, d) for f in MEMBERS for d in MEMBERS if f != d])
def test_orders_by_counting_while_the_stage_is_turned(fixed, driver):
    """Members are rolled on each other in steps; passings of teeth and planets are counted."""
    stage = stage_with(fixed, driver)
    shaft = replace(RIG.shafts[0], name=driver, ratio=1.0)
    orders = planetary_orders(replace(RIG, shafts=(shaft,), planetary_stages=(stage,)), stage)
    turns, steps = 23 * 37, 400_000
    # Rolling without slip, by pitch radii in teeth: the planet's rim moves as sun's and ring's teeth do.
    ws, wr, wc, wp = (0.0 for _ in range(4))
    s, r, p = stage.sun_teeth, stage.ring_teeth, stage.planet_teeth
    if fixed == "carrier":
        ws, wr = (1.0, -s / r) if driver == "sun" else (-r / s, 1.0)
    elif fixed == "sun":
        wr, wc = (1.0, r / (s + r)) if driver == "ring" else ((s + r) / r, 1.0)
    else:
        ws, wc = (1.0, s / (s + r)) if driver == "sun" else ((s + r) / s, 1.0)
    wp = wc + (wr - wc) * r / p
    assert wp == pytest.approx(wc - (ws - wc) * s / p)
    place = np.linspace(0.0, turns, steps)

    def passings(per_turn, relative):
        return np.count_nonzero(np.diff(np.floor(per_turn * relative * place + 0.3))) / turns

    for found, expected in (
        (orders.planet_pass, passings(3, wc - wr)),
        (orders.planet_spin, passings(1, wp - wc)),
        (orders.planet, passings(1, wp)),
        (orders.sun_on_carrier, passings(1, ws - wc)),
        (orders.mesh, passings(r, wr - wc)),
        (orders.sun, passings(1, ws)),
        (orders.ring, passings(1, wr)),
        (orders.carrier, passings(1, wc)),
    ):
        assert found == pytest.approx(expected, abs=1.5 / turns)


def test_the_way_from_ring_to_sun_is_the_simulators():
    for name in ("unsw_planetary", "unsw_planetary_hunting"):
        params = load_planetary_params(name)
        geometry = make_geometry(params)
        ring, sun = (geometry.planet_offset_turns(side, 0) for side in (RING, SUN))
        # Offsets are turns past the pitch point: what lacks to a whole turn is still to go.
        assert ring_to_sun_turn(params.stage) == pytest.approx((ring - sun) % 1.0)
    assert ring_to_sun_turn(STAGE) == pytest.approx(0.475)


@pytest.mark.parametrize(
    ("fixed", "driver", "sign"),
    [
        ("ring", "carrier", -1),
        ("ring", "sun", 1),
        ("carrier", "sun", 1),
        ("carrier", "ring", -1),
        ("sun", "carrier", 1),
        ("sun", "ring", -1),
    ],
)
def test_the_flank_that_drives_decides_which_way_is_longer(fixed, driver, sign):
    assert ring_to_sun_turn(stage_with(fixed, driver)) == pytest.approx(0.5 + sign * 0.5 / 23)


def test_mesh_phases_and_what_a_sensor_on_the_ring_hears():
    """Sequential phasing: 80/3 leaves two thirds; so the ring hears 81, the multiple of three, and not 80."""
    assert mesh_phases(STAGE) == pytest.approx([0, 2 / 3, 1 / 3])
    lines = {line.order: line.weight for line in carrier_sidebands(RIG, STAGE, 1, 3)}
    assert [round(order) for order in lines] == list(range(77, 84))
    assert list(lines.values()) == pytest.approx([0, 1, 0, 0, 1, 0, 0], abs=1e-9)
    third = {line.offset: line.weight for line in carrier_sidebands(RIG, STAGE, 3, 2)}
    assert third[0] == pytest.approx(1)
    uneven = replace(STAGE, planet_angles_rad=(0.0, math.radians(123.0), math.radians(240.0)))
    weights = [line.weight for line in carrier_sidebands(RIG, uneven, 1, 1)]
    expected = abs(sum(np.exp(1j * 80 * a) for a in uneven.planet_angles_rad)) / 3
    assert weights[1] == pytest.approx(expected, abs=1e-9)
    with pytest.raises(InputError, match="harmonic"):
        carrier_sidebands(RIG, STAGE, 0)


def test_hunting_and_not_hunting():
    assert hunting_turns(STAGE) == {"planet_ring": 1, "sun_ring": 1, "all": 1}
    assert hunting_turns(HUNTING) == {"planet_ring": 23, "sun_ring": 37, "all": 851}
    # The same teeth, stepped turn by turn: which planet tooth is at the sensor.
    seen = [(turn * HUNTING.ring_teeth) % HUNTING.planet_teeth for turn in range(24)]
    assert seen[23] == seen[0]
    assert len(set(seen)) == 23


def test_wheels_of_trains():
    plate = load_machine("sq_gearbox")
    wheels = {w.component: w for w in gear_wheels(plate)}
    assert set(wheels) == {"stage_1.pinion", "stage_1.gear", "stage_2.pinion", "stage_2.gear"}
    assert wheels["stage_2.gear"].turn_order == pytest.approx(0.3)
    assert wheels["stage_2.pinion"].mesh_order == pytest.approx(19.2)
    assert wheels["stage_1.gear"].mate == "stage_1.pinion"
    assert hunting_orders(plate) == pytest.approx({"stage_1": 0.2, "stage_2": 0.1})
    # A speed-increasing stage: the pinion is the small wheel, though it is driven.
    fast = {w.component: w for w in gear_wheels(load_machine("wt_hss"))}
    assert fast["high_speed_stage.pinion"].teeth == 22
    wheel = fast["high_speed_stage.gear"]
    assert wheel.turn_order == pytest.approx(22 / wheel.teeth)
    alike = gear_wheels(load_machine("unsw_parallel"))
    assert [w.component for w in alike] == ["gears.pinion", "gears.gear"]
    assert alike[0].shaft == load_machine("unsw_parallel").gear_meshes[0].driving_shaft


def test_families_of_wheels():
    families = {(f.component, f.fault): f for f in wheel_families(load_machine("sq_gearbox"))}
    assert len(families) == 16
    crack = families["stage_1.gear", "gear_tooth_crack"]
    assert crack.impulse_order == pytest.approx(0.4)
    assert crack.sidebands(2, 2) == pytest.approx([63.2, 63.6, 64.4, 64.8])
    assert families["stage_1.gear", "gear_wear"].impulse_order == 0
