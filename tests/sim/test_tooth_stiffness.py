"""Tooth and mesh stiffness: closed forms, independent integrals, standards, and the thesis's values."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from gearsim_io.errors import InputError
from gearsim_sim.model.tooth.compliance import (
    Point,
    beam_compliance,
    contact_point,
    foundation_compliance,
    hertz_compliance,
    root_of,
    tooth_compliance,
)
from gearsim_sim.model.tooth.gear import SpurGear
from gearsim_sim.model.tooth.outline import Outline, tooth_outline
from gearsim_sim.model.tooth.pair import GearPair
from gearsim_sim.model.tooth.stiffness import (
    mesh_stiffness,
    pair_compliance,
    pair_stiffness,
    smith_pair_stiffness,
    stepped_levels,
    stiffness_series,
)

MODULE = 2 * 0.0463 / 32 / math.cos(math.radians(20))  # base radius of thesis A.2


def gear(teeth, module=2e-3, **kwargs):
    pitch = teeth * module / 2
    return SpurGear(teeth, module, 0.02, kwargs.pop("hub_radius_m", pitch / 3), **kwargs)


def test_a_straight_cantilever():
    """Force at the tip of a bar: 4 F l^3 / (E L t^3), 1.2 F l / (G L t); along the bar: F l / (E L t)."""
    steel = gear(20)
    x, w = np.polynomial.legendre.leggauss(8)
    length, half = 5e-3, 1.5e-3
    outline = Outline((x[None] + 1) / 2 * length, np.full((1, 8), half), w[None] / 2 * length)
    modulus, width = steel.youngs_modulus_pa, steel.face_width_m
    shear_modulus = modulus / 2.6

    def at(angle, offset):
        return beam_compliance(outline, Point(*(np.array([v]) for v in (length, offset, angle))), steel)[:, 0]

    expected = [length**3 / (2 * modulus * width * half**3), 0.6 * length / (shear_modulus * width * half), 0]
    assert at(0.0, half) == pytest.approx(expected, rel=1e-12)
    pushed = [
        half**2 * length / (modulus * width * (2 * half) ** 3 / 12),
        0,
        length / (modulus * width * 2 * half),
    ]
    assert at(math.pi / 2, half) == pytest.approx(pushed, rel=1e-12, abs=1e-18)


def test_yang_and_lin():
    """A tooth that starts at its base circle without fillet, by the integrals over the angle of the flank."""
    tooth = replace(gear(45), dedendum=45 * (1 - math.cos(math.radians(20))) / 2, fillet=0.0)
    assert tooth.root_radius_m == pytest.approx(tooth.base_radius_m)
    a2 = tooth.base_half_angle_rad
    modulus, width, nu = tooth.youngs_modulus_pa, tooth.face_width_m, tooth.poisson_ratio
    for roll in (0.3, 0.4, 0.45):
        a1 = float(tooth.force_angle_rad(np.array(roll)))

        def across(a, a2=a2):
            return math.sin(a) + (a2 - a) * math.cos(a)

        def bending(a, a1=a1, a2=a2):
            moment = 1 + math.cos(a1) * ((a2 - a) * math.sin(a) - math.cos(a))
            return 3 * moment**2 * (a2 - a) * math.cos(a) / (2 * modulus * width * across(a) ** 3)

        def shear(a, a1=a1, a2=a2):
            top = 1.2 * (1 + nu) * (a2 - a) * math.cos(a) * math.cos(a1) ** 2
            return top / (modulus * width * across(a))

        def axial(a, a1=a1, a2=a2):
            return (a2 - a) * math.cos(a) * math.sin(a1) ** 2 / (2 * modulus * width * across(a))

        expected = [quad(part, -a1, a2)[0] for part in (bending, shear, axial)]
        root, at = root_of(tooth), np.array([roll])
        outline = tooth_outline(tooth, root, at)
        found = beam_compliance(outline, contact_point(tooth, root, at), tooth)[:, 0]
        assert found == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("internal", [False, True])
def test_energy_is_work(internal):
    """Half force times deflection equals the elastic energy of the sections, integrated point by point."""
    tooth = gear(80, internal=True, hub_radius_m=95e-3, fillet=0.3) if internal else gear(20)
    roll, force = np.array([0.4]), 1000.0
    root = root_of(tooth)
    start, end = max(root.flank_roll_rad, 0.0), float(roll[0])
    arc = _arc(root)
    x, half = tooth.flank(np.linspace(start, end, 40001))
    straight = np.linspace(root.flank_m, x[0], 40001)
    x = np.concatenate([arc[0], straight, x])
    half = np.concatenate([arc[1], np.full(40001, root.flank_half_m), half])
    x_c, h_c = (float(v[0]) for v in tooth.flank(roll))
    angle = float(tooth.force_angle_rad(roll)[0])
    normal, across = force * math.sin(angle), force * math.cos(angle)
    moment = across * (x_c - x) * tooth.side - normal * h_c
    area, inertia = 2 * half * 0.02, (2 * half) ** 3 * 0.02 / 12
    modulus, shear_modulus = tooth.youngs_modulus_pa, tooth.youngs_modulus_pa / 2.6
    density = moment**2 / (2 * modulus * inertia) + normal**2 / (2 * modulus * area)
    density += 1.2 * across**2 / (2 * shear_modulus * area)
    energy = float(np.sum((density[1:] + density[:-1]) / 2 * np.diff(x) * tooth.side))
    deflection = force * tooth_compliance(tooth, roll)[0]
    assert force * deflection / 2 == pytest.approx(energy, rel=1e-6)


def _arc(root):
    a = math.atan2(root.foot_half_m - root.centre_half_m, root.foot_m - root.centre_m)
    b = math.atan2(root.flank_half_m - root.centre_half_m, root.flank_m - root.centre_m)
    angle = np.linspace(a, a + (b - a + math.pi) % (2 * math.pi) - math.pi, 40001)
    x = np.append(root.centre_m + root.fillet_m * np.cos(angle), root.flank_m)
    half = np.append(root.centre_half_m + root.fillet_m * np.sin(angle), root.flank_half_m)
    return x, half


def test_hertz_of_like_cylinders():
    steel = gear(20)
    expected = 4 * (1 - 0.09) / (math.pi * 206e9 * 0.02)
    assert hertz_compliance(steel, steel) == pytest.approx(expected, rel=1e-12)


def test_stiffness_goes_with_face_width_not_with_size():
    """Thesis 7.5.1: per metre of face width a tooth's stiffness does not depend on its size."""
    small, large = (GearPair(gear(32, module), gear(40, module)) for module in (1e-3, 5e-3))
    phase = np.linspace(-0.8, 0.8, 5)
    assert pair_stiffness(small, phase) == pytest.approx(pair_stiffness(large, phase), rel=1e-9)
    wide = GearPair(*(replace(one, face_width_m=0.05) for one in (small.pinion, small.wheel)))
    assert pair_stiffness(wide, phase) == pytest.approx(2.5 * pair_stiffness(small, phase), rel=1e-9)


