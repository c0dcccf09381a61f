"""The present weights applied to stored results, so that a fit needs no second simulation.

Confidence, crack against spall, and the side of a planet's spall are functions of numbers that stand in each
finding's evidence; with other weights they can be worked out anew from these, exactly as a diagnosis would.
"""

from __future__ import annotations

import copy
import math
from typing import Any

from gearsim_dsp.diagnose import LEAST_CONFIDENCE
from gearsim_dsp.judges.confidence import confidence
from gearsim_dsp.judges.planet_side import side_words
from gearsim_dsp.judges.tooth_kind import kind_of

__all__ = ["rejudged"]

Result = dict[str, Any]


def rejudged(result: Result) -> Result:
    """A copy of a result with the confidence, tooth fault and side that the present weights give."""
    if "refused" in result:
        return result
    fresh = copy.deepcopy(result)
    said = [*fresh["findings"], *fresh.pop("doubtful", ())]
    for finding in said:
        evidence = finding["evidence"]
        features = evidence.get("features", {})
        if "kind_features" in evidence:
            kind = kind_of(tuple(evidence["kind_features"]))
            finding["fault"] = kind.fault
            features["kind"] = math.log(kind.probability / max(1.0 - kind.probability, 1e-3))
        if "side_variances" in evidence:
            evidence.update(side_words(evidence["side_features"], evidence["side_variances"]))
        finding["confidence"] = confidence(finding["fault"], features)
    sure = [one for one in said if one["confidence"] >= LEAST_CONFIDENCE or one["fault"] == "crashed"]
    fresh["findings"] = sorted(sure, key=lambda one: -one["confidence"])
    return fresh
