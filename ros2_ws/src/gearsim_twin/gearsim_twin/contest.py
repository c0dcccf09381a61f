"""Fits of several causes side by side: all move together, and those that fall behind are not followed.

Each cause starts from its first guess or from some way beside it, since likelihoods may have several hills.
Then it takes Gauss-Newton steps from differences between simulations; each step lets the tuning adapt by its
known slopes, and counts only after a simulation has confirmed it. What all of them want to have simulated
next is simulated at one go.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from gearsim_twin.fit import Fitted, coordinates_of, fine_step, held, judged, slopes_of, value_of
from gearsim_twin.likelihood import Posterior, Yardstick
from gearsim_twin.model import Model
from gearsim_twin.stack import Array
from gearsim_twin.workbench import Trial, Workbench

__all__ = ["contest"]

_STEPS = 3
# Lengths of a step that are tried at one go.
_PARTS = (1.0, 0.35)
# A step shorter than this part of the posterior's standard deviation changes nothing that could be seen.
_SHORT = 0.25
# So far behind the best, in nats, a cause is not followed after so many steps.
_BEHIND = (80.0, 40.0, 20.0)
# How far off, and in how many parameters, a start is looked for.
_AROUND, _MOST_AROUND = 0.8, 2
# After a longer step than this, slopes are taken anew.
_FAR = 0.3
# Levels change by no more than this per unit of a coordinate before they are no longer in proportion, dB.
_STEEPEST_DB = 12.0


@dataclass(slots=True, eq=False)
class _Runner:
    """A cause on its way, the last one of a trial's model."""

    trial: Trial
    value: float
    own: Array
    rough: bool = True
    going: bool = True
    beside: list[tuple[int, Trial]] = field(default_factory=list)

    @property
    def at(self) -> Array:
        """Its coordinates and those of everything else."""
        return coordinates_of(self.trial)

    def slopes(self, known: Array) -> Array:
        """Slopes of all coordinates: its own between those of the causes before it and those of the knobs."""
        return np.insert(known, [self.trial.model.own[-1].start], self.own, axis=1)


def contest(
    bench: Workbench,
    yard: Yardstick,
    firsts: Sequence[Trial],
    known_slopes: Array,
    enough: Callable[[], bool] = lambda: False,
) -> list[Fitted]:
    """Fits of the last causes of some models, in their order, everything else adapting to them.

    Parameters
    ----------
    bench, yard
    firsts : sequence of Trial
        Models as first guessed, all with the same causes before the last one.
    known_slopes : ndarray, shape (n, q)
        Of the coordinates of the models without their last cause.
    enough : callable
        True once no further simulation may be asked for.
    """
    runners = [_Runner(first, value_of(yard, first), np.zeros((yard.stack.size, 0))) for first in firsts]
    _look_around(bench, yard, runners)
    for turn in range(_STEPS):
        best = max(runner.value for runner in runners)
        for runner in runners:
            runner.going &= runner.value > best - _BEHIND[turn]
        going = [runner for runner in runners if runner.going]
        if not going or enough():
            break
        if turn:
            _take_slopes(bench, [runner for runner in going if runner.rough])
        _step(bench, yard, going, known_slopes)
    best = max(runner.value for runner in runners)
    near = [runner for runner in runners if runner.rough and runner.value > best - _BEHIND[-1]]
    if not enough():
        _take_slopes(bench, near)
    return [judged(yard, runner.trial, runner.slopes(known_slopes)) for runner in runners]


def _own(trial: Trial) -> Array:
    """Coordinates of the last cause."""
    return np.array(trial.model.extensions[-1].coordinates, dtype=np.float64)


def _look_around(bench: Workbench, yard: Yardstick, runners: list[_Runner]) -> None:
    """Start from the guess or from some way off in a single parameter; rough slopes from the same trials."""
    wanted = [
        (runner, k, _beside(runner.trial.model, k, side * _AROUND))
        for runner in runners
        for k in range(_own(runner.trial).size)
        for side in ((-1.0, 1.0) if k < _MOST_AROUND else (1.0,))
    ]
    trials = bench.trials([model for _, _, model in wanted])
    for (runner, k, _), trial in zip(wanted, trials, strict=True):
        if not trial.refused:
            runner.beside.append((k, trial))
    for runner in runners:
        first, here = runner.trial, _own(runner.trial)
        columns = [_column(first, [t for n, t in runner.beside if n == k], k) for k in range(here.size)]
        runner.own = np.stack(columns, axis=1) if columns else np.zeros((yard.stack.size, 0))
        runner.rough = bool(columns)
        for _, trial in runner.beside:
            value = value_of(yard, trial)
            if value > runner.value:
                runner.trial, runner.value = trial, value


