"""Confidence: the probability that a finding is right, from how far its evidence lies beyond the limits.

For each fault a logistic model of a few numbers,

    confidence = 1 / (1 + exp(-(w_0 + sum_i w_i f_i))),

fitted to random simulated cases of one seed and checked on those of another (`./gearsim evaluate --fit`,
docs/evaluation.md). The numbers go along as `features` in the finding's evidence.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from functools import cache
from importlib.resources import files

__all__ = ["LEAST", "MOST", "confidence"]

LEAST, MOST = 0.05, 0.99
_STEEPEST = 60.0


def confidence(fault: str, features: Mapping[str, float]) -> float:
    """Probability that a finding of this fault with these numbers is right.

    Parameters
    ----------
    fault : str
    features : mapping
        Numbers of the fault's model; one that the model lists and that is missing counts as 0.

    Returns
    -------
    float
        Between 0.05 and 0.99: what a few hundred cases can tell.
    """
    models = _models()
    weights = models.get(fault, models["other"])
    total = weights["offset"] + sum(
        weight * float(features.get(name, 0.0)) for name, weight in weights.items() if name != "offset"
    )
    value = 1.0 / (1.0 + math.exp(-max(min(total, _STEEPEST), -_STEEPEST)))
    return min(MOST, max(LEAST, value))


@cache
def _models() -> Mapping[str, Mapping[str, float]]:
    """Weights by fault word, from the file that the fit writes."""
    text = files("gearsim_dsp.judges").joinpath("confidence.json").read_text()
    models: Mapping[str, Mapping[str, float]] = json.loads(text)["models"]
    return models
