"""Models stated by hand, scored on what was held out: the right one wins, and nothing of it was fitted."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from rig_records import case_of, rig_record

from gearsim_io.errors import InputError
from gearsim_twin.causes import CAUSES
from gearsim_twin.stated import score_stated

SPALL = CAUSES["bearing_spall_outer"]


def spall(width_m: float):
    return [(SPALL, {"component": "test_bearing", "width_m": width_m})]


@pytest.fixture(scope="module")
def scores():
    record = rig_record()
    noise = 0.02 * np.random.default_rng(2).standard_normal(record.data.shape)
    noisy = dataclasses.replace(record, data=(record.data + noise).astype(np.float32))
    models = {"nominal": [], "right": spall(5e-4), "narrow": spall(2e-4)}
    return score_stated(case_of("mfpt", "bearing5", noisy), models, seconds=1.0)


def test_the_model_that_made_the_record_closes_the_gap(scores):
    assert list(scores.overall.models) == ["nominal", "right", "narrow"]
    # As the judge must: four fifths of the gap between error and noise floor.
    assert scores.closed("nominal", "right", "envelope") > 0.8
    errors = {name: one.value for name, one in scores.overall.models.items()}
    assert errors["right"] < errors["narrow"] < errors["nominal"]


def test_no_model_is_no_question():
    with pytest.raises(InputError, match="models: got none"):
        score_stated(case_of("mfpt", "bearing5", rig_record()), {})
