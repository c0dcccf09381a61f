"""Where models meet the measured records: contents in, levels at all places out.

What a model is compared by is always its levels *after* the best nuisances (gains, noise floors and
bandwidths of the sensors), found on training records alone and kept for those held out.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Protocol

from gearsim_twin.causes.cause import Content
from gearsim_twin.model import Model
from gearsim_twin.stack import Assumed, Levels, Stack, stack_of

if TYPE_CHECKING:
    from gearsim_twin.compare.features import Features
    from gearsim_twin.realisations import Realisations

__all__ = ["Job", "Nuisances", "Trial", "Workbench"]

_REFUSED_DB = 100.0

Job = tuple[int, Content]
"""Number of the record whose conditions they are, and what the scenario holds."""


class Nuisances(Protocol):
    """How the measuring chain is accounted for."""

    @property
    def assumed(self) -> tuple[Assumed, ...]:
        """What is taken as known of it."""

    def fit(self, pairs: Sequence[tuple[Features, Features]]) -> Any:
        """The best nuisances for (measured, simulated) features of some records."""

    def apply(self, nuisance: Any, simulated: Features) -> Features:
        """Simulated features as the measuring chain would show them."""

    def corrections_db(self, nuisance: Any) -> tuple[float, ...]:
        """What it needed of each assumption."""


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """A model and what it predicts.

    Attributes
    ----------
    model : Model
    levels : Levels
        With nuisances; at records that were not simulated as measured.
    features : mapping of int to Features
        The same by record.
    nuisance : object
    refused : bool
        The simulator refused it: such a machine cannot be. Its levels are as wrong as can be.
    """

    model: Model
    levels: Levels
    features: Mapping[int, Features]
    nuisance: Any
    refused: bool = False


@dataclass(eq=False)
class Workbench:
    """Simulates models under the conditions of the measured records.

    Parameters
    ----------
    measured : tuple of Features
        One entry per record, those for training first.
    nominal : tuple of dict
        The nominal model under the conditions of each record.
    training : tuple of int
        Records that may be fitted to.
    run : callable
        Jobs to features in their order; None for what the simulator refuses.
    nuisances : Nuisances
    chance : mapping of int to Realisations
        Of some records, what chance does to their levels.
    numbers : tuple of int
        Which records of the case they are.
    simulations : int
        Of a record, so far.
    """

    measured: tuple[Features, ...]
    nominal: tuple[Content, ...]
    training: tuple[int, ...]
    run: Callable[[Sequence[Job]], Sequence[Features | None]]
    nuisances: Nuisances
    chance: Mapping[int, Realisations] = field(default_factory=dict)
    numbers: tuple[int, ...] = ()
    simulations: int = 0
    _known: dict[str, Features | None] = field(default_factory=dict)
    _stack: Stack | None = None

    @property
    def stack(self) -> Stack:
        """All measured places, and what is assumed of the measuring chain."""
        if self._stack is None:
            self._stack = stack_of(self.measured, self.nuisances.assumed)
        return self._stack

    @property
    def holdout(self) -> tuple[int, ...]:
        """Records that are never fitted to."""
        return tuple(k for k in range(len(self.measured)) if k not in self.training)

    def trials(self, models: Sequence[Model], records: Sequence[int] | None = None) -> list[Trial]:
        """What models predict for some records (those of training unless told), simulated at one go."""
        records = self.training if records is None else tuple(records)
        fitted = [k for k in records if k in self.training] or list(self.training)
        wanted = tuple(dict.fromkeys([*records, *fitted]))
        contents = [{k: model.content(self.nominal[k]) for k in wanted} for model in models]
        self._simulate([(k, content) for each in contents for k, content in each.items()])
        return [
            self._trial(model, {k: self._known[_key((k, content))] for k, content in each.items()}, fitted)
            for model, each in zip(models, contents, strict=True)
        ]

    def _simulate(self, jobs: Sequence[Job]) -> None:
        missing = {_key(job): job for job in jobs if _key(job) not in self._known}
        if not missing:
            return
        for key, features in zip(missing, self.run(list(missing.values())), strict=True):
            record = missing[key][0]
            if features is not None and record in self.chance:
                features = self.chance[record].applied(features)
            self._known[key] = features
        self.simulations += len(missing)

    def _trial(self, model: Model, made: Mapping[int, Features | None], fitted: Sequence[int]) -> Trial:
        simulated = {k: each for k, each in made.items() if each is not None}
        if len(simulated) < len(made):
            level = self.stack.measured.level_db + _REFUSED_DB
            return Trial(model, replace(self.stack.measured, level_db=level), {}, None, refused=True)
        nuisance = self.nuisances.fit([(self.measured[k], simulated[k]) for k in fitted])
        shown = {k: self.nuisances.apply(nuisance, each) for k, each in simulated.items()}
        levels = self.stack.filled(shown, self.nuisances.corrections_db(nuisance))
        return Trial(model, levels, shown, nuisance)


def _key(job: Job) -> str:
    record, content = job
    return f"{record} " + json.dumps(content, sort_keys=True, default=str)
