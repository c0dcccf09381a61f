"""Confidence of findings: a logistic model of their numbers, fitted to results, reproducible from them."""

import json

import numpy as np
import pytest

from gearsim_bringup.evaluation.fit import fit_all, logistic_weights
from gearsim_dsp.judges.confidence import LEAST, MOST, confidence
from gearsim_dsp.judges.finding import FAULT_WORDS


@pytest.mark.parametrize("fault", FAULT_WORDS)
def test_every_fault_has_a_confidence_between_the_bounds(fault):
    for size in (-50.0, 0.0, 50.0):
        assert LEAST <= confidence(fault, {"modulation": size, "over_rest": size, "level": size}) <= MOST


@pytest.mark.parametrize("fault", ["outer_race", "inner_race"])
def test_the_same_numbers_say_more_over_a_shafts_lines_than_over_a_floor(fault):
    """Of 23 such findings with a mean confidence of 0.84 without that number 22 were right."""
    numbers = {"modulation": 1.81, "dominance": 0.81, "share": 3.0, "improbable": 1.44, "harmonics": 1.75}
    assert confidence(fault, {**numbers, "covered": 1.0}) > confidence(fault, numbers) + 0.1


def test_weights_of_a_known_model_come_back():
    """Logistic data with weights 1.5 and -1: standard errors with 4,000 cases are below 0.07."""
    rng = np.random.default_rng(1)
    x = rng.standard_normal((4000, 2))
    right = rng.random(4000) < 1 / (1 + np.exp(-(0.5 + 1.5 * x[:, 0] - x[:, 1])))
    offset, weights = logistic_weights(x, right)
    assert offset == pytest.approx(0.5, abs=0.2)
    assert weights == pytest.approx([1.5, -1.0], abs=0.2)


def test_a_fit_is_calibrated_on_other_data(tmp_path):
    """Findings that are right with a probability that grows with one number."""

    def results(seed, count):
        rng = np.random.default_rng(seed)
        made = []
        for k in range(count):
            number = rng.uniform(-1, 4)
            right = rng.random() < 1 / (1 + np.exp(-number))
            finding = {
                "component": "a" if right else "b",
                "fault": "outer_race",
                "evidence": {"features": {"modulation": number}},
            }
            truth = {"component": "a", "fault": "outer_race", "side": ""}
            made.append(
                {"name": f"random-{seed}-{k}", "truths": [truth], "twin_wheels": False, "findings": [finding]}
            )
        return made

    fit_all(results(1, 800), "test", tmp_path)
    model = json.loads((tmp_path / "confidence.json").read_text())["models"]["outer_race"]
    fresh = results(2, 2000)
    numbers = np.array([one["findings"][0]["evidence"]["features"]["modulation"] for one in fresh])
    told = 1 / (1 + np.exp(-(model["offset"] + model["modulation"] * numbers)))
    right = np.array([one["findings"][0]["component"] == "a" for one in fresh])
    for low, high in ((0.4, 0.6), (0.6, 0.8), (0.8, 0.95)):
        inside = (told >= low) & (told < high)
        # Three standard deviations of the share, and 5 % for the error of the fit.
        allowed = 3 * np.sqrt(0.25 / inside.sum()) + 0.05
        assert right[inside].mean() == pytest.approx(told[inside].mean(), abs=allowed)
