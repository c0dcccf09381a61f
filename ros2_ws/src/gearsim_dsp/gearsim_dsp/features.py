"""Scalar condition indicators of a signal. All are of the signal without its mean."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError

__all__ = [
    "clearance_factor",
    "crest_factor",
    "impulse_factor",
    "is_signal",
    "kurtosis",
    "peak",
    "rms",
    "shape_factor",
    "skewness",
]

Samples = NDArray[np.float32] | NDArray[np.float64]


def is_signal(samples: Samples) -> bool:
    """True for finite values that are not all the same: what indicators and judges can be asked about."""
    return bool(np.all(np.isfinite(samples))) and float(np.ptp(samples)) > 0.0


def rms(samples: Samples) -> float:
    """Root mean square, in the signal's unit."""
    return math.sqrt(float(np.mean(_centred(samples) ** 2)))


def kurtosis(samples: Samples) -> float:
    """Fourth moment over the squared second: 3 for Gaussian noise, 1.5 for a sine; NaN for a constant."""
    square = _centred(samples) ** 2
    second = float(np.mean(square))
    return float(np.mean(square**2)) / second**2 if second > 0 else float("nan")


def crest_factor(samples: Samples) -> float:
    """Largest magnitude over the RMS: the square root of 2 for a sine; NaN for a constant."""
    x = _centred(samples)
    effective = math.sqrt(float(np.mean(x**2)))
    return float(np.max(np.abs(x))) / effective if effective > 0 else float("nan")


def peak(samples: Samples) -> float:
    """Largest magnitude, in the signal's unit."""
    return float(np.max(np.abs(_centred(samples))))


def skewness(samples: Samples) -> float:
    """Third moment over the second to the power 3/2: 0 for anything symmetrical; NaN for a constant."""
    x = _centred(samples)
    second = float(np.mean(x**2))
    return float(np.mean(x**3)) / second**1.5 if second > 0 else float("nan")


def shape_factor(samples: Samples) -> float:
    """RMS over the mean magnitude: pi / sqrt(8) for a sine, sqrt(pi / 2) for Gaussian noise."""
    x = _centred(samples)
    return _ratio(math.sqrt(float(np.mean(x**2))), float(np.mean(np.abs(x))))


def impulse_factor(samples: Samples) -> float:
    """Largest magnitude over the mean magnitude: pi / 2 for a sine; NaN for a constant."""
    magnitude = np.abs(_centred(samples))
    return _ratio(float(np.max(magnitude)), float(np.mean(magnitude)))


def clearance_factor(samples: Samples) -> float:
    """Largest magnitude over the square of the mean root of the magnitudes; NaN for a constant.

    It answers to spalls early and falls again as they spread.
    """
    magnitude = np.abs(_centred(samples))
    return _ratio(float(np.max(magnitude)), float(np.mean(np.sqrt(magnitude))) ** 2)


def _ratio(value: float, over: float) -> float:
    return value / over if over > 0 else float("nan")


def _centred(samples: Samples) -> NDArray[np.float64]:
    x = np.asarray(samples, dtype=np.float64)
    if x.ndim != 1 or x.size == 0:
        raise InputError("features", "samples", f"shape {x.shape}", "a vector of samples")
    return np.asarray(x - np.mean(x))
