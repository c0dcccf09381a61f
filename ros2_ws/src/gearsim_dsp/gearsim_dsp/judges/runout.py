"""Run-out of gear wheels from the transmission error between two encoders."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from gearsim_dsp.judges.measured import Measured
from gearsim_dsp.judges.tooth_errors import encoder_phases
from gearsim_io.nameplate import GearMesh

__all__ = ["WheelRunout", "wheel_runout"]

_LEAST_TURNS = 4
_PARTED = 2.0  # lines: half the width of a Hann line at its foot
_PER_TURN = 256


@dataclass(frozen=True, slots=True)
class WheelRunout:
    """Transmission error once in the turn of one wheel.

    Parameters
    ----------
    shaft : str
    side : str
        "pinion" or "gear"; empty where both wheels turn at one speed, or so nearly that the record does not
        part their turns.
    share_of_pitch : float
        Amplitude along the pitch circle over the tooth pitch.
    over_floor : float
        Amplitude over that of the neighbouring lines.
    """

    shaft: str
    side: str
    share_of_pitch: float
    over_floor: float


def wheel_runout(measured: Measured, mesh: GearMesh) -> WheelRunout | None:
    """The larger run-out of the two wheels of a mesh; None without encoders on both of its shafts.

    The error is taken in teeth: turns of the driving shaft times its teeth less turns of the driven one times
    its teeth. A wheel e off its axis, with pitch radius r, lets it swing by e / (2 pi r) turns, or e / (pi m)
    pitches with the module m.
    """
    phases = encoder_phases(measured, mesh)
    if phases is None:
        return None
    driving, driven = phases
    low = max(driving.samples[0], driven.samples[0])
    high = min(driving.samples[-1], driven.samples[-1])
    wheels = (
        (mesh.driving_shaft, driving, mesh.driving_teeth),
        (mesh.driven_shaft, driven, mesh.driven_teeth),
    )
    found = []
    for shaft, own, teeth in wheels:
        first, last = np.interp([low, high], own.samples, own.turns)
        turns = math.floor(last - first)
        if turns < _LEAST_TURNS:
            return None
        grid = first + np.arange(turns * _PER_TURN) / _PER_TURN
        at = np.clip(CubicSpline(own.turns, own.samples)(grid), low, high)
        error = CubicSpline(driving.samples, driving.turns)(at) * mesh.driving_teeth
        error = error - CubicSpline(driven.samples, driven.turns)(at) * mesh.driven_teeth
        lines = np.abs(np.fft.rfft((error - error.mean()) * np.hanning(error.size))) * 4 / error.size
        around = np.concatenate([lines[turns // 3 : turns - 2], lines[turns + 3 : 2 * turns - 2]])
        floor = float(np.median(around)) if around.size else 1e-12
        found.append((float(lines[turns - 1 : turns + 2].max()), shaft, teeth, floor))
    twins = abs(mesh.driving_teeth / mesh.driven_teeth - 1.0) * turns < _PARTED
    share, shaft, teeth, floor = max(found)
    small = min(mesh.driving_teeth, mesh.driven_teeth)
    side = "" if twins else "pinion" if teeth == small else "gear"
    return WheelRunout(shaft, side, share, share / max(floor, 1e-12))
