"""Series over a turn: what Fourier transforms and products of waves give is what the sums themselves give."""

from __future__ import annotations

import numpy as np
import pytest

from gearsim_sim.model.periodic import PeriodicSeries
from gearsim_sim.model.tooth.windows import window_nodes, window_series


def _series(count: int) -> PeriodicSeries:
    rng = np.random.default_rng(3)
    orders = np.arange(1, count + 1)
    return PeriodicSeries(0.4, orders, rng.standard_normal(count), rng.standard_normal(count))


@pytest.mark.parametrize("points", [512, 64, 7])
def test_values_on_a_grid_are_those_at_its_angles_also_where_orders_fold(points: int) -> None:
    series = _series(200)
    turns = np.arange(points) / points
    assert series.on_grid(points) == pytest.approx(series.value(turns), abs=1e-10)


def test_a_window_has_the_integrals_of_its_function_with_all_waves() -> None:
    nodes = window_nodes(1.6, 9)
    values = np.cos(np.pi * nodes.phase / 1.6)
    teeth, tooth, harmonics = 11, 4, 9
    series = window_series(nodes, values, teeth, tooth, harmonics)
    turns = (nodes.phase + tooth + 0.5) / teeth
    for k in (1, 31, 32, 33, 64, harmonics * teeth):
        taper = 2 * np.sinc(k / ((harmonics + 1) * teeth))
        wave = taper * np.sum(np.exp(2j * np.pi * k * turns) * nodes.weight * values / teeth)
        assert complex(series.cosine[k - 1], series.sine[k - 1]) == pytest.approx(wave, abs=1e-12)
    assert series.orders.size == harmonics * teeth
