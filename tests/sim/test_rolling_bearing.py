"""Ball and roller bearings against tables and closed forms of the literature."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from gearsim_io.errors import InputError
from gearsim_io.nameplate import Bearing
from gearsim_sim.model.hertz import (
    contact_modulus,
    line_contact_factor,
    line_patch_half_width_m,
    point_contact_patch,
    race_curvatures,
)
from gearsim_sim.model.rolling_bearing import make_rolling_bearing
from gearsim_sim.params.bearing import RollingBearing

STEEL = contact_modulus(206e9, 0.3)
KOYO_1205 = Bearing("koyo", "shaft", 12, 7.12e-3, 38.5e-3)
BALLS = {
    "radial_clearance": "5 um",
    "inner_groove_conformity": 0.52,
    "youngs_modulus": "206 GPa",
    "poisson_ratio": 0.3,
    "nominal_stiffness": "1.5e8 N/m",
}
ROLLERS = {"element": "roller", "element_length": "10 mm"}


def bearing(plate=KOYO_1205, **given):
    params = RollingBearing.model_validate(BALLS | given)
    return make_rolling_bearing(plate, params, load_direction_rad=-math.pi / 2)


@pytest.mark.parametrize(
    ("difference", "major", "minor", "approach"),
    [
        (0.3204, 1.2623, 0.8114, 0.9761),
        (0.5916, 1.6440, 0.6687, 0.9077),
        (0.90999, 3.233, 0.4499, 0.6636),
        (0.97290, 5.267, 0.3490, 0.4960),
        (0.9981847, 14.839, 0.2072, 0.2427),
    ],
)
def test_contact_ellipse_of_harris(difference, major, minor, approach):
    """Dimensionless axes and approach over the curvature difference (Harris, Table 6.1, four digits)."""
    total, force = 200.0, 100.0
    patch = point_contact_patch(total * (1 - difference) / 2, total * (1 + difference) / 2, STEEL, force)
    unit = (3 * force / (2 * total * STEEL)) ** (1 / 3)
    assert patch.semi_major_m == pytest.approx(major * unit, rel=3e-4)
    assert patch.semi_minor_m == pytest.approx(minor * unit, rel=3e-4)
    assert patch.approach_m == pytest.approx(approach * unit**2 * total / 2, rel=3e-4)
    assert patch.peak_pressure_pa == pytest.approx(
        1.5 * force / (math.pi * patch.semi_major_m * patch.semi_minor_m)
    )


def test_palmgren_line_contact():
    """Harris's form for steel, d = 3.84e-5 Q^0.9 / l^0.8 in mm and N, rounded to three digits."""
    force, length_mm = 2000.0, 12.0
    approach_m = (force / line_contact_factor(length_mm * 1e-3, STEEL)) ** 0.9
    assert approach_m * 1e3 == pytest.approx(3.84e-5 * force**0.9 / length_mm**0.8, rel=2e-3)


def test_line_contact_patch_is_johnsons():
    """b = sqrt(4 P R / (pi E*)) and p0 = 2 P / (pi b) (Johnson 4.43, 4.45)."""
    radius, line_load = 5e-3, 1e5
    half = math.sqrt(4 * line_load * radius / (math.pi * STEEL))
    assert line_patch_half_width_m(radius, STEEL, 2 * line_load / (math.pi * half)) == pytest.approx(half)


def test_deep_groove_against_harris_curvatures():
    """Sum and difference of curvatures by Harris (2.28) to (2.33) for both grooves."""
    ball, pitch, conformity, angle = 7.94e-3, 39.04e-3, 0.515, 0.3
    gamma = ball * math.cos(angle) / pitch
    for inner, ratio in ((True, gamma / (1 - gamma)), (False, -gamma / (1 + gamma))):
        rolling, across = race_curvatures(ball, pitch, conformity, angle, inner=inner)
        assert rolling + across == pytest.approx((4 - 1 / conformity + 2 * ratio) / ball)
        difference = (1 / conformity + 2 * ratio) / (4 - 1 / conformity + 2 * ratio)
        assert (rolling - across) / (rolling + across) == pytest.approx(difference)


