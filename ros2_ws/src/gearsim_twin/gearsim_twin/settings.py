"""How hard the judge tries, and what counts as known."""

from __future__ import annotations

import math
from dataclasses import dataclass

__all__ = ["Settings"]


@dataclass(frozen=True, slots=True)
class Settings:
    """How hard to try, and what counts as known.

    Attributes
    ----------
    most_causes : int
        Causes that one model may get.
    fits : int
        Causes that are fitted in a round, those that the best one may be confused with not counted.
    most_guesses : int
        First guesses that are simulated in the first round; half as many in later ones.
    most_simulations : int
        Simulations of a record that a search may cost, the tuning before it not counted; what is not tried
        for that is told. Counted, not timed, so that a verdict does not depend on how busy the computer is.
    most_refining : int
        Simulations of a record for the last fit of the chosen model.
    most_channels : int
        Channels that the search looks at, those that differ most; all count in the final scores.
    most_records : int
        Records for training that the search looks at, those under the most different conditions.
    worth_fitting_nats : float
        Better log likelihood at the first guess, below which no fit is tried.
    another : float
        Probability beforehand that there is a cause, or one more.
    doubt : float
        Probability of no further cause below which one is taken.
    hint_nats : float
        Lead above which the best cause of a round, although not taken, is kept while one more is looked for:
        of two that hide each other neither may be convincing alone.
    trifle_db : float
        Fall of the held-out rms error in the affected domain below which it is not worth a cause.
    seeds : int
        Machines of a kind that are simulated to learn what chance does.
    gear_seeds : int
        The same of machines with gears: teeth wrong at random scatter some lines by 6 dB and others not at
        all, and four machines do not tell which.
    most_seconds : float
        Longest simulation, unless lines of the machine need longer to be told apart.
    seed : int
        Of simulations and of the intervals of held-out gains.
    workers : int
        Processes that simulate.
    """

    most_causes: int = 3
    fits: int = 4
    most_guesses: int = 32
    most_simulations: int = 140
    most_refining: int = 60
    most_channels: int = 3
    most_records: int = 3
    worth_fitting_nats: float = 1.0
    another: float = 0.3
    doubt: float = 0.05
    hint_nats: float = -2.5
    trifle_db: float = 0.02
    seeds: int = 4
    gear_seeds: int = 10
    most_seconds: float = 3.0
    seed: int = 1
    workers: int = 1

    @property
    def convincing_nats(self) -> float:
        """Lead over no further cause at which one is taken."""
        return math.log((1.0 - self.doubt) / self.doubt)

    def prior_nats(self, names: int, guesses: int) -> float:
        """Log odds beforehand of one guess of a cause, among so many causes and guesses."""
        odds = math.log(self.another / (1.0 - self.another))
        return odds - math.log(max(names, 1)) - math.log(max(guesses, 1))
