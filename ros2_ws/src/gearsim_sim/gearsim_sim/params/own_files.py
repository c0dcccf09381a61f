"""Where the files lie that a machine's description, or a scenario in its place, names."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gearsim_io.machines import read_machine_file

__all__ = ["beside"]


def beside(
    machine: str | Path, overrides: Mapping[str, Any] | None, source: str, section: str, key: str, name: str
) -> str:
    """A shipped name as it is; a file's path (.npz) from the folder of what names it.

    Parameters
    ----------
    machine, overrides, source
        As of `load_parallel_params`.
    section, key, name : str
        What names it, and the name.
    """
    if not name.endswith(".npz"):
        return name
    replaced = overrides is not None and f"{section}.{key}" in overrides
    folder = Path(source) if replaced else read_machine_file(machine)[0]
    return str(folder.parent / name)
