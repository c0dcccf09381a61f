"""Weights over the carrier's turn that tell passing planets apart, and how well they do.

A sensor beside the ring hears a planet with the loudness A(u), u the carrier's turn past the planet's pass.
An average with the weight W holds of a planet that passes d turns later the gain::

    G(d) = <W(u) A(u - d)>, the mean over a turn of the carrier

- McFadden, J. Sound Vib. 144 (1991) 163-168 and J. Vib. Acoust. 116 (1994) 179-187: W is a Hann window two
  teeth wide: what is heard as the planet passes, tooth by tooth. Right where A is narrow; most of the record
  is lost.
- Forrester, US patent 6,298,725 (1998): W is wide and made such that G is nil for the other planets. Here: of
  the cosine series nearest to G = 1 for its own planet and 0 for the others, the one with the least noise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_io.nameplate import PlanetaryStage

__all__ = ["ForresterWeights", "McFaddenWindow", "PassWeights", "forrester_weights", "gains"]

Floats = NDArray[np.float64]

# Angles over which gains are summed: the narrowest window, two of some hundred teeth, holds eighty of them.
_GRID = 4096


@dataclass(frozen=True, slots=True)
class McFaddenWindow:
    """A Hann window around the pass.

    Parameters
    ----------
    ring_teeth : int
    width_teeth : int
        Whole width, 2 or more: neighbouring windows then add up to the same at every angle.
    """

    ring_teeth: int
    width_teeth: int = 2

    def __post_init__(self) -> None:
        if not 2 <= self.width_teeth <= self.ring_teeth:
            expected = f"2 to {self.ring_teeth} teeth"
            raise InputError("McFaddenWindow", "width_teeth", self.width_teeth, expected)

    def __call__(self, turns: Floats) -> Floats:
        """Weight at `turns` of the carrier past the pass; its mean over a turn is 1."""
        teeth = (np.mod(turns + 0.5, 1.0) - 0.5) * self.ring_teeth
        inside = np.abs(teeth) < 0.5 * self.width_teeth
        shape = 1.0 + np.cos(2 * np.pi * teeth / self.width_teeth)
        return np.asarray(np.where(inside, shape, 0.0) * (self.ring_teeth / self.width_teeth))


@dataclass(frozen=True, slots=True)
class ForresterWeights:
    """A cosine series over the carrier's turn: sum over m of harmonics[m] cos(2 pi m u)."""

    harmonics: tuple[float, ...]

    def __call__(self, turns: Floats) -> Floats:
        """Weight at `turns` of the carrier past the pass."""
        return _cosines(self.harmonics, turns)


PassWeights = McFaddenWindow | ForresterWeights


def forrester_weights(stage: PlanetaryStage, loudness: Sequence[float] = (1.0, 1.0)) -> ForresterWeights:
    """Weights that hear one planet and, as far as can be, no other.

    Parameters
    ----------
    stage : PlanetaryStage
    loudness : sequence of float
        A as a cosine series, (a_0, a_1, ...): A(u) = sum a_m cos(2 pi m u) around the pass. The default,
        1 + cos, is what is taken when nothing is known; `pass_harmonics` measures it.

    Notes
    -----
    N planets need N // 2 + 1 harmonics to be told apart fully. Where the loudness has fewer (a rigid ring
    hears a planet's force by its direction, one harmonic and no mean) the nearest to it is found, with what
    is left in `gains`. Harmonics below 3 % of the largest are not used: dividing by them brings noise.
    """
    series = np.asarray(loudness, dtype=np.float64)
    if series.ndim != 1 or series.size < 1 or not np.all(np.isfinite(series)) or not np.any(series):
        raise InputError("forrester_weights", "loudness", loudness, "finite amplitudes that are not all 0")
    places = np.asarray(stage.planet_angles_rad) / (2 * math.pi)
    apart = places - places[0]
    orders = np.arange(series.size)
    # <cos(m u) cos(m (u - d))> = cos(m d) / 2, and 1 for m = 0; the noise of the series likewise.
    power = np.where(orders == 0, 1.0, 0.5)
    used = np.abs(series) >= 0.03 * np.abs(series).max()
    matrix = np.cos(2 * np.pi * np.outer(apart, orders[used])) * (series * np.sqrt(power))[used]
    wanted = np.where(np.arange(apart.size) == 0, 1.0, 0.0)
    # The shortest of the nearest solutions, in units where its length is the noise.
    scaled = np.linalg.lstsq(matrix, wanted, rcond=1e-6)[0]
    weights = np.zeros(series.size)
    weights[used] = scaled / np.sqrt(power[used])
    return ForresterWeights(tuple(float(w) for w in weights))


def gains(weights: PassWeights, stage: PlanetaryStage, loudness: Sequence[float]) -> Floats:
    """How much of planet q is in the average of planet p; float64 of shape (planets, planets)."""
    places = np.asarray(stage.planet_angles_rad) / (2 * math.pi)
    turns = np.arange(_GRID) / _GRID
    weight = weights(turns)
    apart = places[:, None] - places[None, :]
    return np.asarray(
        [[float(np.mean(weight * _cosines(loudness, turns - d))) for d in row] for row in apart]
    )


def _cosines(series: Sequence[float], turns: Floats) -> Floats:
    orders = np.arange(len(series)).reshape((-1,) + (1,) * turns.ndim)
    return np.asarray(np.tensordot(np.asarray(series), np.cos(2 * np.pi * orders * turns), axes=1))
