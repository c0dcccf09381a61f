"""Crack or spall: what the event of one tooth looks like in the difference signal.

The flank that rolls over a pit drops and comes back within a fraction of the pitch: a hard, short event. A
cracked tooth yields as long as it carries load, a pitch and more, and gives way gradually on one side. A
linear discriminant of five numbers, fitted to simulated gearboxes with random teeth, masses, springs, speeds
and loads, weighs the differences.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
from scipy import fft as sfft

from gearsim_dsp.judges.gear_signs import ShaftSigns

__all__ = ["KIND_FEATURES", "ToothKind", "kind_of", "tooth_kind"]

KIND_FEATURES = ("peak", "energy", "duration", "pitch", "early")
_HALF_WINDOW_TEETH = 2.5


@dataclass(frozen=True, slots=True)
class ToothKind:
    """The fault word, its probability against the other one, and the numbers that it rests on.

    `features`: logarithm of the event's peak and of its RMS over that of the regular signal; its duration in
    tooth pitches; the centroid of its spectrum in mesh orders, as a logarithm; the share of its energy before
    its peak.
    """

    fault: str
    probability: float
    features: tuple[float, ...]


def tooth_kind(signs: ShaftSigns) -> ToothKind:
    """Which of the two the tooth that stands out has."""
    event = signs.best.difference
    size = event.size
    pitch = size / signs.teeth
    half = round(_HALF_WINDOW_TEETH * pitch)
    middle = round(signs.place * size)
    window = event[(middle + np.arange(-half, half)) % size]
    floor = float(np.median(signs.best.profile))
    energy = np.maximum(window**2 - floor, 0.0)
    total = max(float(energy.sum()), 1e-300)
    at = (np.arange(window.size) - half) / pitch
    centre = float(np.sum(energy * at) / total)
    duration = math.sqrt(float(np.sum(energy * (at - centre) ** 2)) / total)
    spectrum = np.abs(sfft.rfft(window * np.hanning(window.size))) ** 2
    orders = np.arange(spectrum.size) * pitch / window.size
    pitch_order = float(np.sum(spectrum * orders) / max(float(spectrum.sum()), 1e-300))
    top = int(np.argmax(np.abs(window)))
    regular = max(signs.best.regular_rms, 1e-12)
    features = (
        math.log(max(float(np.abs(window).max()), 1e-12) / regular),
        0.5 * math.log(max(float(np.mean(energy)), 1e-24) / regular**2),
        duration,
        math.log(max(pitch_order, 1e-3)),
        float(energy[:top].sum()) / total,
    )
    return kind_of(features)


def kind_of(features: tuple[float, ...]) -> ToothKind:
    """The same from the numbers alone."""
    model = _model()
    total_score = model["offset"] + float(np.dot(model["weights"], features))
    spall = 1.0 / (1.0 + math.exp(-max(min(total_score, 60.0), -60.0)))
    fault = "gear_tooth_spall" if spall >= 0.5 else "gear_tooth_crack"
    return ToothKind(fault, max(spall, 1.0 - spall), features)


@cache
def _model() -> dict[str, Any]:
    model: dict[str, Any] = json.loads(files("gearsim_dsp.judges").joinpath("tooth_kind.json").read_text())
    return model
