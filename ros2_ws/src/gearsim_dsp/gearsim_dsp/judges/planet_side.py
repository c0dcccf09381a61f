"""Which flank of a planet's tooth is spalled: that to the sun or that to the ring.

A spall pushes where it is: a pit to the sun moves sun and planet first, and what it excites most strongly
lies at other frequencies than for a pit to the ring. So the impulse's energies in five bands on the sensors
at ring, sun and carrier differ. A linear discriminant of their ratios, fitted to simulated stages with
masses and stiffnesses up to 40 % off those of the UNSW insert, tells the sides; it needs all three sensors
and says how sure it is. For stages of quite another size it was not fitted, and the side stays open.
"""

from __future__ import annotations

import json
import math
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import butter, sosfiltfilt

from gearsim_dsp.judges.measured import Measured
from gearsim_io.nameplate import PlanetaryStage

if TYPE_CHECKING:
    from gearsim_dsp.judges.planet import FoldedResidual

__all__ = ["SIDE_BANDS_HZ", "side_of", "spall_side"]

SIDE_BANDS_HZ = ((300.0, 1500.0), (1500.0, 3000.0), (3000.0, 5000.0), (5000.0, 8000.0), (8000.0, 13000.0))
_SENSORS = ("ring", "carrier", "sun")
_LEAST_SHARE = 1e-6


def spall_side(
    measured: Measured, stage: PlanetaryStage, folded: list[FoldedResidual], place: int
) -> dict[str, object]:
    """Side of a spall for the evidence of its finding: `side`, `side_confidence` and `side_features`.

    Parameters
    ----------
    measured : Measured
    stage : PlanetaryStage
    folded : list of FoldedResidual
    place : int
        Bin of the folded residual at which the tooth stands out.
    """
    by_name = {one.channel: one for one in folded}
    if not set(_SENSORS) <= set(by_name) or measured.sample_rate_hz < 2.1 * SIDE_BANDS_HZ[-1][1]:
        return {"side": "not told"}
    assert measured.phase is not None
    levels = [_levels(measured, stage, by_name[name], place) for name in _SENSORS]
    ring, carrier, sun = (np.log10(level) for level in levels)
    features = [*(ring - sun), *(carrier - sun)]
    rounded = [round(float(value), 4) for value in features]
    side, sure = side_of(rounded)
    return {"side": side, "side_confidence": sure, "side_features": rounded}


def side_of(features: list[float]) -> tuple[str, float]:
    """Side and its probability from the ten logarithms of energy ratios."""
    model = _model()
    total = model["offset"] + float(np.dot(model["weights"], features))
    probability = 1.0 / (1.0 + math.exp(-max(min(total, 60.0), -60.0)))
    return ("sun" if probability >= 0.5 else "ring"), max(probability, 1.0 - probability)


def _levels(
    measured: Measured, stage: PlanetaryStage, folded: FoldedResidual, place: int
) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Energy of the impulse over the floor in each band."""
    turns_per = folded.energy.shape[0]
    bins = folded.energy.shape[1]
    phase = measured.phase
    assert phase is not None
    scale = abs(stage.member_ratios()["planet"])
    turns = np.interp(np.arange(folded.residual.size), phase.samples, phase.turns * scale)
    first = math.ceil(turns[folded.length])
    begin, end = np.searchsorted(turns, [first, first + turns_per])
    index = ((turns[begin:end] - first) * bins).astype(np.intp) % bins
    count = np.maximum(np.bincount(index, minlength=bins), 1)
    found = []
    for band in SIDE_BANDS_HZ:
        sos = butter(3, band, "bandpass", fs=measured.sample_rate_hz, output="sos")
        part = sosfiltfilt(sos, folded.residual)[begin:end]
        profile = uniform_filter1d(
            np.bincount(index, part**2, bins) / count, bins // stage.planet_teeth, mode="wrap"
        )
        floor = float(np.median(profile))
        found.append(max(float(profile[place]) - floor, _LEAST_SHARE * floor, 1e-30))
    return np.array(found)


@cache
def _model() -> dict[str, Any]:
    text = files("gearsim_dsp.judges").joinpath("planet_side.json").read_text()
    model: dict[str, Any] = json.loads(text)
    return model
