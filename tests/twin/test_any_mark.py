"""What an effect does, found at any place of the mark that angles are counted from: closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from gearsim_twin.causes.any_mark import at_any_mark
from gearsim_twin.causes.turn_lines import Deviation

LINES = 700


def _answer(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    part = rng.random(LINES) < 0.1
    return part * (rng.standard_normal((3, LINES)) + 1j * rng.standard_normal((3, LINES)))


def _deviation(values: np.ndarray, seed: int, noise: float = 0.1) -> Deviation:
    rng = np.random.default_rng(seed)
    own = values + noise * (rng.standard_normal(values.shape) + 1j * rng.standard_normal(values.shape))
    return Deviation(0, 1.0, own, np.abs(own) ** 2, np.full(values.shape, 2.0 * noise**2))


@pytest.mark.parametrize("size", [1.7, -0.6])
@pytest.mark.parametrize("late_turns", [0.0, 0.21, 0.733])
def test_size_and_sign_do_not_hang_on_where_the_mark_stands(size: float, late_turns: float) -> None:
    answer = _answer(1)
    late = size * answer * np.exp(-2j * np.pi * late_turns * np.arange(LINES))
    found = at_any_mark(_deviation(late, 2), answer, signed=True)
    assert found is not None
    # At most a sixteenth of a turn off at the highest line, a fiftieth of the size on average over all.
    assert found.amplitude == pytest.approx(size, rel=0.05)
    assert np.sum(np.abs(found.turned - late) ** 2) < 0.1 * np.sum(np.abs(late) ** 2)


def test_another_effect_and_noise_are_not_taken_for_it() -> None:
    answer = _answer(1)
    right = at_any_mark(_deviation(answer, 2), answer, signed=True)
    other = at_any_mark(_deviation(_answer(3), 2), answer, signed=True)
    assert right is not None
    assert other is None or other.drop < 0.2 * right.drop
    noise = [at_any_mark(_deviation(0.0 * answer, seed), answer, signed=True) for seed in range(40)]
    # What a match must lower chi^2 by, at 5600 angles in each of 40 records of noise.
    assert max((found.drop for found in noise if found is not None), default=0.0) < 30.0


def test_an_effect_without_an_opposite_is_not_found_turned_round() -> None:
    answer = _answer(1)
    found = at_any_mark(_deviation(-answer, 2, noise=0.3), answer, signed=False)
    assert found is None or found.amplitude < 0.5