def _column(first: Trial, beside: list[Trial], number: int) -> Array:
    """Rough slope of one coordinate: the mean of the differences to both sides."""
    here = _own(first)[number]
    parts = []
    for trial in beside:
        step = float(_own(trial)[number] - here)
        if abs(step) > 0.05:
            change = np.nan_to_num(trial.levels.level_db - first.levels.level_db) / step
            parts.append(np.clip(change, -_STEEPEST_DB, _STEEPEST_DB))
    return np.asarray(np.mean(parts, axis=0)) if parts else np.zeros(first.levels.level_db.size)


def _step(bench: Workbench, yard: Yardstick, runners: list[_Runner], known: Array) -> None:
    """One step of each, of the better of two lengths; those that find none stop."""
    wanted: list[tuple[_Runner, Model]] = []
    for runner in runners:
        posterior = yard.posterior(runner.trial.levels, runner.slopes(known), runner.at)
        step = _worthwhile(posterior, runner.at)
        runner.going = step is not None
        if step is not None:
            wanted += [(runner, runner.trial.model.at(runner.at + part * step)) for part in _PARTS]
    trials = bench.trials([model for _, model in wanted])
    found: dict[int, list[Trial]] = {}
    for (runner, _), trial in zip(wanted, trials, strict=True):
        found.setdefault(id(runner), []).append(trial)
    for runner in runners:
        own = found.get(id(runner), [])
        values = [value_of(yard, trial) for trial in own]
        k = int(np.argmax(values)) if values else -1
        if k < 0 or values[k] <= runner.value:
            # Rough slopes may mislead: they are taken anew once before that is the end.
            runner.going = bool(own) and runner.rough
            continue
        moved = float(np.max(np.abs(_own(own[k]) - _own(runner.trial)), initial=0.0))
        runner.rough = runner.rough or moved > _FAR
        runner.trial, runner.value = own[k], values[k]


def _worthwhile(posterior: Posterior, at: Array) -> Array | None:
    """The step to where the slopes say; None where it is too short to be seen."""
    step = held(posterior.coordinates - at)
    spread = np.sqrt(np.diag(posterior.covariance))
    return None if not step.size or bool(np.all(np.abs(step) < _SHORT * spread)) else step


def _take_slopes(bench: Workbench, runners: list[_Runner]) -> None:
    """Slopes of each one's own coordinates, by a simulation for each; backwards where that is refused."""
    wanted = [
        (runner, k, fine_step(parameter, float(runner.trial.model.extensions[-1].values[parameter.name]), u))
        for runner in runners
        for k, (parameter, u) in enumerate(
            zip(runner.trial.model.extensions[-1].free, _own(runner.trial).tolist(), strict=True)
        )
    ]
    beside = bench.trials([_beside(runner.trial.model, k, step) for runner, k, step in wanted])
    refused = [n for n, trial in enumerate(beside) if trial.refused]
    if refused:
        wanted = [(r, k, -step if n in refused else step) for n, (r, k, step) in enumerate(wanted)]
        again = bench.trials([_beside(wanted[n][0].trial.model, *wanted[n][1:]) for n in refused])
        for n, trial in zip(refused, again, strict=True):
            beside[n] = wanted[n][0].trial if trial.refused else trial
    for runner in runners:
        mine = [
            (trial, step) for (owner, _, step), trial in zip(wanted, beside, strict=True) if owner is runner
        ]
        runner.own = slopes_of(
            runner.trial, [trial for trial, _ in mine], np.array([step for _, step in mine])
        )
        runner.rough = False


def _beside(model: Model, number: int, step: float) -> Model:
    """The model with one coordinate of its last cause changed."""
    last = model.extensions[-1]
    moved = np.array(last.coordinates, dtype=np.float64)
    moved[number] += step
    return model.with_last(last.at(tuple(moved)))