def load_integral(epsilon, exponent):
    """Sjoevall's integral J_r (Harris 7.18)."""
    half = math.acos(1 - 2 * epsilon) if epsilon < 1 else math.pi

    def density(angle):
        return (1 - (1 - math.cos(angle)) / (2 * epsilon)) ** exponent * math.cos(angle)

    return quad(density, -half, half)[0] / (2 * math.pi)


@pytest.mark.parametrize(
    ("epsilon", "ball", "roller"),
    [(0.2, 0.1590, 0.1737), (0.5, 0.2288, 0.2453), (0.8, 0.2559, 0.2658), (1.25, 0.2289, 0.2078)],
)
@pytest.mark.parametrize("element", ["ball", "roller"])
def test_load_distribution_of_stribeck_and_harris(element, epsilon, ball, roller):
    """Greatest element load F / (Z J_r), J_r from Harris's Table 7.1, clearance and preload alike.

    Many elements stand for a continuous ring; Harris's rollers have the exponent 1.11 or 1.1, hence the 1 %.
    """
    plate = Bearing("ring", "shaft", 200, 1e-4, 38.5e-3)
    shift = 20e-6
    clearance = shift * (1 - 2 * epsilon)
    given = ROLLERS if element == "roller" else {}
    law = bearing(plate, radial_clearance={"value": clearance, "unit": "m"}, **given)
    load = law.force(np.array([0.0, shift]), 0.0)[1]
    greatest = law.ball_forces(law.compressions(np.array([0.0, shift]), 0.0)).max()
    published = roller if element == "roller" else ball
    assert load / (200 * greatest) == pytest.approx(load_integral(epsilon, law.exponent), rel=2e-3)
    assert load / (200 * greatest) == pytest.approx(published, rel=0.01)
    assert law.mean_displacement_m(load) == pytest.approx(shift, rel=1e-3)
    half = math.acos(1 - 2 * epsilon) if epsilon < 1 else math.pi
    assert law.load_zone_half_angle_rad(load) == pytest.approx(half, rel=2e-3)


def test_stribecks_number():
    """Without clearance the most loaded of many balls carries 4.37 F / Z (Stribeck 1901)."""
    law = bearing(Bearing("ring", "shaft", 100, 1e-4, 38.5e-3), radial_clearance="0 um")
    displacement = np.array([10e-6, 0.0])
    greatest = law.ball_forces(law.compressions(displacement, 0.0)).max()
    assert greatest * 100 / law.force(displacement, 0.0)[0] == pytest.approx(4.37, abs=0.01)


