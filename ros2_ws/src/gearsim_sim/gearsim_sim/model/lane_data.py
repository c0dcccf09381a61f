"""What the compiled loop of an ensemble is given; `loop_data` with a column for each lane.

Lanes are variants of one machine: what counts or names things (interfaces, tracks, balls, rows of teeth) is
the same for all and kept once; every physical number is each lane's own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.loop_data import Bearings, Meshes

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class LaneElements(NamedTuple):
    """Constants of the force elements."""

    bearings: Bearings  # of any lane: its indices, azimuths and numbers of balls are those of all
    bearing_numbers: Array  # ([bearing] load factor, clearance, nominal stiffness; LANES)
    cosines: Array  # (bearings balls,) flat
    sines: Array
    directions: Array  # (bearings,) where the load presses the inner ring to, in turns
    meshes: Meshes  # of any lane: its indices, but for those into tables
    mesh_numbers: Array  # ([mesh] mean stiffness, damping, cycles, phase offset; LANES)
    table_places: Array  # ([mesh, then error] offset and points of its table; LANES)
    tables: Array  # flat
    drive_numbers: Array  # (inertia, 1 / torque ratio of the motor, ratio of the load, gravity; LANES)
    rotations: Array  # `Data.rotations`
    step_s: float
    oversampling: int


class LaneDrive(NamedTuple):
    """What changes at events."""

    turns: Array  # ([coefficient], LANES)
    load: Array  # ([coefficient], LANES)
    clock: Array  # (start step, 1 / length_steps, anchor step; LANES)
    steady: int  # 1: speed and load are constant in all lanes
    anchor_phases: Array  # (tracks, LANES)
    rates: Array  # (tracks, LANES)
    spalls: Array  # (LANES, rows, columns)
    spall_counts: Indices  # (LANES + 1,) of each lane, then of all
    mesh_mods: Array  # (LANES, rows, columns)
    mod_counts: Indices  # (LANES + 1,)
    samples: Array


class LaneRows(NamedTuple):
    """The fault rows of one lane, under the names that they have in `Drive`."""

    spalls: Array
    mesh_mods: Array
    samples: Array
    rates: Array


class LaneWork(NamedTuple):
    """Work space; `missing` and `lane_missing` are zero between steps."""

    phases: Array  # (tracks, LANES)
    inputs: Array  # (known inputs, LANES)
    frames: Array  # ([bearing] cosine, sine, shift; LANES)
    missing: Array  # ([bearing, ball], LANES)
    meshes: Array  # ([mesh] stiffness, error, its rate; LANES)
    lane_phases: Array  # (tracks,)
    lane_rates: Array  # (tracks,)
    lane_missing: Array  # (bearings, balls)
    lane_meshes: Array  # (meshes, 3)
    touched: Indices  # (spalls of a lane, 2)
    marks: Indices  # (spalls of all lanes, 2) rows and lanes of `missing` that are not zero
