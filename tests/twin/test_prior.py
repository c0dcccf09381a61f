"""Priors: coordinates that are standard normal beforehand, and bounds that hold."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from gearsim_twin.causes.prior import LogNormal, Normal, Uniform

PRIORS = [Normal(3.0, 2.0, -1.0, 6.0), LogNormal(1e-3, 2.0, 2e-4, 5e-3), Uniform(40.0, 400.0)]


@pytest.mark.parametrize("prior", PRIORS)
def test_coordinate_and_value_are_inverse_within_the_bounds(prior):
    for value in np.linspace(prior.low, prior.high, 23)[1:-1]:
        assert prior.value(prior.coordinate(value)) == pytest.approx(value, rel=1e-9)


@pytest.mark.parametrize("prior", PRIORS)
def test_values_stay_within_the_bounds_at_any_coordinate(prior):
    values = [prior.value(u) for u in np.linspace(-50, 50, 41)]
    assert min(values) >= prior.low
    assert max(values) <= prior.high
    assert np.all(np.diff(values) >= 0)


def test_normal_coordinates_give_the_distribution_that_is_meant():
    u = stats.norm.ppf((np.arange(4000) + 0.5) / 4000)
    log = np.log([LogNormal(2.0, 3.0).value(x) for x in u])
    assert np.mean(log) == pytest.approx(math.log(2.0), abs=0.01)
    assert np.std(log) == pytest.approx(math.log(3.0), rel=0.01)
    flat = [Uniform(-1.0, 3.0).value(x) for x in u]
    assert stats.kstest(flat, stats.uniform(-1.0, 4.0).cdf).pvalue > 0.5
