"""Geometry of involute teeth: contact ratios, thicknesses, what can be assembled and what cannot."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gearsim_io.errors import InputError
from gearsim_sim.model.tooth.contact_ratio import contact_ratio_external, contact_ratio_internal
from gearsim_sim.model.tooth.gear import SpurGear
from gearsim_sim.model.tooth.outline import tooth_outline, tooth_root
from gearsim_sim.model.tooth.pair import GearPair

ALPHA = math.radians(20)
BASE_PITCH = math.pi * 2e-3 * math.cos(ALPHA)
PLANET = SpurGear(20, 2e-3, 0.02, 5e-3, fillet=0.3, name="planet")
SUN = SpurGear(40, 2e-3, 0.02, 10e-3, name="sun")
RING = SpurGear(80, 2e-3, 0.02, 95e-3, internal=True, fillet=0.3, name="ring")


def test_contact_ratios_of_the_thesis():
    """Table 7.5 gives the printed 1.64 and 1.89, here in full: half a unit of the last digit allowed."""
    base = [radius * math.cos(ALPHA) for radius in (40e-3, 20e-3, 80e-3)]
    sun = contact_ratio_external(42e-3, base[0], 22e-3, base[1], 60e-3, ALPHA, BASE_PITCH)
    ring = contact_ratio_internal(22e-3, base[1], 78e-3, base[2], 60e-3, ALPHA, BASE_PITCH)
    assert sun == pytest.approx(1.64, abs=0.005)
    assert ring == pytest.approx(1.89, abs=0.005)
    assert GearPair(PLANET, SUN).contact_ratio == pytest.approx(sun, rel=1e-12)
    assert GearPair(PLANET, RING).contact_ratio == pytest.approx(ring, rel=1e-12)


def test_data_of_table_7_5():
    assert np.array([SUN.base_radius_m, RING.base_radius_m, PLANET.base_radius_m]) == pytest.approx(
        [37.59e-3, 75.18e-3, 18.79e-3], abs=5e-6
    )
    assert PLANET.base_pitch_m == pytest.approx(5.9043e-3, abs=5e-8)
    assert [gear.tip_radius_m for gear in (SUN, RING, PLANET)] == pytest.approx([42e-3, 78e-3, 22e-3])


def test_a_ring_is_the_space_of_an_external_gear():
    """At every radius a tooth of one and a tooth of the other fill a pitch; with the same shift too."""
    for shift in (0.0, 0.3, -0.2):
        outer = SpurGear(60, 3e-3, 0.02, 20e-3, profile_shift=shift)
        ring = SpurGear(60, 3e-3, 0.02, 120e-3, internal=True, profile_shift=shift)
        for radius in (87e-3, 90e-3, 93e-3):
            filled = outer.half_angle_rad(radius) + ring.half_angle_rad(radius)
            assert filled == pytest.approx(math.pi / 60, rel=1e-12)
    assert SUN.half_angle_rad(SUN.pitch_radius_m) == pytest.approx(math.pi / 80, rel=1e-12)


@pytest.mark.parametrize("gear", [PLANET, SUN, RING])
def test_normals_of_the_flank_touch_the_base_circle(gear):
    roll = np.linspace(0.2, 0.5, 7)
    x, half = gear.flank(roll)
    angle = gear.force_angle_rad(roll)
    step = 1e-6
    x1, half1 = gear.flank(roll + step)
    along = (x1 - x) * gear.side * np.sin(angle) + (half1 - half) * np.cos(angle)
    assert along == pytest.approx(0, abs=1e-6 * step)  # normal: the flank does not move along it
    distance = x * np.cos(angle) - half * gear.side * np.sin(angle)
    assert distance == pytest.approx(gear.base_radius_m, rel=1e-12)


@pytest.mark.parametrize("wheel", [SUN, RING])
def test_contact_begins_and_ends_at_the_tips(wheel):
    pair = GearPair(PLANET, wheel)
    begin, end = pair.path_m
    radii = [
        gear.base_radius_m * np.sqrt(1 + pair.roll_rad(at, of_wheel=gear is wheel) ** 2)
        for gear, at in ((wheel, begin), (PLANET, end))
    ]
    assert radii == pytest.approx([wheel.tip_radius_m, PLANET.tip_radius_m], rel=1e-12)
    pinion, other = pair.curvature_radii_m(pair.pitch_point_m)
    assert other / pinion == pytest.approx(wheel.teeth / 20)  # pure rolling: as the speeds, inverted


def test_profile_shifts_set_the_distance_of_the_axes():
    """KHK's worked example: 12/24 teeth, m 3, shifts 0.6 and 0.36 give 26.0886 deg and 56.4999 mm."""
    pair = GearPair(
        SpurGear(12, 3e-3, 0.02, 4e-3, profile_shift=0.6, dedendum=1.25, fillet=0.2),
        SpurGear(24, 3e-3, 0.02, 10e-3, profile_shift=0.36, dedendum=1.25, fillet=0.2),
    )
    assert math.degrees(pair.pressure_angle_rad) == pytest.approx(26.0886, abs=1e-4)
    assert pair.centre_distance_m == pytest.approx(56.4999e-3, abs=1e-7)


