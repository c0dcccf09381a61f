"""A bag or a measured file with the nameplate of the machine it comes from."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from gearsim_io.bags import is_bag, read_machine, read_record
from gearsim_io.errors import InputError
from gearsim_io.importers import Overrides, import_file, machine_for
from gearsim_io.machines import load_machine, machine_names
from gearsim_io.nameplate import Machine
from gearsim_io.record import Record
from gearsim_io.stated_speed import FROM_USER, with_speed


def open_source(path: Path, machine: str | None, overrides: Overrides) -> tuple[Record, Machine]:
    """The record in a bag or file, and the nameplate to judge it by.

    A bag's own nameplate is used unless `machine` names another; a file needs `machine`. The nominal speed
    that the file or the user tells replaces the nameplate's.

    Raises
    ------
    InputError
        If there is nothing at `path`, it cannot be read, or no machine is known.
    """
    if not path.exists():
        raise InputError(str(path), "", "nothing there", "a bag or a measured file")
    if is_bag(path):
        known = read_machine(path) if machine is None else load_machine(machine)
        if known is None:
            raise InputError(str(path), "MachineInfo", "none in the bag", _machine_option())
        record = read_record(path)
        if overrides.speed_hz is not None:
            notes = with_speed(record.notes, overrides.speed_hz, FROM_USER, known)
            record = dataclasses.replace(record, notes=notes)
        return record, machine_for(record, known)
    if machine is None:
        raise InputError(str(path), "--machine", "nothing", _machine_option())
    record = import_file(path, machine, overrides)
    return record, machine_for(record, load_machine(machine))


def _machine_option() -> str:
    return f"--machine with one of {', '.join(machine_names())}, or the path of a YAML file"
