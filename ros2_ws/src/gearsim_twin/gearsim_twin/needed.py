"""Which causes of a model are needed: each is tried without, on training and on held-out records."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from gearsim_twin.choices import Choice
from gearsim_twin.fit import Fitted, judged
from gearsim_twin.holdout import Gain, affected_domain, heldout_gain
from gearsim_twin.likelihood import Yardstick
from gearsim_twin.settings import Settings
from gearsim_twin.workbench import Workbench

__all__ = ["gain_between", "needed", "settled"]


def gain_between(bench: Workbench, yard: Yardstick, before: Fitted, after: Fitted, seed: int) -> Gain:
    """What one fitted model gains over another on the held-out records."""
    records = (*bench.training, *bench.holdout)
    trials = bench.trials([before.trial.model, after.trial.model], records)
    held = replace(yard, use=yard.stack.part(bench.holdout) & yard.stack.told)
    z = []
    for each in (before, after):
        levels = each.trial.levels
        z.append(yard.z(yard.residual(levels), levels, each.posterior.noise))
    domain = affected_domain(yard.stack, yard.use, z[0], z[1])
    first, second = ((t.levels, f.posterior.noise) for t, f in zip(trials, (before, after), strict=True))
    return heldout_gain(held, first, second, domain, seed)


def settled(bench: Workbench, yard: Yardstick, fitted: Fitted) -> Fitted:
    """All causes and the tuning moved together to where their slopes say, if a simulation confirms it."""
    step = fitted.posterior.coordinates - fitted.at
    if not np.any(np.abs(step) > 0.25 * np.sqrt(np.diag(fitted.posterior.covariance))):
        return fitted
    (trial,) = bench.trials([fitted.trial.model.at(fitted.at + step)])
    moved = judged(yard, trial, fitted.slopes)
    return moved if moved.evidence > fitted.evidence else fitted


def needed(
    bench: Workbench, yard: Yardstick, settings: Settings, current: Fitted, choices: list[Choice]
) -> tuple[Fitted, list[Choice]]:
    """The model with the causes that it needs, each with its probability and gain there.

    A cause is dropped if without it, everything else adapting, the evidence is not convincingly worse, or
    held-out records are predicted as well. The least needed one goes first.
    """
    while True:
        without = [_without(bench, yard, current, k) for k in range(len(choices))]
        leads = [
            current.evidence - smaller.evidence + choice.candidate.prior_nats + choice.candidate.proof_nats
            for smaller, choice in zip(without, choices, strict=True)
        ]
        gains = [gain_between(bench, yard, smaller, current, settings.seed) for smaller in without]
        bad = [
            k
            for k, (lead, gain) in enumerate(zip(leads, gains, strict=True))
            if lead < settings.convincing_nats or not choices[k].candidate.holds(gain, settings.trifle_db)
        ]
        if not bad:
            rows = zip(choices, leads, gains, strict=True)
            return current, [
                replace(_judged(choice, choices, lead), gain=gain) for choice, lead, gain in rows
            ]
        worst = min(bad, key=lambda k: leads[k])
        current, choices = without[worst], [*choices[:worst], *choices[worst + 1 :]]


def _without(bench: Workbench, yard: Yardstick, current: Fitted, number: int) -> Fitted:
    model = current.trial.model
    slopes = np.delete(current.slopes, model.own[number], axis=1)
    (trial,) = bench.trials([model.without(number)])
    return settled(bench, yard, judged(yard, trial, slopes))


def _judged(choice: Choice, choices: list[Choice], lead_nats: float) -> Choice:
    """With its probability against no such cause, and against those rivals of its round that were not taken.

    Rivals count by what all records say, as when the cause was taken. Another name of the same thing speaks
    against the name, not against the thing.
    """
    taken = {each.key for each in choices}
    own = choice.candidate
    others = [each for each in choice.round.candidates if each.extension.key not in taken]
    rivals = [each for each in others if each.could_stand_for(own)]
    odds = [(each, math.exp(min(each.all_nats - own.all_nats, 50.0))) for each in rivals]
    alike = sum(value for each, value in odds if own.thing and each.thing == own.thing)
    total = 1.0 + math.exp(min(-lead_nats, 50.0)) + sum(value for _, value in odds)
    return replace(choice, probability=1.0 / total, thing_probability=(1.0 + alike) / total)
