"""The oil film between rolling elements and races, in series with their elastic contacts.

A ball with films of the thickness h (both contacts together) is compressed elastically by d + h where the
rings approach by d: Q = k (d + h)^n if d + h > 0, else 0. The film obeys

    c(h) h' = Q_s(h) - Q.

Q_s is the load that the rolling surfaces carry at the thickness h when nothing moves up or down: the
central thickness of Hamrock and Dowson (1981), h ~ Q^-0.067, read backwards with the exponent 1/15, so that
Q_s = (h_1 / h)^15 with h_1 the thickness under 1 N (rollers: Dowson and Toyoda (1979), h ~ Q^-0.1, power 10).
c(h) h' is the squeeze film of two rigid paraboloids, p = -6 eta h' / ((1/Rx + 1/Ry) H^2) in the gap H, which
integrates to

    c(h) = 12 pi eta sqrt(Rx Ry) / (1/Rx + 1/Ry) / h     (6 pi eta R^2 / h for a sphere on a plane),

and for rollers of length l c(h) = 3 sqrt(2) pi eta l (R / h)^(3/2). Contacts only push, because the Hertz
contact carries all force; the damper only dissipates, c h'^2 >= 0; as the film gives way softly, force comes
and goes without a kink. In a loaded contact the film is a stiff spring, so that d + h differs from dry
contact by the offset h; between a ball that comes back and its race, the film that has grown meanwhile
must be squeezed out first: that is what makes an exit softer.

Left out: the rise of viscosity with pressure within c(h) and the time that oil takes to pass through the
contact (0.1 to 0.5 ms); both hold the film in a loaded contact still for longer, where it moves by a few
per cent only. Starvation, and heat.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from gearsim_sim.model.hertz import POINT_EXPONENT

POINT_LOAD_POWER, LINE_LOAD_POWER = 15, 10


@dataclass(frozen=True, slots=True)
class ContactGeometry:
    """Radii of one contact of an element with a race; `across_m` is infinite for rollers."""

    rolling_m: float  # equivalent radius in the direction of rolling
    across_m: float
    length_m: float  # of a roller; 0 for balls
    patch_half_length_m: float  # of the contact in the direction of rolling, at 1.5 GPa


@dataclass(frozen=True, slots=True)
class Oil:
    """A lubricant at its temperature."""

    viscosity_pa_s: float
    pressure_viscosity_1_per_pa: float


@dataclass(frozen=True, slots=True)
class Film:
    """The film of one element, radially, per unit of speed: numbers for the contact loop.

    At the entrainment speed u the thickness under 1 N is `unit_thickness_m` u^`speed_power`.
    """

    unit_thickness_m: float
    speed_power: float
    load_power: int
    squeeze_ns: float  # c(h) = squeeze / h                          (balls) [N s]
    squeeze_root_ns: float  # ... + squeeze_root / h^(3/2)           (rollers) [N s m^(1/2)]

    def thickness_m(self, entrainment_m_per_s: float, load_n: float) -> float:
        """Steady thickness of both films together."""
        under_1_n = self.unit_thickness_m * entrainment_m_per_s**self.speed_power
        return float(under_1_n * load_n ** (-1 / self.load_power))

    def damping(self, thickness_m: float) -> float:
        """c(h) [N s/m]."""
        return (self.squeeze_ns + self.squeeze_root_ns / math.sqrt(thickness_m)) / thickness_m


def central_film_thickness_m(
    contact: ContactGeometry, oil: Oil, modulus_pa: float, entrainment_m_per_s: float, load_n: float
) -> float:
    """Central thickness of an elastohydrodynamic film.

    Points: Hamrock and Dowson, Ball Bearing Lubrication (1981), h = 2.69 Rx U^0.67 G^0.53 W^-0.067
    (1 - 0.61 exp(-0.73 k)) with k = 1.0339 (Ry / Rx)^0.636. Lines: Dowson and Toyoda (1979),
    h = 3.06 R U^0.69 G^0.56 W^-0.10. `modulus_pa` is E* (their E' is twice that), entrainment speed the
    mean speed of both surfaces through the contact.
    """
    double, radius = 2 * modulus_pa, contact.rolling_m
    speed = oil.viscosity_pa_s * entrainment_m_per_s / (double * radius)
    material = oil.pressure_viscosity_1_per_pa * double
    if contact.length_m > 0:
        load = load_n / (double * radius * contact.length_m)
        return float(3.06 * radius * speed**0.69 * material**0.56 * load**-0.10)
    load = load_n / (double * radius**2)
    ellipticity = 1.0339 * (contact.across_m / radius) ** 0.636
    shape = 1 - 0.61 * math.exp(-0.73 * ellipticity)
    return float(2.69 * radius * speed**0.67 * material**0.53 * load**-0.067 * shape)


def squeeze_constants(contact: ContactGeometry, viscosity_pa_s: float) -> tuple[float, float]:
    """The constants of c(h) = first / h + second / h^(3/2) of one contact."""
    rolling, across = contact.rolling_m, contact.across_m
    if contact.length_m > 0:
        return 0.0, 3 * math.sqrt(2) * math.pi * viscosity_pa_s * contact.length_m * rolling**1.5
    mean = rolling * across / (rolling + across)
    return 12 * math.pi * viscosity_pa_s * math.sqrt(rolling * across) * mean, 0.0


def make_film(
    contacts: tuple[ContactGeometry, ContactGeometry],
    exponent: float,
    oil: Oil,
    modulus_pa: float,
    contact_angle_rad: float,
) -> Film:
    """Both films of an element in series, as one film in the radial direction.

    Both carry the same force Q; they share the thickness h as their steady thicknesses do, h_i = f_i h. So
    h' = -Q sum(h_i / C_i): 1 / C = sum(f_i / C_i) (with f_i^(3/2) for lines). Along a contact at the
    angle a everything is cos(a) of the radial length, and the radial force cos(a) of that along it.
    """
    tilt = math.cos(contact_angle_rad)
    point = exponent == POINT_EXPONENT
    power, speed_power = (POINT_LOAD_POWER, 0.67) if point else (LINE_LOAD_POWER, 0.69)
    steady = [central_film_thickness_m(contact, oil, modulus_pa, 1.0, 1.0) for contact in contacts]
    shares = [one / sum(steady) for one in steady]
    squeezes = [squeeze_constants(contact, oil.viscosity_pa_s) for contact in contacts]
    first = second = 0.0
    if point:
        first = tilt / sum(share / one for share, (one, _) in zip(shares, squeezes, strict=True))
    else:
        second = tilt**0.5 / sum(share**1.5 / one for share, (_, one) in zip(shares, squeezes, strict=True))
    # Under a radial force of 1 N the force along the line is 1 / tilt, the radial thickness h / tilt.
    return Film(
        unit_thickness_m=sum(steady) * tilt ** (1 / power) / tilt,
        speed_power=speed_power,
        load_power=power,
        squeeze_ns=first,
        squeeze_root_ns=second,
    )


def film_rate(film: Film, thickness_m: float, unit_load_thickness_m: float, force_n: float) -> float:
    """h' [m/s]; `unit_load_thickness_m` is the steady thickness under 1 N at the present speed."""
    carried = (unit_load_thickness_m / thickness_m) ** film.load_power
    return (carried - force_n) / film.damping(thickness_m)