def test_equal_shifts_leave_a_ring_mesh_as_it_is():
    shifted = GearPair(replace(PLANET, profile_shift=0.3), replace(RING, profile_shift=0.3))
    assert shifted.centre_distance_m == pytest.approx(60e-3, rel=1e-12)


@pytest.mark.parametrize("gear", [PLANET, SUN, RING, SpurGear(62, 2e-3, 0.02, 20e-3)])
def test_outline_is_whole(gear):
    """The fillet touches the root circle and passes into the flank; the sections fill the whole height."""
    root = tooth_root(gear)
    assert math.hypot(root.foot_m, root.foot_half_m) == pytest.approx(gear.root_radius_m, rel=1e-12)
    touch = math.hypot(root.flank_m - root.centre_m, root.flank_half_m - root.centre_half_m)
    assert touch == pytest.approx(gear.fillet * gear.module_m, rel=1e-12)
    roll = np.array([gear.roll_rad(gear.tip_radius_m)])
    outline = tooth_outline(gear, root, roll)
    height = gear.side * (gear.flank(roll)[0] - root.foot_m)
    assert outline.weight_m.sum() == pytest.approx(height[0], rel=1e-9)
    # A ring's root circle dips by a hair beside the foot.
    assert np.all(np.diff(outline.height_m[0]) > -1e-3 * gear.module_m)
    assert outline.half_m[0].max() <= root.foot_half_m * (1 + 1e-9)
    area = 2 * np.sum(outline.weight_m * outline.half_m)
    assert area == pytest.approx(_polygon_area(gear, root), rel=2e-3)


def _polygon_area(gear, root):
    """The same tooth drawn as a polygon: fillet and flank point by point, chords at foot and tip."""
    tip = gear.roll_rad(gear.tip_radius_m)
    start = max(root.flank_roll_rad, 0.0)
    x, half = gear.flank(np.linspace(start, tip, 2000))
    a = math.atan2(root.foot_half_m - root.centre_half_m, root.foot_m - root.centre_m)
    b = math.atan2(root.flank_half_m - root.centre_half_m, root.flank_m - root.centre_m)
    b = a + (b - a + math.pi) % (2 * math.pi) - math.pi
    arc = np.linspace(a, b, 2000)
    x = np.concatenate([root.centre_m + root.fillet_m * np.cos(arc), x])
    half = np.concatenate([root.centre_half_m + root.fillet_m * np.sin(arc), half])
    return 2 * abs(np.sum((half[1:] + half[:-1]) / 2 * np.diff(x)))


def wrong(call, *words):
    with pytest.raises(InputError) as caught:
        call()
    for word in words:
        assert word in str(caught.value)


def test_impossible_gears_are_refused():
    wrong(lambda: SpurGear(12, 2e-3, 0.02, 3e-3), "teeth", "18 or more", "0.298", "undercut")
    SpurGear(12, 2e-3, 0.02, 3e-3, profile_shift=0.3)
    wrong(lambda: SpurGear(20, 2e-3, 0.02, 30e-3), "hub_radius_m", "less than")
    wrong(lambda: replace(RING, hub_radius_m=70e-3), "hub_radius_m", "more than")
    wrong(lambda: SpurGear(20, 2e-3, 0.02, 5e-3, addendum=1.0, profile_shift=1.6), "pointed")
    wrong(lambda: SpurGear(20.5, 2e-3, 0.02, 5e-3), "whole number")
    wrong(lambda: tooth_root(SpurGear(20, 2e-3, 0.02, 5e-3, fillet=0.9)), "fillet")
    wrong(lambda: SpurGear(20, 2e-3, 0.02, 5e-3, pressure_angle_rad=math.radians(50)), "10 to 35 deg")


def test_impossible_pairs_are_refused():
    wrong(lambda: GearPair(PLANET, replace(SUN, module_m=3e-3, hub_radius_m=5e-3)), "module_m")
    wrong(lambda: GearPair(RING, PLANET), "pinion", "external")
    tall = SpurGear(90, 2e-3, 0.02, 30e-3, addendum=1.5)
    wrong(lambda: GearPair(SpurGear(18, 2e-3, 0.02, 4e-3, dedendum=1.8), tall), "interference")
    stub = SpurGear(40, 2e-3, 0.02, 10e-3, addendum=0.4)
    wrong(lambda: GearPair(stub, stub), "contact_ratio")
    wrong(lambda: GearPair(PLANET, replace(SUN, addendum=1.3)), "dedendum", "hit the roots")
    # A full-depth pinion needs some nine teeth less than its ring (Colbourne): 60 fouls in 66, not in 70.
    big = SpurGear(60, 2e-3, 0.02, 20e-3)
    wrong(lambda: GearPair(big, replace(RING, teeth=66)), "foul", "6 teeth")
    assert GearPair(big, replace(RING, teeth=70)).contact_ratio > 1
