"""Models judged, and the tuning fitted: Gauss-Newton steps from differences between simulations.

All simulations have the same seed (common random numbers), so that differences between them are what the
parameters do. How causes are fitted, several at a time, is told in `contest`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearsim_twin.causes.cause import Parameter
from gearsim_twin.likelihood import Posterior, Yardstick
from gearsim_twin.model import Model
from gearsim_twin.stack import Array
from gearsim_twin.workbench import Trial, Workbench

__all__ = ["Fitted", "coordinates_of", "fine_step", "fit_tuning", "held", "judged", "slopes_of", "value_of"]

_STEPS = 6
# Lengths of a step that are tried at one go; shorter ones change nothing, lesser gains are not worth a step.
_PARTS = (1.0, 0.35)
_SHORT, _WORTH = 0.1, 0.25
_ELSEWHERE = 0.5  # standard deviations of the prior
# Where else to begin, what makes that worth it in nats, and from which mean square in standard deviations on.
_LOOKS, _HIGHER = (-1.5, -0.75, 0.75, 1.5), 1.0
_POOR, _SMOOTH_DB = 1.5, 1.0
# Longest step, in standard deviations of the prior: beyond, levels are no longer linear in the parameters.
_LONGEST = 1.5
_TUNING_STEP, _PLAIN_STEP = 0.5, 0.25
# Levels that change by more from one simulation to its neighbour (notches, lines that sink into noise) do not
# change in proportion.
_LINEAR_DB = 3.0


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
        return coordinates_of(self.trial)


def coordinates_of(trial: Trial) -> Array:
    """Coordinates of a trial's causes, then those of its tuning, shape (p,)."""
    return np.array(trial.model.coordinates, dtype=np.float64)


def value_of(yard: Yardstick, trial: Trial) -> float:
    """Log likelihood of a trial plus the log priors of its coordinates, in nats."""
    return yard.value(trial.levels, coordinates_of(trial))


def fine_step(parameter: Parameter, value: float, coordinate: float) -> float:
    """Step of a difference in the coordinate, away from the nearer bound."""
    if not parameter.step:
        return -_PLAIN_STEP if coordinate > 0 else _PLAIN_STEP
    up = parameter.prior.coordinate(value + parameter.step) - coordinate
    down = parameter.prior.coordinate(value - parameter.step) - coordinate
    return up if abs(up) >= abs(down) else down


def fit_tuning(bench: Workbench, yard: Yardstick, model: Model) -> Fitted:
    """The model tuned to the training records, with the slopes of the knobs."""
    start = np.array(model.knobs, dtype=np.float64)
    if all(bench.familiar(k) for k in bench.training):
        # The healthy machine is known by its records, whatever the knobs are.
        (trial,) = bench.trials([model])
        return judged(yard, trial, np.zeros((yard.stack.size, start.size)))
    best, slopes = _climbed(bench, yard, bench.trials([model])[0])
    if _poor(yard, best):
        # Likelihoods of resonances have several hills: a model that tells little is on a low one.
        here = np.array(best.model.knobs)
        looks = [here + far * row for row in np.eye(here.size) for far in _LOOKS]
        other = max(bench.trials([model.at(at) for at in looks]), key=lambda trial: value_of(yard, trial))
        if value_of(yard, other) > value_of(yard, best) + _HIGHER:
            best, slopes = _climbed(bench, yard, other)
    return judged(yard, best, slopes)


def _climbed(bench: Workbench, yard: Yardstick, first: Trial) -> tuple[Trial, Array]:
    """The best trial that steps from the first one lead to, with the slopes of the knobs."""
    best, slopes = _with_slopes(bench, first)
    value, taken_at = value_of(yard, best), np.array(best.model.knobs)
    for _ in range(_STEPS):
        here = np.array(best.model.knobs)
        step = held(yard.posterior(best.levels, slopes, here).coordinates - here)
        if not step.size or float(np.max(np.abs(step))) < _SHORT:
            break
        trials = bench.trials([best.model.at(here + part * step) for part in _PARTS])
        values = [value_of(yard, trial) for trial in trials]
        k = int(np.argmax(values))
        if values[k] > value + _WORTH:
            best, value = trials[k], values[k]
        elif _far(here, taken_at):
            # Slopes from where it began may mislead by now: they are taken anew before that is the end.
            (best, slopes), taken_at = _with_slopes(bench, best), here
        else:
            break
    if _far(np.array(best.model.knobs), taken_at):
        best, slopes = _with_slopes(bench, best)
    return best, slopes


def _poor(yard: Yardstick, trial: Trial) -> bool:
    """Whether levels differ by more than models of this kind are thought to err."""
    residual = yard.residual(trial.levels)
    told = np.isfinite(residual)
    missed = yard.tau_median_db[yard.stack.domain] ** 2 + _SMOOTH_DB**2
    z2 = residual[told] ** 2 / (yard.variance(trial.levels) + missed)[told]
    return bool(z2.size) and float(np.mean(z2)) > _POOR


def _far(here: Array, other: Array) -> bool:
    """Whether slopes are to be expected to differ between two places."""
    return float(np.max(np.abs(here - other), initial=0.0)) > _ELSEWHERE


def _with_slopes(bench: Workbench, trial: Trial) -> tuple[Trial, Array]:
    """A trial and the slopes of its knobs there, each taken towards the middle of what it may be."""
    here = np.array(trial.model.knobs, dtype=np.float64)
    steps = np.where(here > 0, -_TUNING_STEP, _TUNING_STEP) * np.eye(here.size)
    beside = bench.trials([trial.model.at(here + step) for step in steps])
    return trial, slopes_of(trial, beside, np.diag(steps))


def judged(yard: Yardstick, trial: Trial, slopes: Array) -> Fitted:
    """A trial by a yardstick, with the slopes of its coordinates."""
    here = coordinates_of(trial)
    posterior = yard.posterior(trial.levels, slopes, here)
    value = yard.value(trial.levels, here) - trial.model.reading_nats
    return Fitted(trial, slopes, posterior, value + posterior.volume)


def held(step: Array) -> Array:
    """A step, shortened to where levels are still linear."""
    longest = float(np.max(np.abs(step), initial=0.0))
    return step if longest <= _LONGEST else step * (_LONGEST / longest)


def slopes_of(trial: Trial, beside: list[Trial], steps: Array) -> Array:
    """Differences of levels over steps, shape (n, steps); 0 where there is no level."""
    columns = [
        np.clip(np.nan_to_num(other.levels.level_db - trial.levels.level_db), -_LINEAR_DB, _LINEAR_DB) / step
        for other, step in zip(beside, steps, strict=True)
    ]
    return np.stack(columns, axis=1) if columns else np.zeros((trial.levels.level_db.size, 0))
