"""Names of things to be written, which must not exist yet."""

from __future__ import annotations

from pathlib import Path

from gearsim_io.errors import InputError


def refuse_existing(path: Path, expected: str) -> None:
    """InputError if something of that name exists; `expected` is such as `the name of a new bag`."""
    if path.exists():
        kind = "folder" if path.is_dir() else "file"
        raise InputError(str(path), "", f"a {kind} that exists already", expected)
