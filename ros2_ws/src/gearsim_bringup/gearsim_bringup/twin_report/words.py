"""The verdict in plain words, and the rows of the tables."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import PurePath

from gearsim_bringup.twin_report.numbers import (
    cause_name,
    decibels,
    domain_name,
    parameter_name,
    quantity,
    span,
    step_name,
)
from gearsim_twin.causes import CAUSES
from gearsim_twin.compare.merged import Discrepancy
from gearsim_twin.exhibit import Exhibit
from gearsim_twin.verdict import Found, Verdict

__all__ = [
    "case_line",
    "deciding",
    "difference_rows",
    "finding",
    "headline",
    "record_rows",
    "rest",
    "step_rows",
    "taken",
    "tuning_line",
]

Row = tuple[str, ...]

_STATE = {"consistent": "sound", "explained": "fault", "partly_explained": "open", "unknown": "open"}
_MOST_DIFFERENCES, _MOST_REST = 30, 8
_SPEED = {
    "tacho": "tacho",
    "encoder": "encoder",
    "estimated": "found in the vibration",
    "nameplate": "nameplate",
}


def taken(verdict: Verdict) -> list[Found]:
    """Causes that are in the extended model."""
    return [each for each in verdict.causes if each.name != "unknown" and not each.instead_of]


def headline(verdict: Verdict) -> tuple[str, str, str]:
    """Class of the banner, its words, and the sentence below."""
    scores = verdict.scores.overall
    tuned, extended = scores.models["tuned_only"].value, scores.models["extended"].value
    floor = f"chance alone leaves {decibels(scores.noise_floor)}"
    names = "; ".join(cause_name(each) for each in taken(verdict))
    fall = f"The error on held-out records falls from {tuned:.1f} to {decibels(extended)}; {floor}."
    stays = f"The error on held-out records is {decibels(tuned)}; {floor}."
    if verdict.word == "consistent":
        return _STATE[verdict.word], "The model agrees with the records", f"Nothing differs for sure. {stays}"
    if verdict.word == "explained":
        return _STATE[verdict.word], f"The model misses: {names}", f"That explains what differs. {fall}"
    if verdict.word == "partly_explained":
        return _STATE[verdict.word], f"The model misses: {names}; and something else", fall
    below = f"What differs for sure is described below; no known cause explains it. {stays}"
    return _STATE[verdict.word], "The model misses something that no known cause explains", below


def finding(verdict: Verdict) -> list[str]:
    """What was found, a paragraph per cause."""
    told = []
    for each in taken(verdict):
        told += [_sentence(verdict, each), *verdict.in_place_of(each)]
    return told


def rest(verdict: Verdict) -> tuple[list[str], int]:
    """What no cause explains, what is in excess first; and how many more there are."""
    if verdict.word not in ("unknown", "partly_explained"):
        return [], 0
    first = sorted(verdict.remaining, key=lambda each: (each.size_db < 0, -abs(each.z)))
    return [each.words() for each in first[:_MOST_REST]], max(0, len(first) - _MOST_REST)


def _sentence(verdict: Verdict, found: Found) -> str:
    """ "The model misses lines at 48.4 Hz and multiples: rolling elements slip by ...; the error falls." """
    mine = [each for each in verdict.discrepancies if each.explained_by == found.name]
    # The surest of its domain in which the record has more: what the model misses, and not what that drowns.
    first = min(mine, key=lambda each: (each.domain != found.domain, each.size_db < 0), default=None)
    where = "The model misses " if first is None else f"The model misses {first.where}: "
    numbers = "; ".join(f"{parameter_name(each.name)} {quantity(each)}" for each in found.parameters)
    told = f" ({numbers}, 95 %)" if numbers else ""
    return f"{where}{found.signature}{told}. {_gain(verdict, found)}"


def _gain(verdict: Verdict, found: Found) -> str:
    score, domain = verdict.scores.by_domain.get(found.domain), domain_name(found.domain)
    if score is not None and len(taken(verdict)) == 1:
        before, after = (score.models[name].value for name in ("tuned_only", "extended"))
        return (
            f"With it the held-out {domain} error falls from {before:.1f} to {decibels(after)}, where chance "
            f"alone leaves {decibels(score.noise_floor)}."
        )
    return (
        f"With it the held-out {domain_name(found.domain)} error falls by {decibels(found.heldout_gain_db)}."
    )


def deciding(found: Found) -> list[Row]:
    """With what a cause can be confused, and the measurement that would decide."""
    cause = CAUSES.get(found.name)
    pairs = cause.confused_with if cause is not None else ()
    return [(name.replace("_", " "), measurement) for name, measurement in pairs]


def difference_rows(verdict: Verdict) -> tuple[list[Row], int]:
    """What differed from the tuned model, the surest first; and how many more there are."""
    rows: list[Row] = [
        (each.where, decibels(each.size_db, sign=True), f"{each.z:+.1f}", _explained(each))
        for each in verdict.discrepancies[:_MOST_DIFFERENCES]
    ]
    return rows, max(0, len(verdict.discrepancies) - _MOST_DIFFERENCES)


def _explained(each: Discrepancy) -> str:
    return each.explained_by.replace("_", " ") if each.explained_by else "not explained"


def step_rows(exhibit: Exhibit) -> tuple[list[str], list[Row]]:
    """Domains, and held-out errors of each step by domain; last the noise floor."""
    domains = [name for name, score in exhibit.scores.by_domain.items() if score.places]
    rows = []
    for key, step in zip(exhibit.keys, exhibit.steps, strict=True):
        overall = exhibit.scores.overall.models[key]
        each = [f"{exhibit.scores.by_domain[name].models[key].value:.1f}" for name in domains]
        rows.append((step_name(step.name, step.component), f"{overall.value:.1f}", span(overall.ci95), *each))
    floors = [f"{exhibit.scores.by_domain[name].noise_floor:.1f}" for name in domains]
    rows.append(("chance alone (noise floor)", f"{exhibit.scores.overall.noise_floor:.1f}", "", *floors))
    return [domain_name(name) for name in domains], rows


def tuning_line(verdict: Verdict) -> str:
    """What the tuning did."""
    changed = [f"{name} × {factor:.3f}" for name, factor in verdict.tuning.items() if abs(factor - 1) > 5e-4]
    return f"Tuned before anything was concluded: {', '.join(changed)}." if changed else ""


def case_line(exhibit: Exhibit) -> str:
    """The case in one line below the machine's name."""
    count = {
        role: sum(each.role == role for each in exhibit.given) for role in ("training", "held out", "healthy")
    }
    parts = [f"{number} {role}" for role, number in count.items() if number]
    split = "; the held-out part is the last third of each record" if exhibit.split else ""
    return f"model {exhibit.model}; records: {', '.join(parts)}{split}"


def record_rows(exhibit: Exhibit) -> Iterator[Row]:
    """Every record: what for, how long, how fast, under what load."""
    for each in exhibit.given:
        error = f" ± {100 * each.relative_error:.2g} %" if math.isfinite(each.relative_error) else ""
        speed = f"{each.speed_hz:.4f} Hz{error} ({_SPEED.get(each.speed_source, each.speed_source)})"
        load = "as described" if each.load_nm is None else f"{each.load_nm:.4g} N m"
        length = f"{each.seconds:.2f} s at {each.rate_hz:g} Hz"
        name = PurePath(each.source).name or "record"
        yield name, each.role, length, ", ".join(each.channels), speed, load
