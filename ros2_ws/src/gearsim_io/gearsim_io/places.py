"""Places in YAML as errors name them; entries of lists are counted from 1, and it is said so."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any


def entry(name: str, index: int, count: int) -> str:
    """An entry of a list by its index from 0, as in `faults (entry 1 of 3)`."""
    return f"{name} (entry {index + 1} of {count})"


def place_in(content: Any, path: Sequence[int | str]) -> str:
    """The dotted place at the end of a path through `content`, as in `faults (entry 1 of 3).kind`."""
    parts: list[str] = []
    for step in path:
        if isinstance(step, int) and isinstance(content, (list, tuple)) and parts:
            parts[-1] = entry(parts[-1], step, len(content))
            content = content[step] if step < len(content) else None
        else:
            parts.append(str(step))
            content = content.get(step) if isinstance(content, Mapping) else None
    return ".".join(parts)
