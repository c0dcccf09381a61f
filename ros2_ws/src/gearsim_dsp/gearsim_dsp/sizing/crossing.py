"""The way of a rolling element across a spall, as the force between the rings feels it.

An element of radius r that rolls over the sharp edge of a spall in a race of radius R tips about the edge. At
the distance b past the edge its centre is

    drop(b) = b^2 / (2 R_x),      1 / R_x = 1 / r + 1 / R (inner), 1 / r - 1 / R (outer race)

lower, until the far edge takes over half-way. Under the compression delta of its Hertz contacts it carried
F_0 = k delta^(3/2); on the way it carries

    F / F_0 = (1 - b^2 / s^2)^(3/2), nothing beyond b = s,      s = sqrt(2 R_x delta).

So a spall wider than 2 s says two things that have the same shape mirrored: the load leaves until b = s
(entry), and comes back from width - s on (impact). One narrower than 2 s never empties the contact: there the
force has a kink half-way, width / 2 behind the entry (Sawalhi and Randall, Mech. Syst. Signal Process. 25
(2011) 846-870, find that delay measured). With a floor in the spall, s is where the element touches it, and
the two events are the same.

The release distance s hangs on the load, which no nameplate tells. It is about twice the half-length a of the
contact patch, since delta is a^2 / R_x at either race; and a / R_x = pi p / (2 E*) for a pressure p in the
middle of the patch (Johnson, Contact Mechanics, ch. 4; E* = 113 GPa for steel on steel). Bearings run at 1 to
3 GPa and take permanent dents from 4.2 GPa (ISO 76), so s / r is between 0.02 and 0.12.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_io.nameplate import Bearing

__all__ = ["RELEASE_LOG_SD", "RELEASE_SHARE", "RacePass", "force_change"]

_STEEL_PA = 113e9
_PRESSURE_PA = 1.9e9  # geometric middle of the 1 to 3 GPa above, a little up: diagnosed rigs run loaded
RELEASE_SHARE = 2 * math.pi * _PRESSURE_PA / (2 * _STEEL_PA)
"""Release distance over the element's radius that is to be expected."""
RELEASE_LOG_SD = 0.45
"""Standard deviation of its logarithm: 1 to 3 GPa are within 1.2 of them, 4.2 GPa within 1.8."""


@dataclass(frozen=True, slots=True)
class RacePass:
    """How elements pass a defect of a race.

    Parameters
    ----------
    race_radius_m, element_radius_m : float
    elements : int
        Of one row.
    passes_hz : float
        Elements that pass a point of the race each second: BPFO or BPFI as found.
    """

    race_radius_m: float
    element_radius_m: float
    elements: int
    passes_hz: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.passes_hz) and self.passes_hz > 0):
            raise InputError("RacePass", "passes_hz", self.passes_hz, "a finite frequency above 0 Hz")

    @property
    def speed_m_s(self) -> float:
        """Speed of the contact along the race."""
        return self.spacing_m * self.passes_hz

    @property
    def spacing_m(self) -> float:
        """Distance of neighbouring elements along the race."""
        return 2 * math.pi * self.race_radius_m / self.elements

    @property
    def release_m(self) -> float:
        """Release distance to be expected, see the module's text."""
        return RELEASE_SHARE * self.element_radius_m

    def arc_rad(self, width_m: float) -> float:
        """Angle of the race that a width takes."""
        return width_m / self.race_radius_m

    @classmethod
    def of(cls, bearing: Bearing, fault: str, passes_hz: float) -> RacePass:
        """The pass over a defect of a bearing's race.

        Parameters
        ----------
        bearing : Bearing
            Geometry in metres and radians.
        fault : str
            "outer_race" or "inner_race".
        passes_hz : float

        Raises
        ------
        InputError
            For another fault, or a frequency that is none.
        """
        if fault not in ("outer_race", "inner_race"):
            raise InputError(f"bearing {bearing.name!r}", "fault", fault, "one of outer_race, inner_race")
        along = bearing.element_diameter_m * math.cos(bearing.contact_angle_rad)
        diameter = bearing.pitch_diameter_m + (along if fault == "outer_race" else -along)
        return cls(
            0.5 * diameter, 0.5 * bearing.element_diameter_m, bearing.rolling_elements, float(passes_hz)
        )


def force_change(place: NDArray[np.float64], width: float, release: float) -> NDArray[np.float64]:
    """Force of the element less its force beside the spall, over the latter: 0 to -1.

    Parameters
    ----------
    place : ndarray of float64, any shape
        Distance of the contact behind the entry edge; any unit, the same for all three.
    width, release : float
    """
    past = np.maximum(np.minimum(place, width - place), 0.0)
    rest = np.maximum(1.0 - (past / release) ** 2, 0.0)
    return np.asarray(rest * np.sqrt(rest) - 1.0)
