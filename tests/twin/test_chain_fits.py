"""Many robust least squares at once end where scipy's solver ends, one by one."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import least_squares

from gearsim_twin.compare.chain_fits import KNOTS, ChainData, residuals, solve, stacked

ROWS = 40


def problem(seed: int, rows: int = ROWS) -> tuple[ChainData, np.ndarray]:
    """Levels of a model behind a gain, a sloping floor and a corner, a tenth of them far off."""
    rng = np.random.default_rng(seed)
    hz = np.geomspace(100.0, 1e4, rows)
    knots = np.geomspace(100.0, 1e4, KNOTS)
    weights = np.stack([np.interp(np.log(hz), np.log(knots), row) for row in np.eye(KNOTS)], axis=1)
    ratio4 = (hz / hz.max()) ** 4
    simulated = 10 ** (0.1 * rng.uniform(-20.0, 20.0, rows))
    truth = np.concatenate([[rng.uniform(-6, 6)], np.linspace(-10, -25, KNOTS), [math.log(0.6)]])
    model = 10 ** (0.1 * truth[0]) / (1 + ratio4 * math.exp(-4 * truth[-1])) * simulated
    level = 10 * np.log10(model + 10 ** (0.1 * (weights @ truth[1:-1]))) + 0.3 * rng.standard_normal(rows)
    level[:: rows // 4] += 15.0
    belief = np.eye(KNOTS + 2) / np.array([10.0, *[20.0] * KNOTS, 2.0])
    believed = belief @ np.array([0.0, *[-20.0] * KNOTS, math.log(4.0)])
    low = np.array([-60.0, *[-80.0] * KNOTS, math.log(0.05)])
    high = np.array([60.0, *[40.0] * KNOTS, math.log(100.0)])
    arrays = (level, simulated, np.ones(rows), ratio4, np.ones(rows), weights, belief, believed, low, high)
    start = np.array([0.0, *[-20.0] * KNOTS, math.log(0.8)])
    return ChainData(*(array[None] for array in arrays)), start


def cost_of(data: ChainData, x: np.ndarray) -> float:
    residual, _ = residuals(data, x[None])
    return float(2.0 * np.log1p((residual / 2.0) ** 2).sum())


def test_slopes_are_those_of_the_residuals():
    data, start = problem(0)
    _, slopes = residuals(data, start[None])
    for k in range(start.size):
        ahead, behind = start.copy(), start.copy()
        ahead[k] += 1e-5
        behind[k] -= 1e-5
        found = (residuals(data, ahead[None])[0] - residuals(data, behind[None])[0]) / 2e-5
        assert np.allclose(found, slopes[..., k], atol=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_each_ends_as_low_as_alone(seed):
    data, start = problem(seed)
    x, cost = solve(data, start[None])
    alone = least_squares(
        lambda p: residuals(data, p[None])[0][0],
        start,
        bounds=(data.low[0] - 1e-9, data.high[0] + 1e-9),
        loss="cauchy",
        f_scale=2.0,
    )
    assert cost[0] == pytest.approx(cost_of(data, x[0]))
    # Steps end where they gain less than 1e-5 of the cost.
    assert cost[0] <= float(alone.cost) * (1 + 1e-3)


def test_problems_of_other_lengths_do_not_disturb_each_other():
    made = [problem(seed, rows) for seed, rows in ((1, 40), (2, 28), (3, 36))]
    _, costs = solve(stacked([data for data, _ in made]), np.stack([start for _, start in made]))
    for k, (data, start) in enumerate(made):
        _, cost = solve(data, start[None])
        # In company those that are done go on while others are not.
        assert cost[0] * (1 - 1e-3) <= costs[k] <= cost[0] * (1 + 1e-9)


def test_equal_bounds_hold_an_unknown():
    data, start = problem(5)
    data.low[:, 0] = data.high[:, 0] = 0.0
    x, _ = solve(data, start[None])
    assert x[0, 0] == 0.0
