"""A gear wheel as faults know it: its teeth, its angle, and the mesh that it is in."""

from __future__ import annotations

from dataclasses import dataclass, replace

from gearsim_sim.model.periodic import PeriodicSeries
from gearsim_sim.model.tooth.gear import SpurGear
from gearsim_sim.model.tooth.pair import GearPair
from gearsim_sim.model.tooth.windows import shifted

# A spall of a quarter of a pitch needs three times the lines of the mesh to be right within some 3 % rms.
_SHARPER = 3


@dataclass(frozen=True)
class GearWheel:
    """One wheel in one mesh.

    Parameters
    ----------
    name : str
        Component, such as `gears.pinion`.
    mesh : int
        Index of the mesh in the plant.
    track : int
        Angle over whose turn the wheel's faults are periodic; it grows as the wheel turns in the mesh.
    pair : GearPair
        Teeth of both wheels.
    of_wheel : bool
        It is the wheel of the pair (else its pinion).
    start_turns : float
        Angle of the track at which tooth 0 is half a pitch before the middle of its contact (after it if
        `sense` is -1).
    force_per_load_n_per_nm : float
        Mean force of the mesh over the load torque.
    harmonics : int
        Lines of the tooth mesh that functions of all its teeth keep.
    sense : int
        +1 if contact moves from root to tip of the pinion's teeth as the track turns, else -1.
    """

    name: str
    mesh: int
    track: int
    pair: GearPair
    of_wheel: bool
    start_turns: float
    force_per_load_n_per_nm: float
    harmonics: int
    sense: int = 1

    @property
    def gear(self) -> SpurGear:
        """Its own teeth."""
        return self.pair.gear(of_wheel=self.of_wheel)

    @property
    def sharp_harmonics(self) -> int:
        """Lines that functions of single flanks keep, which are narrower than a pitch."""
        return _SHARPER * self.harmonics

    @property
    def stream(self) -> int:
        """A number of its own for random errors."""
        return 2 * self.mesh + int(self.of_wheel)

    def placed(self, series: PeriodicSeries) -> PeriodicSeries:
        """A function of the turn since tooth 0 was half a pitch before its contact, over the track.

        The function is that of a pair in which contact moves from root to tip of the pinion's teeth.
        """
        forward = series if self.sense > 0 else replace(series, sine=-series.sine)
        return shifted(forward, self.start_turns) if self.start_turns else forward
