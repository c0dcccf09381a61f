"""Whether a planetary stage can be put together from its tooth numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence

from gearsim_io.errors import InputError

# A planet that misses a tooth space by more than this part of a pitch cannot be put in.
_FIT = 1e-6


def check_planetary_assembly(
    where: str,
    sun_teeth: int,
    planet_teeth: int,
    ring_teeth: int,
    planet_angles_rad: Sequence[float],
    planet_tip_over_distance: float,
) -> None:
    """InputError unless the stage can be assembled.

    Parameters
    ----------
    where : str
        File or section, for errors.
    sun_teeth, planet_teeth, ring_teeth : int
        Numbers of teeth.
    planet_angles_rad : sequence of float
        Places of the planets on the carrier.
    planet_tip_over_distance : float
        Tip radius of a planet over the distance between sun and planet axes.

    Notes
    -----
    Coaxial without profile shift: z_r = z_s + 2 z_p. A planet fits at angle psi after the first one if
    psi (z_s + z_r) / 2 pi is whole (equally spaced: (z_s + z_r) / N). Tips of neighbours stay apart if
    2 a sin(gap / 2) > 2 r_tip. Source: Inalpolat and Kahraman (2009), thesis 7.6.
    """
    if ring_teeth != sun_teeth + 2 * planet_teeth:
        expected = f"{sun_teeth + 2 * planet_teeth}, sun + 2 planet, so that the planets fit between"
        raise InputError(where, "ring_teeth", ring_teeth, expected)
    step = 2 * math.pi / (sun_teeth + ring_teeth)
    first = planet_angles_rad[0]
    for number, angle in enumerate(planet_angles_rad, start=1):
        places = (angle - first) / step
        if abs(places - round(places)) > _FIT:
            near = math.degrees(first + round(places) * step)
            expected = (
                f"a multiple of 360/{sun_teeth + ring_teeth} deg after the first; next is {near:.6g} deg"
            )
            raise InputError(where, f"angle of planet {number}", f"{math.degrees(angle):.6g} deg", expected)
    turns = sorted(angle % (2 * math.pi) for angle in planet_angles_rad)
    for this, following in zip(turns, [*turns[1:], turns[0] + 2 * math.pi], strict=True):
        if math.sin(min(following - this, math.pi) / 2) <= planet_tip_over_distance:
            expected = f"more than {math.degrees(2 * math.asin(planet_tip_over_distance)):.4g} deg apart"
            raise InputError(
                where, "planet angles", f"{math.degrees(following - this):.4g} deg apart", expected
            )


def equal_spacing_possible(sun_teeth: int, ring_teeth: int, planets: int) -> bool:
    """Whether this many planets fit at equal angles: (z_s + z_r) / N is whole."""
    return (sun_teeth + ring_teeth) % planets == 0
