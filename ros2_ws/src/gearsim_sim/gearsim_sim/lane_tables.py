"""Force elements and operating points of an ensemble's lanes as the arrays of the compiled loop."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_sim.integrate.vectors import LANES
from gearsim_sim.lane_pack import aligned
from gearsim_sim.model.bearing_fault_loop import JUMP_COLUMNS, LAG, NOW_COLUMNS, SPIN_LAG
from gearsim_sim.model.lane_data import LaneDrive, LaneElements, LaneMemory, LaneWork
from gearsim_sim.model.loop_data import COLUMNS, SEVERITY_COLUMNS, Data, Drive, Meshes
from gearsim_sim.model.mesh_loop import WORK_ROWS
from gearsim_sim.model.plant import Plant

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
# Tables of fault rows that the loop of the ensemble knows.
TABLES = ("spalls", "profiles", "bearing_terms", "mesh_mods", "mesh_pulses", "mesh_terms")
_OF_BEARINGS, _OF_MESHES = TABLES[:3], TABLES[3:]
_RECTANGULAR = SEVERITY_COLUMNS + COLUMNS["spalls"].index("rectangular")
_BALL = SEVERITY_COLUMNS + COLUMNS["spalls"].index("ball")


def check_alike(number: int, data: Data, first: Data) -> None:
    """InputError unless variant `number` differs from the first one in physical numbers only."""
    bearings, meshes = data.bearings, data.meshes
    pairs = [
        (own, getattr(first.bearings, name)) for name, own in bearings._asdict().items() if name != "numbers"
    ]
    pairs += [
        (meshes.places[:, [0, 1, 4, 5]], first.meshes.places[:, [0, 1, 4, 5]]),
        (meshes.errors[:, 0], first.meshes.errors[:, 0]),
        (data.rotations, first.rotations),
    ]
    if not all(np.array_equal(one, other) for one, other in pairs):
        expected = "a machine built as that of variant 0, with as many rolling elements in its bearings"
        raise InputError("ensemble", f"variants.{number}", "another structure", expected)


def pack_elements(data: Sequence[Data], plant: Plant) -> LaneElements:
    """Constants of the force elements of all lanes; `plant` is that of any lane."""
    bearings, meshes = data[0].bearings, data[0].meshes
    tables, located = _located([one.meshes for one in data])
    places = [np.concatenate([one.places[:, 2:4], one.errors[:, 1:3]]).ravel() for one in located]
    return LaneElements(
        bearings=bearings,
        bearing_numbers=_lanes(one.bearings.numbers.ravel() for one in data),
        lane_bearings=np.array([one.bearings.numbers for one in data]),
        cosines=aligned(bearings.cosines.ravel()),
        sines=aligned(bearings.sines.ravel()),
        directions=np.array([seat.law.load_direction_rad / (2 * np.pi) for seat in plant.bearings]),
        circle=data[0].circle,
        meshes=meshes,
        mesh_numbers=_lanes(one.numbers.ravel() for one in located),
        table_places=_lanes(places),
        lane_index=np.array([one.places for one in located]),
        lane_numbers=np.array([one.numbers for one in located]),
        lane_errors=np.array([one.errors for one in located]),
        tables=tables,
        drive_numbers=_lanes(
            [one.inertia, 1 / one.torque_ratios[0], one.torque_ratios[1], one.gravity] for one in data
        ),
        rotations=data[0].rotations,
        step_s=data[0].step_s,
        oversampling=data[0].oversampling,
    )


def _lanes(rows: Iterable[Sequence[float] | Array | Indices]) -> Array:
    """One column for each lane."""
    return aligned(np.array(list(rows), dtype=np.float64).T)


def _located(meshes: Sequence[Meshes]) -> tuple[Array, list[Meshes]]:
    """The tables of all lanes, each kept once, and the meshes with their places among these."""
    known: dict[bytes, int] = {}
    kept: list[Array] = [np.zeros(1)]
    size = 1
    result = []
    for one in meshes:
        index, errors = one.places.copy(), one.errors.copy()
        for row in (*index[:, 2:4], *errors[:, 1:3]):
            table = one.tables[row[0] : row[0] + 2 * (row[1] + 1)]
            key = table.tobytes()
            if key not in known:
                known[key] = size
                kept.append(table)
                size += table.size
            row[0] = known[key]
        result.append(one._replace(places=index, errors=errors))
    return np.concatenate(kept), result


def make_work(elements: LaneElements, drive: LaneDrive, inputs: int, interfaces: int) -> LaneWork:
    """Work space of the loop for so many tracks and fault rows."""
    bearings, balls = elements.bearings.cosines.shape
    meshes, tracks, spalls = elements.meshes.places.shape[0], drive.rates.shape[0], drive.spalls.shape[1]
    return LaneWork(
        phases=aligned(np.zeros((tracks, LANES))),
        speeds=aligned(np.zeros((1, LANES))),
        inputs=aligned(np.zeros((inputs, LANES))),
        frames=aligned(np.zeros((3 * bearings, LANES))),
        missing=aligned(np.zeros((bearings * balls, LANES))),
        marks=np.zeros((spalls * LANES, 2), dtype=np.int64),
        lane_phases=np.zeros(tracks),
        lane_rates=np.zeros(tracks),
        lane_motion=np.zeros(interfaces),
        lane_motion_rates=np.zeros(interfaces),
        lane_forces=np.zeros(interfaces),
        lane_missing=np.zeros((bearings, balls)),
        touched=np.zeros((spalls, 2), dtype=np.int64),
        now=np.zeros((LANES, bearings, NOW_COLUMNS)),
        jumps=np.zeros((spalls, JUMP_COLUMNS)),
        lane_meshes=np.zeros((WORK_ROWS, meshes)),
    )


def pack_drive(
    drives: Sequence[Drive], elements: LaneElements, memory: LaneMemory, variants: int
) -> LaneDrive:
    """Operating points, angles and fault rows of all lanes, of which the first `variants` are real."""
    rows = {name: [getattr(drive, name) for drive in drives] for name in TABLES}
    offsets = np.cumsum([1, *(drive.samples.size for drive in drives)])
    pitted, ill_bearings, ill_meshes = [], [], []
    for lane in range(variants):
        own = {name: rows[name][lane] for name in TABLES}
        if _needs_single_bearings(own, elements, memory, lane):
            ill_bearings.append(lane)
        elif len(own["spalls"]):
            pitted.append(lane)
        if any(len(own[name]) for name in _OF_MESHES) or np.any(elements.lane_numbers[lane, :, 6]):
            ill_meshes.append(lane)
    clock = [[drive.start_step, 1.0 / drive.length_steps, drive.anchor_step] for drive in drives]
    return LaneDrive(
        turns=_lanes(drive.turns for drive in drives),
        load=_lanes(drive.load for drive in drives),
        clock=_lanes(clock),
        steady=int(all(drive.steady == 1 for drive in drives)),
        anchor_phases=_lanes(drive.anchor_phases for drive in drives),
        rates=_lanes(drive.rates for drive in drives),
        pitted=np.array(pitted, dtype=np.int64),
        ill_bearings=np.array(ill_bearings, dtype=np.int64),
        ill_meshes=np.array(ill_meshes, dtype=np.int64),
        **{name: _table(name, rows[name], offsets) for name in TABLES},
        samples=np.concatenate([np.zeros(1), *(drive.samples for drive in drives)]),
    )


def _needs_single_bearings(
    own: dict[str, Array], elements: LaneElements, memory: LaneMemory, lane: int
) -> bool:
    """Whether a lane has more than rounded pits of races, or line contacts, or a cage that has slipped."""
    spalls = own["spalls"]
    return bool(
        len(own["profiles"])
        or len(own["bearing_terms"])
        or np.any(spalls[:, _RECTANGULAR] != 0.0)
        or np.any(spalls[:, _BALL] >= 0.0)
        or np.any(elements.bearings.rollers)
        or np.any(memory.cage[lane][:, [LAG, SPIN_LAG]])
    )


def _table(name: str, rows: Sequence[Array], offsets: Indices) -> Array:
    """Fault rows of all lanes, filled up with rows of severity zero."""
    columns = COLUMNS[name]
    table = np.zeros((LANES, max(len(own) for own in rows), SEVERITY_COLUMNS + len(columns)))
    for lane, own in enumerate(rows):
        table[lane, : len(own)] = own
        if "offset" in columns:
            table[lane, : len(own), SEVERITY_COLUMNS + columns.index("offset")] += offsets[lane]
    return table
