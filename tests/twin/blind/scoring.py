"""Verdict against truth."""

from __future__ import annotations

import math
import re
from typing import Any

# Causes that one set of records at one speed and load cannot tell apart, whatever is made of it.
ALIKE = (
    # A stiffer or advanced planet and one that is told to carry more: the same forces at a given load.
    frozenset({"unequal_load_sharing", "planet_position_error"}),
    # Both move the cage; without the balls' own frequency, or a second load, nothing tells them apart.
    frozenset({"cage_slip", "bearing_geometry"}),
    # A localised pit that its ring leaves before the element reaches the floor is a short wide one.
    frozenset({"bearing_spall_outer", "wide_spall"}),
    frozenset({"bearing_spall_inner", "wide_spall"}),
    # At one load a tooth that gives way by force over stiffness is a tooth that is out of place by as much.
    frozenset({"tooth_crack", "tooth_pitch_error"}),
)
_NUMBER = re.compile(r"(\d+(?:\.\d+)?(?:e[-+]?\d+)?)")
_TOLERANCE = 0.02
_TOLERANCE_HZ = 0.7
_FAMILY = 8


def alike(one: str, other: str) -> bool:
    """Whether two names are the same or cannot be told apart by construction."""
    return one == other or any({one, other} <= family for family in ALIKE)


def named(verdict: dict[str, Any]) -> list[str]:
    """Causes in the order of the verdict, those that could merely stand in for another left out."""
    return [one["name"] for one in verdict["causes"] if not one.get("instead_of")]


def also(verdict: dict[str, Any]) -> list[str]:
    """All causes that are put forward at all, in order."""
    return [one["name"] for one in verdict["causes"]]


def score(truth: dict[str, Any], kind: str, verdict: dict[str, Any]) -> dict[str, Any]:
    """What of a case is right.

    Returns
    -------
    dict
        `first`, `second`: the causes named first and second ("" for none); `strict`, `lenient`: whether the
        truth is named as it has to be, with families of `ALIKE` told apart and not; `false`: causes named
        that are neither hidden nor alike to one; `parameters`: name to (truth, value, low, high);
        `closed`, `closed_by_tuning`: share of the gap in the affected domain; `gain_db`; `says_unknown`;
        `frequency_told`.
    """
    hidden = [one["name"] for one in truth["effects"]]
    causes = [name for name in named(verdict) if name != "unknown"]
    result: dict[str, Any] = {
        "word": verdict["verdict"],
        "causes": also(verdict),
        "first": causes[0] if causes else "",
        "second": causes[1] if len(causes) > 1 else "",
    }
    result["false"] = [name for name in causes if not any(alike(name, one) for one in hidden)]
    result["says_unknown"] = verdict["verdict"] in ("unknown", "partly_explained")
    result["strict"], result["lenient"] = _right(kind, hidden, causes, also(verdict), result)
    if kind == "outside":
        result["frequency_told"] = tells(verdict, truth["effects"][0]["hz"], truth["speed_hz"])
        folded = truth["effects"][0].get("what") == "missing_antialias" and "antialias_rolloff" in causes
        result["lenient"] = (result["strict"] and result["frequency_told"]) or folded
    result["parameters"] = _parameters(truth, verdict)
    return {**result, **_closed(verdict, hidden)}


def _right(
    kind: str, hidden: list[str], causes: list[str], every: list[str], result: dict[str, Any]
) -> tuple[bool, bool]:
    if kind == "none":
        return not causes, not causes
    if kind == "outside":
        return bool(result["says_unknown"]), bool(result["says_unknown"])
    if kind == "single":
        first = result["first"]
        return first == hidden[0], bool(first) and alike(first, hidden[0])
    return all(one in causes for one in hidden), all(any(alike(one, c) for c in every) for one in hidden)


def tells(verdict: dict[str, Any], hz: list[float], speed_hz: float) -> bool:
    """Whether one of the frequencies stands in what is not explained, in Hz or as an order."""
    words = [one["where"] for one in verdict["discrepancies"] if one["explained_by"] in (None, "", "unknown")]
    words += [one["signature"] for one in verdict["causes"] if one["name"] == "unknown"]
    numbers = [float(n) for text in words for n in _NUMBER.findall(text)]
    for true in hz:
        for told in numbers:
            for as_hz in (told, told * 1e3, told * speed_hz):
                if abs(as_hz - true) <= max(_TOLERANCE * true, _TOLERANCE_HZ):
                    return True
    return False


def _parameters(truth: dict[str, Any], verdict: dict[str, Any]) -> dict[str, list[float]]:
    found = {}
    for hidden in truth["effects"]:
        told = next((one for one in verdict["causes"] if one["name"] == hidden["name"]), None)
        for name, value in hidden["parameters"].items():
            number = (told or {"parameters": {}})["parameters"].get(name)
            if number is not None and number.get("ci95") and math.isfinite(value):
                low, high = number["ci95"]
                found[f"{hidden['name']}.{name}"] = [value, number["value"], low, high]
    return found


def _closed(verdict: dict[str, Any], hidden: list[str]) -> dict[str, Any]:
    """Gap between the nominal model's held-out error and the floor, closed, in the domain most affected."""
    domains = verdict["score"].get("by_domain") or {"overall": verdict["score"]}
    told = next((one for one in verdict["causes"] if one["name"] in hidden), None)
    gaps = {
        name: one["baseline"] - one["noise_floor"]
        for name, one in domains.items()
        if None not in (one.get("baseline"), one.get("noise_floor"))
    }
    if not gaps:
        return {}
    domain = told["domain"] if told and told.get("domain") in gaps else max(gaps, key=lambda name: gaps[name])
    one, gap = domains[domain], max(gaps[domain], 1e-9)
    gains = [each["heldout_gain_db"] for each in verdict["causes"] if each["name"] in hidden]
    return {
        "domain": domain,
        "gap_db": gap,
        "closed": (one["baseline"] - one["extended"]) / gap,
        "closed_by_tuning": (one["baseline"] - one["tuned_only"]) / gap,
        "gain_db": gains[0] if gains else None,
    }
