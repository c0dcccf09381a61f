"""Names of things to be written, which must not exist yet, in a place where they can be made."""

from __future__ import annotations

import os
from pathlib import Path

from gearsim_io.errors import InputError


def refuse_existing(path: Path, expected: str) -> None:
    """InputError if something of that name exists or cannot be made; `expected`: `the name of a new bag`."""
    if path.exists():
        kind = "folder" if path.is_dir() else "file"
        raise InputError(str(path), "", f"a {kind} that exists already", expected)
    if path.is_symlink():
        raise InputError(str(path), "", "a link that leads nowhere", expected)
    check_place(path, expected)


def check_place(path: Path, expected: str) -> None:
    """InputError if what is above `path` is no folder or may not be written to."""
    above = next(parent for parent in path.absolute().parents if parent.exists())
    if not above.is_dir():
        raise InputError(str(path), "", f"{above} is a file", expected)
    if not os.access(above, os.W_OK | os.X_OK):
        raise InputError(str(path), "", f"{above} may not be written to", expected)
