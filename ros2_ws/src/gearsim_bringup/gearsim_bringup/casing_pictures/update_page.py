"""What `gearsim casing update` leaves in its folder: description, table and pictures."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np

from gearsim_bringup.casing_pictures.draw import draw_modes
from gearsim_bringup.casing_pictures.updating import draw_deviations, draw_thickness
from gearsim_io.errors import InputError
from gearsim_sim.model.casing.updated_file import (
    description_path,
    updated_description,
    write_description,
)
from gearsim_sim.model.casing.updating import Update

HEADER = ("measured_hz", "mode_before", "before_hz", "off_percent", "mode_after", "after_hz", "off_percent")


def make_folder(out: Path) -> None:
    """The folder for the files; InputError if there cannot be one."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError("--out", "", str(out), f"a folder ({error.strerror})") from None


def write_update(
    casing: str, update: Update, basis: str, out: Path, tell: Callable[[str], None]
) -> list[Path]:
    """Write all files into an existing folder; their paths."""
    tell("files and pictures")
    files = [out / name for name in ("updated.yaml", "pairs.csv", "thickness.png", "pairs.png", "modes.png")]
    write_description(updated_description(description_path(casing), update, basis), files[0])
    with files[1].open("w", newline="", encoding="utf-8") as stream:
        csv.writer(stream).writerows([HEADER, *table(update)])
    draw_thickness(update.after.structure.mesh, update.change, files[2], f"updated against {basis}")
    draw_deviations(update, files[3])
    model, modes = update.after, update.last_pairs.modes
    draw_modes(model.structure, model.frequencies_hz[modes], model.shapes[:, modes], files[4])
    return files


def table(update: Update) -> list[tuple[float, ...]]:
    """One row for each measured frequency, as `HEADER` says; modes are counted from 1."""
    first, last = update.first_pairs, update.last_pairs
    before, after = (100 * update.deviations(after=late) for late in (False, True))
    columns = (
        last.measured_hz,
        first.modes + 1,
        np.round(update.before.frequencies_hz[first.modes], 2),
        np.round(before, 2),
        last.modes + 1,
        np.round(update.after.frequencies_hz[last.modes], 2),
        np.round(after, 2),
    )
    return list(zip(*(column.tolist() for column in columns), strict=True))
