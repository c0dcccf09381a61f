"""Force elements and operating points of an ensemble's lanes as the arrays of the compiled loop."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_sim.integrate.vectors import LANES
from gearsim_sim.lane_pack import aligned
from gearsim_sim.model.lane_data import LaneDrive, LaneElements, LaneWork
from gearsim_sim.model.loop_data import COLUMNS, SEVERITY_COLUMNS, Data, Drive
from gearsim_sim.model.plant import Plant

Array = NDArray[np.float64]
# Tables of fault rows that the loop of the ensemble knows, and their columns that point into the samples.
TABLES = ("spalls", "mesh_mods")


def check_alike(number: int, data: Data, first: Data) -> None:
    """InputError unless variant `number` differs from the first one in physical numbers only."""
    bearings, meshes = data.bearings, data.meshes
    pairs = [
        (getattr(bearings, name), getattr(first.bearings, name))
        for name in ("index", "cosines", "sines", "row_offsets", "balls_per_row")
    ]
    pairs += [
        (meshes.index[:, [0, 1, 4, 5]], first.meshes.index[:, [0, 1, 4, 5]]),
        (meshes.errors[:, 0], first.meshes.errors[:, 0]),
        (data.rotations, first.rotations),
    ]
    if not all(np.array_equal(one, other) for one, other in pairs):
        expected = "a machine built as that of variant 0, with as many rolling elements in its bearings"
        raise InputError("ensemble", f"variants.{number}", "another structure", expected)


def pack_elements(data: Sequence[Data], plant: Plant) -> LaneElements:
    """Constants of the force elements of all lanes; `plant` is that of any lane."""
    bearings, meshes = data[0].bearings, data[0].meshes
    tables, places = _table_places(data)
    return LaneElements(
        bearings=bearings,
        bearing_numbers=_lanes(one.bearings.numbers.ravel() for one in data),
        cosines=aligned(bearings.cosines.ravel()),
        sines=aligned(bearings.sines.ravel()),
        directions=np.array([seat.law.load_direction_rad / (2 * np.pi) for seat in plant.bearings]),
        meshes=meshes,
        mesh_numbers=_lanes(one.meshes.numbers.ravel() for one in data),
        table_places=places,
        tables=tables,
        drive_numbers=_lanes(
            np.array([one.inertia, 1 / one.torque_ratios[0], one.torque_ratios[1], one.gravity])
            for one in data
        ),
        rotations=data[0].rotations,
        step_s=data[0].step_s,
        oversampling=data[0].oversampling,
    )


def _lanes(rows: Iterable[Sequence[float] | Array]) -> Array:
    """One column for each lane."""
    return aligned(np.array(list(rows), dtype=np.float64).T)


def _table_places(data: Sequence[Data]) -> tuple[Array, Array]:
    """The tables of all lanes, each kept once, and where each lane's are."""
    known: dict[bytes, int] = {}
    kept: list[Array] = []
    size = 0
    places = []
    for one in data:
        own: list[float] = []
        for offset, points in (*one.meshes.index[:, 2:4], *one.meshes.errors[:, 1:3]):
            table = one.meshes.tables[offset : offset + 2 * (points + 1)]
            key = table.tobytes()
            if key not in known:
                known[key] = size
                kept.append(table)
                size += table.size
            own += [known[key], points]
        places.append(np.array(own))
    return np.concatenate(kept) if kept else np.zeros(1), _lanes(places)


def make_work(elements: LaneElements, drive: LaneDrive, inputs: int) -> LaneWork:
    """Work space of the loop for so many tracks and fault rows."""
    bearings, balls = elements.bearings.cosines.shape
    meshes, tracks = elements.meshes.index.shape[0], drive.rates.shape[0]
    spalls = drive.spall_counts
    return LaneWork(
        phases=aligned(np.zeros((tracks, LANES))),
        inputs=aligned(np.zeros((inputs, LANES))),
        frames=aligned(np.zeros((3 * bearings, LANES))),
        missing=aligned(np.zeros((bearings * balls, LANES))),
        meshes=aligned(np.zeros((3 * meshes, LANES))),
        lane_phases=np.zeros(tracks),
        lane_rates=np.zeros(tracks),
        lane_missing=np.zeros((bearings, balls)),
        lane_meshes=np.zeros((meshes, 3)),
        touched=np.zeros((int(spalls[:-1].max()), 2), dtype=np.int64),
        marks=np.zeros((int(spalls[-1]), 2), dtype=np.int64),
    )


def pack_drive(drives: Sequence[Drive]) -> LaneDrive:
    """Operating points, angles and fault rows of all lanes."""
    offsets = np.cumsum([0, *(drive.samples.size for drive in drives)])
    tables = {}
    for name in TABLES:
        rows = [getattr(drive, name) for drive in drives]
        counts = np.array([len(own) for own in rows], dtype=np.int64)
        table = np.zeros((LANES, max(1, counts.max()), SEVERITY_COLUMNS + len(COLUMNS[name])))
        for lane, own in enumerate(rows):
            table[lane, : len(own)] = own
            if "offset" in COLUMNS[name]:
                table[lane, : len(own), SEVERITY_COLUMNS + COLUMNS[name].index("offset")] += offsets[lane]
        tables[name] = (table, np.append(counts, counts.sum()))
    clock = [[drive.start_step, 1.0 / drive.length_steps, drive.anchor_step] for drive in drives]
    return LaneDrive(
        turns=_lanes(drive.turns for drive in drives),
        load=_lanes(drive.load for drive in drives),
        clock=_lanes(clock),
        steady=int(all(drive.steady == 1 for drive in drives)),
        anchor_phases=_lanes(drive.anchor_phases for drive in drives),
        rates=_lanes(drive.rates for drive in drives),
        spalls=tables["spalls"][0],
        spall_counts=tables["spalls"][1],
        mesh_mods=tables["mesh_mods"][0],
        mod_counts=tables["mesh_mods"][1],
        samples=np.concatenate([np.zeros(1), *(drive.samples for drive in drives)]),
    )
