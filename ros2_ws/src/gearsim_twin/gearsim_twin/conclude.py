"""From what was selected to what is said."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gearsim_twin.calibrate import Prior
from gearsim_twin.chain_doubts import chain_doubts
from gearsim_twin.choices import Candidate, Choice
from gearsim_twin.compare.discrepancy import Comparison, compare, pooled
from gearsim_twin.compare.merged import Discrepancy, discrepancies
from gearsim_twin.intervals import numbers_of
from gearsim_twin.labels import Label
from gearsim_twin.rivals import alternatives, rejected, variant_of
from gearsim_twin.score import Scores
from gearsim_twin.select import Selection
from gearsim_twin.verdict import Found, Verdict, Word
from gearsim_twin.words import describe_rest, material
from gearsim_twin.workbench import Trial, Workbench

__all__ = ["Evidence", "concluded"]

_HALVED = 0.5


def _no_patterns(rest: Sequence[Discrepancy]) -> tuple[str, ...]:  # noqa: ARG001
    return ()


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """All that a verdict rests on.

    Attributes
    ----------
    bench : Workbench
        Of all channels and records for training, and those held out.
    selection : Selection
    tuned, final : Trial
        The tuned and the extended model on that bench.
    prior : Prior
    scores : Scores
    remarks : tuple of str
    label : Label or None
        What the records say against their labels.
    patterns : callable
        What differences that nothing explains have in common, a phrase each.
    """

    bench: Workbench
    selection: Selection
    tuned: Trial
    final: Trial
    prior: Prior
    scores: Scores
    remarks: tuple[str, ...]
    label: Label | None = None
    patterns: Callable[[Sequence[Discrepancy]], tuple[str, ...]] = _no_patterns

    def comparisons(self, trial: Trial) -> list[Comparison]:
        """Training records beside a model."""
        tau = self.prior.tau_of(self.bench.stack.domains)
        return [compare(self.bench.measured[k], trial.features[k], tau) for k in self.bench.training]


def concluded(evidence: Evidence) -> Verdict:
    """The verdict, its extended model not yet written."""
    selection, scores = evidence.selection, evidence.scores
    before = discrepancies(evidence.comparisons(evidence.tuned))
    after = material(discrepancies(evidence.comparisons(evidence.final)))
    doubts = [chain_doubts(evidence.bench, trial) for trial in (evidence.tuned, evidence.final)]
    after = (*doubts[1], *after)
    found = [_found(choice, k, selection) for k, choice in enumerate(selection.choices)]
    label = evidence.label
    word = _word(bool(found or label), after)
    others = [each for choice in selection.choices for each in alternatives(choice, selection)]
    told = word in ("unknown", "partly_explained")
    unknown = [_unknown(after, selection, evidence.patterns(after))] if told else []
    return Verdict(
        word=word,
        scores=scores,
        discrepancies=(*_first(label, doubts, selection), *_attributed(evidence, before)),
        remaining=after,
        causes=(*(() if label is None else (label.found,)), *found, *others, *unknown),
        rejected=rejected(selection, {each.name for each in (*others, *([label.found] if label else []))}),
        tuning=selection.tuned.trial.model.tuning.factors(selection.final.trial.model.knobs),
        extended_model=None,
        selection=selection,
        remarks=evidence.remarks,
    )


def _first(
    label: Label | None, doubts: Sequence[Sequence[Discrepancy]], selection: Selection
) -> tuple[Discrepancy, ...]:
    """What is wrong as a whole: a label, and channels; with the cause after which a channel is right."""
    left = {each.places[0].channel for each in doubts[1]}
    name = next((choice.key[0] for choice in selection.choices), None)
    channels = (
        replace(each, explained_by=None if each.places[0].channel in left else name) for each in doubts[0]
    )
    return (*(() if label is None else (label.discrepancy,)), *channels)


def _word(found: bool, rest: Sequence[Discrepancy]) -> Word:
    if found:
        return "partly_explained" if rest else "explained"
    return "unknown" if rest else "consistent"


def _found(choice: Choice, number: int, selection: Selection) -> Found:
    model = selection.final.trial.model
    extension = model.extensions[number]
    gain = choice.gain
    assert gain is not None  # none is taken without
    return Found(
        name=extension.cause.name,
        component=extension.words.get("component", ""),
        parameters=numbers_of(selection.final, number),
        heldout_gain_db=gain.gain_db,
        heldout_ci95_db=gain.ci95_db,
        domain=gain.domain,
        probability=choice.probability,
        signature=extension.cause.signature(extension.values),
        variant=variant_of(extension),
        thing=choice.candidate.thing,
        thing_probability=choice.thing_probability,
    )


def _unknown(rest: Sequence[Discrepancy], selection: Selection, patterns: Sequence[str]) -> Found:
    """What none of the causes explains; its probability is that of none of those fitted last."""
    last: Sequence[Candidate] = selection.rounds[-1].candidates if selection.rounds else ()
    against = sum(math.exp(min(each.lead_nats, 50.0)) for each in last if each.gain is not None)
    return Found(
        name="unknown",
        component="",
        parameters=(),
        heldout_gain_db=0.0,
        heldout_ci95_db=(0.0, 0.0),
        domain=rest[0].domain,
        probability=1.0 / (1.0 + against) if not selection.choices else 1.0,
        signature=describe_rest(rest, patterns),
    )


def _attributed(evidence: Evidence, before: Sequence[Discrepancy]) -> tuple[Discrepancy, ...]:
    """Each discrepancy with the cause without which it would be there."""
    selection = evidence.selection
    if not selection.choices:
        return tuple(before)
    model = selection.final.trial.model
    without = evidence.bench.trials([model.without(k) for k in range(len(model.extensions))])
    final = _size(evidence, evidence.final)
    tuned = _size(evidence, evidence.tuned)
    lacking = [_size(evidence, trial) for trial in without]
    places = evidence.bench.measured[evidence.bench.training[0]].places
    index = {place: k for k, place in enumerate(places)}
    found = []
    for each in before:
        rows = [index[place] for place in each.places]
        gone = float(np.mean(final[rows])) < _HALVED * float(np.mean(tuned[rows]))
        worst = int(np.argmax([float(np.mean(sizes[rows])) for sizes in lacking]))
        name = selection.choices[worst].key[0]
        found.append(replace(each, explained_by=name if gone else None))
    return tuple(found)


def _size(evidence: Evidence, trial: Trial) -> np.ndarray:
    return np.abs(pooled(evidence.comparisons(trial)).z)
