"""A model under judgement: the nominal one, tuned, and extended by causes."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gearsim_twin.causes.cause import Cause, Content, Values
from gearsim_twin.causes.context import Context
from gearsim_twin.tuning import Tuning

__all__ = ["Extension", "Model"]


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
    def coordinates(self) -> tuple[float, ...]:
        """Its parameters in the coordinates of their priors."""
        return tuple(p.prior.coordinate(float(self.values[p.name])) for p in self.cause.parameters)

    def at(self, coordinates: tuple[float, ...]) -> Extension:
        """The same at other coordinates."""
        pairs = zip(self.cause.parameters, coordinates, strict=True)
        return self.with_numbers({p.name: p.prior.value(u) for p, u in pairs})

    @property
    def words(self) -> dict[str, str]:
        """What it chose, such as the component."""
        numbers = {parameter.name for parameter in self.cause.parameters}
        return {k: str(v) for k, v in self.values.items() if k not in numbers}

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
            ends.append(ends[-1] + len(extension.cause.parameters))
        return tuple(slice(start, stop) for start, stop in pairwise(ends))

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
