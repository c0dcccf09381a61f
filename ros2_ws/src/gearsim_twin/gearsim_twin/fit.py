"""Models judged, and the tuning fitted: Gauss-Newton steps from differences between simulations.

All simulations have the same seed (common random numbers), so that differences between them are what the
parameters do. How causes are fitted, several at a time, is told in `contest`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearsim_twin.likelihood import Posterior, Yardstick
from gearsim_twin.model import Model
from gearsim_twin.stack import Array
from gearsim_twin.workbench import Trial, Workbench

__all__ = ["Fitted", "fit_tuning", "held", "judged", "slopes_of"]

_STEPS = 4
# Longest step, in standard deviations of the prior: beyond, levels are no longer linear in the parameters.
_LONGEST = 1.5
_TUNING_STEP = 0.5
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
        return np.array(self.trial.model.coordinates, dtype=np.float64)


def fit_tuning(bench: Workbench, yard: Yardstick, model: Model) -> Fitted:
    """The model tuned to the training records, with the slopes of the knobs."""
    start = np.array(model.knobs, dtype=np.float64)
    if all(bench.familiar(k) for k in bench.training):
        # The healthy machine is known by its records, whatever the knobs are.
        (trial,) = bench.trials([model])
        return judged(yard, trial, np.zeros((yard.stack.size, start.size)))
    steps = np.where(start > 0, -_TUNING_STEP, _TUNING_STEP) * np.eye(start.size)
    trials = bench.trials([model, *(model.at(start + step) for step in steps)])
    slopes = slopes_of(trials[0], trials[1:], np.diag(steps))
    best, value = trials[0], yard.value(trials[0].levels, start)
    for _ in range(_STEPS - 1):
        here = np.array(best.model.knobs)
        step = held(yard.posterior(best.levels, slopes, here).coordinates - here)
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
