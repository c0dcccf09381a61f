import math
from dataclasses import replace

import numpy as np
import pytest
from bearing_signals import machine

from gearsim_dsp.kinematics import bearing_orders, fault_families, mesh_orders
from gearsim_io.errors import InputError
from gearsim_io.machines import load_machine
from gearsim_io.nameplate import Bearing, GearMesh, Shaft

KOYO = Bearing("koyo", "input", 12, 7.12e-3, 38.5e-3)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        # Orders printed with the data sets (MFPT description; CWRU bearing data center's table for the 6205).
        ("mfpt", (3.245, 4.755, 2.5546, 0.4056)),
        ("cwru_drive_end", (3.5848, 5.4152, 4.7135 / 2, 0.39828)),
        ("hit_sq", (3.5848, 5.4152, 2.3567, 0.3983)),
    ],
)
def test_orders_are_those_printed_with_the_data_sets(name, expected):
    plate = load_machine(name)
    orders = bearing_orders(plate.bearings[0])
    assert (orders.bpfo, orders.bpfi, orders.bsf, orders.ftf) == pytest.approx(expected, abs=1.1e-4)


def test_koyo_1205_at_10_hz_has_the_thesis_frequencies():
    orders = bearing_orders(KOYO)
    # The thesis prints 48.8, 71.1 and 4.1 Hz; 26.1 Hz is the ball spin from the same geometry.
    assert 10 * orders.bpfo == pytest.approx(48.9, abs=0.15)
    assert 10 * orders.bpfi == pytest.approx(71.1, abs=0.1)
    assert 10 * orders.ftf == pytest.approx(4.1, abs=0.05)
    assert 10 * orders.bsf == pytest.approx(26.1, abs=0.05)


@pytest.mark.parametrize("angle_deg", [0.0, 15.0, 40.0])
@pytest.mark.parametrize("outer", [False, True])
def test_orders_follow_from_rolling_without_slip(angle_deg, outer):
    """Against velocities at the contact points, written out for both rings."""
    bearing = replace(KOYO, contact_angle_rad=math.radians(angle_deg), outer_ring_rotates=outer)
    inner_turn, outer_turn = (0.0, 1.0) if outer else (1.0, 0.0)
    d, big = bearing.element_diameter_m, bearing.pitch_diameter_m
    cos = math.cos(bearing.contact_angle_rad)
    inner_speed = inner_turn * (big - d * cos) / 2
    outer_speed = outer_turn * (big + d * cos) / 2
    cage = 0.5 * (inner_speed + outer_speed) / (big / 2)
    spin = abs(inner_speed - outer_speed - cage * ((big - d * cos) - (big + d * cos)) / 2) / d
    orders = bearing_orders(bearing)
    assert orders.ftf == pytest.approx(cage)
    assert orders.bpfo == pytest.approx(12 * abs(cage - outer_turn))
    assert orders.bpfi == pytest.approx(12 * abs(inner_turn - cage))
    assert orders.bsf == pytest.approx(spin)


def test_ball_passes_of_both_races_add_up_to_the_number_of_elements():
    orders = bearing_orders(KOYO, shaft_ratio=2.5)
    assert orders.bpfo + orders.bpfi == pytest.approx(12 * 2.5)


def test_families_carry_the_modulation_of_what_bears_the_defect():
    families = {f.fault: f for f in fault_families(machine())}
    assert families["outer_race"].sideband_order == 0.0
    assert families["inner_race"].sideband_order == 1.0
    assert families["rolling_element"].order == pytest.approx(2 * 2.5546, abs=1e-3)
    assert families["rolling_element"].sideband_order == pytest.approx(families["cage"].order)


def test_orders_of_a_slow_shaft_count_turns_of_the_reference_shaft():
    plate = machine()
    slow = replace(
        plate,
        shafts=(*plate.shafts, Shaft("slow", 0.4, 10.0)),
        bearings=(replace(plate.bearings[0], shaft="slow"),),
    )
    fast = {f.fault: f.order for f in fault_families(plate)}
    for family in fault_families(slow):
        assert family.order == pytest.approx(0.4 * fast[family.fault])


def test_mesh_orders_and_contradicting_teeth():
    plate = load_machine("sq_gearbox")
    assert mesh_orders(plate) == pytest.approx({"stage_1": 32.0, "stage_2": 19.2})
    wrong = replace(plate, gear_meshes=(GearMesh("m", "input", "intermediate", 32, 81),))
    with pytest.raises(InputError, match="teeth"):
        mesh_orders(wrong)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"rolling_elements": 2}, "rolling_elements"),
        ({"element_diameter_m": 0.0}, "element_diameter"),
        ({"element_diameter_m": 0.05}, "element_diameter"),
        ({"contact_angle_rad": np.pi / 2}, "contact_angle"),
        ({"pitch_diameter_m": float("nan")}, "element_diameter"),
    ],
)
def test_impossible_geometry_is_refused(change, field):
    with pytest.raises(InputError, match=field):
        bearing_orders(replace(KOYO, **change))
