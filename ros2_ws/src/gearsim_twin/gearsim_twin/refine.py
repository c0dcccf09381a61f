"""The chosen model fitted to the end: all of its coordinates move together, by slopes taken where it stands.

Causes are compared by fits that stop early and let the tuning adapt by the slopes that it had without them. A
spall rings resonances that nothing rang before: only beside it do the levels tell, and depend on, damping and
stiffness. So sizes and intervals are those of a last fit, with the slopes of everything taken anew.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gearsim_twin.fit import Fitted, coordinates_of, fine_step, held, judged, value_of
from gearsim_twin.likelihood import Yardstick
from gearsim_twin.model import Model
from gearsim_twin.stack import Array
from gearsim_twin.workbench import Trial, Workbench

__all__ = ["refined", "slopes_among"]

_PARTS = (1.0, 0.35)
# Likelihoods of sizes have several hills: looked for so many standard deviations to either side.
_LOOKS = (-4.0, -1.5, 1.5, 4.0)
_LEAST_SPREAD = 0.05
_ADAPTED = 3
# Simulations within about such a distance tell slopes; coordinates that hardly differ among them tell none.
_REACH, _RIDGE = 0.5, 1e-3
_STEEPEST_DB, _FAR = 6.0, 0.3
# Slopes are not wrong by more than this factor.
_WIDEST = 5.0
_KNOB_STEP = 0.5
# Steps shorter than this part of the posterior's standard deviation change nothing that could be seen.
_SHORT = 0.25
# Nats for which a step is worth its simulations.
_WORTH = 0.25


def refined(bench: Workbench, yard: Yardstick, fitted: Fitted, most: int = 60) -> Fitted:
    """A fitted model at its best, with the slopes of all of its coordinates there.

    Parameters
    ----------
    bench, yard
    fitted : Fitted
        With at least one cause.
    most : int
        Simulations of a record after which no further step is begun; the slopes are always taken.
    """
    first = bench.simulations
    seen = [fitted.trial, *_around(bench, fitted.trial)]
    best = judged(yard, fitted.trial, slopes_among(fitted.trial, seen))
    renewed = True
    while bench.simulations - first < most * len(bench.training):
        found, looked = _better(bench, yard, best)
        seen += looked
        if found is None and renewed:
            break
        renewed = found is None or _far(found, best.trial)
        trial = best.trial if found is None else found
        if renewed:
            seen += _around(bench, trial)
        best = judged(yard, trial, slopes_among(trial, seen))
    best = judged(yard, best.trial, slopes_among(best.trial, seen))
    seen += bench.trials([best.trial.model.at(at) for at in _near(best)])
    return _as_it_falls(yard, best, seen)


def _as_it_falls(yard: Yardstick, fitted: Fitted, seen: Sequence[Trial]) -> Fitted:
    """The fit with the spread of each parameter of a cause as the likelihood falls beside it.

    Information from slopes counts what chance does to differences of simulations as if the parameter did it.
    How far the log likelihood falls by h to either side, everything else adapting, holds no such part: normal
    with the spread s it falls by h^2 / 2 s^2 (Cox and Hinkley, Theoretical Statistics, 1974, 9.3).
    """
    here, spread = fitted.at, np.sqrt(np.diag(fitted.posterior.covariance))
    wider = np.ones(here.size)
    for k in range(_causes(fitted)):
        slopes = fitted.slopes.copy()
        slopes[:, k] = 0.0
        top = yard.posterior(fitted.trial.levels, slopes, here).value
        far, falls = [], []
        for trial in seen:
            moved = np.abs(coordinates_of(trial) - here)
            if trial.refused or not moved[k] > 0.0 or np.any(np.delete(moved, k) > 1e-9):
                continue
            far.append(float(moved[k]))
            falls.append(top - yard.posterior(trial.levels, slopes, coordinates_of(trial)).value)
        h2 = np.array(far) ** 2
        total = max(2.0 * float(np.sum(h2 * np.array(falls))), 1e-12)
        if far:
            wider[k] = np.clip(np.sqrt(float(np.sum(h2**2)) / total) / spread[k], 1.0, _WIDEST)
    covariance = fitted.posterior.covariance * wider[:, None] * wider
    return replace(fitted, posterior=replace(fitted.posterior, covariance=covariance))


def _better(bench: Workbench, yard: Yardstick, base: Fitted) -> tuple[Trial | None, list[Trial]]:
    """A trial that does better, if one is found, and all that were simulated for it."""
    least = value_of(yard, base.trial) + _WORTH
    looked = bench.trials([base.trial.model.at(at) for at in _near(base)])
    found = _best(yard, looked)
    if found is None or value_of(yard, found) < least:
        moved = bench.trials(_adapted(yard, base, looked))
        looked += moved
        found = _best(yard, moved)
    return (found if found is not None and value_of(yard, found) >= least else None), looked


def slopes_among(trial: Trial, seen: Sequence[Trial]) -> Array:
    """Slopes of the levels at a trial, from all that was simulated near it, shape (n, p).

    Weighted least squares over differences from the trial. A difference between two simulations is partly
    chance, and taken for a slope it would be information on the parameter that nobody has: each slope is
    shrunk by what the scatter about the plane makes of it.
    """
    here = coordinates_of(trial)
    others = [each for each in seen if not each.refused and each is not trial]
    x = np.array([coordinates_of(each) - here for each in others]).reshape(len(others), here.size)
    weight = np.exp(-0.5 * np.sum(x**2, axis=1) / _REACH**2)
    change = np.array([np.nan_to_num(each.levels.level_db - trial.levels.level_db) for each in others])
    change = np.clip(change, -_STEEPEST_DB, _STEEPEST_DB).reshape(len(others), -1)
    normal = np.linalg.inv((x.T * weight) @ x + _RIDGE * np.eye(here.size))
    slopes = normal @ ((x.T * weight) @ change)
    left = float(np.sum(weight)) ** 2 / max(float(np.sum(weight**2)), 1e-12)
    scatter = np.sum(weight[:, None] * (change - x @ slopes) ** 2, axis=0)
    scatter /= max(float(np.sum(weight)) * max(1.0 - here.size / left, 1.0 / left), 1e-12)
    noise = np.diag(normal @ (x.T * weight**2) @ x @ normal)[:, None] * scatter
    kept = slopes**2 / np.maximum(slopes**2 + noise, 1e-12)
    return np.asarray((slopes * kept).T)


def _far(one: Trial, other: Trial) -> bool:
    return float(np.max(np.abs(coordinates_of(one) - coordinates_of(other)))) > _FAR


def _near(fitted: Fitted) -> list[Array]:
    """Where to look next: along the Gauss-Newton step, and to both sides of each parameter of a cause."""
    here, spread = fitted.at, np.sqrt(np.diag(fitted.posterior.covariance))
    step = held(fitted.posterior.coordinates - here)
    found = []
    if bool(np.any(np.abs(step) > _SHORT * spread)):
        found += [here + part * step for part in _PARTS]
    for k in range(_causes(fitted)):
        for far in _LOOKS:
            moved = here.copy()
            moved[k] += far * max(float(spread[k]), _LEAST_SPREAD)
            found.append(moved)
    return found


def _best(yard: Yardstick, trials: Sequence[Trial]) -> Trial | None:
    able = [each for each in trials if not each.refused]
    return max(able, key=lambda each: value_of(yard, each), default=None)


def _adapted(yard: Yardstick, base: Fitted, near: Sequence[Trial]) -> list[Model]:
    """Of all looked at those that do best once everything else adapts to them, so adapted."""
    found = []
    for trial in near:
        if trial.refused:
            continue
        slopes = base.slopes.copy()
        slopes[:, np.abs(coordinates_of(trial) - base.at) > 0.0] = 0.0
        if np.all(slopes == 0.0):
            slopes[:, _causes(base) :] = base.slopes[:, _causes(base) :]
        posterior = yard.posterior(trial.levels, slopes, coordinates_of(trial))
        found.append(
            (
                posterior.value,
                trial.model.at(coordinates_of(trial) + held(posterior.coordinates - coordinates_of(trial))),
            )
        )
    found.sort(key=lambda each: -each[0])
    return [model for _, model in found[:_ADAPTED]]


def _causes(fitted: Fitted) -> int:
    """Coordinates of causes; those of the tuning follow."""
    return fitted.at.size - len(fitted.trial.model.knobs)


def _around(bench: Workbench, trial: Trial) -> list[Trial]:
    """A simulation beside it for each coordinate; on the other side where that is refused."""
    here = coordinates_of(trial)
    steps = np.array([_step(trial.model, k, float(u)) for k, u in enumerate(here.tolist())])
    beside = bench.trials([_beside(trial.model, here, k, step) for k, step in enumerate(steps.tolist())])
    refused = [k for k, each in enumerate(beside) if each.refused]
    if refused:
        beside += bench.trials([_beside(trial.model, here, k, -float(steps[k])) for k in refused])
    return beside


def _beside(model: Model, here: Array, number: int, step: float) -> Model:
    moved = here.copy()
    moved[number] += step
    return model.at(moved)


def _step(model: Model, number: int, coordinate: float) -> float:
    """Step of a difference: of a cause's own parameter as it wants, of the tuning towards its middle."""
    for extension, own in zip(model.extensions, model.own, strict=True):
        if own.start <= number < own.stop:
            parameter = extension.free[number - own.start]
            return fine_step(parameter, float(extension.values[parameter.name]), coordinate)
    return -_KNOB_STEP if coordinate > 0 else _KNOB_STEP
