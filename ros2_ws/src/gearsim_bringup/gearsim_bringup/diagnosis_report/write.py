"""A diagnosis as a folder with a page and the numbers of the verdict."""

from __future__ import annotations

import json
from pathlib import Path

from gearsim_bringup.diagnosis_report.material import Material
from gearsim_bringup.diagnosis_report.page import make_page
from gearsim_bringup.pages.folder import check_folder, placed
from gearsim_bringup.ui import plain
from gearsim_dsp.diagnose import Diagnosis
from gearsim_io.nameplate import Machine
from gearsim_io.record import Record

__all__ = ["PAGE", "VERDICT", "write_report"]

PAGE, VERDICT = "report.html", "diagnosis.json"


def write_report(folder: Path, record: Record, machine: Machine, diagnosis: Diagnosis) -> tuple[Path, ...]:
    """Write `report.html` and `diagnosis.json` into the new folder.

    Parameters
    ----------
    folder : Path
    record : Record
    machine : Machine
        As handed to `diagnose_record`.
    diagnosis : Diagnosis
        Of that record.

    Returns
    -------
    tuple of Path
        The files.

    Raises
    ------
    InputError
        If the folder exists or cannot be made. Nothing half-written remains.
    """
    check_folder(folder)
    page = make_page(Material.of(record, machine, diagnosis))
    verdict = json.dumps(plain(diagnosis.to_json()), allow_nan=False, indent=2) + "\n"
    return placed(folder, {PAGE: page, VERDICT: verdict})
