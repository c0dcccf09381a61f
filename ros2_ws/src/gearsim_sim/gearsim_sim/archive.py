"""Arrays with a description in one file (.npz): shipped by name, written whole, read with clear errors."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from gearsim_io.errors import InputError

_DAMAGED = (OSError, ValueError, KeyError, TypeError, AttributeError, EOFError, zipfile.BadZipFile)


def find_archive(name_or_path: str, shipped: Path, where: str) -> Path:
    """The file shipped in a folder under a name, or one of one's own (.npz); InputError for other names."""
    path = Path(name_or_path)
    if path.suffix == ".npz":
        return path
    known = sorted(file.stem for file in shipped.glob("*.npz"))
    if name_or_path not in known:
        expected = f"one of {', '.join(known)}, or the path of a .npz file"
        raise InputError(where, "", name_or_path, expected)
    return shipped / f"{name_or_path}.npz"


def write_archive(path: Path, about: Mapping[str, Any], arrays: Mapping[str, Any]) -> None:
    """Write one compressed .npz; a file that is there is replaced only by a whole one."""
    part = path.with_name(path.name + ".part")
    with part.open("wb") as file:
        np.savez_compressed(file, about=np.array(json.dumps(about)), **arrays)
    part.replace(path)


@contextmanager
def read_archive(path: Path, kind: str, expected: str) -> Iterator[tuple[Any, dict[str, Any]]]:
    """What `write_archive` wrote: the description and the arrays.

    A file that is missing or damaged, also one whose content fails in the block, gives an InputError that
    says which `kind` of file is `expected`.
    """
    where = str(path)
    try:
        with np.load(path, allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
        yield json.loads(str(arrays.pop("about"))), arrays
    except FileNotFoundError:
        raise InputError(where, "", "no such file", f"{kind} (.npz)") from None
    except InputError:
        raise
    except _DAMAGED as error:
        raise InputError(where, "", f"{type(error).__name__}: {error}", expected) from None
