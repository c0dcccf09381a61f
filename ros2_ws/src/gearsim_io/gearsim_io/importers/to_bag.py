"""Measured files as bags that play like a live stream."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path

from gearsim_io.bags.stream import StreamWriter
from gearsim_io.bags.writer import BagWriter
from gearsim_io.errors import InputError
from gearsim_io.importers.build import import_file, machine_for
from gearsim_io.importers.content import stem_of
from gearsim_io.importers.settings import Overrides
from gearsim_io.machines import load_machine
from gearsim_io.new_paths import check_place, refuse_existing
from gearsim_io.record import Record

_BATCH_SAMPLES = 4096


def import_to_bag(
    files: Sequence[Path | str],
    machine: str | Path,
    out: Path | str,
    overrides: Overrides | None = None,
    batch_samples: int = _BATCH_SAMPLES,
) -> list[tuple[Path, Record]]:
    """Turn measured files into bags.

    Parameters
    ----------
    files : sequence of paths
        One file becomes the bag `out`; of several each becomes a bag `out/<file's name>` of its own,
        as records of different runs do not follow each other in time.
    machine : str or Path
        Machine description; its nameplate goes into the bag, with the speed that the file tells.
    out : Path or str
        Folder of the new bag, or of the new bags.
    overrides : Overrides, optional
        What the user knows better than the machine's description.
    batch_samples : int
        Samples per channel in one message.

    Returns
    -------
    list of (Path, Record)
        The bags with what is in them. All files are read before the first bag is written.

    Raises
    ------
    InputError
        As `import_file`, or if a bag exists already.
    BagError
        If the disk does not take it all.
    """
    if not files:
        raise InputError("import", "files", "none", "at least one file")
    if batch_samples < 1:
        raise InputError("import", "batch_samples", batch_samples, "at least 1")
    target = Path(out)
    paths = [Path(file) for file in files]
    nameplate = load_machine(machine)
    check_place(target, "the name of a new bag")
    records = [import_file(path, machine, overrides) for path in paths]
    places = [target] if len(paths) == 1 else [target / stem_of(path) for path in paths]
    for path, place in zip(paths, places, strict=True):
        refuse_existing(place, "the name of a new bag")
        if places.count(place) > 1:
            got = f"wanted by several files, {path.name} among them"
            raise InputError(str(place), "", got, "the name of a new bag")
    for path, place, record in zip(paths, places, records, strict=True):
        custom = {
            "source_file": path.name,
            "source_sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
            "machine": nameplate.name,
            **record.notes,
        }
        with BagWriter(place, custom, sync_period_s=None) as writer:
            stream = StreamWriter(writer)
            stream.write(machine_for(record, nameplate), record.t0_ns)
            for batch in record.batches(batch_samples):
                stream.write(batch)
    return list(zip(places, records, strict=True))