def test_swapping_the_gears_turns_the_cycle_round():
    pair, swapped = GearPair(gear(20), gear(45)), GearPair(gear(45), gear(20))
    phase = np.linspace(0, 1, 11)
    assert mesh_stiffness(pair, phase) == pytest.approx(mesh_stiffness(swapped, 1 - phase), rel=1e-9)


@pytest.mark.parametrize("teeth", [(20, 40), (32, 32), (25, 30), (19, 48), (62, 62)])
def test_standard_and_finite_elements(teeth):
    """Stiffness of a pair at the pitch point, per metre of face width.

    ISO 6336-1 method B: c' = 0.8 / (0.04723 + 0.15551 / z1 + 0.25791 / z2) N/(mm um), said to hold within
    some 10 %; Kuang and Yang (1992), finite elements of one tooth each without contact and wheel body;
    Smith: 1.4e10. A beam on an elastic foundation is a different model: 20 % is what such models differ by.
    """
    pair = GearPair(*(gear(z) for z in teeth))
    at = (pair.pitch_point_m - sum(pair.path_m) / 2) / pair.pinion.base_pitch_m
    found = float(pair_stiffness(pair, np.array([at]))[0]) / 0.02
    iso = 0.8e9 / (0.04723 + 0.15551 / teeth[0] + 0.25791 / teeth[1])
    flexible = sum(1 / (3.867 + 1.612 * z - 0.02916 * z**2 + 0.0001553 * z**3) for z in teeth)
    for published in (iso, 1e9 / flexible, smith_pair_stiffness(pair) / 0.02):
        assert found == pytest.approx(published, rel=0.20)


