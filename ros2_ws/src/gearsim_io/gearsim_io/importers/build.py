"""From the content of a measured file to a `Record`, with every doubtful thing checked or noted."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_io.importers import readers  # noqa: F401  (registers the formats)
from gearsim_io.importers.content import Content, read_content, stem_of
from gearsim_io.importers.settings import (
    ChannelSettings,
    ImportSettings,
    Overrides,
    ValueSettings,
    load_settings,
)
from gearsim_io.importers.times import rate_of_times
from gearsim_io.importers.units import to_hz, to_si
from gearsim_io.machines import load_machine
from gearsim_io.nameplate import Machine
from gearsim_io.record import Record
from gearsim_io.stated_speed import FROM_FILE, FROM_USER, OPTION, check_speed, with_speed

# Rates given in several places are one and the same if they differ by less (rounding to whole Hz).
_RATE_TOLERANCE = 1e-4
_CLIPPED_RUN = 3
_TIME_NAMES = re.compile(r"(time|t)\s*([\[(_ ]*s(ec)?[\])]*)?", re.IGNORECASE)


def import_file(
    path: Path | str, machine: str | Path | None = None, overrides: Overrides | None = None
) -> Record:
    """A measured file as a record in m/s^2, or in unit "1" where the source states no unit.

    Parameters
    ----------
    path : Path or str
        The suffix chooses the reader, see `READERS`.
    machine : str or Path, optional
        Machine description whose `import` section says what the file holds.
    overrides : Overrides, optional
        What the user knows better.

    Returns
    -------
    Record
        `notes["speed_hz"]` is the nominal speed that the file tells, `notes["load"]` the load,
        `notes["clipped <channel>"]` how much of a channel is clipped.

    Raises
    ------
    InputError
        If the file cannot be read, lacks a variable, states two sampling rates or none, or has a channel
        that is empty, constant, of another length, or holds values that are not finite.
    """
    path = Path(path)
    wanted = overrides or Overrides()
    settings = load_settings(machine)
    content = read_content(path)
    where = str(path)
    notes = dict(content.notes)
    channels = _channels(where, content, settings, wanted)
    rate_hz = _rate(path, content, settings, wanted, notes)
    scaled, unit = _scaled(where, channels, wanted, notes)
    for name, values in scaled.items():
        _check_signal(where, name, values, notes)
    plate = None if machine is None else load_machine(machine)
    speed_hz = _speed(path, content, settings, wanted)
    if speed_hz is not None:
        origin = FROM_FILE if wanted.speed_hz is None else FROM_USER
        notes = with_speed(notes, speed_hz, origin, plate)
    load = _value(path, content, settings.load, "load")
    if load is not None and settings.load is not None:
        notes["load"] = f"{load:.9g} {settings.load.unit}"
    return Record(
        sample_rate_hz=rate_hz,
        channels=tuple(scaled),
        unit=unit,
        data=np.stack([values.astype(np.float32) for values in scaled.values()]),
        machine="" if plate is None else plate.name,
        source=where,
        notes=notes,
    )


def machine_for(record: Record, machine: Machine) -> Machine:
    """The nameplate with the speed that file or user state as nominal speed, where they state one.

    Raises
    ------
    InputError
        If that is far off the nameplate's, as when rpm are taken for Hz.
    """
    text = record.notes.get("speed_hz")
    if text is None:
        return machine
    speed_hz = float(text)
    given = record.notes.get("speed from") == FROM_USER
    check_speed(OPTION if given else f"{record.source}: speed", speed_hz, machine)
    shafts = tuple(replace(shaft, nominal_speed_hz=shaft.ratio * speed_hz) for shaft in machine.shafts)
    return replace(machine, shafts=shafts)


Chosen = dict[str, tuple[NDArray[Any], str]]


def _channels(where: str, content: Content, settings: ImportSettings, wanted: Overrides) -> Chosen:
    """Values and unit of each channel, by its name; all of one length."""
    sources = _sources(where, content, settings, wanted)
    chosen: Chosen = {}
    for name, source in sources.items():
        try:
            variable, values = content.array(where, source.pattern)
        except InputError as error:
            if source.optional and error.value == "not in the file":
                continue
            raise
        stated = content.units.get(variable)
        chosen[name] = (values, source.unit if source.unit is not None else stated or "1")
    if not chosen:
        expected = f"one of {', '.join(sources)}, or --column to say which variables are channels"
        raise InputError(where, "channels", content.listing(), expected)
    lengths = {name: values.size for name, (values, _) in chosen.items()}
    if len(set(lengths.values())) > 1:
        listed = ", ".join(f"{name} {count}" for name, count in lengths.items())
        raise InputError(where, "lengths", listed, "as many samples in each channel")
    return chosen


def _sources(
    where: str, content: Content, settings: ImportSettings, wanted: Overrides
) -> dict[str, ChannelSettings]:
    """Which variable is which channel: the user's word, else the machine's, else all that look like it."""
    if wanted.variables:
        names = wanted.channels or wanted.variables
        if not wanted.channels and len(wanted.variables) == len(settings.channels):
            names = tuple(settings.channels)
        if len(set(names)) != len(names):
            raise InputError(where, "channels", ", ".join(names), "no name twice")
        return {name: ChannelSettings(variable=v) for name, v in zip(names, wanted.variables, strict=True)}
    if settings.channels:
        given = settings.channels
        if wanted.channels:
            unknown = [name for name in wanted.channels if name not in given]
            if unknown:
                expected = "one of the machine's channels " + ", ".join(given)
                raise InputError(where, "channels", unknown[0], expected)
            return {name: given[name] for name in wanted.channels}
        return given
    time = settings.rate.time or _time_name(content)
    signals = [name for name in content.arrays if name != time]
    if wanted.channels and len(wanted.channels) == len(signals):
        return {name: ChannelSettings(variable=v) for name, v in zip(wanted.channels, signals, strict=True)}
    return {name: ChannelSettings(variable=name) for name in signals}


def _time_name(content: Content) -> str | None:
    return next((name for name in content.arrays if _TIME_NAMES.fullmatch(name.strip())), None)


def _rate(
    path: Path, content: Content, settings: ImportSettings, wanted: Overrides, notes: dict[str, str]
) -> float:
    """The sampling rate; every place that states it must agree."""
    where = str(path)
    stated: dict[str, float] = {}
    told = wanted.rate_hz is not None  # then the file need not state it where the machine's files do
    for pattern in settings.rate.variables:
        if not told or content.value(pattern) is not None:
            stated[pattern] = _number(where, content, pattern)
    for pattern in settings.rate.intervals:
        if not told or content.value(pattern) is not None:
            stated[pattern] = 1.0 / _number(where, content, pattern)
    named = settings.rate.file_name
    if named is not None and not (told and re.search(named, stem_of(path)) is None):
        stated["the file's name"] = _from_name(path, named, "sampling rate")
    stated.update(content.rates_hz)
    time = settings.rate.time or _time_name(content)
    if time is not None and time in content.arrays:
        stated[time] = rate_of_times(where, time, content.arrays[time])
    if wanted.rate_hz is not None:
        stated = {"the rate given": wanted.rate_hz, **stated}
    elif settings.rate.value is not None:
        stated = {"the machine's description": settings.rate.value, **stated}
    if not stated:
        raise InputError(where, "sampling rate", "stated nowhere", "a rate (--rate), as the file has none")
    (first, rate_hz), *others = stated.items()
    for name, other_hz in others:
        if abs(other_hz / rate_hz - 1.0) > _RATE_TOLERANCE:
            raise InputError(where, name, f"{other_hz:.9g} Hz", f"{rate_hz:.9g} Hz, as {first} says")
    if not (math.isfinite(rate_hz) and rate_hz > 0):
        raise InputError(where, first, rate_hz, "a rate above 0 Hz")
    notes["sampling rate from"] = ", ".join(stated)
    return rate_hz


def _number(where: str, content: Content, pattern: str) -> float:
    found = content.value(pattern)
    if found is None:
        expected = f"a number of that name, or --rate; the file has {content.listing()}"
        raise InputError(where, pattern, "not in the file", expected)
    name, value = found
    try:
        number = float(value)
    except ValueError:
        raise InputError(where, name, value, "a number") from None
    if not math.isfinite(number) or number <= 0:
        raise InputError(where, name, value, "a finite number above 0")
    return number


def _from_name(path: Path, pattern: str, what: str) -> float:
    match = re.search(pattern, stem_of(path))
    if match is None:
        raise InputError(str(path), "file name", stem_of(path), f"a name that tells the {what} ({pattern})")
    return float(match[1])


def _value(path: Path, content: Content, source: ValueSettings | None, what: str) -> float | None:
    """A single number that the file or its name tells; None where it need not."""
    if source is None:
        return None
    if source.variable is not None:
        found = content.value(source.variable)
        if found is None:
            if source.optional or what == "load":  # without its load a record is worth less, not nothing
                return None
            expected = f"a number of that name, or --{what}; the file has {content.listing()}"
            raise InputError(str(path), source.variable, "not in the file", expected)
        try:
            return float(found[1])
        except ValueError:
            raise InputError(str(path), found[0], found[1], "a number") from None
    if source.file_name is not None:
        if source.optional and re.search(source.file_name, stem_of(path)) is None:
            return None
        return _from_name(path, source.file_name, what)
    return None


def _speed(path: Path, content: Content, settings: ImportSettings, wanted: Overrides) -> float | None:
    if wanted.speed_hz is not None:
        return wanted.speed_hz
    value = _value(path, content, settings.speed, "speed")
    if value is None or settings.speed is None:
        return None
    speed_hz = to_hz(str(path), value, settings.speed.unit)
    if not (math.isfinite(speed_hz) and speed_hz > 0):
        raise InputError(str(path), "speed", value, f"a speed above 0 {settings.speed.unit}")
    return speed_hz


def _scaled(
    where: str, channels: Chosen, wanted: Overrides, notes: dict[str, str]
) -> tuple[dict[str, NDArray[np.float64]], str]:
    """All channels in one unit."""
    scaled: dict[str, NDArray[np.float64]] = {}
    units: dict[str, str] = {}
    for name, (values, stated) in channels.items():
        unit = wanted.unit if wanted.unit is not None else stated
        factor, units[name] = to_si(where, unit)
        scaled[name] = np.asarray(values, dtype=np.float64) * factor
        if factor != 1.0:
            notes["unit"] = f"{unit}, kept as {units[name]} (x {factor:.9g})"
    if len(set(units.values())) > 1:
        listed = ", ".join(f"{name} in {unit}" for name, unit in units.items())
        raise InputError(where, "units", listed, "channels of one unit; choose some of them")
    return scaled, next(iter(units.values()))


def _check_signal(where: str, name: str, values: NDArray[np.float64], notes: dict[str, str]) -> None:
    """Refuse what no analysis could use; note what it should know."""
    if values.size < 2:
        raise InputError(where, name, f"{values.size} samples", "at least two")
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        got = f"{values[bad[0]]} at sample {bad[0]} ({bad.size} such values)"
        raise InputError(where, name, got, "finite values")
    low, high = float(values.min()), float(values.max())
    if low == high:
        raise InputError(where, name, f"{low:g} in all {values.size} samples", "a signal that changes")
    clipped = _clipped(values, low) + _clipped(values, high)
    if clipped:
        share = 100.0 * clipped / values.size
        notes[f"clipped {name}"] = f"{clipped} samples ({share:.2g} %) stand at {low:.6g} or {high:.6g}"


def _clipped(values: NDArray[np.float64], limit: float) -> int:
    """Samples in runs of three or more at the limit."""
    at = np.concatenate(([False], values == limit, [False]))
    edges = np.flatnonzero(np.diff(at.astype(np.int8)))
    lengths = edges[1::2] - edges[::2]
    return int(lengths[lengths >= _CLIPPED_RUN].sum())
