"""What the compiled loop of an ensemble is given; `loop_data` with a column for each lane.

Lanes are variants of one machine: what counts or names things (interfaces, tracks, balls, rows of teeth) is
the same for all and kept once; every physical number is each lane's own. Faults are rare and of many kinds,
so that lanes which have some take their forces from the functions of the single loop, one lane after the
other; only pits in races of ball bearings, the commonest, are entered into the forces of all lanes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.loop_data import BearingMemory, Bearings, Meshes

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class LaneElements(NamedTuple):
    """Constants of the force elements.

    `bearings` and `meshes` are those of the first lane, for what all lanes have in common.
    """

    bearings: Bearings
    bearing_numbers: Array  # ([bearing] load factor, clearance, nominal stiffness; LANES)
    lane_bearings: Array  # (LANES, bearings, 3) the same
    cosines: Array  # (bearings balls,) flat
    sines: Array
    directions: Array  # (bearings,) where the load presses the inner ring to, in turns
    circle: Array  # `pieces.cosine_sine`'s table
    meshes: Meshes
    mesh_numbers: Array  # ([mesh] `Meshes.numbers`; LANES)
    table_places: Array  # ([mesh, then error] offset and points of its table; LANES)
    lane_index: Indices  # (LANES, meshes, 6) `Meshes.index` with the offsets of each lane
    lane_numbers: Array  # (LANES, meshes, 7)
    lane_errors: Indices  # (LANES, errors, 3)
    tables: Array  # flat
    drive_numbers: Array  # (inertia, 1 / torque ratio of the motor, ratio of the load, gravity; LANES)
    rotations: Array  # `Data.rotations`
    step_s: float
    oversampling: int


class LaneDrive(NamedTuple):
    """What changes at events.

    Tables of fault rows are (LANES, rows, columns), filled up with rows of severity zero.
    """

    turns: Array  # ([coefficient], LANES)
    load: Array  # ([coefficient], LANES)
    clock: Array  # (start step, 1 / length_steps, anchor step; LANES)
    steady: int  # 1: speed and load are constant in all lanes
    anchor_phases: Array  # (tracks, LANES)
    rates: Array  # (tracks, LANES)
    pitted: Indices  # lanes whose bearings have pits and nothing else
    ill_bearings: Indices  # lanes whose bearings take their forces from the single loop
    ill_meshes: Indices  # lanes whose meshes do
    spalls: Array
    profiles: Array
    bearing_terms: Array
    mesh_mods: Array
    mesh_pulses: Array
    mesh_terms: Array
    samples: Array


class LaneRows(NamedTuple):
    """The fault rows of one lane, under the names that they have in `Drive`."""

    spalls: Array
    profiles: Array
    bearing_terms: Array
    mesh_mods: Array
    mesh_pulses: Array
    mesh_terms: Array
    samples: Array
    rates: Array


class LaneWork(NamedTuple):
    """Work space; `missing` and `lane_missing` are zero between steps."""

    phases: Array  # (tracks, LANES)
    speeds: Array  # (1, LANES) [Hz]
    inputs: Array  # (known inputs, LANES)
    frames: Array  # ([bearing] cosine, sine, shift; LANES)
    missing: Array  # ([bearing, ball], LANES)
    marks: Indices  # (pits, 2) rows and lanes of `missing` that are not zero
    lane_phases: Array  # (tracks,) of one lane, as all that follow
    lane_rates: Array  # (tracks,)
    lane_motion: Array  # (interfaces,)
    lane_motion_rates: Array  # (interfaces,)
    lane_forces: Array  # (interfaces,)
    lane_missing: Array  # (bearings, balls)
    touched: Indices  # (spalls, 2)
    now: Array  # (LANES, bearings, NOW_COLUMNS)
    jumps: Array  # (spalls, JUMP_COLUMNS)
    lane_meshes: Array  # (WORK_ROWS, meshes)


class LaneMemory(NamedTuple):
    """What the bearings of all lanes remember; `BearingMemory` with an axis for the lanes in front."""

    missing: Array
    play: Array
    cosines: Array
    sines: Array
    film: Array
    cage: Array

    @classmethod
    def of(cls, memories: list[BearingMemory]) -> LaneMemory:
        """Those of single machines, side by side."""
        return cls(*(np.array(parts) for parts in zip(*memories, strict=True)))
