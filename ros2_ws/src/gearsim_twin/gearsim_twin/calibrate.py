"""What is known before the measured records are looked at: of the machine's numbers, and of a model's errors.

Records of the healthy machine replace the plain assumptions by what they teach: the knobs start where they
want them, known as well as they tell, the spread of the model's own errors is the one found there, and places
that were there before are known from the records themselves (`taught`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gearsim_twin.causes.prior import LogNormal
from gearsim_twin.fit import fit_tuning, judged
from gearsim_twin.likelihood import REPEAT_FACTOR, TAU_FACTOR, Yardstick
from gearsim_twin.model import Model
from gearsim_twin.stack import ASSUMED, TONES
from gearsim_twin.systematic import smooth_errors
from gearsim_twin.taught import Conditions, Taught
from gearsim_twin.tuning import Setting, Tuning
from gearsim_twin.workbench import Workbench

__all__ = ["Prior", "calibrated", "plain_prior", "settled_on", "taught_by"]

SMOOTH_DB = 1.0
"""Spread of smooth errors of a tuned model; single places scatter beyond."""
TAU_DB = {
    "orders": 1.5,
    "psd": 0.5,
    "envelope": 0.7,
    "cyclic": 1.0,
    "torsional": 1.5,
    "statistics": 0.4,
    "transient": 1.0,
    TONES: 1.5,
}
"""That scatter, as measured between a model and itself with other random errors of teeth and numbers a few
per cent off: single lines of orders depend on which tooth is how wrong, wide bands do not."""
_FIRST_SHARE = 0.3
# What one healthy machine tells is known no better than this: another day, another load.
_LEAST_FACTOR, _LEARNT_TAU_FACTOR, _LESS_SURE = 1.02, 1.3, 1.5


@dataclass(frozen=True, slots=True)
class Prior:
    """Knobs of the machine and errors of its model.

    Attributes
    ----------
    tuning : Tuning
    tau_db : dict of str to float
        Spread of the model's errors by domain, as far as learnt.
    """

    tuning: Tuning
    tau_db: dict[str, float]

    def tau_of(self, domains: Sequence[str]) -> dict[str, float]:
        """What a good model misses, smooth errors and scatter together, by domain."""
        return {
            name: float(np.hypot(SMOOTH_DB, self.tau_db.get(name, TAU_DB[name])))
            for name in domains
            if name not in (ASSUMED, TONES)
        }

    def yard(self, bench: Workbench) -> Yardstick:
        """The measure of models on the training records of a bench."""
        stack = bench.stack
        use = stack.part((*bench.training, -1)) & stack.told
        median = np.array([self._tau(name) for name in stack.domains])
        learnt = [name in self.tau_db for name in stack.domains]
        if bench.taught is not None:
            # What a cause adds the healthy machine has not shown: it is known no better than models are.
            plain = [1.0 if name == ASSUMED else TAU_DB[name] for name in stack.domains]
            median, learnt = np.maximum(median, plain), [False] * len(plain)
        factor = np.where(learnt, _LEARNT_TAU_FACTOR, TAU_FACTOR)
        several = bench.taught is not None and bench.taught.several
        repeat = np.full(len(stack.domains), _LEARNT_TAU_FACTOR if several else REPEAT_FACTOR)
        share = np.array([1.0 if name in (ASSUMED, TONES) else _FIRST_SHARE for name in stack.domains])
        spread = np.full(len(stack.domains), SMOOTH_DB)
        return Yardstick(stack, share, median, factor, use, smooth_errors(stack, use, spread), repeat)

    def tau_of_places(self, domain: str) -> float:
        """What a good model misses of a place, smooth errors and scatter together."""
        return float(np.hypot(SMOOTH_DB, self._tau(domain)))

    def _tau(self, domain: str) -> float:
        return 1.0 if domain == ASSUMED else self.tau_db.get(domain, TAU_DB[domain])


def plain_prior(tuning: Tuning) -> Prior:
    """What is assumed of any machine."""
    return Prior(tuning, {})


def calibrated(bench: Workbench, prior: Prior) -> Prior:
    """What records of the healthy machine teach."""
    yard = prior.yard(bench)
    fitted = fit_tuning(bench, yard, Model(prior.tuning, prior.tuning.nominal))
    levels = fitted.trial.levels
    yard = yard.by_independence(fitted.posterior.residual_db, levels, fitted.posterior.noise)
    fitted = judged(yard, fitted.trial, fitted.slopes)
    spread = np.sqrt(np.diag(fitted.posterior.covariance))
    settings = tuple(
        _known(setting, float(u), float(std))
        for setting, u, std in zip(prior.tuning.settings, fitted.at, spread, strict=True)
    )
    tau = zip(bench.stack.domains, fitted.posterior.noise.tau_db, strict=True)
    return Prior(Tuning(settings), {name: float(value) for name, value in tau if name != ASSUMED})


def taught_by(bench: Workbench, prior: Prior, conditions: Sequence[Conditions]) -> Taught | None:
    """What records of the healthy machine show at each place, beside the calibrated model.

    Parameters
    ----------
    bench : Workbench
        Of the healthy records.
    prior : Prior
        As they calibrated it.
    conditions : sequence of Conditions
        Of each of them.

    Returns
    -------
    Taught or None
        None where the calibrated model is none that the simulator takes.
    """
    model = Model(prior.tuning, prior.tuning.nominal)
    (trial,) = bench.trials([model])
    plain = bench.simulated(model, bench.training)
    if trial.refused:
        return None
    shown = tuple(bench.nuisances.apply(trial.nuisance, each) for each in plain if each is not None)
    measured = tuple(bench.measured[k] for k in bench.training)
    tau_db = {name: prior.tau_of_places(name) for name in bench.stack.domains}
    return Taught(measured, shown, tuple(conditions), tau_db, trial.nuisance)


# That records given as those of the machine are none of it, or that it was changed: once in thousands.
_SAME_MACHINE_NATS = 8.0
_OTHER = (
    "the healthy records predict the others no better than the model alone does: of another machine, or one "
    "that was changed; they teach the machine's numbers only"
)
_ELSEWHERE = (
    "no healthy record is of much the same speed and load: they teach the machine's numbers, not its places"
)


def settled_on(bench: Workbench, prior: Prior) -> tuple[Workbench, tuple[str, ...]]:
    """The bench with what healthy records teach of places, or without where that is none of this machine.

    Returns
    -------
    Workbench
    tuple of str
        What is to be told of it.
    """
    if bench.taught is None:
        return bench, ()
    if not any(bench.familiar(k) for k in bench.training):
        return bench.by_models_alone(), (_ELSEWHERE,)
    model = Model(prior.tuning, prior.tuning.nominal)
    alone = bench.by_models_alone()
    values = []
    for each in (bench, alone):
        (trial,) = each.trials([model])
        # Before independence is looked at: both are to be weighed alike.
        values.append(judged(prior.yard(each), trial, np.zeros((each.stack.size, len(model.knobs)))).evidence)
    return (alone, (_OTHER,)) if values[1] > values[0] + _SAME_MACHINE_NATS else (bench, ())


def _known(setting: Setting, coordinate: float, std: float) -> Setting:
    """A knob around what was found, with its numbers as they are then."""
    found = setting.prior.value(coordinate)
    factor = max(setting.prior.factor ** (_LESS_SURE * std), _LEAST_FACTOR)
    factor = min(factor, setting.prior.factor)
    numbers = tuple((name, value * found, unit) for name, value, unit in setting.numbers)
    return replace(
        setting, prior=LogNormal(1.0, factor, factor**-3.0, factor**3.0), numbers=numbers, calibrated=True
    )
