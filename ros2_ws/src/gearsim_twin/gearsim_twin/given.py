"""What can be told of a case before any file is read: names, and files that stand in two places."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from gearsim_io.errors import InputError
from gearsim_io.machines import machine_names, read_machine_file
from gearsim_sim.models import MODELS

__all__ = ["HEALTHY", "HELD_OUT", "MEASURED", "check_given", "model_kind", "stands_twice"]

MEASURED, HELD_OUT, HEALTHY = "MEASURED", "--holdout", "--healthy"
_WANTED = {
    HELD_OUT: "a recording that nothing is fitted to; without --holdout a third of each is held out",
    HEALTHY: "a recording of the machine without the effect",
    MEASURED: "every recording once",
}


def check_given(files: Mapping[str, Sequence[Path | str]], machine: str | Path, model: str) -> None:
    """Refuse what needs no reading to be refused.

    Parameters
    ----------
    files : mapping
        Paths under `MEASURED`, `HELD_OUT` and `HEALTHY`.
    machine, model : str
        As given.

    Raises
    ------
    InputError
        For names that nobody knows, a machine without numbers for a model, a file that is not there or stands
        in two places.
    """
    if model not in MODELS:
        raise InputError("--model", "", model, "one of " + ", ".join(sorted(MODELS)))
    model_kind(machine)
    seen: list[tuple[str, Path]] = []
    for option, paths in files.items():
        for path in map(Path, paths):
            if not path.exists():
                raise InputError(str(path), "", "nothing there", "a bag or a measured file")
            for other, known in seen:
                if os.path.samefile(path, known):
                    raise stands_twice(option, str(path), other, str(known))
            seen.append((option, path))


def model_kind(machine: str | Path) -> str:
    """Kind of the section `model` of a machine's description.

    Raises
    ------
    InputError
        If there is no such machine, or its description has no such section.
    """
    path, content = read_machine_file(machine)
    kind = _kind(content)
    if kind is None:
        able = ", ".join(name for name in machine_names() if _kind(read_machine_file(name)[1]) is not None)
        expected = (
            "a section `model` with masses, stiffnesses and dampers, without which nothing can be simulated "
            f"(docs/rigs.md; the machines {able} have one); `gearsim diagnose` needs none"
        )
        raise InputError(str(path), "model", "nothing", expected)
    return kind


def stands_twice(option: str, name: str, other: str, known: str) -> InputError:
    """The refusal of a recording that stands in two places."""
    place = f"the recording {known}" + (f" of {other}" if other != option else "") + " once more"
    return InputError(option, name, place, _WANTED[option])


def _kind(content: Mapping[str, object]) -> str | None:
    section = content.get("model")
    return str(section["kind"]) if isinstance(section, Mapping) and "kind" in section else None
