"""A case for the judge: measured records, the machine they are said to be of, and the model to be judged.

All input that cannot be judged is refused here, in words that say what would do.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from gearsim_dsp.features import is_signal
from gearsim_dsp.kinematics import bearing_orders
from gearsim_io.bags.records import is_bag, read_machine, read_record
from gearsim_io.errors import InputError
from gearsim_io.importers import Overrides, import_file, machine_for
from gearsim_io.machines import load_machine, machine_file
from gearsim_io.nameplate import Bearing, Machine
from gearsim_io.record import Record
from gearsim_twin.given import HEALTHY, HELD_OUT, MEASURED, check_given, stands_twice
from gearsim_twin.modelled import Modelled, describe
from gearsim_twin.recordings import cut, only, same_recording, thinned
from gearsim_twin.view import View, view_of

__all__ = ["LEAST_PERIODS", "Case", "least_seconds", "load_case", "make_case"]

LEAST_PERIODS = 4.0
"""Periods of the slowest part that a record must hold: a line of a Hann window is four lines wide."""
_HELD_OUT_SHARE = 3
_SAME_RATE = 1e-6
_RATES_HZ = (1000.0, 1e6)
_ACCELERATION = "m/s^2"


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """What is to be judged.

    Parameters
    ----------
    machine : Machine
        Nameplate.
    machine_path : Path
        Its description, with the numbers of the model.
    model : str
        Model that stands for it.
    training, holdout, healthy : tuple of Record
        What a model may be fitted to; what it is scored on; the same machine without the effect (may be
        empty). All have the same channels and rate.
    split : bool
        True where the held-out records are the last third of the others, as none were given.
    modelled : Modelled
        What the model tells of the machine.
    remarks : tuple of str
        What was left out or taken as it comes, for people.
    originals : tuple of Record
        The records as they were given, for training, held out, healthy: not split, with all their channels.
    """

    machine: Machine
    machine_path: Path
    model: str
    training: tuple[Record, ...]
    holdout: tuple[Record, ...]
    healthy: tuple[Record, ...]
    split: bool
    modelled: Modelled
    remarks: tuple[str, ...] = ()
    originals: tuple[Record, ...] = ()

    @property
    def records(self) -> tuple[Record, ...]:
        """All records: those for training, those held out, those of the healthy machine."""
        return (*self.training, *self.holdout, *self.healthy)

    def views(self) -> tuple[View, ...]:
        """Each of `records` with its angle, which is found over the whole record and by all its channels."""
        views = [view_of(record, self.machine) for record in self.originals]
        if self.split:
            wholes, healthy = views[: len(self.training)], views[len(self.training) :]
            ends = [record.sample_count for record in self.training]
            first = [view.part(0, end) for view, end in zip(wholes, ends, strict=True)]
            last = [view.part(end, view.record.sample_count) for view, end in zip(wholes, ends, strict=True)]
            views = [*first, *last, *healthy]
        return tuple(view.only(self.channels) for view in views)

    @property
    def channels(self) -> tuple[str, ...]:
        """The channels that are compared."""
        return self.training[0].channels

    @property
    def sample_rate_hz(self) -> float:
        """Rate of all records."""
        return self.training[0].sample_rate_hz

    @property
    def unit(self) -> str:
        """Unit of all records."""
        return self.training[0].unit

    @property
    def levels_known(self) -> bool:
        """Whether absolute levels mean anything: False where the unit is not that of an acceleration."""
        return self.unit == _ACCELERATION


def load_case(
    measured: Sequence[Path | str],
    machine: str | Path,
    model: str,
    healthy: Sequence[Path | str] = (),
    holdout: Sequence[Path | str] = (),
    overrides: Overrides | None = None,
) -> Case:
    """The case in files and bags.

    Parameters
    ----------
    measured, healthy, holdout : sequence of paths
        Bags, or measured files that the machine's description tells how to read.
    machine : str or Path
        Shipped name, or the path of a YAML file.
    model : str
        A name of `gearsim_sim.models.MODELS`.
    overrides : Overrides, optional
        What the user knows better of all measured files.

    Raises
    ------
    InputError
        As `make_case`, or if a file is not there, cannot be read, or is given twice.
    """
    groups = {MEASURED: measured, HELD_OUT: holdout, HEALTHY: healthy}
    check_given(groups, machine, model)
    path = machine_file(machine)
    plate = load_machine(path)
    modelled = describe(path, model)
    read = {
        option: tuple(_read(Path(one), path, overrides) for one in files) for option, files in groups.items()
    }
    case = make_case(plate, path, model, read[MEASURED], read[HEALTHY], read[HELD_OUT], modelled=modelled)
    bags = [Path(one) for files in groups.values() for one in files if is_bag(one)]
    return replace(case, remarks=(*case.remarks, *_other_nameplates(bags, plate)))


def make_case(
    machine: Machine,
    machine_path: Path,
    model: str,
    measured: Sequence[Record],
    healthy: Sequence[Record] = (),
    holdout: Sequence[Record] = (),
    *,
    modelled: Modelled | None = None,
) -> Case:
    """The case of records in memory.

    Without `holdout` the last third of every record is held out. Records whose rates are multiples of the
    lowest are thinned to it; of channels those stay that all records have, that are no constants, and that
    the model gives.

    Raises
    ------
    InputError
        If the model does not describe the machine, no channel can be compared, rates or units do not fit
        each other, a record is too short, or one recording stands in two places.
    """
    modelled = modelled or describe(machine_path, model)
    groups = {MEASURED: tuple(measured), HELD_OUT: tuple(holdout), HEALTHY: tuple(healthy)}
    if not groups[MEASURED]:
        raise InputError("twin", MEASURED, "no record", "at least one bag or measured file")
    remarks: list[str] = []
    groups = _one_rate(groups, remarks)
    groups = _one_unit(groups, remarks)
    originals = tuple(record for records in groups.values() for record in records)
    groups = _one_set_of_channels(groups, machine, modelled, model, remarks)
    _check_distinct(groups)
    training, held = groups[MEASURED], groups[HELD_OUT]
    split = not held
    if held:
        for record in (*training, *held):
            _check_length(record, machine, 1)
    else:
        for record in training:
            _check_length(record, machine, _HELD_OUT_SHARE)
        training, held = zip(*(_split(record) for record in training), strict=True)
        remarks.append("no held-out record was given: the last third of each record is held out")
    for record in groups[HEALTHY]:
        _check_length(record, machine, 1)
    return Case(
        machine=machine,
        machine_path=machine_path,
        model=model,
        training=training,
        holdout=held,
        healthy=groups[HEALTHY],
        split=split,
        modelled=modelled,
        remarks=tuple(remarks),
        originals=originals,
    )


def least_seconds(machine: Machine) -> float:
    """Shortest record in which the lines of the slowest part stand apart; 0 where no speed is stated."""
    slowest = min((abs(shaft.ratio) for shaft in machine.shafts), default=1.0)
    for bearing in machine.bearings:
        slowest = min(slowest, bearing_orders(bearing, machine.shaft(bearing.shaft).ratio).ftf)
    speed_hz = machine.nominal_speed_hz
    return LEAST_PERIODS / (slowest * speed_hz) if math.isfinite(speed_hz) else 0.0


Groups = dict[str, tuple[Record, ...]]


def _read(path: Path, machine_path: Path, overrides: Overrides | None) -> Record:
    if not is_bag(path):
        return import_file(path, machine_path, overrides)
    record = read_record(path)
    if overrides is not None and overrides.speed_hz is not None:
        return replace(record, notes={**record.notes, "speed_hz": f"{overrides.speed_hz:.9g}"})
    return record


def _other_nameplates(bags: Sequence[Path], plate: Machine) -> tuple[str, ...]:
    """What the nameplates that bags carry say against the description."""
    remarks = []
    for bag in bags:
        own = read_machine(bag)
        if own is None:
            continue
        parts = {"name": (own.name, plate.name), "bearings": (_geometry(own), _geometry(plate))}
        parts["gears"] = (
            (own.gear_meshes, own.planetary_stages),
            (plate.gear_meshes, plate.planetary_stages),
        )
        told = [name for name, (one, other) in parts.items() if one != other]
        if told:
            words = " and ".join(told)
            remarks.append(
                f"{bag}: the nameplate in the bag has other {words} than the description of {plate.name}"
            )
    return tuple(remarks)


def _geometry(machine: Machine) -> tuple[Bearing, ...]:
    """The bearings; which channels are near is a matter of the sensors of a run."""
    return tuple(replace(bearing, channels=()) for bearing in machine.bearings)


def _check_distinct(groups: Groups) -> None:
    seen: list[tuple[str, Record]] = []
    for option, records in groups.items():
        for record in records:
            for other, known in seen:
                if same_recording(record, known):
                    raise stands_twice(option, _name(record), other, _name(known))
            seen.append((option, record))


def _name(record: Record) -> str:
    return record.source or "record"


def _one_rate(groups: Groups, remarks: list[str]) -> Groups:
    every = [record for records in groups.values() for record in records]
    slowest = min(every, key=lambda record: record.sample_rate_hz)
    if not _RATES_HZ[0] <= slowest.sample_rate_hz <= _RATES_HZ[1]:
        expected = f"{_RATES_HZ[0]:g} to {_RATES_HZ[1]:g} Hz, at which a model can be run"
        raise InputError(_name(slowest), "sampling rate", f"{slowest.sample_rate_hz:.9g} Hz", expected)
    factors = {}
    for record in every:
        ratio = record.sample_rate_hz / slowest.sample_rate_hz
        factors[id(record)] = round(ratio)
        if abs(ratio / round(ratio) - 1.0) > _SAME_RATE:
            expected = (
                f"{slowest.sample_rate_hz:.9g} Hz as {_name(slowest)} has, or a whole multiple of it: "
                "records are compared at one rate"
            )
            raise InputError(_name(record), "sampling rate", f"{record.sample_rate_hz:.9g} Hz", expected)
        if round(ratio) > 1:
            rates = f"{record.sample_rate_hz:g} Hz to {slowest.sample_rate_hz:g} Hz, the rate of the others"
            remarks.append(f"{_name(record)} was thinned from {rates}")
    return {
        option: tuple(thinned(record, factors[id(record)]) for record in records)
        for option, records in groups.items()
    }


def _one_unit(groups: Groups, remarks: list[str]) -> Groups:
    every = [record for records in groups.values() for record in records]
    first = every[0]
    for record in every:
        if record.unit != first.unit:
            expected = f"{first.unit} as {_name(first)} has; --unit tells a unit that the files do not state"
            raise InputError(_name(record), "unit", record.unit, expected)
    if first.unit != _ACCELERATION:
        said = "is not stated" if first.unit == "1" else f"is {first.unit}, no acceleration"
        remarks.append(
            f"the unit of the records {said}: the judge works on shapes and ratios, with a gain of its own "
            "for each channel; absolute levels are not judged"
        )
    return groups


def _one_set_of_channels(
    groups: Groups, machine: Machine, modelled: Modelled, model: str, remarks: list[str]
) -> Groups:
    every = [record for records in groups.values() for record in records]
    known = [channel.name for channel in machine.channels if channel.name in modelled.sites]
    first = every[0]
    left = {name: f"{model} has no such place" for name in first.channels if name not in known}
    chosen = [name for name in first.channels if name in known]
    if not chosen:
        expected = f"a channel that {model} gives: " + ", ".join(known)
        raise InputError(_name(first), "channels", ", ".join(first.channels), expected)
    for record in every:
        for name in tuple(chosen):
            if name not in record.channels:
                left[name] = f"{_name(record)} does not have it"
            elif not is_signal(record.data[record.channels.index(name)]):
                left[name] = f"{_name(record)} has a constant or values that are not finite there"
            else:
                continue
            chosen.remove(name)
        if not chosen:
            why = "; ".join(f"{name}: {reason}" for name, reason in left.items())
            expected = f"at least one good channel that all records have ({why})"
            raise InputError(_name(record), "channels", ", ".join(record.channels), expected)
    remarks += [f"channel {name} is left out: {reason}" for name, reason in left.items()]
    return {option: tuple(only(record, chosen) for record in records) for option, records in groups.items()}


def _check_length(record: Record, machine: Machine, parts: int) -> None:
    """Each of so many parts of the record must be long enough."""
    needed = least_seconds(machine_for(record, machine))
    if record.seconds >= parts * needed:
        return
    reason = f"({LEAST_PERIODS:g} turns of the slowest shaft or cage part its lines)"
    expected = f"at least {_above(needed)} s {reason}"
    if parts > 1:
        expected = (
            f"at least {_above(parts * needed)} s, of which a third is held out, or {_above(needed)} s with "
            f"another record as --holdout {reason}"
        )
    raise InputError(_name(record), "length", f"{record.seconds:.3g} s", expected)


def _above(seconds: float) -> str:
    digits = 2 - math.floor(math.log10(seconds))
    return f"{math.ceil(seconds * 10**digits) / 10**digits:g}"


def _split(record: Record) -> tuple[Record, Record]:
    end = record.sample_count
    middle = end - end // _HELD_OUT_SHARE
    return cut(record, 0, middle), cut(record, middle, end)
