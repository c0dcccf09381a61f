"""Hertz's constant against closed forms and the thesis's linear stiffness."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from gearsim_sim.model.hertz import ball_load_factor, point_contact_factor
from gearsim_sim.model.plants import make_plant
from gearsim_sim.params import load_parallel_params

STEEL = 206e9 / (2 * (1 - 0.3**2))


def test_sphere_on_plane_closed_form():
    radius = 3.56e-3
    expected = 4 / 3 * STEEL * math.sqrt(radius)
    assert point_contact_factor(1 / radius, 1 / radius, STEEL) == pytest.approx(expected, rel=1e-12)


def test_nearly_circular_contact_joins_the_circular_one():
    circle = point_contact_factor(100.0, 100.0, STEEL)
    assert point_contact_factor(100.0, 100.002, STEEL) == pytest.approx(circle, rel=1e-5)


@pytest.mark.parametrize("ratio", [1.5, 6.0, 30.0])
def test_elliptic_contact_against_direct_integration(ratio):
    """Gap curvatures and approach as integrals over the ellipse (Johnson 3.5), without elliptic functions."""
    low = 40.0
    high = ratio * low

    def integrals(k):  # k = b/a; pressure p0, semi-axis a = 1, prefactor p0 b / E*
        common = lambda w: math.sqrt((k**2 + w) * w)  # noqa: E731
        first = quad(lambda s: 2 * s / ((1 + s * s) ** 1.5 * common(s * s)), 0, np.inf)[0]
        second = quad(lambda s: 2 * s / ((k**2 + s * s) * math.sqrt(1 + s * s) * common(s * s)), 0, np.inf)[0]
        zero = quad(lambda s: 2 * s / (math.sqrt(1 + s * s) * common(s * s)), 0, np.inf)[0]
        return first, second, zero

    k = brentq(lambda k: integrals(k)[1] / integrals(k)[0] - ratio, 1e-3, 1)
    first, _, zero = integrals(k)
    # A x^2 with A = low / 2 = p0 b / (2 E* a^2) * first; delta = p0 b / (2 E*) * zero; Q = 2/3 p0 pi a b.
    scale = 1e-3  # semi-axis a
    pressure_b = low / 2 * 2 * STEEL * scale**2 / first
    force = 2 / 3 * math.pi * scale * pressure_b
    approach = pressure_b * zero / (2 * STEEL)
    assert point_contact_factor(low, high, STEEL) == pytest.approx(force / approach**1.5, rel=1e-6)


def test_koyo_1205_load_factor():
    """Between the flat-plate limit and a closely fitting groove; the value is in docs/physics.md."""
    factor = ball_load_factor(7.12e-3, 38.5e-3, 0.52, 206e9, 0.3)
    assert factor == pytest.approx(5.081e9, rel=1e-3)
    assert ball_load_factor(7.12e-3, 38.5e-3, 0.51, 206e9, 0.3) > factor


def test_linear_stiffness_of_the_thesis_at_working_load():
    """Two rows of these balls are as stiff as the tabulated 1.5e8 N/m within the range of loads."""
    bearing = make_plant(load_parallel_params(), 1).bearings[0].law

    def stiffness(load):
        y = brentq(lambda y: bearing.force(np.array([0.0, y]), 0.0)[1] - load, 0, 1e-3)
        return bearing.stiffness(np.array([0.0, y]), 0.0)[1, 1]

    at_50_nm, at_130_nm = stiffness(50 / 0.0463 / 2), stiffness(130 / 0.0463 / 2)
    assert at_50_nm == pytest.approx(1.10e8, rel=0.02)
    assert at_130_nm == pytest.approx(1.5e8, rel=0.05)


def test_hertz_reading_of_the_tabulated_value_is_impossible():
    """As a factor in N/m^1.5, 1.5e8 would let the shaft sink deeper than the spall is (errata)."""
    bearing = make_plant(load_parallel_params().with_physics(clearance=False), 1).bearings[0].law
    load = 50 / 0.0463 / 2
    y = brentq(lambda y: bearing.force(np.array([0.0, y]), 0.0)[1] - load, 0, 1e-3)
    assert y * (bearing.load_factor / 1.5e8) ** (2 / 3) > 60e-6
    assert y < 10e-6
