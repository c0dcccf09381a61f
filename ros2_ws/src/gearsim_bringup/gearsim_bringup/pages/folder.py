"""The folder of a report: refused at once where it cannot be made, written whole or not at all."""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path

from gearsim_io.errors import InputError
from gearsim_io.new_paths import refuse_existing

__all__ = ["check_folder", "placed"]

_EXPECTED = "the name of a new folder"


def check_folder(folder: Path) -> None:
    """Refuse at once what could not be written at the end.

    Raises
    ------
    InputError
        If something of that name exists, or what is above it is no folder or may not be written to.
    """
    refuse_existing(folder, _EXPECTED)


def placed(folder: Path, files: dict[str, str]) -> tuple[Path, ...]:
    """All files in a folder beside, which then takes the name."""
    made: Path | None = None
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        made = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
        for name, content in files.items():
            (made / name).write_text(content, encoding="utf-8")
        made.chmod(0o755)
        refuse_existing(folder, _EXPECTED)
        os.rename(made, folder)
    except OSError as error:
        raise InputError(str(folder), "", error.strerror or str(error), _EXPECTED) from error
    finally:
        if made is not None:
            shutil.rmtree(made, ignore_errors=True)
    return tuple(folder / name for name in files)
