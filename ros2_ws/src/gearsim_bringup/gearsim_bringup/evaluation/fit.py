"""Weights of the confidence and of the discriminants, fitted to results of one seed.

Logistic regression with a ridge (a Gaussian prior on standardised weights), so that faults whose findings
were all right do not get infinite weights; one wrong finding with the mean numbers is added to each model, as
a few dozen cases cannot tell 97 from 100 %. Faults that are found by the same evidence share a model, and a
number that means more evidence cannot lower the confidence.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

import gearsim_dsp.judges
from gearsim_bringup.evaluation.fit_side import fit_side
from gearsim_bringup.evaluation.score import is_right, judged
from gearsim_dsp.judges.tooth_kind import KIND_FEATURES

__all__ = ["fit_all", "logistic_weights"]

Array = NDArray[np.float64]
Result = dict[str, Any]
_PRIOR = 1.0
_LEAST_FINDINGS = 15
_GROUPS = (
    ("outer_race", "inner_race", "rolling_element", "cage"),
    ("gear_tooth_crack", "gear_tooth_spall"),
    ("planet_tooth_crack", "planet_tooth_spall"),
    ("gear_wear",),
    ("gear_eccentricity",),
    ("unbalance", "misalignment", "looseness"),
)
_EITHER_WAY = ("spread", "pair", "share_of_harmonics")
_FOLDER = Path(gearsim_dsp.judges.__file__).parent


def fit_all(results: Sequence[Result], source: str, folder: Path = _FOLDER) -> list[str]:
    """Write the fitted weights into the judges' files.

    Parameters
    ----------
    results : sequence of dict
        Of the calibration set.
    source : str
        How they were made, for the files.
    folder : Path
        Where `confidence.json`, `tooth_kind.json` and `planet_side.json` lie.

    Returns
    -------
    list of str
        What was fitted, line by line.
    """
    fine = judged(results)
    said = []
    kinds = [
        (f["evidence"]["kind_features"], t["fault"] == "gear_tooth_spall")
        for one in fine
        for f in one["findings"]
        if "kind_features" in f["evidence"]
        for t in one["truths"]
        if t["fault"] in ("gear_tooth_spall", "gear_tooth_crack")
    ]
    said.append(_discriminant(kinds, folder / "tooth_kind.json", source, list(KIND_FEATURES)))
    said.append(fit_side(fine, folder / "planet_side.json", source))
    said.append(_confidence(fine, folder / "confidence.json", source))
    return said


def logistic_weights(
    features: Array, right: NDArray[np.bool_], rising: Sequence[bool] = ()
) -> tuple[float, Array]:
    """Offset and weights of the most probable logistic model under the prior.

    Parameters
    ----------
    features : ndarray, shape (cases, numbers)
    right : ndarray of bool, shape (cases,)
    rising : sequence of bool, optional
        Numbers whose weight may not be negative.
    """
    mean, scale = features.mean(axis=0), np.maximum(features.std(axis=0), 1e-6)
    x = (features - mean) / scale
    sign = np.where(right, 1.0, -1.0)

    def loss(weights: Array) -> tuple[float, Array]:
        margin = sign * (weights[0] + x @ weights[1:])
        pull = -sign / (1.0 + np.exp(np.clip(margin, -60, 60)))
        gradient = np.concatenate(([pull.sum()], x.T @ pull + weights[1:] / _PRIOR**2))
        value = np.logaddexp(0.0, -margin).sum() + 0.5 * np.sum((weights[1:] / _PRIOR) ** 2)
        return float(value), gradient

    bounds = [(None, None), *((0.0 if up else None, None) for up in rising or [False] * x.shape[1])]
    best = minimize(loss, np.zeros(x.shape[1] + 1), jac=True, method="L-BFGS-B", bounds=bounds).x
    weights = best[1:] / scale
    return float(best[0] - weights @ mean), np.asarray(weights)


def _discriminant(cases: list[tuple[list[float], bool]], file: Path, source: str, names: list[str]) -> str:
    if len(cases) < 2 * _LEAST_FINDINGS or len({label for _, label in cases}) < 2:
        return f"{file.stem}: {len(cases)} cases are too few, left as it is"
    features = np.array([numbers for numbers, _ in cases], dtype=np.float64)
    labels = np.array([label for _, label in cases])
    offset, weights = logistic_weights(features, labels)
    share = float(np.mean((offset + features @ weights > 0) == labels))
    content = {"source": source, "offset": offset, "weights": [float(w) for w in weights]}
    if names:
        content["features"] = names
    file.write_text(json.dumps(content, indent=2) + "\n")
    return f"{file.stem}: {len(cases)} cases, {100 * share:.1f} % of them told apart"


def _confidence(results: Sequence[Result], file: Path, source: str) -> str:
    findings = [
        (f["fault"], f["evidence"].get("features", {}), is_right(f, one))
        for one in results
        for f in (*one["findings"], *one.get("doubtful", ()))
    ]
    models: dict[str, dict[str, float]] = {}
    right = sum(ok for _, _, ok in findings)
    # Faults with too few findings share what holds for all together, less one right one in each hundred.
    share = (right + 1) / (len(findings) + 3)
    models["other"] = {"offset": float(np.log(share / (1 - share)))}
    for group in _GROUPS:
        own = [(numbers, ok) for word, numbers, ok in findings if word in group]
        if len(own) < _LEAST_FINDINGS:
            continue
        names = sorted({name for numbers, _ in own for name in numbers})
        x = np.array([[float(numbers.get(name, 0.0)) for name in names] for numbers, _ in own])
        x = np.vstack([x, x.mean(axis=0)])
        ok = np.array([*(label for _, label in own), False])
        offset, weights = logistic_weights(x, ok, [name not in _EITHER_WAY for name in names])
        model = {"offset": offset, **{n: float(w) for n, w in zip(names, weights, strict=True)}}
        models.update(dict.fromkeys(group, model))
    file.write_text(json.dumps({"source": source, "models": models}, indent=2) + "\n")
    return f"confidence: {len(findings)} findings, {right} right, models for {', '.join(models)}"
