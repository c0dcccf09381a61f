"""The oil film: published formulas, quadrature of Reynolds' equation, and a stiff solver."""

import math

import numpy as np
import pytest
from scipy.integrate import dblquad, quad, solve_ivp

from gearsim_sim.model.hertz import LINE_EXPONENT, POINT_EXPONENT
from gearsim_sim.model.oil_film import (
    ContactGeometry,
    Oil,
    central_film_thickness_m,
    film_rate,
    make_film,
    squeeze_constants,
)

MODULUS = 2e11 / (2 * (1 - 0.3**2))
OIL = Oil(0.04, 2.3e-8)
# Radial ball bearing of Hamrock (Fundamentals of Fluid Film Lubrication, 1991, ch. 22): balls of 12.7 mm,
# races of 52.291 and 77.706 mm, grooves of 6.604 mm, 400 rad/s, 8900 N on 9 balls, 0.04 Pa s, 2.3e-8 1/Pa.
_PITCH, _BALL = 65.0e-3, 12.7e-3
INNER = ContactGeometry(_BALL * (_PITCH - _BALL) / (2 * _PITCH), 6.604e-3 / (2 * 0.52 - 1), 0.0, 1e-4)
OUTER = ContactGeometry(_BALL * (_PITCH + _BALL) / (2 * _PITCH), 6.604e-3 / (2 * 0.52 - 1), 0.0, 1e-4)
ENTRAINMENT = 400 * (_PITCH**2 - _BALL**2) / (4 * _PITCH)
LOAD = 5 * 8900 / 9


def nijenbanning_moes_thickness(contact, oil, entrainment, load):
    """Central film of Nijenbanning, Venner and Moes (Wear 176, 1994): fitted to other computations."""
    double, radius = 2 * MODULUS, contact.rolling_m
    ratio = radius / contact.across_m
    sum_speed = oil.viscosity_pa_s * 2 * entrainment / (double * radius)
    load_number = load / (double * radius**2) * sum_speed**-0.75
    material = oil.pressure_viscosity_1_per_pa * double * sum_speed**0.25
    shape = 1 + 0.006 * math.log(ratio) + 0.63 * ratio ** (4 / 7)
    rigid_iso = 145 * (1 + 0.796 * ratio ** (14 / 15)) ** (-15 / 7) / ratio / load_number**2
    rigid_piezo = 1.29 * (1 + 0.691 * ratio) ** (-2 / 3) * material ** (2 / 3)
    elastic_iso = 3.18 * shape ** (-14 / 25) * ratio ** (-1 / 15) * load_number ** (-2 / 15)
    elastic_piezo = 1.48 * shape ** (-7 / 20) * ratio ** (-1 / 24) * load_number ** (-1 / 12) * material**0.75
    s = 1.5 * (1 + math.exp(-1.2 * elastic_iso / elastic_piezo))
    iso = (rigid_iso**1.5 + (elastic_iso**-4 + (1.8 / ratio) ** -4) ** (-3 / 8)) ** (2 * s / 3)
    piezo = (rigid_piezo**-8 + elastic_piezo**-8) ** (-s / 8)
    return (iso + piezo) ** (1 / s) * math.sqrt(sum_speed) * radius


@pytest.mark.parametrize("contact", [INNER, OUTER])
def test_hamrock_dowson_on_the_bearing_of_hamrock(contact):
    """Against an independent formula; fits to different computations differ by up to 30 % at these loads."""
    film = central_film_thickness_m(contact, OIL, MODULUS, ENTRAINMENT, LOAD)
    assert film == pytest.approx(nijenbanning_moes_thickness(contact, OIL, ENTRAINMENT, LOAD), rel=0.3)
    assert 0.3e-6 < film < 1.5e-6


def test_exponents_of_hamrock_and_dowson():
    def film(speed=1.0, load=1.0, viscosity=1.0):
        oil = Oil(OIL.viscosity_pa_s * viscosity, OIL.pressure_viscosity_1_per_pa)
        return central_film_thickness_m(INNER, oil, MODULUS, ENTRAINMENT * speed, LOAD * load)

    assert math.log(film(speed=2) / film(), 2) == pytest.approx(0.67)
    assert math.log(film(viscosity=2) / film(), 2) == pytest.approx(0.67)
    assert math.log(film(load=2) / film(), 2) == pytest.approx(-0.067)


def test_squeeze_of_paraboloids_against_reynolds():
    """Force of p = -6 eta h' / ((1/Rx + 1/Ry) H^2) by quadrature, and that p solves Reynolds' equation."""
    rx, ry, gap, eta, speed = 3e-3, 20e-3, 1e-6, 0.05, 1e-2
    contact = ContactGeometry(rx, ry, 0.0, 1e-4)

    def height(x, y):
        return gap + x * x / (2 * rx) + y * y / (2 * ry)

    def pressure(x, y):
        return 6 * eta * speed / ((1 / rx + 1 / ry) * height(x, y) ** 2)

    # polar coordinates in x / sqrt(2 Rx gap), y / sqrt(2 Ry gap)
    lx, ly = math.sqrt(2 * rx * gap), math.sqrt(2 * ry * gap)
    force = dblquad(
        lambda r, a: pressure(lx * r * math.cos(a), ly * r * math.sin(a)) * lx * ly * r,
        0,
        2 * math.pi,
        0,
        np.inf,
    )[0]
    first, second = squeeze_constants(contact, eta)
    assert second == 0.0
    assert first / gap * speed == pytest.approx(force, rel=1e-6)
    sphere, _ = squeeze_constants(ContactGeometry(rx, rx, 0.0, 1e-4), eta)
    assert sphere == pytest.approx(6 * math.pi * eta * rx**2)
    x, y, d = 20e-6, 30e-6, 1e-7

    def flux(x, y, axis):
        dx, dy = (d, 0.0) if axis == 0 else (0.0, d)
        slope = (pressure(x + dx, y + dy) - pressure(x - dx, y - dy)) / (2 * d)
        return height(x, y) ** 3 * slope

    divergence = (flux(x + d, y, 0) - flux(x - d, y, 0) + flux(x, y + d, 1) - flux(x, y - d, 1)) / (2 * d)
    assert divergence == pytest.approx(-12 * eta * speed, rel=1e-4)


