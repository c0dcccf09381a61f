"""Causes on their way: fitted candidates, the rounds they compete in, and those that were taken."""

from __future__ import annotations

from dataclasses import dataclass

from gearsim_twin.causes.cause import REPEATED_NATS
from gearsim_twin.fit import Fitted
from gearsim_twin.holdout import Gain
from gearsim_twin.model import Extension
from gearsim_twin.screen import Screened

__all__ = ["Candidate", "Choice", "Round"]

_HARM_NATS = 2.0
# What must be left of a proof on held-out records, which levels there speak against: odds of 1 in 20.
_LEFT_NATS = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A fitted cause in a round.

    Attributes
    ----------
    fitted : Fitted
    lead_nats : float
        Log of its posterior odds against no further cause.
    prior_nats : float
        What of that was known beforehand.
    probability : float
        Among all candidates of the round and no further cause.
    gain : Gain or None
        On held-out records; None where nothing was held out or it was never near.
    proof_nats : float
        What finding it again in held-out records has added to its odds.
    """

    fitted: Fitted
    lead_nats: float
    prior_nats: float = 0.0
    probability: float = 0.0
    gain: Gain | None = None
    proof_nats: float = 0.0

    def holds(self, gain: Gain, trifle_db: float) -> bool:
        """Whether a gain on held-out records is real.

        What was found again in them must do no sure harm to likelihood and error at once, or less than the
        finding speaks for it: rare events that are drawn at other times fit worse. Nor must what the
        measuring chain makes up for by what no sensor needs: it predicts the same, and only differs by how
        probable that is.
        """
        if gain.real(trifle_db):
            return True
        harmless = gain.nats > -_HARM_NATS
        if self.proof_nats > 0.0:
            outweighed = gain.nats > -min(self.proof_nats, REPEATED_NATS) + _LEFT_NATS
            return harmless or outweighed or gain.ci95_nats[1] > 0.0 or gain.gain_db > trifle_db
        return harmless and bool(getattr(self.extension.cause, "of_chain", False))

    @property
    def extension(self) -> Extension:
        """The cause with its values."""
        return self.fitted.trial.model.extensions[-1]

    @property
    def all_nats(self) -> float:
        """Log odds by all records: evidence of those for training, and what that predicts of the others."""
        return self.lead_nats + (0.0 if self.gain is None else self.gain.nats)

    def could_stand_for(self, other: Candidate) -> bool:
        """Whether it explains what another one does, so that one of the two is enough.

        What was found again by itself, and is no other name of the other, stands beside it.
        """
        if self.proof_nats <= 0.0 or (self.thing and self.thing == other.thing):
            return True
        one, two = self.extension.cause, other.extension.cause
        return (
            one.name == two.name or two.name in dict(one.confused_with) or one.name in dict(two.confused_with)
        )

    @property
    def thing(self) -> str:
        """What is wrong by this cause, where several causes are names of it; "" where there is no other."""
        words = getattr(self.extension.cause, "thing", None)
        return "" if words is None else str(words(self.extension.values))


@dataclass(frozen=True, slots=True, eq=False)
class Round:
    """A round of candidates.

    Attributes
    ----------
    candidates : tuple of Candidate
        Those fitted, by descending probability.
    left : tuple of Screened
        Guesses that were not worth a fit.
    taken : int or None
        Which candidate was taken.
    untried : tuple of str
        Causes that had guesses, for which no simulation was left.
    """

    candidates: tuple[Candidate, ...]
    left: tuple[Screened, ...]
    taken: int | None
    untried: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """A cause that was taken.

    Attributes
    ----------
    round : Round
        In which it was taken, with its rivals.
    candidate : Candidate
        What it was there.
    probability : float
        That it is there, and none of its rivals in its place, given the final model.
    thing_probability : float
        That it or another name of the same thing is there.
    gain : Gain or None
        What it gains on held-out records in the final model.
    """

    round: Round
    candidate: Candidate
    probability: float = 0.0
    thing_probability: float = 0.0
    gain: Gain | None = None

    @property
    def key(self) -> tuple[str, str]:
        """What makes it the same cause as another."""
        return self.candidate.extension.key
