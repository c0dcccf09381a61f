"""Which causes are worth a fit: one simulation per first guess, its strength scaled afterwards.

What most causes add is power: at strength a the power at a place is that of the base plus a times what the
guess added. So one simulation tells how well the cause would do at any strength, near enough to rank it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from gearsim_twin.causes.cause import Cause
from gearsim_twin.causes.context import Context
from gearsim_twin.fit import Fitted
from gearsim_twin.likelihood import Yardstick
from gearsim_twin.model import Extension
from gearsim_twin.stack import Array
from gearsim_twin.workbench import Trial, Workbench

__all__ = ["Screened", "first_guesses", "most_hopeful", "screen"]

_AT_ONCE = 8
# A guess that did so much worse than nothing is not tried again in the next round.
_NO_USE_NATS = 5.0
_STRENGTHS = 2.0 ** np.arange(-5, 6)


@dataclass(frozen=True, slots=True, eq=False)
class Screened:
    """A first guess, simulated.

    Attributes
    ----------
    trial : Trial
    nats : float
        By how much the log likelihood is better than without, at the best strength.
    guesses : int
        How many guesses that cause had.
    proof_nats : float
        What finding it again in held-out records adds.
    """

    trial: Trial
    nats: float
    guesses: int
    proof_nats: float = 0.0

    @property
    def extension(self) -> Extension:
        """The cause with its guess."""
        return self.trial.model.extensions[-1]


def first_guesses(causes: tuple[Cause, ...], context: Context) -> list[tuple[Extension, int]]:
    """First guesses of all causes that apply, with the number that the cause had."""
    found = []
    for cause in causes:
        if not cause.applies(context):
            continue
        guesses = cause.starts(context)
        found += [(Extension(cause, guess, context), len(guesses)) for guess in guesses]
    return found


def most_hopeful(
    guesses: list[tuple[Extension, int]], earlier: Mapping[tuple[str, str], float]
) -> list[tuple[Extension, int]]:
    """The guesses, new ones first, then those that did best in the round before.

    Of equal ones each cause's first guess comes before any second one. Those that have done far worse than
    nothing before are left out.
    """
    rank: dict[str, int] = {}
    order = []
    for extension, _ in guesses:
        place = rank.setdefault(extension.cause.name, 0)
        rank[extension.cause.name] += 1
        order.append((-earlier.get(extension.key, np.inf), place))
    ranked = sorted(range(len(guesses)), key=lambda k: order[k])
    return [guesses[k] for k in ranked if order[k][0] < _NO_USE_NATS]


def screen(
    bench: Workbench,
    yard: Yardstick,
    base: Fitted,
    guesses: list[tuple[Extension, int]],
    enough: Callable[[], bool] = lambda: False,
) -> list[Screened]:
    """All guesses by how much better than the base they do, best first; one per cause and component.

    They are simulated some at a time, until `enough` says that no further one may be.
    """
    before = yard.value(base.trial.levels, base.at)
    best: dict[tuple[str, str], Screened] = {}
    for start in range(0, len(guesses), _AT_ONCE):
        if enough():
            break
        some = guesses[start : start + _AT_ONCE]
        trials = bench.trials([base.trial.model.extended(extension) for extension, _ in some])
        for trial, (extension, count) in zip(trials, some, strict=True):
            value = -np.inf if trial.refused else _best_value(yard, base, trial)
            found = Screened(trial, float(value) - before - extension.reading_nats, count)
            known = best.get(extension.key)
            if known is None or known.nats < found.nats:
                best[extension.key] = found
    return sorted(best.values(), key=lambda each: -each.nats)


def _best_value(yard: Yardstick, base: Fitted, trial: Trial) -> float:
    """Log probability of the guess as simulated, or at a strength that does better, all else adapting."""
    noise = base.posterior.noise
    candidates = [trial.levels]
    below, above = _power(base.trial.levels.level_db), _power(trial.levels.level_db)
    if trial.model.extensions[-1].free:
        for strength in _STRENGTHS:
            power = np.maximum(below + strength * (above - below), 1e-3 * np.minimum(below, above))
            level = np.where(yard.is_assumed, trial.levels.level_db, 10.0 * np.log10(power))
            candidates.append(replace(trial.levels, level_db=level))
    adapted = [yard.adapted(levels, base.slopes, base.at, noise) for levels in candidates]
    values = [
        float(yard.loglike(yard.residual(levels), yard.variance(levels), noise).sum()) - 0.5 * float(at @ at)
        for levels, at in adapted
    ]
    return yard.value(*adapted[int(np.argmax(values))])


def _power(level_db: Array) -> Array:
    return np.asarray(10.0 ** (0.1 * level_db))
