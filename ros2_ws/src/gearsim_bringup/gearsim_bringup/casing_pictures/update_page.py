"""What `gearsim casing update` leaves in its folder: description, table and pictures."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from gearsim_bringup.casing_pictures.draw import draw_modes
from gearsim_bringup.casing_pictures.modal_test import draw_macs, draw_responses
from gearsim_bringup.casing_pictures.updating import draw_deviations, draw_thickness
from gearsim_io.errors import InputError
from gearsim_sim.model.casing.from_test import TestedUpdate
from gearsim_sim.model.casing.modal_test import ModalTest
from gearsim_sim.model.casing.updated_file import (
    description_path,
    updated_description,
    write_description,
)
from gearsim_sim.model.casing.updating import Update

HEADER = ("measured_hz", "mode_before", "before_hz", "off_percent", "mode_after", "after_hz", "off_percent")


@contextmanager
def folder_for(out: Path) -> Iterator[None]:
    """The folder for the files, made before the work; InputError if there cannot be one.

    One that was not there before goes again if the work fails before it has left anything.
    """
    was_there = out.is_dir()
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError("--out", "", str(out), f"a folder ({error.strerror})") from None
    try:
        yield
    except BaseException:
        if not was_there and not any(out.iterdir()):
            out.rmdir()
        raise


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


def write_test(tested: TestedUpdate, test: ModalTest | None, out: Path) -> list[Path]:
    """Pictures of the test beside those of the updating; their paths. Without responses none of them."""
    files = [out / "mac.png"]
    draw_macs(tested, files[0])
    if test is not None:
        files.append(out / "responses.png")
        draw_responses(tested, test, files[-1])
    return files


def table(update: Update) -> list[tuple[float | str, ...]]:
    """One row for each measured frequency, as `HEADER` says; modes from 1, blanks where there is no pair."""
    sides = []
    for after in (False, True):
        model, pairs = (update.after, update.last_pairs) if after else (update.before, update.first_pairs)
        found = {}
        rows = zip(pairs.measured_hz, pairs.modes, update.deviations(after=after), strict=True)
        for hz, mode, off in rows:
            own = round(float(model.frequencies_hz[mode]), 2)
            found[float(hz)] = (int(mode) + 1, own, round(100 * float(off), 2))
        sides.append(found)
    measured = sorted({*sides[0], *sides[1]})
    none = ("", "", "")
    return [(round(hz, 3), *sides[0].get(hz, none), *sides[1].get(hz, none)) for hz in measured]
