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
from gearsim_twin.model import Extension, Model
from gearsim_twin.stack import Assumed, Levels, Stack, stack_of

if TYPE_CHECKING:
    from gearsim_twin.compare.features import Features
    from gearsim_twin.familiar import Familiar
    from gearsim_twin.realisations import Realisations
    from gearsim_twin.taught import Conditions, Taught

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
    taught : Taught, optional
        What records of the healthy machine show: then the levels of a model are those of the healthy machine
        with what its causes change (`familiar`).
    conditions : tuple of Conditions
        Of each record; asked for where `taught` is there.
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
    taught: Taught | None = None
    conditions: tuple[Conditions, ...] = ()
    simulations: int = 0
    _known: dict[str, Features | None] = field(default_factory=dict)
    _stack: Stack | None = None
    _behind: dict[int, Features] = field(default_factory=dict)
    _familiar: dict[int, Familiar] = field(default_factory=dict)

    @property
    def stack(self) -> Stack:
        """All measured places, and what is assumed of the measuring chain."""
        if self._stack is None:
            # Where the healthy machine is known it does not matter what others of the kind differ by.
            chance = {k: each for k, each in self.chance.items() if not self.familiar(k)}
            self._stack = stack_of(self.measured, self.nuisances.assumed, chance)
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
        parts = [{k: self._parts(model, k) for k in wanted} for model in models]
        contents = [
            {k: [part.content(self.nominal[k]) for part in own] for k, own in each.items()} for each in parts
        ]
        self._simulate([(k, one) for each in contents for k, own in each.items() for one in own])
        return [
            self._trial(
                model, {k: [self._known[_key((k, one))] for one in own] for k, own in each.items()}, fitted
            )
            for model, each in zip(models, contents, strict=True)
        ]

    def simulated(self, model: Model, records: Sequence[int]) -> list[Features | None]:
        """What a model gives by itself: no measuring chain, nothing of chance, no healthy machine."""
        jobs = [(k, model.content(self.nominal[k])) for k in records]
        self._simulate(jobs)
        return [self._known[_key(job)] for job in jobs]

    def by_models_alone(self) -> Workbench:
        """The same without what healthy records teach of places."""
        return replace(self, taught=None, _stack=None)

    def familiar(self, record: int) -> bool:
        """Whether healthy records teach the places of a record."""
        return self.taught is not None and bool(self.taught.near(self.conditions[record]))

    def _parts(self, model: Model, record: int) -> list[Model]:
        """What is simulated of a model: itself, and where the healthy machine is known three more.

        These are the healthy model, this one without causes, and with those causes alone that add.
        """
        if not self.familiar(record):
            return [model]
        healthy = Model(model.tuning, model.tuning.nominal)
        return [model, healthy, replace(model, extensions=()), replace(model, extensions=_adding(model))]

    def _simulate(self, jobs: Sequence[Job]) -> None:
        missing = {_key(job): job for job in jobs if _key(job) not in self._known}
        if not missing:
            return
        for key, features in zip(missing, self.run(list(missing.values())), strict=True):
            self._known[key] = features
        self.simulations += len(missing)

    def _trial(
        self, model: Model, made: Mapping[int, Sequence[Features | None]], fitted: Sequence[int]
    ) -> Trial:
        parts = {k: [part for part in own if part is not None] for k, own in made.items()}
        if any(len(parts[k]) < len(own) for k, own in made.items()):
            level = self.stack.measured.level_db + _REFUSED_DB
            return Trial(model, replace(self.stack.measured, level_db=level), {}, None, refused=True)
        simulated = {k: self._seen(model, k, own) for k, own in parts.items()}
        nuisance = self.nuisances.fit([(self.measured[k], simulated[k]) for k in fitted])
        shown = {k: self.nuisances.apply(nuisance, each) for k, each in simulated.items()}
        levels = self.stack.filled(shown, self.nuisances.corrections_db(nuisance))
        return Trial(model, levels, shown, nuisance)

    def _seen(self, model: Model, record: int, parts: Sequence[Features]) -> Features:
        """A simulation with what chance does to it, or the healthy machine with what it changes."""
        plain = self.chance[record].applied(parts[0]) if record in self.chance else parts[0]
        if len(parts) == 1 or self.taught is None:
            return plain
        whole, healthy, bare, added = (self._behind_chain(part) for part in parts)
        if record not in self._familiar:
            found = self.taught.familiar(healthy, self.conditions[record])
            assert found is not None  # as there are parts
            self._familiar[record] = found
        superposed = all(getattr(each.cause, "superposes", False) for each in _adding(model))
        plain = self.nuisances.apply(self.taught.chain, plain)
        return self._familiar[record].with_cause(bare, added, whole, plain, superposed)

    def _behind_chain(self, simulated: Features) -> Features:
        """A simulation as the measuring chain of the healthy records would show it."""
        assert self.taught is not None
        key = id(simulated)  # they are all kept
        if key not in self._behind:
            self._behind[key] = self.nuisances.apply(self.taught.chain, simulated)
        return self._behind[key]


def _adding(model: Model) -> tuple[Extension, ...]:
    """Causes that add to what is there; the others scale it."""
    return tuple(each for each in model.extensions if not getattr(each.cause, "scales", False))


def _key(job: Job) -> str:
    record, content = job
    return f"{record} " + json.dumps(content, sort_keys=True, default=str)
