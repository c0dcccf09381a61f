"""Where measured records lie here: a folder of one's own, or the cache of `./gearsim data get`."""

from __future__ import annotations

import os
from pathlib import Path

from gearsim_io.errors import EnvironmentLackError

_REPOSITORY = Path(__file__).resolve().parents[4]


def cache_folder() -> Path:
    """Where this program keeps what it fetched: `$GEARSIM_CACHE`, else `gearsim` in the user's cache."""
    own = os.environ.get("GEARSIM_CACHE")
    if own:
        return Path(own)
    home = os.environ.get("XDG_CACHE_HOME")
    return (Path(home) if home else Path.home() / ".cache") / "gearsim"


def data_folders() -> tuple[Path, ...]:
    """Folders that may hold records, the first to be asked first, whether they exist or not.

    `$GEARSIM_DATA`, then `../shared/data` beside the repository, then the cache. Below each of them
    the records of one machine lie in a folder of their own, such as `mfpt/baseline_1.mat`.
    """
    own = os.environ.get("GEARSIM_DATA")
    folders = [Path(own)] if own else []
    if (_REPOSITORY / "ros2_ws").is_dir():
        folders.append(_REPOSITORY.parent / "shared" / "data")
    return (*folders, cache_folder())


def find_record(relative: str) -> Path | None:
    """The record of that path below one of `data_folders()`, None if no folder has it."""
    for folder in data_folders():
        path = folder / relative
        if path.is_file():
            return path
    return None


def require_record(relative: str) -> Path:
    """The record of that path below one of `data_folders()`.

    Raises
    ------
    EnvironmentLackError
        If no folder has it.
    """
    path = find_record(relative)
    if path is None:
        looked = ", ".join(str(folder) for folder in data_folders())
        raise EnvironmentLackError(f"no record {relative} in {looked}", "./gearsim data get mfpt")
    return path
