"""What a cause may look at when it guesses its parameters: data, and the present model beside them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from gearsim_twin.causes.cause import Content

if TYPE_CHECKING:
    from gearsim_twin.case import Case
    from gearsim_twin.compare.discrepancy import Comparison
    from gearsim_twin.compare.features import Features
    from gearsim_twin.compare.places import Place
    from gearsim_twin.view import View


@dataclass(frozen=True, slots=True)
class Difference:
    """Measured minus simulated at one place of one record; `z` is in standard deviations."""

    record: int
    place: Place
    measured_db: float
    simulated_db: float
    difference_db: float
    z: float


@dataclass(frozen=True, slots=True, eq=False)
class Context:
    """The training records beside the present model, each tuple with one entry per record.

    Attributes
    ----------
    case : Case
    views : tuple of View
        The measured records with their angle.
    measured, simulated : tuple of Features
        At the same places; `simulated` of the present model with its nuisances (gain, floor) in place.
    comparison : tuple of Comparison
    contents : tuple of dict
        The present model under the conditions of each record.
    simulated_views : tuple of View
        What the present model gave.
    noisy_views : tuple of View
        The same with the noise of the sensors that the records tell; empty where that is not known.
    more_views, more_contents
        Further records under the same conditions, not simulated, and the model under these: for what is read
        off records alone.
    healthy_views : tuple of View
        For each record one of the healthy machine under much the same conditions; no cause shows in it.
        Empty where there are none, and once the model has causes.
    gains_db : mapping of str to float
        By channel, the gain of the measuring chain that `simulated` has been given.
    """

    case: Case
    views: tuple[View, ...]
    measured: tuple[Features, ...]
    simulated: tuple[Features, ...]
    comparison: tuple[Comparison, ...]
    contents: tuple[Content, ...]
    simulated_views: tuple[View, ...]
    noisy_views: tuple[View, ...] = ()
    more_views: tuple[View, ...] = ()
    more_contents: tuple[Content, ...] = ()
    gains_db: Mapping[str, float] = field(default_factory=dict)
    healthy_views: tuple[View, ...] = ()

    def differences(
        self, domain: str, channel: str | None = None, kind: str | None = None
    ) -> tuple[Difference, ...]:
        """What differs in a domain, the most significant excess of the measurement first."""
        found = [
            entry
            for entry in self._all()
            if entry.place.domain == domain
            and (channel is None or entry.place.channel == channel)
            and (kind is None or entry.place.kind == kind)
        ]
        return tuple(sorted(found, key=lambda entry: -entry.z))

    def _all(self) -> Iterator[Difference]:
        rows = zip(self.measured, self.simulated, self.comparison, strict=True)
        for record, (measured, simulated, comparison) in enumerate(rows):
            for k, place in enumerate(measured.places):
                yield Difference(
                    record,
                    place,
                    float(measured.level_db[k]),
                    float(simulated.level_db[k]),
                    float(comparison.difference_db[k]),
                    float(comparison.z[k]),
                )
