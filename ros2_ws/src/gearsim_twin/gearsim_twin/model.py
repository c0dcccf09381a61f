"""A model under judgement: the nominal one, tuned, and extended by causes."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gearsim_twin.causes.cause import Cause, Content, Parameter, Values
from gearsim_twin.causes.context import Context
from gearsim_twin.tuning import Tuning

__all__ = ["READ", "Extension", "Model"]

READ = "std:"
"""Before the name of a parameter in a start: the standard deviation with which it was read off the records.

Such a parameter is not fitted by simulation."""
# A reading is chosen among some hundred places that can be told apart, however sharp it is itself.
_MOST_READING_NATS = 5.0


@dataclass(frozen=True, slots=True, eq=False)
class Extension:
    """A cause with its values, as guessed or fitted from what `context` showed."""

    cause: Cause
    values: Values
    context: Context

    def with_numbers(self, numbers: dict[str, float]) -> Extension:
        """The same with other numbers."""
        return replace(self, values={**self.values, **numbers})

    @property
    def free(self) -> tuple[Parameter, ...]:
        """Parameters that are fitted: all but those read off the records."""
        return tuple(p for p in self.cause.parameters if f"{READ}{p.name}" not in self.values)

    @property
    def coordinates(self) -> tuple[float, ...]:
        """Its free parameters in the coordinates of their priors."""
        return tuple(p.prior.coordinate(float(self.values[p.name])) for p in self.free)

    @property
    def reading_nats(self) -> float:
        """What reading parameters off the records has cost: each had the whole prior to choose from."""
        cost = 0.0
        for parameter in self.cause.parameters:
            if parameter not in self.free:
                value, std = (float(self.values[key]) for key in (parameter.name, f"{READ}{parameter.name}"))
                u = parameter.prior.coordinate(value)
                width = parameter.prior.coordinate(value + std) - parameter.prior.coordinate(value - std)
                cost += 0.5 * u * u + min(-math.log(max(0.5 * width, 1e-9)), _MOST_READING_NATS)
        return max(cost, 0.0)

    def at(self, coordinates: tuple[float, ...]) -> Extension:
        """The same at other coordinates."""
        pairs = zip(self.free, coordinates, strict=True)
        return self.with_numbers({p.name: p.prior.value(u) for p, u in pairs})

    @property
    def words(self) -> dict[str, str]:
        """What it chose, such as the component."""
        return {key: value for key, value in self.values.items() if isinstance(value, str)}

    @property
    def key(self) -> tuple[str, str]:
        """Name and choices: what makes two extensions the same cause."""
        return self.cause.name, json.dumps(self.words, sort_keys=True)


@dataclass(frozen=True, slots=True, eq=False)
class Model:
    """The nominal model under some conditions becomes this one by `content`.

    Attributes
    ----------
    tuning : Tuning
    knobs : tuple of float
        Coordinates of the tuning.
    extensions : tuple of Extension
        In the order in which they were found.
    """

    tuning: Tuning
    knobs: tuple[float, ...]
    extensions: tuple[Extension, ...] = ()

    def content(self, nominal: Content) -> Content:
        """What the scenario of this model holds, under the conditions of `nominal`."""
        content = self.tuning.apply(nominal, self.knobs)
        for extension in self.extensions:
            content = extension.cause.extend(content, extension.values, extension.context)
        return content

    @property
    def coordinates(self) -> tuple[float, ...]:
        """Those of all causes in their order, then those of the tuning."""
        return (*(u for extension in self.extensions for u in extension.coordinates), *self.knobs)

    @property
    def own(self) -> tuple[slice, ...]:
        """Where the coordinates of each cause are."""
        ends = [0]
        for extension in self.extensions:
            ends.append(ends[-1] + len(extension.free))
        return tuple(slice(start, stop) for start, stop in pairwise(ends))

    @property
    def reading_nats(self) -> float:
        """What reading parameters off the records has cost, of all causes."""
        return sum(extension.reading_nats for extension in self.extensions)

    def at(self, coordinates: Sequence[float] | NDArray[np.float64]) -> Model:
        """The same at other coordinates."""
        plain = tuple(float(u) for u in coordinates)
        found = tuple(each.at(plain[own]) for each, own in zip(self.extensions, self.own, strict=True))
        return replace(self, extensions=found, knobs=plain[len(plain) - len(self.knobs) :])

    def tuned(self, knobs: tuple[float, ...]) -> Model:
        """The same with other coordinates of the tuning."""
        return replace(self, knobs=knobs)

    def extended(self, extension: Extension) -> Model:
        """The same with one more cause."""
        return replace(self, extensions=(*self.extensions, extension))

    def with_last(self, extension: Extension) -> Model:
        """The same with another last cause."""
        return replace(self, extensions=(*self.extensions[:-1], extension))

    def without(self, number: int) -> Model:
        """The same without one of its causes."""
        kept = (*self.extensions[:number], *self.extensions[number + 1 :])
        return replace(self, extensions=kept)