def test_frequencies_of_the_thesis():
    """Section 2.2.1 and 5.5 at 10 Hz: BPFO 48.8, BPFI 71.1, FTF 4.1; BSF 26.1 (errata)."""
    law = bearing()
    cage = law.cage_rate(10.0)
    assert cage == pytest.approx(4.1, abs=0.05)
    assert 12 * cage == pytest.approx(48.9, abs=0.1)
    assert 12 * (10.0 - cage) == pytest.approx(71.1, abs=0.05)
    assert -law.spin_rate(10.0) == pytest.approx(26.1, abs=0.05)


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_kinematics_are_rolling(angle):
    """Where ball and race touch both have one speed: of any two ring speeds, with any contact angle."""
    plate = Bearing("tilted", "shaft", 12, 7.12e-3, 38.5e-3, angle)
    law = bearing(plate)
    for inner, outer in ((10.0, 0.0), (0.0, 7.0), (3.0, -5.0)):
        cage, spin = law.cage_rate(inner, outer), law.spin_rate(inner, outer)
        for ring, radius, side in ((inner, law.inner_race_radius_m, -1), (outer, law.outer_race_radius_m, 1)):
            surface = cage * radius + side * spin * law.ball_radius_m
            # the ball turns about an axis square to the line of contact, its surface relative to the cage
            assert ring * radius == pytest.approx(surface, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("given", [{}, ROLLERS, {"radial_clearance": "-3 um"}, {"rows": 2}])
def test_force_is_minus_the_gradient_of_the_energy(given):
    law = bearing(**given)
    rng = np.random.default_rng(3)
    for _ in range(5):
        direction, cage = rng.uniform(0, 2 * np.pi, 2)
        at = rng.uniform(8e-6, 3e-5) * np.array([np.cos(direction), np.sin(direction)])
        missing = rng.uniform(-3e-6, 3e-6, law.ball_count)
        step = 1e-8
        gradient, tangent = np.empty(2), np.empty((2, 2))
        for i in range(2):
            shift = step * np.eye(2)[i]
            gradient[i] = law.energy(at + shift, cage, missing) - law.energy(at - shift, cage, missing)
            tangent[i] = law.force(at + shift, cage, missing) - law.force(at - shift, cage, missing)
        assert gradient / (2 * step) == pytest.approx(law.force(at, cage, missing), rel=1e-3, abs=0.1)
        stiffness = law.stiffness(at, cage, missing)
        # rollers at touch: the stiffness rises as d^(1/9), steeply for differences
        assert tangent / (2 * step) == pytest.approx(stiffness, rel=0.02, abs=0.02 * stiffness.max())


def test_axial_preload_is_a_uniform_pre_compression():
    """All balls along the line of contact, in three dimensions, under axial load alone and with a shift."""
    angle, axial = math.radians(25), 300.0
    plate = Bearing("angular", "shaft", 14, 9e-3, 46e-3, angle)
    given = {"radial_clearance": "0 um", "outer_groove_conformity": 0.52}
    law = bearing(plate, axial_preload="300 N", **given)
    free = bearing(plate, **given)
    factor = free.load_factor / math.cos(angle) ** 2.5
    along = brentq(lambda d: 14 * factor * d**1.5 * math.sin(angle) - axial, 0, 1e-4)
    shift = np.array([1e-6, -2e-6])
    force = np.zeros(2)
    for azimuth in law.azimuths_rad + 0.2:
        unit = np.array([math.cos(azimuth), math.sin(azimuth)])
        force += factor * max(0.0, along + shift @ unit * math.cos(angle)) ** 1.5 * math.cos(angle) * unit
    assert law.force(shift, 0.2) == pytest.approx(force, rel=1e-7)
    assert law.load_zone_half_angle_rad(10.0) == math.pi


def test_preload_stiffens_and_clearance_softens():
    stiffness = {}
    for name in ("-4 um", "0 um", "10 um"):
        law = bearing(radial_clearance=name)
        shift = law.mean_displacement_m(300.0)
        stiffness[name] = law.stiffness(np.array([0.0, shift]), 0.1)[1, 1]
    assert stiffness["-4 um"] > 1.2 * stiffness["0 um"] > 1.2 * stiffness["10 um"]


@pytest.mark.parametrize("given", [{}, ROLLERS])
def test_varying_compliance(given):
    """Under a constant load the ring rises and falls with every ball, not otherwise (12 balls in one row)."""
    law = bearing(**given)

    def height(cage):
        return brentq(lambda y: law.force(np.array([0.0, y]), cage)[1] - 500.0, 0, 1e-3, xtol=1e-15)

    spacing = law.ball_spacing_rad
    at = [height(fraction * spacing) for fraction in np.arange(16) / 16]
    assert max(at) - min(at) > 1e-8
    assert height(0.3 * spacing) == pytest.approx(height(1.3 * spacing), abs=1e-12)


@pytest.mark.parametrize(
    ("plate", "given", "field"),
    [
        (Bearing("many", "s", 12, 12e-3, 38.5e-3), {}, "element_diameter"),
        (Bearing("two", "s", 2, 7e-3, 38.5e-3), {}, "rolling_elements"),
        (Bearing("thrust", "s", 12, 7e-3, 38.5e-3, math.pi / 2), {}, "contact_angle"),
        (KOYO_1205, {"axial_preload": "100 N"}, "axial_preload"),
    ],
)
def test_impossible_bearings_are_refused(plate, given, field):
    with pytest.raises(InputError) as error:
        bearing(plate, **given)
    assert error.value.field == field


def test_clearance_without_load_zone_is_refused():
    law = bearing()
    law.check_load_zone("here", "clearance_m", 500.0)
    with pytest.raises(InputError, match="load zone"):
        law.check_load_zone("here", "clearance_m", 500.0, 5e-3)


def test_missing_contact_data_is_named():
    with pytest.raises(ValueError, match="element_length"):
        RollingBearing.model_validate(BALLS | {"element": "roller"})
    without = {key: value for key, value in BALLS.items() if key != "inner_groove_conformity"}
    with pytest.raises(ValueError, match="inner_groove_conformity"):
        RollingBearing.model_validate(without)
