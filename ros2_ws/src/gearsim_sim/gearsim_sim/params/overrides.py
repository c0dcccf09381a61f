"""Single numbers of a machine's `model` section replaced by a scenario's, under dotted names."""

from __future__ import annotations

import copy
import re
from collections.abc import Mapping
from typing import Any

from gearsim_io.errors import InputError

_QUANTITY = re.compile(r"\s*([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*(\S.*?)?\s*$")
_SOURCE = "scenario"


def override(section: Mapping[str, Any], overrides: Mapping[str, Any], where: str) -> dict[str, Any]:
    """A copy of `section` with what `overrides` names replaced, such as `{"pedestal.mass": "10 kg"}`.

    Parameters
    ----------
    section : mapping
        Plain content of a `model` section; each number is `{value, unit, source}`.
    overrides : mapping
        Dotted name to `"10 kg"`, `{value: 10, unit: kg}` or, without unit, a plain number; a choice is
        replaced by another word.
    where : str
        Named in errors.

    Raises
    ------
    InputError
        A name that the section does not have, or that is not a single number or choice.
    """
    result = copy.deepcopy(dict(section))
    for name, value in overrides.items():
        *path, last = name.split(".")
        place: Any = result
        for part in path:
            place = _inner(place, part, f"parameters.{name}", where)
        old = _inner(place, last, f"parameters.{name}", where)
        if path and isinstance(old, str) and isinstance(value, str):
            place[last] = value  # a choice, such as mesh.stiffness_model; not the kind of the model
            continue
        if not isinstance(old, dict) or "value" not in old:
            expected = _known(old) if isinstance(old, dict) else "the name of a number of the model"
            raise InputError(where, f"parameters.{name}", value, expected)
        place[last] = _quantity(value)
    return result


def _inner(place: Any, part: str, field: str, where: str) -> Any:
    if not isinstance(place, dict) or "value" in place or part not in place:
        raise InputError(where, field, part, _known(place))
    return place[part]


def _quantity(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {"source": _SOURCE, **value}
    if isinstance(value, str) and (match := _QUANTITY.match(value)):
        return {"value": match[1], "unit": match[2] or "", "source": _SOURCE}
    return {"value": value, "unit": "", "source": _SOURCE}


def split_quantity(value: Any) -> tuple[float, str]:
    """Number and unit of a value as `override` takes it; ValueError if it has no number."""
    quantity = _quantity(value)
    try:
        return float(quantity["value"]), str(quantity.get("unit", ""))
    except (KeyError, TypeError, ValueError):
        raise ValueError(f"{value!r} is no quantity") from None


def _known(place: Any) -> str:
    if isinstance(place, dict) and "value" not in place:
        return "one of " + ", ".join(sorted(str(key) for key in place))
    return "no further name, as this is a number already"
