"""Expected orders: at which multiples of the reference shaft's speed bearings and gears speak."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["FaultFamily"]


@dataclass(frozen=True, slots=True)
class FaultFamily:
    """A family of lines that one fault of one component puts into an envelope spectrum.

    Parameters
    ----------
    component : str
        Bearing or gear, as on the nameplate.
    fault : str
        Fault word of the diagnosis contract, such as "outer_race".
    order : float
        Fundamental, in multiples of the reference shaft's speed.
    sideband_order : float
        Spacing of the sidebands around each harmonic; 0: none expected.
    label : str
        For markers: "BPFO", "BPFI", "BSF", "FTF".
    tolerance : float
        Relative half-width within which the true line may lie (slip and geometry; not the speed's error).
    """

    component: str
    fault: str
    order: float
    sideband_order: float
    label: str
    tolerance: float
