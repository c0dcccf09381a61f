"""Causes that were not taken: those that could stand in place of one that was, and why the others lost."""

from __future__ import annotations

import math

from gearsim_twin.choices import Candidate, Choice
from gearsim_twin.intervals import numbers_of
from gearsim_twin.model import Extension
from gearsim_twin.select import Selection
from gearsim_twin.settings import Settings
from gearsim_twin.verdict import Found, Rejected

__all__ = ["alternatives", "decided_by", "rejected", "variant_of"]

LEAST_PROBABILITY = 0.1
"""Of a rival in place of a cause that was taken, for it to be told among the causes."""

_UNTRIED = "not tried: others looked more hopeful, and all simulations that a case may cost were spent"


def alternatives(choice: Choice, selection: Selection) -> tuple[Found, ...]:
    """Causes that the records cannot tell from one that was taken, with what would."""
    found = []
    for rival, probability in _rivals(choice, selection):
        if probability < LEAST_PROBABILITY or rival.gain is None:
            continue
        extension = rival.extension
        number = len(rival.fitted.trial.model.extensions) - 1
        measurement = decided_by(choice, rival)
        told = f"; {measurement} would decide" if measurement else ""
        found.append(
            Found(
                name=extension.cause.name,
                component=extension.words.get("component", ""),
                parameters=numbers_of(rival.fitted, number),
                heldout_gain_db=rival.gain.gain_db,
                heldout_ci95_db=rival.gain.ci95_db,
                domain=rival.gain.domain,
                probability=probability,
                signature=f"in place of {choice.key[0]}: {extension.cause.signature(extension.values)}{told}",
                instead_of=choice.key[0],
                variant=variant_of(extension),
                thing=rival.thing if rival.thing == choice.candidate.thing else "",
                thing_probability=choice.thing_probability,
            )
        )
    return tuple(found)


def variant_of(extension: Extension) -> str:
    """Which form of a cause it is, where one name has several that could stand in each other's place."""
    words = getattr(extension.cause, "variant", None)
    return "" if words is None else str(words(extension.values))


def decided_by(choice: Choice, rival: Candidate) -> str:
    """The measurement that tells a cause from its rival; "" if neither of them knows one."""
    known = dict(choice.candidate.extension.cause.confused_with)
    other = dict(rival.extension.cause.confused_with)
    return known.get(rival.extension.cause.name, "") or other.get(choice.key[0], "")


def _rivals(choice: Choice, selection: Selection) -> list[tuple[Candidate, float]]:
    """Rivals of the round in which a cause was taken, each with its probability of being there instead."""
    taken = {each.key for each in selection.choices}
    own = choice.candidate.all_nats
    return [
        (each, choice.probability * math.exp(min(each.all_nats - own, 0.0)))
        for each in choice.round.candidates
        if each.extension.key not in taken and each.could_stand_for(choice.candidate)
    ]


def rejected(selection: Selection, told: set[str], settings: Settings | None = None) -> tuple[Rejected, ...]:
    """All causes that were tried and not taken, the most probable first, each once, with the reason."""
    limits = settings or Settings()
    names = {choice.key[0] for choice in selection.choices} | told
    found: dict[str, Rejected] = {}
    for each in selection.rounds:
        for candidate in each.candidates:
            name = candidate.extension.cause.name
            if name in names:
                continue
            why = _why(candidate, None if each.taken is None else each.candidates[each.taken], limits)
            gain = None if candidate.gain is None else candidate.gain.gain_db
            component = candidate.extension.words.get("component", "")
            new = Rejected(name, component, why, gain, candidate.probability)
            if name not in found or found[name].probability < new.probability:
                found[name] = new
    for each in selection.rounds:
        for guess in each.left:
            name = guess.extension.cause.name
            if name not in names and name not in found:
                component = guess.extension.words.get("component", "")
                found[name] = Rejected(name, component, _left(guess.nats), None, 0.0)
        for name in each.untried:
            if name not in names and name not in found:
                found[name] = Rejected(name, "", _UNTRIED, None, 0.0)
    return tuple(sorted(found.values(), key=lambda entry: -entry.probability))


def _left(nats: float) -> str:
    if nats <= 0:
        return f"what it would show is not in the records (log likelihood {nats:+.1f} at its best strength)"
    return f"others came nearer at the first guess (log likelihood only {nats:+.1f})"


def _why(candidate: Candidate, winner: Candidate | None, limits: Settings) -> str:
    lead = candidate.lead_nats
    if winner is not None and winner.lead_nats > lead:
        better = winner.lead_nats - lead
        return f"{winner.extension.cause.name} explains the same better by {better:.1f} nats of log evidence"
    if lead < limits.convincing_nats:
        return (
            f"log odds of {lead:+.1f} against no further cause; {limits.convincing_nats:.1f} would convince"
        )
    if candidate.gain is None or candidate.gain.ci95_nats[0] <= 0.0:
        return "what it gains on the training records does not hold on those held out"
    return f"lowers the held-out error by {candidate.gain.gain_db:.2f} dB only"
