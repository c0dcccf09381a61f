"""Whether the two events of a wide spall are entry and impact: their distance in time must go as 1 / speed.

The ringing of a housing, an echo, or the passing of a neighbouring row also put a second event behind a
first. Those come after a fixed time, entry and impact after a fixed way. With the spacings T of the events at
several contact speeds v the line

    T = a + L / v

through them has a = 0 and L = width - 2 release for a spall, and L = 0 for anything that rings.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from gearsim_io.errors import InputError

__all__ = ["DoubleImpact", "SpeedLaw", "speed_law"]


@dataclass(frozen=True, slots=True)
class DoubleImpact:
    """Spacing of two events at one speed.

    Parameters
    ----------
    speed_m_s : float
        Of the contact along the race, `RacePass.speed_m_s`.
    spacing_s, error_s : float
        Time between the events, and its standard deviation.
    """

    speed_m_s: float
    spacing_s: float
    error_s: float

    def __post_init__(self) -> None:
        for name in ("speed_m_s", "spacing_s", "error_s"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise InputError("DoubleImpact", name, value, "a finite number above 0")


@dataclass(frozen=True, slots=True)
class SpeedLaw:
    """The line T = a + L / v through spacings at several speeds.

    Parameters
    ----------
    way_m, way_ci95_m : float, tuple of float
        L.
    delay_s, delay_ci95_s : float, tuple of float
        a.
    verdict : {"way", "time", "neither"}
        "way": the spacings go as 1 / v, the events are entry and impact; "time": they do not depend on the
        speed; "neither": both parts are there, or none can be told from nothing.
    """

    way_m: float
    way_ci95_m: tuple[float, float]
    delay_s: float
    delay_ci95_s: tuple[float, float]
    verdict: str


def speed_law(impacts: Sequence[DoubleImpact]) -> SpeedLaw:
    """Fit the line, weighted by the spacings' errors; errors are scaled up where the points scatter more.

    Raises
    ------
    InputError
        With fewer than three spacings, or speeds that differ by less than a fifth.
    """
    if len(impacts) < 3:
        raise InputError("speed_law", "impacts", len(impacts), "spacings at 3 or more speeds")
    speed = np.array([impact.speed_m_s for impact in impacts])
    if speed.max() < 1.2 * speed.min():
        raise InputError(
            "speed_law", "speeds", f"{speed.min():.3g} to {speed.max():.3g} m/s", "a range of 1.2 or more"
        )
    spacing = np.array([impact.spacing_s for impact in impacts])
    weight = 1.0 / np.array([impact.error_s for impact in impacts])
    columns = np.column_stack([np.ones(speed.size), 1.0 / speed]) * weight[:, None]
    (delay, way), *_ = np.linalg.lstsq(columns, spacing * weight, rcond=None)
    left = spacing * weight - columns @ np.array([delay, way])
    freedom = speed.size - 2
    scale = max(1.0, float(left @ left) / freedom)
    covariance = scale * np.linalg.inv(columns.T @ columns)
    # Where the scatter had to be estimated from the points the interval is Student's.
    reach = float(student.ppf(0.975, freedom)) if scale > 1 else 1.96
    half = reach * np.sqrt(np.diag(covariance))
    no_delay, no_way = abs(delay) <= half[0], abs(way) <= half[1]
    verdict = "way" if no_delay and not no_way else "time" if no_way and not no_delay else "neither"
    return SpeedLaw(
        float(way),
        (float(way - half[1]), float(way + half[1])),
        float(delay),
        (float(delay - half[0]), float(delay + half[0])),
        verdict,
    )