def test_squeeze_of_a_roller_against_reynolds():
    """H^3 p' = 12 eta h' x integrated twice, per length."""
    radius, gap, eta, speed, length = 4e-3, 1e-6, 0.05, 1e-2, 12e-3
    first, second = squeeze_constants(ContactGeometry(radius, math.inf, length, 1e-4), eta)
    scale = math.sqrt(2 * radius * gap)
    integral = quad(lambda u: 6 * eta * speed * radius / (gap * (1 + u * u)) ** 2 * scale, -np.inf, np.inf)[0]
    assert first == 0.0
    assert second / gap**1.5 * speed == pytest.approx(integral * length, rel=1e-9)


@pytest.mark.parametrize("angle", [0.0, 0.4])
def test_two_films_in_series_are_one(angle):
    """Steady thickness and squeeze of the one film against both films taken apart."""
    film = make_film((INNER, OUTER), POINT_EXPONENT, OIL, MODULUS, angle)
    tilt = math.cos(angle)
    radial = 200.0
    each = [central_film_thickness_m(c, OIL, MODULUS, 3.0, radial / tilt) for c in (INNER, OUTER)]
    # 1/15 stands for 0.067 over the range from 1 N to 200 N: 200^(0.067 - 1/15) = 1.0018
    assert film.thickness_m(3.0, radial) == pytest.approx(sum(each) / tilt, rel=3e-3)
    unit = [central_film_thickness_m(c, OIL, MODULUS, 1.0, 1.0) for c in (INNER, OUTER)]
    shares = [one / sum(unit) for one in unit]
    closing = 1e-3
    along = [share * sum(each) for share in shares]
    rates = [closing_of * 1.0 for closing_of in (1.0, 1.0)]
    dampings = [
        squeeze_constants(c, OIL.viscosity_pa_s)[0] / h for c, h in zip((INNER, OUTER), along, strict=True)
    ]
    force = closing * tilt / sum(rate / damping for rate, damping in zip(rates, dampings, strict=True))
    assert film.damping(sum(along) / tilt) * closing == pytest.approx(force * tilt, rel=1e-9)


def test_steady_film_carries_the_load_and_the_damper_dissipates():
    film = make_film((INNER, OUTER), POINT_EXPONENT, OIL, MODULUS, 0.0)
    under_1_n = film.thickness_m(3.0, 1.0)
    for load in (1.0, 50.0, 500.0):
        steady = film.thickness_m(3.0, load)
        # the power 15 of the thickness: relative errors of rounding grow 15 times
        assert abs(film_rate(film, steady, under_1_n, load)) * film.damping(steady) < 1e-9 * load
        assert (
            film_rate(film, 1.1 * steady, under_1_n, load)
            < 0
            < film_rate(film, 0.9 * steady, under_1_n, load)
        )


def test_roller_film():
    contact = ContactGeometry(4e-3, math.inf, 12e-3, 1e-4)
    film = make_film((contact, contact), LINE_EXPONENT, OIL, MODULUS, 0.0)
    assert film.load_power == 10
    steady = central_film_thickness_m(contact, OIL, MODULUS, 2.0, 300.0)
    assert film.thickness_m(2.0, 300.0) == pytest.approx(2 * steady, rel=1e-9)
    # the same force closes both films: each has half the speed and half the thickness
    single = squeeze_constants(contact, OIL.viscosity_pa_s)[1] / steady**1.5
    assert film.damping(2 * steady) == pytest.approx(single / 2, rel=1e-9)


def test_film_softens_the_return_to_contact():
    """A ball that comes back at 65 mm/s: force begins earlier and rises less steeply; it never pulls."""
    film = make_film((INNER, OUTER), POINT_EXPONENT, Oil(0.5, 2.3e-8), MODULUS, 0.0)
    factor, under_1_n = 5e9, film.thickness_m(0.58, 1.0)

    def approach(t):
        return 0.065 * (t - 1e-4)

    def force(t, h):
        return factor * max(approach(t) + h, 0.0) ** 1.5

    def rate(t, y):
        h = math.exp(y[0])
        return [film_rate(film, h, under_1_n, force(t, h)) / h]

    start = math.log(film.thickness_m(0.58, 1e-3))
    times = np.linspace(0, 2e-4, 2001)
    solution = solve_ivp(rate, (0, 2e-4), [start], "Radau", t_eval=times, rtol=1e-8, atol=1e-10)
    wet = np.array([force(t, math.exp(y)) for t, y in zip(times, solution.y[0], strict=True)])
    thickness = film.thickness_m(0.58, 200.0)
    offset = factor * np.maximum([approach(t) + thickness for t in times], 0.0) ** 1.5
    assert wet.min() >= 0
    assert np.argmax(wet > 1) < np.argmax(offset > 1)
    assert np.diff(wet).max() < np.diff(offset).max()
    rise = [np.argmax(one > 20) - np.argmax(one > 1) for one in (wet, offset)]
    assert rise[0] > 1.2 * rise[1]
