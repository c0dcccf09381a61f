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
# Of a guess that would do better at less strength, the size is sought: events of a size that is much too
# great are of another shape, and no scaling of what they add makes them those of a small one.
_SMALLER = (-0.7, -1.4, -2.1)
_PARTS = (1.0, 0.4, 0.15)


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
    plain_nats : float
        As `nats`, at the strength of the guess itself.
    strength : float
        The best strength, of the guess's own.
    """

    trial: Trial
    nats: float
    guesses: int
    proof_nats: float = 0.0
    plain_nats: float = 0.0
    strength: float = 1.0

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
    before = _adapted_value(yard, base)
    best: dict[tuple[str, str], Screened] = {}
    for start in range(0, len(guesses), _AT_ONCE):
        if enough():
            break
        for found in _screened(bench, yard, base, guesses[start : start + _AT_ONCE], before):
            known = best.get(found.extension.key)
            if known is None or known.nats < found.nats:
                best[found.extension.key] = found
    if not enough():
        for found in _screened(bench, yard, base, _smaller(list(best.values())), before):
            known = best[found.extension.key]
            if known.plain_nats < found.plain_nats:
                best[found.extension.key] = replace(found, nats=max(found.nats, known.nats))
    return sorted(best.values(), key=lambda each: -each.nats)


def _adapted_value(yard: Yardstick, base: Fitted) -> float:
    """Log probability of the base, which adapts as it may beside each guess."""
    levels = base.trial.levels
    adapted = yard.adapted(levels, base.slopes, base.at, base.posterior.noise)
    return max(yard.value(levels, base.at), yard.value(*adapted))


def _screened(
    bench: Workbench, yard: Yardstick, base: Fitted, guesses: list[tuple[Extension, int]], before: float
) -> list[Screened]:
    """Some guesses beside the log likelihood without."""
    trials = bench.trials([base.trial.model.extended(extension) for extension, _ in guesses])
    found = []
    for trial, (extension, count) in zip(trials, guesses, strict=True):
        plain, value, strength = (-np.inf, -np.inf, 1.0) if trial.refused else _values(yard, base, trial)
        price = before + extension.reading_nats
        found.append(Screened(trial, value - price, count, plain_nats=plain - price, strength=strength))
    return found


def _smaller(screened: list[Screened]) -> list[tuple[Extension, int]]:
    """Smaller sizes of the guesses that show too much."""
    found = []
    for each in screened:
        names = [parameter.name for parameter in each.extension.free]
        size = getattr(each.extension.cause, "size", "")
        if each.strength < 1.0 and size in names:
            k = names.index(size)
            for coordinate in _less(each, k):
                at = list(each.extension.coordinates)
                at[k] = coordinate
                found.append((each.extension.at(tuple(at)), each.guesses))
    return found


def _less(each: Screened, number: int) -> list[float]:
    """Coordinates of smaller sizes; those of a signed one go towards zero, power being its square."""
    prior = each.extension.free[number].prior
    here = each.extension.coordinates[number]
    if prior.low >= 0.0:
        return [here + step for step in _SMALLER]
    best = prior.value(here) * each.strength**0.5
    return [prior.coordinate(part * best) for part in _PARTS]


def _values(yard: Yardstick, base: Fitted, trial: Trial) -> tuple[float, float, float]:
    """Log probability as simulated and at the best strength, all else adapting; that strength."""
    noise = base.posterior.noise
    candidates, strengths = [trial.levels], [1.0]
    below, above = _power(base.trial.levels.level_db), _power(trial.levels.level_db)
    if trial.model.extensions[-1].free:
        strengths += _STRENGTHS.tolist()
        for strength in _STRENGTHS:
            power = np.maximum(below + strength * (above - below), 1e-3 * np.minimum(below, above))
            level = np.where(yard.is_assumed, trial.levels.level_db, 10.0 * np.log10(power))
            candidates.append(replace(trial.levels, level_db=level))
    adapted = [yard.adapted(levels, base.slopes, base.at, noise) for levels in candidates]
    values = [
        float(yard.loglike(yard.residual(levels), levels, noise).sum()) - 0.5 * float(at @ at)
        for levels, at in adapted
    ]
    best = int(np.argmax(values))
    plain = yard.value(*adapted[0])
    return plain, (yard.value(*adapted[best]) if best else plain), strengths[best]


def _power(level_db: Array) -> Array:
    return np.asarray(10.0 ** (0.1 * level_db))
