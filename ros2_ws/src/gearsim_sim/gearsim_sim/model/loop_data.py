"""What the compiled loop is given: constants of a plant (`Data`), and what changes at events (`Drive`).

The numbers of bearings, meshes, errors and rows of a table are run-time values, so that one compiled loop
serves many machines and every fault; those of modes, interfaces and (padded) balls are constants of it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.integrate.carrier_kernel import Carrier

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
# Each row of a table of `Drive` begins with the ramp of its severity: from, to, start step, steps.
SEVERITY_COLUMNS = 4


class Part(NamedTuple):
    """Constants of one independent part of the linear system."""

    k: Array  # `kernel.pack_constants`
    length: int  # 2 nm, see `kernel.times_state`
    left_known: Array  # (inputs, 2 nm) force on the modes per known input, within a step
    site_known: Array  # (sites, inputs) acceleration per known input
    site_index: Indices  # (sites,) output row that each site adds to
    state_rows: Array  # (rows, 2 nm) outputs of the state at the output samples


class Bearings(NamedTuple):
    """Constants of all rolling bearings; balls are padded with cosine and sine zero."""

    places: Indices  # (bearings, 3): interface in x, in y, track of the cage
    numbers: Array  # (bearings, 3): load factor, clearance, nominal stiffness
    cosines: Array  # (bearings, balls) of the azimuths in the cage's frame
    sines: Array
    azimuths: Array  # (bearings, balls) in turns
    row_offsets: Array  # (bearings, rows) azimuth of the first ball of each row in turns
    balls_per_row: Indices  # (bearings,)
    rollers: Indices  # (bearings,) 1: line contacts
    spins: Indices  # (bearings,) track of the balls' spin


class BearingMemory(NamedTuple):
    """What the bearings remember from step to step, and work space.

    `missing` is zero between steps; the others matter only while a fault uses them.
    """

    missing: Array  # (bearings, balls) what surfaces lack under each ball [m]
    play: Array  # (bearings, balls) way of each ball out of the middle of its pocket [turns]
    cosines: Array  # (bearings, balls) of azimuths with that play
    sines: Array
    film: Array  # (bearings, balls) thickness of the oil film over that under 1 N
    cage: Array  # (bearings, 4) what cage and balls have fallen behind, way of the cage [turns], force [N]


class Meshes(NamedTuple):
    """Constants of all gear meshes; tables as `PeriodicSeries.table` makes them, one behind the other.

    A mesh may have a rectangular pulse of stiffness once per tooth phase; its height is 0 if not.
    """

    places: Indices  # (meshes, 6): interface, track, table's offset and points, its `errors` from, to
    numbers: Array  # (meshes, 7): mean stiffness, damping, cycles per turn of the track, phase offset,
    # and the pulse: start and width in pitches, height
    errors: Indices  # (errors, 3): track, table's offset and points; those of a mesh are neighbours
    tables: Array
    step_s: float


class Data(NamedTuple):
    """Constants of the loop."""

    first: Part
    second: Part  # without modes and interfaces if the plant has one part only
    carrier: Carrier  # empty if the bearings stand on the ground
    bearings: Bearings
    meshes: Meshes
    circle: Array  # `pieces.cosine_sine`'s table
    rotations: Array  # (rotating sites, 4): output row of x (y is the next), track, sense, offset in turns
    inertia: float  # of the rigid rotation, at the reference shaft [kg m^2]
    torque_ratios: Array  # (2,) `Plant.torque_ratios`
    gravity: float
    step_s: float
    oversampling: int


class Drive(NamedTuple):
    """What changes at events.

    Between events the angle of the reference shaft and the load are polynomials of
    u = (step - start_step) / length_steps.
    """

    turns: Array  # DEGREE + 1 coefficients, ascending: turns of the reference shaft since start_step
    load: Array  # DEGREE + 1 coefficients, ascending: load torque [N m]
    fluctuation: Array  # the same of what the load has beyond that and the motor does not balance
    start_step: int
    length_steps: float
    steady: int  # 1: speed and load are constant, so that the known inputs are
    anchor_step: int
    anchor_phases: Array  # (tracks,) turns in [0, 1) at the anchor
    rates: Array  # (tracks,) turns per turn of the reference shaft
    need_rates: int  # 1: some element wants the rates of the interfaces
    spalls: Array
    profiles: Array
    bearing_terms: Array
    mesh_mods: Array
    mesh_pulses: Array
    mesh_terms: Array
    samples: Array


# Own columns of each table of rows, behind those of the severity. `offset` and `points` are filled in for
# contributions with samples: where these begin in `Drive.samples`, and how many intervals they have.
COLUMNS = {
    "spalls": (
        "bearing", "row", "ball", "track", "sense", "position_turns", "half_width_rad", "depth_m",
        "carrier_radius_m", "other_radius_m", "carrier_sign", "other_sign", "rectangular",
    ),
    "profiles": (
        "bearing", "first_ball", "balls", "track", "sense", "on_ball", "start_turns", "span_turns",
        "offset", "points",
    ),
    "bearing_terms": ("bearing", "what", "first", "second", "third", "fourth", "fifth"),
    "mesh_mods": ("mesh", "what", "track", "offset", "points"),
    "mesh_pulses": ("mesh", "what", "track", "start_turns", "width_turns", "height"),
    "mesh_terms": ("mesh", "what", "value_m"),
}  # fmt: skip
# Tables whose rows need the rates of the interfaces, unless their severity is zero.
NEED_RATES = ("mesh_terms",)
