"""Fits of causes by simulation: Gauss-Newton steps from differences between simulations.

All simulations of a fit have the same seed (common random numbers), so that differences between them are
what the parameters do. Each step lets the tuning adapt by its known slopes, and counts only after a
simulation has confirmed it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearsim_twin.causes.cause import Parameter
from gearsim_twin.likelihood import Posterior, Yardstick
from gearsim_twin.model import Model
from gearsim_twin.stack import Array
from gearsim_twin.workbench import Trial, Workbench

__all__ = ["Fitted", "fit", "fit_tuning", "judged"]

_STEPS = 4
# Lengths of a step that are tried, two at a time.
_PARTS = ((1.0, 3.0), (0.3, 0.1))
# Longest step, in standard deviations of the prior: beyond, levels are no longer linear in the parameters.
_LONGEST = 1.5
# A step shorter than this part of the posterior's standard deviation changes nothing that could be seen.
_SHORT = 0.25
_TUNING_STEP = 0.5
_PLAIN_STEP = 0.25
# So far behind another cause none catches up with it.
_HOPELESS_NATS = 60.0
# Levels that change by more from one simulation to its neighbour (notches, lines that sink into noise) do not
# change in proportion.
_LINEAR_DB = 3.0
# How far off, and in how many parameters, a fit looks for a better start.
_AROUND, _MOST_AROUND = 0.8, 2
# After a longer step than this, slopes are taken anew.
_FAR = 0.3


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """A model fitted to the training records.

    Attributes
    ----------
    trial : Trial
    slopes : ndarray, shape (n, p)
        Of the levels by the coordinates of the model, dB.
    posterior : Posterior
        Around the trial.
    evidence : float
        Log evidence in nats, at what was simulated.
    """

    trial: Trial
    slopes: Array
    posterior: Posterior
    evidence: float

    @property
    def at(self) -> Array:
        """Coordinates of the trial."""
        return np.array(self.trial.model.coordinates, dtype=np.float64)


def fit_tuning(bench: Workbench, yard: Yardstick, model: Model) -> Fitted:
    """The model tuned to the training records, with the slopes of the knobs."""
    start = np.array(model.knobs, dtype=np.float64)
    steps = np.where(start > 0, -_TUNING_STEP, _TUNING_STEP) * np.eye(start.size)
    trials = bench.trials([model, *(model.at(start + step) for step in steps)])
    slopes = _slopes(trials[0], trials[1:], np.diag(steps))
    best, value = trials[0], yard.value(trials[0].levels, start)
    for _ in range(_STEPS - 1):
        here = np.array(best.model.knobs)
        step = _held(yard.posterior(best.levels, slopes, here).coordinates - here)
        if not step.size or float(np.max(np.abs(step))) < 0.1:
            break
        (trial,) = bench.trials([model.at(here + step)])
        found = yard.value(trial.levels, here + step)
        if found <= value:
            break
        best, value = trial, found
    return judged(yard, best, slopes)


def judged(yard: Yardstick, trial: Trial, slopes: Array) -> Fitted:
    """A trial by a yardstick, with the slopes of its coordinates."""
    here = np.array(trial.model.coordinates, dtype=np.float64)
    posterior = yard.posterior(trial.levels, slopes, here)
    value = yard.value(trial.levels, here) - trial.model.reading_nats
    return Fitted(trial, slopes, posterior, value + posterior.volume)


def fit(
    bench: Workbench, yard: Yardstick, first: Trial, known_slopes: Array, rival: float = -np.inf
) -> Fitted:
    """The last cause of a model fitted to the training records, everything else adapting to it.

    Parameters
    ----------
    bench, yard
    first : Trial
        Of the model with the cause as first guessed.
    known_slopes : ndarray, shape (n, q)
        Of the coordinates of the model without its last cause.
    rival : float
        Evidence of the best other cause: one that stays far behind it is not followed to its end.
    """
    best, own = _best_around(bench, yard, first), first.model.own[-1]
    first = best
    slopes = _with_own(bench, first, known_slopes)
    at = np.array(first.model.coordinates, dtype=np.float64)
    value = yard.value(first.levels, at)
    for turn in range(_STEPS):
        if turn and value < rival - _HOPELESS_NATS:
            break
        posterior = yard.posterior(best.levels, slopes, at)
        step = _held(posterior.coordinates - at)
        spread = np.sqrt(np.diag(posterior.covariance))
        if not step.size or np.all(np.abs(step) < _SHORT * spread):
            break
        trial, found, moved = _search(bench, yard, best, at, step, value)
        if trial is None:
            break
        if turn < _STEPS - 1 and float(np.max(np.abs(moved[own]), initial=0.0)) > _FAR:
            slopes = _with_own(bench, trial, known_slopes)
        best, value, at = trial, found, at + moved
    return judged(yard, best, slopes)


def _best_around(bench: Workbench, yard: Yardstick, first: Trial) -> Trial:
    """The first guess, or one some way off in a single parameter: likelihoods may have several hills."""
    last = first.model.extensions[-1]
    here = np.array(last.coordinates)
    models = [
        _beside(first.model, here, k, side * _AROUND)
        for k in range(min(here.size, _MOST_AROUND))
        for side in (-1.0, 1.0)
    ]
    trials = [first, *(each for each in bench.trials(models) if not each.refused)]
    values = [yard.value(each.levels, np.array(each.model.coordinates)) for each in trials]
    return trials[int(np.argmax(values))]


def _search(
    bench: Workbench, yard: Yardstick, best: Trial, at: Array, step: Array, value: float
) -> tuple[Trial | None, float, Array]:
    """The best of some lengths of a step, short ones only where the longer ones are no improvement."""
    for parts in _PARTS:
        trials = bench.trials([best.model.at(at + part * step) for part in parts])
        values = [yard.value(each.levels, np.array(each.model.coordinates)) for each in trials]
        k = int(np.argmax(values))
        if values[k] > value:
            moved = np.array(trials[k].model.coordinates) - at
            return trials[k], values[k], moved
    return None, value, np.zeros_like(step)


def _held(step: Array) -> Array:
    longest = float(np.max(np.abs(step), initial=0.0))
    return step if longest <= _LONGEST else step * (_LONGEST / longest)


def _with_own(bench: Workbench, trial: Trial, known_slopes: Array) -> Array:
    """Slopes of all coordinates: those of the last cause between those of the others and of the knobs."""
    return np.insert(known_slopes, [trial.model.own[-1].start], _own_slopes(bench, trial), axis=1)


def _own_slopes(bench: Workbench, trial: Trial) -> Array:
    """Slopes of the last cause, by one more simulation per parameter; backwards where it refuses that."""
    last = trial.model.extensions[-1]
    here = np.array(last.coordinates)
    pairs = zip(last.free, here, strict=True)
    steps = np.array([_step(p, float(last.values[p.name]), u) for p, u in pairs])
    beside = bench.trials([_beside(trial.model, here, k, step) for k, step in enumerate(steps)])
    refused = [k for k, each in enumerate(beside) if each.refused]
    if refused:
        steps[refused] *= -1.0
        again = bench.trials([_beside(trial.model, here, k, float(steps[k])) for k in refused])
        for k, each in zip(refused, again, strict=True):
            beside[k] = trial if each.refused else each
    return _slopes(trial, beside, steps)


def _beside(model: Model, here: Array, number: int, step: float) -> Model:
    """The model with one coordinate of its last cause changed."""
    moved = here.copy()
    moved[number] += step
    return model.with_last(model.extensions[-1].at(tuple(moved)))


def _step(parameter: Parameter, value: float, coordinate: float) -> float:
    """Step of a difference in the coordinate, away from the nearer bound."""
    if not parameter.step:
        return -_PLAIN_STEP if coordinate > 0 else _PLAIN_STEP
    up = parameter.prior.coordinate(value + parameter.step) - coordinate
    down = parameter.prior.coordinate(value - parameter.step) - coordinate
    return up if abs(up) >= abs(down) else down


def _slopes(trial: Trial, beside: list[Trial], steps: Array) -> Array:
    """Differences of levels over steps, shape (n, steps); 0 where there is no level."""
    columns = [
        np.clip(np.nan_to_num(other.levels.level_db - trial.levels.level_db), -_LINEAR_DB, _LINEAR_DB) / step
        for other, step in zip(beside, steps, strict=True)
    ]
    return np.stack(columns, axis=1) if columns else np.zeros((trial.levels.level_db.size, 0))
