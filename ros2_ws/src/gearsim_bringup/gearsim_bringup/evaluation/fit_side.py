"""The model by which sun and ring side of a planet's spall are told apart, fitted to simulated stages.

Two Gaussians with one covariance, seen through noise whose variance is known for each number of each case:
expectation and maximisation (Dempster, Laird and Rubin, J. R. Stat. Soc. B 39 (1977) 1-38), as for Gaussian
data with missing entries. A prior worth a few cases keeps the covariance regular and the means apart no
further than so few cases can tell.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from gearsim_dsp.judges.planet_side import UNKNOWN_VARIANCE, log_likelihood_ratio

__all__ = ["fit_side", "gaussians_through_noise"]

Array = NDArray[np.float64]
Model = dict[str, Any]
_ROUNDS = 60
_PRIOR_CASES = 4.0
_PRIOR_VARIANCE = 0.5  # nepers of energy squared: about 3 dB
_MEAN_PRIOR_CASES = 1.0
_PARTS = 5
_LEAST_CASES = 30


def fit_side(results: Sequence[dict[str, Any]], file: Path, source: str) -> str:
    """Write the model for the spalls among the results; says what was fitted."""
    cases = [
        (f["evidence"]["side_features"], f["evidence"]["side_variances"], t["side"] == "sun")
        for one in results
        for f in one["findings"]
        if "side_variances" in f["evidence"]
        for t in one["truths"]
        if t["fault"] == "planet_tooth_spall" and f["fault"] == t["fault"]
    ]
    labels = np.array([label for _, _, label in cases], dtype=np.bool_)
    if len(cases) < _LEAST_CASES or min(labels.sum(), (~labels).sum()) < _LEAST_CASES / 3:
        return f"{file.stem}: {len(cases)} cases are too few, left as it is"
    values = np.array([numbers for numbers, _, _ in cases], dtype=np.float64)
    variances = np.array([noise for _, noise, _ in cases], dtype=np.float64)
    left_out = _left_out(values, variances, labels)
    model = gaussians_through_noise(values, variances, labels)
    # A wrong case that was not met may be met next: no more can be claimed than so many cases back.
    most = math.log(len(cases) + 1.0)
    model |= {"factor": _factor(np.clip(left_out, -most, most), labels), "most": most}
    rounded = {
        key: np.round(value, 4).tolist() if not isinstance(value, float) else value
        for key, value in model.items()
    }
    file.write_text(json.dumps({"source": source, **rounded}) + "\n")
    share = float(np.mean((left_out > 0) == labels))
    return f"{file.stem}: {len(cases)} cases, {100 * share:.1f} % told apart when left out of the fit"


def gaussians_through_noise(values: Array, variances: Array, sun: NDArray[np.bool_]) -> Model:
    """Means of both sides and their common covariance.

    Parameters
    ----------
    values, variances : ndarray, shape (cases, numbers)
        Measured numbers and the variances of their noise; `UNKNOWN_VARIANCE` and above: not measured.
    sun : ndarray of bool, shape (cases,)
    """
    count = values.shape[1]
    noise = np.minimum(variances, UNKNOWN_VARIANCE)
    known = variances < UNKNOWN_VARIANCE
    middle = np.where(known, values, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    means = [middle, middle]
    covariance = np.eye(count) * (1.0 + _PRIOR_VARIANCE)
    prior = _PRIOR_CASES * _PRIOR_VARIANCE * np.eye(count)
    for _ in range(_ROUNDS):
        own = np.where(sun[:, None], means[0], means[1])
        gain = covariance @ np.linalg.inv(covariance + noise[:, :, None] * np.eye(count))
        expected = own + np.einsum("kij,kj->ki", gain, values - own)
        left = len(values) * covariance - gain.sum(axis=0) @ covariance
        means = [
            (side.sum(axis=0) + _MEAN_PRIOR_CASES * middle) / (len(side) + _MEAN_PRIOR_CASES)
            for side in (expected[sun], expected[~sun])
        ]
        off = expected - np.where(sun[:, None], means[0], means[1])
        covariance = (off.T @ off + left + prior) / (len(values) + _PRIOR_CASES)
    return {"mean_sun": means[0], "mean_ring": means[1], "covariance": covariance}


def _left_out(values: Array, variances: Array, sun: NDArray[np.bool_]) -> Array:
    """Logarithm of the likelihood ratio of each case by models fitted without it."""
    part = np.arange(sun.size) % _PARTS
    found = np.zeros(sun.size)
    for k in range(_PARTS):
        model = gaussians_through_noise(values[part != k], variances[part != k], sun[part != k])
        for row in np.flatnonzero(part == k):
            found[row] = log_likelihood_ratio(model, values[row], variances[row])
    return found


def _factor(ratios: Array, sun: NDArray[np.bool_]) -> float:
    """By which the ratios give the most probable logistic model; one case told most wrongly is added."""
    margin = np.where(sun, ratios, -ratios)
    margin = np.append(margin, -np.abs(ratios).max())
    loss = minimize_scalar(
        lambda factor: float(np.logaddexp(0.0, -factor * margin).sum()), bounds=(0.0, 1.0), method="bounded"
    )
    return float(loss.x)
