"""Records that differ by chance alone: differences are as large as the standard deviations say."""

from functools import cache

import numpy as np
import pytest
from compare_signals import BPFO_SEEDS, features_of_replicates
from scipy import stats

from gearsim_twin.compare.discrepancy import NU, compare, significant
from gearsim_twin.compare.lines import LEAST_STD_DB
from gearsim_twin.compare.nuisances import apply, fit_nuisance
from gearsim_twin.compare.places import DOMAINS
from gearsim_twin.score import score_models

NO_TAU = dict.fromkeys(DOMAINS, 0.0)


@cache
def pairs(kind: str):
    found = features_of_replicates(kind, BPFO_SEEDS)
    return list(zip(found[:-1:2], found[1::2], strict=True))


def z_of(kind: str, domain: str, fitted: bool = False) -> np.ndarray:
    values = []
    for one, other in pairs(kind):
        shown = apply(fit_nuisance(one, other), other) if fitted else other
        comparison = compare(one, shown, NO_TAU)
        rows = comparison.counted & np.array([p.domain == domain for p in comparison.places])
        rows &= one.std_db > 1.5 * LEAST_STD_DB  # where chance is more than rounding
        values.append(comparison.z[rows])
    return np.concatenate(values)


@pytest.mark.parametrize("domain", DOMAINS)
def test_z_has_unit_deviation_and_tails_no_worse_than_students(domain):
    each = [z_of(kind, domain) for kind in ("sound", "outer", "inner")]
    z = np.concatenate(each)
    # The deviation of n values is itself known to 1 / sqrt(2 n); places share windows, so n / 2 count.
    assert z.size >= 15
    doubt = 1.0 / np.sqrt(z.size)
    assert 0.8 - doubt < z.std() < 1.25 + doubt
    for part in each:
        assert part.size < 30 or 0.8 - 2.5 / np.sqrt(part.size) < part.std() < 1.25 + 2.5 / np.sqrt(part.size)
    beyond = np.mean(np.abs(z) > stats.t.isf(0.005, NU))
    assert beyond <= 0.01 + 3 * np.sqrt(0.01 / z.size)


@pytest.mark.parametrize("kind", ["sound", "outer"])
def test_nothing_is_discovered_between_replicates(kind):
    """At most one in twenty places told may be chance, so at most one in twenty pairs may tell any."""
    told = [
        significant(compare(one, apply(fit_nuisance(one, other), other), NO_TAU), 0.05).sum()
        for one, other in pairs(kind)
    ]
    assert np.count_nonzero(told) <= 1


def test_a_replicate_scores_the_noise_floor():
    ratios = []
    for one, other in pairs("outer"):
        overall = score_models([one], {"replicate": [other]}).overall
        ratios.append(overall.models["replicate"].value / overall.noise_floor)
    assert 0.8 < np.sqrt(np.mean(np.square(ratios))) < 1.25