def test_mean_stiffness_of_the_standard():
    """ISO 6336-1: c_gamma = c' (0.75 contact ratio + 0.25), against the mean over the mesh cycle."""
    pair = GearPair(gear(32), gear(32))
    mean = stiffness_series(pair, 8).mean
    iso = 0.8e9 / (0.04723 + (0.15551 + 0.25791) / 32) * 0.02 * (0.75 * pair.contact_ratio + 0.25)
    assert mean == pytest.approx(iso, rel=0.15)


def test_parallel_rig_of_the_thesis():
    """With 32/32 teeth, base radius 46.3 mm (A.2) and 20 mm of face (as 7.5.1): near 3.178e8 N/m (A.1)."""
    rig = gear(32, MODULE)
    assert stiffness_series(GearPair(rig, rig), 8).mean == pytest.approx(3.178e8, rel=0.20)


def test_planetary_insert_of_the_thesis():
    """Table 7.5 with 20 mm of face: one ring pair near Smith's 2.8e8 N/m, the means near 3e8 (Table C.4)."""
    planet = gear(20, fillet=0.3)
    sun = GearPair(planet, gear(40, fillet=0.3))
    ring = GearPair(planet, gear(80, internal=True, hub_radius_m=95e-3, fillet=0.3))
    assert pair_stiffness(ring, np.zeros(1))[0] == pytest.approx(2.8e8, rel=0.10)
    assert stiffness_series(sun, 8).mean == pytest.approx(3e8, rel=0.2)
    assert stiffness_series(ring, 8).mean > stiffness_series(sun, 8).mean  # stiffer tooth, longer contact


def test_series_is_the_mesh_stiffness():
    """The series is the sum of pairs, its jumps rounded; its mean is the mean of the curve."""
    pair = GearPair(gear(32), gear(32))
    phase = (np.arange(4000) + 0.5) / 4000
    exact = mesh_stiffness(pair, phase)
    assert stiffness_series(pair, 8).mean == pytest.approx(exact.mean(), rel=1e-3)
    errors = [np.sqrt(np.mean((stiffness_series(pair, n).value(phase) - exact) ** 2)) for n in (8, 32, 128)]
    assert errors[2] < errors[1] < errors[0] < 0.12 * exact.mean()  # a jump costs 1 / sqrt(harmonics)
    assert errors[0] / errors[2] == pytest.approx(4, rel=0.1)
    swing = stiffness_series(pair, 8).value(phase)
    assert swing.max() < 1.02 * exact.max()
    assert swing.min() > 0.98 * exact.min()


def test_rectangular_stiffness_of_the_thesis():
    """Every pair 1.4e10 N/m per metre: two levels, the upper one for contact ratio - 1 of a pitch."""
    pair = GearPair(gear(20), gear(40))
    edges, levels = stepped_levels(pair, smith_pair_stiffness(pair))
    assert levels == pytest.approx([2.8e8, 5.6e8])
    assert 1 - (edges[1] - edges[0]) == pytest.approx(pair.contact_ratio - 1)
    mean = levels @ np.array([edges[1] - edges[0], 1 - edges[1] + edges[0]])
    assert mean == pytest.approx(2.8e8 * pair.contact_ratio)


def test_wheel_bodies_outside_the_formula_are_refused():
    with pytest.raises(InputError, match=r"hub_radius_m.*0\.0125 m"):
        foundation_compliance(gear(20, hub_radius_m=15e-3), np.array([0.4]))


def test_a_mesh_gives_way_more_than_any_of_its_parts():
    pair = GearPair(gear(20), gear(40))
    phase = np.linspace(-0.8, 0.8, 9)
    total = pair_compliance(pair, phase)
    roll = pair.roll_rad(pair.position_m(phase), of_wheel=False)
    assert np.all(total > tooth_compliance(pair.pinion, roll) + foundation_compliance(pair.pinion, roll))
    assert np.all(np.diff(tooth_compliance(pair.pinion, roll)) > 0)  # the higher the load, the softer
