"""What a reader finds in a measured file, before anything is known of its meaning."""

from __future__ import annotations

import fnmatch
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import EnvironmentLackError, InputError


@dataclass(slots=True)
class Content:
    """Named signals and values of one file.

    Parameters
    ----------
    arrays : dict of str to ndarray of shape (samples,)
        Numeric vectors; a struct's field is `struct.field`, column k of a matrix is `matrix[k]`.
    values : dict of str to float or str
        Single numbers and texts.
    rates_hz : dict of str to float
        Sampling rates that the format itself states, by the name of the field that states them.
    units : dict of str to str
        Units that the format states, by array.
    notes : dict of str to str
        What the reader had to decide.
    """

    arrays: dict[str, NDArray[Any]] = field(default_factory=dict)
    values: dict[str, float | str] = field(default_factory=dict)
    rates_hz: dict[str, float] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    notes: dict[str, str] = field(default_factory=dict)

    def add(self, name: str, value: Any) -> None:
        """Take in whatever a file holds under a name: numbers, texts, vectors, matrices; the rest is left."""
        if isinstance(value, (str, bytes)):
            self.values[name] = value.decode("utf-8", "replace") if isinstance(value, bytes) else value
            return
        array = np.asarray(value)
        if array.dtype.kind in "US" and array.size == 1:
            self.values[name] = str(array.reshape(-1)[0])
        elif array.dtype.kind in "biuf":
            self._add_numbers(name, array)

    def _add_numbers(self, name: str, array: NDArray[Any]) -> None:
        squeezed = np.squeeze(array)
        if squeezed.ndim == 0:
            self.values[name] = float(squeezed)
        elif squeezed.ndim == 1:
            self.arrays[name] = squeezed
        elif squeezed.ndim == 2:
            columns = squeezed if squeezed.shape[0] >= squeezed.shape[1] else squeezed.T
            for k in range(columns.shape[1]):
                self.arrays[f"{name}[{k + 1}]"] = columns[:, k]

    def listing(self) -> str:
        """What is there, for error messages."""
        arrays = [f"{name} ({array.size} values)" for name, array in self.arrays.items()]
        return ", ".join([*arrays, *self.values]) or "nothing readable"

    def array(self, where: str, pattern: str) -> tuple[str, NDArray[Any]]:
        """The one array whose name fits a pattern (`X*_DE_time`); InputError if none or several do."""
        found = [name for name in self.arrays if _fits(name, pattern)]
        if pattern == "*" and len(found) > 1:  # "the only one" does not count short helpers
            longest = max(self.arrays[name].size for name in found)
            found = [name for name in found if self.arrays[name].size == longest]
        if len(found) == 1:
            return found[0], self.arrays[found[0]]
        if not found:
            expected = f"a variable of that name; the file has {self.listing()}"
            raise InputError(where, pattern, "not in the file", expected)
        raise InputError(where, pattern, ", ".join(found), "a pattern that fits one variable only")

    def value(self, pattern: str) -> tuple[str, float | str] | None:
        """The first single value whose name fits a pattern, with its name."""
        for name, value in self.values.items():
            if _fits(name, pattern):
                return name, value
        return None


Reader = Callable[[Path], Content]
READERS: dict[str, Reader] = {}


def reads(*suffixes: str) -> Callable[[Reader], Reader]:
    """Register a reader for files with these suffixes."""

    def register(reader: Reader) -> Reader:
        READERS.update(dict.fromkeys(suffixes, reader))
        return reader

    return register


def suffix_of(path: Path) -> str:
    """The suffix that chooses the reader; `.csv.gz` counts as one."""
    name = path.name.lower()
    return next((suffix for suffix in sorted(READERS, key=len, reverse=True) if name.endswith(suffix)), "")


def stem_of(path: Path) -> str:
    """The file's name without the suffix that chose the reader."""
    return path.name[: len(path.name) - len(suffix_of(path))]


def read_content(path: Path) -> Content:
    """What is in a measured file.

    Raises
    ------
    InputError
        If it does not exist, has an unknown suffix or cannot be read.
    EnvironmentLackError
        If the library for this format is not installed.
    """
    where = str(path)
    if not path.is_file():
        raise InputError(where, "", "no such file", "a measured file")
    reader = READERS.get(suffix_of(path))
    if reader is None:
        raise InputError(where, "", path.suffix or "no suffix", "one of " + ", ".join(sorted(READERS)))
    if path.stat().st_size == 0:
        raise InputError(where, "", "an empty file", "a measured file")
    try:
        return reader(path)
    except (InputError, EnvironmentLackError):
        raise
    except ImportError as error:
        library = error.name or str(error)
        raise EnvironmentLackError(f"{library} is not installed", f"pip install {library}") from None
    except Exception as error:  # what the libraries raise on damaged files is not listed anywhere
        kind = suffix_of(path).lstrip(".")
        raise InputError(where, "", _damage(error), f"a readable .{kind} file") from None


def _damage(error: Exception) -> str:
    """What a reading library found, in words where it is usual."""
    if isinstance(error, UnicodeDecodeError):
        return f"bytes that are no text, from byte {error.start} on"
    told = f": {error}" if str(error) else ""
    if isinstance(error, (OSError, EOFError)):
        return f"a file that is damaged or cut off{told or f' ({type(error).__name__})'}"
    return f"{type(error).__name__}{told}"


def _fits(name: str, pattern: str) -> bool:
    # fnmatch would take the brackets of `x[2]` for a set of characters
    return name == pattern or ("*" in pattern and fnmatch.fnmatchcase(name, pattern.replace("[", "[[]")))
