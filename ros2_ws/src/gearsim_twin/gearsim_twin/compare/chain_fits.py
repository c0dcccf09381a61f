"""Many small robust least squares at once: the measuring chains of all channels, from several starts each.

Every problem has the same seven unknowns (a gain, five knots of a floor, a corner), so that one step of
Levenberg and Marquardt for all of them is a handful of array operations.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

__all__ = ["KNOTS", "ChainData", "residuals", "solve", "stacked"]

Array = NDArray[np.float64]

KNOTS = 5
_ROUNDS = 40
_CAUCHY = 2.0
_FIRST, _EASIER, _HARDER, _GIVEN_UP = 1e-2, 0.2, 5.0, 1e5
_SAME = 1e-5
_LN10 = math.log(10.0)


@dataclass(frozen=True, slots=True, eq=False)
class ChainData:
    """What chains are fitted to; leading axis P of problems, N levels (weight 0 beyond a channel's own).

    Attributes
    ----------
    measured_db, simulated, weight : ndarray, shape (P, N)
        Levels, power of the model, and one over the standard deviation.
    ratio4 : ndarray, shape (P, N)
        (frequency over the highest one)^4; 0 where no low pass is fitted.
    width : ndarray, shape (P, N)
        Bandwidth that a level takes in.
    knots : ndarray, shape (P, N, KNOTS)
        Weights of the floor's knots at each level.
    belief, believed : ndarray, shapes (P, R, KNOTS + 2) and (P, R)
        Rows of what is known beforehand: belief times unknowns is about `believed`.
    low, high : ndarray, shape (P, KNOTS + 2)
        Bounds; equal ones hold an unknown.
    """

    measured_db: Array
    simulated: Array
    weight: Array
    ratio4: Array
    width: Array
    knots: Array
    belief: Array
    believed: Array
    low: Array
    high: Array


def stacked(parts: list[ChainData]) -> ChainData:
    """Problems one after the other; shorter ones are filled up with levels that weigh nothing."""
    longest = max(part.measured_db.shape[1] for part in parts)

    def joined(name: str) -> Array:
        arrays = [getattr(part, name) for part in parts]
        if name in ("belief", "believed", "low", "high"):
            return np.concatenate(arrays)
        fill = 1.0 if name in ("simulated", "width") else 0.0
        gap = [(0, 0), (0, 0), (0, 0)]
        out = []
        for array in arrays:
            gap[1] = (0, longest - array.shape[1])
            out.append(np.pad(array, gap[: array.ndim], constant_values=fill))
        return np.concatenate(out)

    return ChainData(*(joined(entry.name) for entry in fields(ChainData)))


def residuals(data: ChainData, x: Array) -> tuple[Array, Array]:
    """Weighted residuals (P, N + R) and their slopes (P, N + R, KNOTS + 2) at unknowns of shape (P, ...)."""
    ratio4 = data.ratio4 * np.exp(-4.0 * x[:, -1:])
    model = 10 ** (0.1 * x[:, :1]) / (1.0 + ratio4) * data.simulated
    floor = 10 ** (0.1 * np.einsum("pnk,pk->pn", data.knots, x[:, 1:-1])) * data.width
    both = model + floor
    share = data.weight * model / both
    slopes = np.empty((*data.measured_db.shape, KNOTS + 2))
    slopes[..., 0] = share
    slopes[..., 1:-1] = (data.weight - share)[..., None] * data.knots
    slopes[..., -1] = share * (40.0 / _LN10) * ratio4 / (1.0 + ratio4)
    plain = data.weight * (10.0 / _LN10 * np.log(both) - data.measured_db)
    told = np.einsum("prk,pk->pr", data.belief, x) - data.believed
    return np.concatenate([plain, told], axis=1), np.concatenate([slopes, data.belief], axis=1)


def _cost(residual: Array) -> Array:
    """Cauchy's loss, which forgives what a model lacks at some places."""
    return np.asarray(0.5 * _CAUCHY**2 * np.log1p((residual / _CAUCHY) ** 2).sum(axis=1))


def solve(data: ChainData, start: Array) -> tuple[Array, Array]:
    """The unknowns (P, KNOTS + 2) of least cost near `start`, and the costs (P,)."""
    x = np.clip(start, data.low, data.high)
    damping = np.full(x.shape[0], _FIRST)
    residual, slopes = residuals(data, x)
    cost = _cost(residual)
    eye = np.eye(x.shape[1], dtype=np.bool_)
    for _ in range(_ROUNDS):
        weight = 1.0 / (1.0 + (residual / _CAUCHY) ** 2)
        weighted = slopes * weight[..., None]
        normal = np.matmul(weighted.transpose(0, 2, 1), slopes)
        pull = np.einsum("pnk,pn->pk", weighted, residual)
        held = ((x <= data.low) & (pull > 0)) | ((x >= data.high) & (pull < 0))
        normal = np.where(held[:, :, None] | held[:, None, :], 0.0, normal)
        diagonal = np.where(held, 1.0, np.einsum("pkk->pk", normal) * (1.0 + damping[:, None]) + 1e-9)
        normal = np.where(eye, diagonal[:, :, None], normal)
        step = -np.linalg.solve(normal, np.where(held, 0.0, pull)[..., None])[..., 0]
        new = np.clip(x + step, data.low, data.high)
        found, slopes_there = residuals(data, new)
        cost_there = _cost(found)
        better = cost_there < cost
        done = (better & (cost - cost_there < _SAME * cost)) | (damping > _GIVEN_UP)
        x = np.where(better[:, None], new, x)
        residual = np.where(better[:, None], found, residual)
        slopes = np.where(better[:, None, None], slopes_there, slopes)
        cost = np.where(better, cost_there, cost)
        damping = np.where(better, np.maximum(damping * _EASIER, 1e-7), damping * _HARDER)
        if np.all(done):
            break
    return x, cost
