"""Changes of a scenario's content that many causes make; each returns a new content."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

from gearsim_twin.causes.cause import Content


def with_fault(content: Content, kind: str, component: str, params: Mapping[str, Any]) -> Content:
    """With one more fault from the first sample; `params` in the units of their keys."""
    fault = {"kind": kind, "component": component, "params": dict(params)}
    return {**copy.deepcopy(content), "faults": [*copy.deepcopy(content.get("faults", ())), fault]}


def with_parameter(content: Content, name: str, value: float, unit: str) -> Content:
    """With another number of the machine's model, by its dotted name such as `mesh.mean_stiffness`."""
    changed = copy.deepcopy(content)
    changed.setdefault("parameters", {})[name] = {"value": float(value), "unit": unit}
    return changed


def with_section(content: Content, path: str, value: Any) -> Content:
    """With `value` at a dotted path, such as `operating_point.speed`; levels that lack are made."""
    changed = copy.deepcopy(content)
    *above, last = path.split(".")
    place = changed
    for key in above:
        place = place.setdefault(key, {})
    place[last] = copy.deepcopy(value)
    return changed


def with_entry(content: Content, path: str, entry: Any) -> Content:
    """With one more entry in the list at a dotted path, such as `structure.resonances`."""
    present: Any = content
    for key in path.split("."):
        present = present.get(key, {}) if isinstance(present, Mapping) else {}
    return with_section(content, path, [*(present or ()), entry])


def with_sensor(content: Content, channel: str | None, key: str, value: Any) -> Content:
    """With a property of one accelerometer, or of all where `channel` is None, such as `range`."""
    row = "all" if channel is None else f"each.{channel}"
    return with_section(content, f"sensors.accelerometers.{row}.{key}", value)
