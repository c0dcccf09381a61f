"""What chance draws for each machine: how alike differences are, and how a cause beats with it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from gearsim_twin.compare.features import Features
from gearsim_twin.compare.levels import Levels
from gearsim_twin.compare.places import Place
from gearsim_twin.dependence import independent_share
from gearsim_twin.realisations import realisations_of
from gearsim_twin.stack import stack_of

MACHINES, LINES, ALIKE = 10, 60, 4
BANDS = ((100.0, 400.0), (400.0, 1600.0), (1600.0, 6400.0))


def _shown(places: Sequence[Place], level_db: np.ndarray, std_db: float = 0.1) -> Features:
    return Features(tuple(places), Levels.of(np.asarray(level_db, dtype=float), np.full(len(places), std_db)))


def _machines(seed: int, alike: int, count: int = MACHINES, std_db: float = 3.0) -> list[Features]:
    """Levels of machines whose errors are the same at `alike` places each, and independent otherwise."""
    rng = np.random.default_rng(seed)
    places = [
        Place("orders", str(k), "shaft", float(line), "order", 1.0)
        for line in range(LINES)
        for k in range(alike)
    ]
    each = np.repeat(std_db * rng.standard_normal((count, LINES)), alike, axis=1)
    return [_shown(places, 20.0 + row) for row in each]


@pytest.mark.parametrize("alike", [1, ALIKE])
def test_machines_of_a_kind_tell_how_many_differences_say_the_same(alike: int) -> None:
    # Of ten machines and 60 independent lines squared correlations are known to some hundredths of `alike`.
    found = np.mean([realisations_of(_machines(seed, alike)).effect["orders"] for seed in range(5)])
    assert found == pytest.approx(alike, rel=0.25)


def test_what_machines_differ_by_counts_as_they_show_it_and_not_as_one_record_does() -> None:
    machines = _machines(1, ALIKE)
    known = stack_of([machines[-1]], chance={0: realisations_of(machines[:-1])})
    assert np.sqrt(np.mean(known.chance_db**2)) == pytest.approx(3.0, rel=0.15)
    z = np.random.default_rng(3).standard_normal(LINES * ALIKE)
    share = independent_share(known, z, np.array([0.05]))[0]
    # All but a twentieth is chance's, beside which the sampling of 0.1 dB is nothing.
    assert share == pytest.approx(1 / ALIKE, rel=0.3)
    assert independent_share(stack_of([machines[-1]]), z, np.array([0.05]))[0] > 0.8


def test_machines_that_do_not_differ_tell_nothing_of_how_alike_they_do() -> None:
    assert "orders" not in realisations_of(_machines(7, 1, std_db=0.0)).effect


def test_bands_of_one_line_are_counted_as_alike_once() -> None:
    places = [
        Place("envelope", "a", "line", float(k), "order", 0.5, f"line {k}", band)
        for band in BANDS
        for k in range(80)
    ]
    stack = stack_of([_shown(places, np.zeros(len(places)))])
    z = np.tile(np.random.default_rng(4).standard_normal(80), len(BANDS))
    # Counted as neighbours along a run or among records as well it would be a ninth and less.
    assert independent_share(stack, z, np.ones(1))[0] == pytest.approx(1 / len(BANDS), rel=0.35)


@pytest.mark.parametrize("strength", [0.5, 2.0])
def test_what_a_cause_adds_beats_with_what_chance_drew(strength: float) -> None:
    rng = np.random.default_rng(6)
    lines, bands = 24, 400  # so many lines in a band that its level scatters nearly normally

    def drawn(*shape: int) -> np.ndarray:
        parts = rng.standard_normal((2, *shape, bands, lines))
        return (parts[0] + 1j * parts[1]) / np.sqrt(2)

    def level_db(amplitude: np.ndarray) -> np.ndarray:
        return 10 * np.log10(np.sum(np.abs(amplitude) ** 2, axis=-1))

    places = [Place("psd", "a", "band", float(k), "Hz", 1.0) for k in range(1, bands + 1)]
    added = np.sqrt(strength) * np.exp(2j * np.pi * rng.random((bands, lines)))
    machines = drawn(MACHINES)
    chance = realisations_of([_shown(places, row, 1e-3) for row in level_db(machines)])
    shown = chance.applied(_shown(places, level_db(machines[0] + added), 1e-3))
    error = level_db(drawn() + added) - shown.level_db
    # Without the beating a half and a third of it would be told. A tenth is lost as decibels are no powers.
    assert np.std(error) == pytest.approx(np.sqrt(np.mean(shown.levels.std_db**2)), rel=0.2)
    assert abs(float(np.mean(error))) < 0.3
