"""Choosing causes one by one, with rivals, probabilities and reasons.

In each round the first guesses of all causes are simulated, the best few are fitted, and their evidence is
compared with that of no further cause. A cause is taken if it is probable (its evidence includes the price of
its freedom and of there being so many to choose from), if what it predicts for the held-out records is
significantly better, and if that is more than a trifle. What was taken before is tried again without.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from gearsim_twin.causes.cause import Cause
from gearsim_twin.causes.context import Context
from gearsim_twin.choices import Candidate, Choice, Round
from gearsim_twin.contest import contest
from gearsim_twin.fit import Fitted, judged
from gearsim_twin.likelihood import Yardstick
from gearsim_twin.needed import gain_between, needed, settled
from gearsim_twin.proof import with_proofs
from gearsim_twin.refine import refined
from gearsim_twin.screen import Screened, first_guesses, most_hopeful, screen
from gearsim_twin.settings import Settings
from gearsim_twin.workbench import Trial, Workbench

__all__ = ["Selection", "select"]


@dataclass(frozen=True, slots=True, eq=False)
class Selection:
    """What was found.

    Attributes
    ----------
    tuned : Fitted
    final : Fitted
        The extended model; the coordinates of its posterior are those of all causes in their order, then
        those of the tuning.
    choices : tuple of Choice
        In the order of the extensions of the final model.
    rounds : tuple of Round
    yard : Yardstick
        By which the final model was judged.
    """

    tuned: Fitted
    final: Fitted
    choices: tuple[Choice, ...]
    rounds: tuple[Round, ...]
    yard: Yardstick


@dataclass(frozen=True, slots=True, eq=False)
class _Search:
    """What stays the same over the rounds."""

    bench: Workbench
    causes: tuple[Cause, ...]
    context_of: Callable[[Trial], Context]
    settings: Settings
    tell: Callable[[str], None]
    heldout_of: Callable[[Trial], Context] | None
    begun: int  # simulations of the bench before it

    def spent(self) -> bool:
        """Whether the search has cost what it may."""
        return self.bench.simulations - self.begun >= self.settings.most_simulations


def select(
    bench: Workbench,
    yard: Yardstick,
    tuned: Fitted,
    causes: tuple[Cause, ...],
    context_of: Callable[[Trial], Context],
    settings: Settings,
    tell: Callable[[str], None] = lambda _: None,
    content: Callable[[Context], bool] = lambda _: False,
    heldout_of: Callable[[Trial], Context] | None = None,
) -> Selection:
    """Causes that explain what the tuned model misses.

    Parameters
    ----------
    bench : Workbench
    yard : Yardstick
        Of the training records.
    tuned : Fitted
        The tuned model with the slopes of its knobs.
    causes : tuple of Cause
    context_of : callable
        What causes may look at, for a trial.
    settings : Settings
    tell : callable
        Gets a line on what is being done.
    content : callable
        Whether nothing of note is left to be explained: then no further cause is looked for.
    heldout_of : callable, optional
        As `context_of`, of the records held out: what is found again in them is proven.
    """
    search = _Search(bench, causes, context_of, settings, tell, heldout_of, bench.simulations)
    current = tuned
    rounds: list[Round] = []
    choices: list[Choice] = []
    certain = (yard, tuned, choices)
    tentative = False
    while len(choices) < settings.most_causes:
        context = context_of(current.trial)
        if choices and content(context) and not _left_over(rounds[-1], choices, settings):
            break
        done, yard, current = _round(
            search, yard, current, {choice.key for choice in choices}, rounds, context
        )
        rounds.append(done)
        if done.taken is not None:
            number = done.taken
        elif not tentative and done.candidates and done.candidates[0].lead_nats > settings.hint_nats:
            number = 0
        else:
            break
        tentative = done.taken is None
        candidate = done.candidates[number]
        choices = [*choices, Choice(done, candidate)]
        current = settled(bench, yard, candidate.fitted)
        if not tentative:
            current, choices = needed(bench, yard, settings, current, choices)
            certain = (yard, current, choices)
        if search.spent():
            break
    yard, current, choices = certain
    if choices:
        tell("fitting the whole model to the end")
        current, choices = _to_the_end(search, yard, current, choices)
    return Selection(tuned, current, tuple(choices), tuple(rounds), yard)


def _to_the_end(
    search: _Search, yard: Yardstick, current: Fitted, choices: list[Choice]
) -> tuple[Fitted, list[Choice]]:
    """The chosen model at its best, its causes with their gains there."""
    best = refined(search.bench, yard, current, search.settings.most_refining)
    same, again = needed(search.bench, yard, search.settings, best, choices)
    # What convinced before a better fit is not dropped for one.
    return (same, again) if len(again) == len(choices) else (best, choices)


def _left_over(done: Round, choices: list[Choice], settings: Settings) -> bool:
    """Whether a round had a convincing cause besides the one taken, which that one need not explain too."""
    taken = {choice.key for choice in choices}
    instead = {name for choice in choices for name, _ in choice.candidate.extension.cause.confused_with}
    return any(
        each.lead_nats > settings.convincing_nats
        and each.extension.key not in taken
        and each.extension.cause.name not in instead | {name for name, _ in taken}
        for each in done.candidates
    )


def _round(
    search: _Search,
    yard: Yardstick,
    current: Fitted,
    taken: set[tuple[str, str]],
    rounds: list[Round],
    context: Context,
) -> tuple[Round, Yardstick, Fitted]:
    guesses = [
        (extension, count)
        for extension, count in first_guesses(search.causes, context)
        if extension.key not in taken
    ]
    names = len({extension.cause.name for extension, _ in guesses})
    earlier = {each.extension.key: each.nats for each in rounds[-1].left} if rounds else {}
    ranked = most_hopeful(guesses, earlier)
    kept = ranked[: search.settings.most_guesses // (2 if rounds else 1)]
    search.tell(f"trying {len(kept)} first guesses")
    screened = screen(search.bench, yard, current, kept, search.spent)
    screened = _proven(search, current, screened)
    chosen = _worth_fitting(screened, search.settings)
    if chosen:
        search.tell("fitting " + ", ".join(dict.fromkeys(each.extension.cause.name for each in chosen)))
    trials = [each.trial for each in chosen]
    found = contest(search.bench, yard, trials, current.slopes, search.spent) if trials else []
    fits = [(fitted, each) for fitted, each in zip(found, chosen, strict=True)]
    yard, current, fits = _same_measure(yard, current, fits)
    candidates = _probable(search.settings, current, fits, names)
    candidates, accepted = _held_out(search, yard, current, candidates, len(rounds))
    left = tuple(each for each in screened if each not in chosen)
    seen = {each.extension.cause.name for each in screened}
    untried = tuple(dict.fromkeys(one.cause.name for one, _ in ranked if one.cause.name not in seen))
    return Round(tuple(candidates), left, accepted, untried), yard, current


def _proven(search: _Search, current: Fitted, screened: list[Screened]) -> list[Screened]:
    """The guesses with what finding them again adds, the best first."""
    heldout_of = search.heldout_of
    if heldout_of is None:
        return screened
    proofs = with_proofs([each.extension for each in screened], lambda: heldout_of(current.trial))
    found = [replace(each, proof_nats=proof) for each, proof in zip(screened, proofs, strict=True)]
    return sorted(found, key=lambda each: -(each.nats + each.proof_nats))


def _worth_fitting(screened: list[Screened], settings: Settings) -> list[Screened]:
    """The best few, and those that the best may be confused with."""
    able = [each for each in screened if each.nats + each.proof_nats > settings.worth_fitting_nats]
    if not able:
        return []
    rivals = {name for name, _ in able[0].extension.cause.confused_with}
    near = [each for each in able[settings.fits :] if each.extension.cause.name in rivals]
    return [*able[: settings.fits], *near[:2]]


def _same_measure(
    yard: Yardstick, current: Fitted, fits: list[tuple[Fitted, Screened]]
) -> tuple[Yardstick, Fitted, list[tuple[Fitted, Screened]]]:
    """All judged by the independence of what the best of them leaves."""
    everything = [current, *(each for each, _ in fits)]
    best = max(everything, key=lambda each: each.evidence)
    levels = best.trial.levels
    yard = yard.by_independence(best.posterior.residual_db, levels, best.posterior.noise)
    again = [judged(yard, each.trial, each.slopes) for each in everything]
    return yard, again[0], [(found, fits[k][1]) for k, found in enumerate(again[1:])]


def _probable(
    settings: Settings, current: Fitted, fits: list[tuple[Fitted, Screened]], names: int
) -> list[Candidate]:
    """Candidates with their probabilities, the most probable first."""
    prior = [settings.prior_nats(names, guess.guesses) for _, guess in fits]
    leads = [
        each.evidence - current.evidence + odds + guess.proof_nats
        for (each, guess), odds in zip(fits, prior, strict=True)
    ]
    most = max([0.0, *leads])
    total = math.exp(-most) + sum(math.exp(lead - most) for lead in leads)
    found = [
        Candidate(each, lead, odds, math.exp(lead - most) / total, proof_nats=guess.proof_nats)
        for (each, guess), lead, odds in zip(fits, leads, prior, strict=True)
    ]
    return sorted(found, key=lambda each: -each.lead_nats)


def _held_out(
    search: _Search, yard: Yardstick, current: Fitted, candidates: list[Candidate], number: int
) -> tuple[list[Candidate], int | None]:
    """Candidates with their held-out gains, and which one is taken."""
    least = search.settings.convincing_nats
    near = [each for each in candidates if each.lead_nats > 0.0]
    if not near:
        return candidates, None
    search.tell("checking on held-out records")
    found = list(candidates)
    for k, each in enumerate(near):
        gain = gain_between(search.bench, yard, current, each.fitted, search.settings.seed + number)
        found[k] = replace(each, gain=gain)
    passed = {
        # Evidence of the training records, and what that predicts of the others: together that of all.
        k: each.all_nats
        for k, each in enumerate(found)
        if each.lead_nats > least
        and each.gain is not None
        and each.holds(each.gain, search.settings.trifle_db)
    }
    return found, max(passed, key=lambda k: passed[k], default=None)
