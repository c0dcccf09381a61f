"""The 34-DOF model in motion: prepares the compiled loop and owns its state.

`Stepper` knows steps of integration only; events, filtering and output samples are the engine's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.integrate.coefficients import Propagator, make_propagator, padded
from gearsim_sim.integrate.kernel import pack_constants, pack_state
from gearsim_sim.integrate.modes import complex_modes
from gearsim_sim.integrate.pieces import circle_table
from gearsim_sim.model.assembly import LinearSystem, Vector
from gearsim_sim.model.lpm34 import ENCODER_DOFS, Gearbox, Moment
from gearsim_sim.model.lpm34_loop import INTERFACES, X_INTERFACES, Data, Part, make_loop
from gearsim_sim.model.statics import static_equilibrium
from gearsim_sim.schedule import Schedule

Array = NDArray[np.float64]
# Bearings with fewer balls share the compiled loop of those with so many.
_LEAST_BALLS = 24


@dataclass(frozen=True, eq=False)
class _PartSetup:
    """One independent part of the system, ready for the loop."""

    names: tuple[str, ...]
    propagator: Propagator
    part: Part
    interfaces: NDArray[np.int64]  # indices of its interfaces in the whole system


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """State at the output samples within a stretch of steps."""

    turns: NDArray[np.int64]  # (shafts, n)
    fraction: Array  # (shafts, n)
    speed_hz: Array  # (shafts, n)
    displacements: Array  # (interfaces, n), empty unless probed
    forces: Array  # (interfaces, n) contact forces and mesh force, empty unless probed


class Stepper:
    """Integrates the model step by step.

    Parameters
    ----------
    gearbox : Gearbox
        The model.
    schedule : Schedule
        Operating point, angles and faults; the stepper reads it at each call.
    sites : mapping
        Name of each acceleration output and its combination of degrees of freedom.
    oversampling : int
        Steps per output sample.
    probed : bool
        Whether displacements and forces of the interfaces are kept.
    """

    def __init__(
        self,
        gearbox: Gearbox,
        schedule: Schedule,
        sites: Mapping[str, Vector],
        oversampling: int,
        *,
        probed: bool = False,
    ) -> None:
        self._gearbox = gearbox
        self._schedule = schedule
        self._probed = probed
        self.step = schedule.anchor_step
        self.oversampling = oversampling
        system = gearbox.system
        matrix = np.array([system.direction(vector) for vector in sites.values()])
        x_names = tuple(name for name in system.dof_names if name.startswith("x_"))
        y_names = tuple(name for name in system.dof_names if not name.startswith("x_"))
        x = _set_up(system, x_names, matrix, schedule.step_s, _x_rows(probed))
        y = _set_up(system, y_names, matrix, schedule.step_s, _y_rows(gearbox, probed))
        self._data = _loop_data(gearbox, x.part, y.part, schedule.step_s, oversampling)
        balls = self._data.cosines.shape[1]
        self._loop = make_loop(x.propagator.modes, y.propagator.modes, balls)
        self._missing = np.zeros((4, balls))
        self._state = self._rest(x, y)

    def _rest(self, x: _PartSetup, y: _PartSetup) -> tuple[Array, Array]:
        """State of both parts at static equilibrium under the present load."""
        system, schedule = self._gearbox.system, self._schedule
        turns = float(schedule.anchor_turns[0] + schedule.anchor_phases[0])
        spalls = tuple(fault.spall for fault in schedule.faults.values())
        moment = Moment(turns, schedule.speed_hz(self.step), spalls)
        u = self._gearbox.known_inputs(schedule.load_nm(self.step))
        rest = static_equilibrium(self._gearbox, complex_modes(system), moment, u)
        motion = system.interfaces.T @ rest
        forces = self._gearbox.interface_forces(motion, np.zeros(motion.size), moment)
        states = []
        for setup in (x, y):
            own = rest[[system.dof(name) for name in setup.names]]
            z = setup.propagator.modal(own, np.zeros_like(own))
            known = u @ setup.propagator.left_known
            states.append(pack_state(setup.propagator, z, known, forces[setup.interfaces]))
        return states[0], states[1]

    def advance(self, count: int, accel: Array, column: int) -> Motion:
        """Integrate `count` steps; accelerations go to accel[:, column : column + count]."""
        drive = self._schedule.drive()
        rows = 2 + self._data.x.state_rows.shape[0] + self._data.y.state_rows.shape[0] + INTERFACES
        motion = np.empty((count // self.oversampling + 1, rows))
        sx, sy = self._state
        samples = self._loop(
            sx, sy, self._data, drive, self._missing, self.step, count, accel, column, motion
        )
        self.step += count
        return self._unpack(motion[:samples].T)

    def _unpack(self, rows: Array) -> Motion:
        """Angles from the turns since the anchor and the twist of the encoders, and probes."""
        schedule, ratios = self._schedule, self._schedule.rates[:2, None]
        passed, speed = rows[0], rows[1]
        x_rows = X_INTERFACES if self._probed else 0
        y_rows = rows[2 + x_rows :]
        angle = schedule.anchor_phases[:2, None] + ratios * passed + y_rows[:2] / (2 * np.pi)
        whole = np.floor(angle)
        displacements = forces = np.zeros((0, passed.size))
        if self._probed:
            displacements = np.vstack([rows[2 : 2 + x_rows], y_rows[4:9]])
            forces = self._total_forces(displacements, y_rows[9], rows[-INTERFACES:])
        return Motion(
            turns=schedule.anchor_turns[:2, None] + whole.astype(np.int64),
            fraction=angle - whole,
            speed_hz=ratios * speed + y_rows[2:4] / (2 * np.pi),
            displacements=displacements,
            forces=forces,
        )

    def _total_forces(self, displacements: Array, mesh_rate: Array, deviations: Array) -> Array:
        """Contact and mesh forces from the deviations that the loop works with."""
        stiffness = np.full((INTERFACES, 1), self._data.nominal_stiffness)
        stiffness[-1] = self._data.mesh[0]
        total = stiffness * displacements - deviations
        total[-1] += self._data.mesh[1] * mesh_rate
        return np.asarray(total)


def _x_rows(probed: bool) -> list[tuple[Vector, bool]]:
    """State outputs of the x part: displacements of the bearings."""
    return [({f"x_s{i}": 1.0, f"x_p{i}": -1.0}, False) for i in range(1, 5)] if probed else []


def _y_rows(gearbox: Gearbox, probed: bool) -> list[tuple[Vector, bool]]:
    """State outputs of the y part: twist of the encoders and its rate; probes as in `Stepper._unpack`."""
    rows: list[tuple[Vector, bool]] = [({dof: 1.0}, rate) for rate in (False, True) for dof in ENCODER_DOFS]
    if probed:
        system = gearbox.system
        mesh = dict(zip(system.dof_names, system.interfaces[:, -1].tolist(), strict=True))
        mesh = {name: value for name, value in mesh.items() if value}
        rows += [({f"y_s{i}": 1.0, f"y_p{i}": -1.0}, False) for i in range(1, 5)]
        rows += [(mesh, False), (mesh, True)]
    return rows


def _set_up(
    system: LinearSystem,
    names: tuple[str, ...],
    sites: Array,
    step_s: float,
    rows: Sequence[tuple[Vector, bool]],
) -> _PartSetup:
    """Cut out a part, with the sites that feel it."""
    part = system.part(names)
    own = sites[:, [system.dof(name) for name in names]]
    felt = np.flatnonzero(np.any(own != 0, axis=1))
    propagator = make_propagator(part, step_s, own[felt])
    linear = propagator.linear
    shapes = [
        part.direction(vector) @ (linear.shapes_rate if rate else linear.shapes) for vector, rate in rows
    ]
    matrix = np.array(shapes, dtype=np.complex128).reshape(len(rows), linear.eigenvalues.size)
    return _PartSetup(
        names=names,
        propagator=propagator,
        part=Part(
            k=pack_constants(propagator),
            length=2 * propagator.modes,
            left_known=propagator.left_known,
            site_known=np.ascontiguousarray(propagator.site_known),
            site_index=felt.astype(np.int64),
            state_rows=propagator.output_rows(matrix),
        ),
        interfaces=np.array([system.interface_names.index(name) for name in part.interface_names]),
    )


def _loop_data(gearbox: Gearbox, x: Part, y: Part, step_s: float, oversampling: int) -> Data:
    """Constants of the force elements for the loop."""
    params, mesh, bearings = gearbox.params, gearbox.mesh, gearbox.bearings
    balls = padded(max(_LEAST_BALLS, *(bearing.ball_count for bearing in bearings)))
    cosines, sines = np.zeros((4, balls)), np.zeros((4, balls))
    row_offsets = np.zeros((4, 2))
    for i, bearing in enumerate(bearings):
        cosines[i, : bearing.ball_count] = np.cos(bearing.azimuths_rad)
        sines[i, : bearing.ball_count] = np.sin(bearing.azimuths_rad)
        first = bearing.azimuths_rad[:: bearing.balls_per_row]
        row_offsets[i, : first.size] = first / (2 * np.pi)
    inertia = float(gearbox.rigid @ gearbox.system.mass @ gearbox.rigid)
    return Data(
        x=x,
        y=y,
        circle=circle_table(),
        stiffness=mesh.stiffness.table(),
        pinion_error=mesh.pinion_error.table(),
        gear_error=mesh.gear_error.table(),
        mesh=np.array([mesh.mean_stiffness_n_per_m, mesh.damping_ns_per_m, float(mesh.pinion_teeth)]),
        bearings=np.array([[bearing.load_factor, bearing.clearance_m] for bearing in bearings]),
        cosines=cosines,
        sines=sines,
        row_offsets=row_offsets,
        balls_per_row=np.array([bearing.balls_per_row for bearing in bearings]),
        nominal_stiffness=params.model.ball_bearing.nominal_stiffness_n_per_m,
        inertia=inertia,
        speed_ratio=float(gearbox.speed_ratio),
        gravity=float(gearbox.known_inputs(0.0)[2]),
        step_s=step_s,
        oversampling=oversampling,
    )
