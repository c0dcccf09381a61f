"""What the judge says, for programs and for people."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from gearsim_twin.compare.merged import Discrepancy
from gearsim_twin.exhibit import Exhibit
from gearsim_twin.score import METRIC, Interval, Scores
from gearsim_twin.select import Selection

__all__ = ["Found", "Number", "Rejected", "Verdict", "Word"]

Word = Literal["consistent", "explained", "partly_explained", "unknown"]


@dataclass(frozen=True, slots=True)
class Number:
    """A fitted parameter with its 95 % interval."""

    name: str
    unit: str
    value: float
    ci95: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Found:
    """A cause that was found, or `unknown` for what none explains.

    Attributes
    ----------
    name : str
    component : str
        That has it; "" where that is no question.
    parameters : tuple of Number
    heldout_gain_db : float
        By how much it lowers the held-out rms error in the domain that it affects.
    heldout_ci95_db : tuple of float
    domain : str
    probability : float
    signature : str
        What it shows, in plain words; of what cannot be told from it, what would decide.
    instead_of : str
        The cause in whose place it could stand and from which the records cannot tell it; it is then not in
        the extended model.
    variant : str
        Which form of the cause it is, where one name has several.
    thing : str
        What is wrong in plain words, where several causes are names of it; else "".
    thing_probability : float
        That it is there, by whichever name.
    """

    name: str
    component: str
    parameters: tuple[Number, ...]
    heldout_gain_db: float
    heldout_ci95_db: tuple[float, float]
    domain: str
    probability: float
    signature: str
    instead_of: str = ""
    variant: str = ""
    thing: str = ""
    thing_probability: float = 0.0


@dataclass(frozen=True, slots=True)
class Rejected:
    """A rival, and why it lost; the gain is None where it was not near enough to be asked."""

    name: str
    component: str
    why: str
    heldout_gain_db: float | None
    probability: float


@dataclass(frozen=True, slots=True, eq=False)
class Verdict:
    """All that was found.

    Attributes
    ----------
    word : str
    scores : Scores
        On held-out records, of `baseline`, `tuned_only` and `extended`.
    discrepancies : tuple of Discrepancy
        Between the training records and the tuned model, with the cause that takes each away.
    remaining : tuple of Discrepancy
        Between them and the extended model.
    causes : tuple of Found
    rejected : tuple of Rejected
    tuning : mapping of str to float
        Factor of each number that was tuned.
    extended_model : Path or None
        File of the extended model.
    selection : Selection
        How it was found, for reports.
    remarks : tuple of str
    exhibit : Exhibit or None
        What a page shows beside all this; only where it was asked for.
    """

    word: Word
    scores: Scores
    discrepancies: tuple[Discrepancy, ...]
    remaining: tuple[Discrepancy, ...]
    causes: tuple[Found, ...]
    rejected: tuple[Rejected, ...]
    tuning: dict[str, float]
    extended_model: Path | None
    selection: Selection
    remarks: tuple[str, ...] = ()
    exhibit: Exhibit | None = None

    def to_json(self) -> dict[str, Any]:
        """As `twin --json` prints it."""
        overall = self.scores.overall
        models = {name: _rounded(value.value) for name, value in overall.models.items()}
        return {
            "verdict": self.word,
            "score": {
                "metric": METRIC,
                **models,
                "noise_floor": _rounded(overall.noise_floor),
                "heldout": True,
                "ci95": {name: _pair(value) for name, value in overall.models.items()},
                "by_domain": self._domains(),
            },
            "discrepancies": [each.to_json() for each in self.discrepancies],
            "causes": [_found(each) for each in self.causes],
            "rejected": [
                {
                    "name": each.name,
                    "why": each.why,
                    "heldout_gain_db": _rounded(each.heldout_gain_db),
                }
                for each in self.rejected
            ],
            "extended_model": None if self.extended_model is None else str(self.extended_model),
            "remarks": list(self.remarks),
        }

    def _domains(self) -> dict[str, Any]:
        return {
            name: {
                **{model: _rounded(value.value) for model, value in score.models.items()},
                "noise_floor": _rounded(score.noise_floor),
                "places": score.places,
            }
            for name, score in self.scores.by_domain.items()
        }

    def written(self, path: Path) -> Verdict:
        """The same with the file of its extended model."""
        return replace(self, extended_model=path)

    def comments(self) -> tuple[str, ...]:
        """What was fitted and how sure it is, for the file of the extended model."""
        tuned = ", ".join(f"{name} x {factor:.3f}" for name, factor in self.tuning.items())
        numbers = [
            f"{_name(each)}, probability {each.probability:.2f}: "
            + (", ".join(map(_interval, each.parameters)) or "no parameters")
            for each in self.causes
            if each.name != "unknown" and not each.instead_of
        ]
        return (self.words(), f"Tuned: {tuned or 'nothing'}.", *(f"Fitted: {each}." for each in numbers))

    def in_place_of(self, found: Found) -> list[str]:
        """What could stand in place of a cause, a sentence each; other names of the same thing in one."""
        others = [each for each in self.causes if each.instead_of == found.name]
        same = [each for each in others if each.thing and each.thing == found.thing]
        told = []
        if same:
            names = " or ".join(f"{_form(each)} ({each.probability:.2f})" for each in (found, *same))
            sure = f"Sure is {found.thing} (probability {found.thing_probability:.2f})"
            told.append(f"{sure}; open is whether it is {names}.")
        told += [
            f"{each.name} could stand in place of {found.name}: from these records the two cannot be told "
            f"apart (probability {each.probability:.2f})."
            for each in others
            if each not in same
        ]
        return told

    def words(self) -> str:
        """The finding in plain words, a sentence or a few."""
        scores = self.scores.overall.models
        if self.word == "consistent":
            return (
                f"The model is consistent with the records: nothing differs for certain once it is tuned "
                f"(held-out error {scores['tuned_only'].value:.1f} dB)."
            )
        named = [each for each in self.causes if each.name != "unknown" and not each.instead_of]
        parts = []
        for each in named:
            parts += [_sentence(each), *self.in_place_of(each)]
        unknown = next((each for each in self.causes if each.name == "unknown"), None)
        if unknown is not None:
            parts.append(
                ("What remains" if named else "Something") + f" has no known cause: {unknown.signature}."
            )
        change = f"{scores['tuned_only'].value:.1f} to {scores['extended'].value:.1f} dB"
        return " ".join(parts) + (f" The held-out error falls from {change}." if named else "")


def _sentence(found: Found) -> str:
    numbers = ", ".join(map(_interval, found.parameters))
    told = f" ({numbers})" if numbers else ""
    gain = f"the held-out {found.domain} error falls by {found.heldout_gain_db:.1f} dB"
    return f"The model misses {_name(found)}{told}: {found.signature}; with it {gain}."


def _form(found: Found) -> str:
    """Its name, and which form of the cause it is."""
    return f"{found.name} by {found.variant}" if found.variant else found.name


def _name(found: Found) -> str:
    return f"{found.name} of {found.component}" if found.component else found.name


def _interval(number: Number) -> str:
    low, high = number.ci95
    return f"{number.name} {number.value:.3g} {number.unit} ({low:.3g} to {high:.3g})"


def _found(found: Found) -> dict[str, Any]:
    parameters: dict[str, Any] = {
        each.name: {"value": each.value, "unit": each.unit, "ci95": list(each.ci95)}
        for each in found.parameters
    }
    return {
        "name": found.name,
        "component": found.component,
        "parameters": parameters,
        "heldout_gain_db": _rounded(found.heldout_gain_db),
        "heldout_gain_ci95_db": [_rounded(value) for value in found.heldout_ci95_db],
        "probability": round(found.probability, 4),
        "signature": found.signature,
        "domain": found.domain,
        "instead_of": found.instead_of,
        "variant": found.variant,
        "thing": {"name": found.thing, "probability": round(found.thing_probability, 4)}
        if found.thing
        else None,
    }


def _pair(value: Interval) -> list[float | None]:
    return [_rounded(each) for each in value.ci95]


def _rounded(value: float | None) -> float | None:
    """JSON has no NaN."""
    return None if value is None or value != value else round(value, 3)
