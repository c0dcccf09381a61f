"""The measured records that the pictures are drawn from, each read once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearsim_io.datasets import data_folders, find_record
from gearsim_io.errors import EnvironmentLackError, InputError
from gearsim_io.importers import import_file
from gearsim_io.machines import load_machine
from gearsim_io.nameplate import Machine
from gearsim_io.record import Record

__all__ = ["Measured"]

# Folder of the records -> machine description shipped.
MACHINES = {
    "cwru": "cwru_drive_end",
    "gear0": "gear0",
    "hit_sm": "hit_sq",
    "mfpt": "mfpt",
    "sq_gearbox": "sq_gearbox",
    "wt_hss_gear": "wt_hss",
}


class Measured:
    """Measured records by their path below a data folder, such as "mfpt/baseline_1.mat"."""

    def __init__(self) -> None:
        self._read: dict[str, Record] = {}

    def record(self, relative: str) -> Record:
        """The record, imported with its machine's settings.

        Raises
        ------
        EnvironmentLackError
            If no data folder has it.
        """
        if relative not in self._read:
            machine = self._machine_name(relative)
            path = find_record(relative)
            if path is None:
                looked = ", ".join(str(folder) for folder in data_folders())
                raise EnvironmentLackError(f"no record {relative} in {looked}", _remedy(relative))
            self._read[relative] = import_file(path, machine)
        return self._read[relative]

    def machine(self, relative: str) -> Machine:
        """The nameplate of the machine that the record is of."""
        return load_machine(self._machine_name(relative))

    def signal(self, relative: str, channel: int = 0) -> tuple[NDArray[np.float64], float]:
        """Samples of one channel as float64, and the sampling rate in Hz."""
        record = self.record(relative)
        return record.data[channel].astype(np.float64), record.sample_rate_hz

    @staticmethod
    def _machine_name(relative: str) -> str:
        folder = relative.split("/", maxsplit=1)[0]
        if folder not in MACHINES:
            raise InputError("method figures", "record", relative, f"a path below {', '.join(MACHINES)}")
        return MACHINES[folder]


def _remedy(relative: str) -> str:
    if relative.startswith("mfpt/"):
        return "./gearsim data get mfpt"
    return f"export GEARSIM_DATA=DIR, with DIR/{relative} in it"
