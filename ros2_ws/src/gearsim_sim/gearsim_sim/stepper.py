"""A plant in motion: prepares the compiled loop and owns its state.

`Stepper` knows steps of integration only; events, filtering and output samples are the engine's.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.carrying import Carrying
from gearsim_sim.integrate.carrier_kernel import Carrier
from gearsim_sim.integrate.coefficients import Propagator, make_propagator
from gearsim_sim.integrate.kernel import pack_constants, pack_state
from gearsim_sim.integrate.modes import complex_modes
from gearsim_sim.integrate.pieces import circle_table
from gearsim_sim.model.assembly import LinearSystem, Vector
from gearsim_sim.model.carrier import without
from gearsim_sim.model.loop import MOTION_COLUMNS, make_loop, make_work
from gearsim_sim.model.loop_data import Data, Drive, Part
from gearsim_sim.model.mesh_nodes import node_order, node_stride
from gearsim_sim.model.plant import Moment, Plant, RotatingSite, StateRow
from gearsim_sim.model.plant_data import bearing_data, bearing_memory, mesh_data
from gearsim_sim.model.side_data import Side, SidePart
from gearsim_sim.model.side_state import SideState
from gearsim_sim.model.statics import static_equilibrium
from gearsim_sim.schedule import Schedule

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PartSetup:
    """One independent part of the system, ready for the loop."""

    names: tuple[str, ...]
    dofs: NDArray[np.int64]  # indices of its degrees of freedom in the whole system
    propagator: Propagator | None  # None: a part without degrees of freedom
    part: Part
    interfaces: NDArray[np.int64]  # indices of its interfaces in the whole system
    state_rows: NDArray[np.int64]  # indices of the state rows that it gives
    sites: Array  # (sites, own degrees of freedom) combinations that are put out


@dataclass(frozen=True, eq=False)
class Rest:
    """Static equilibrium under the load at the start."""

    x: Array  # (dofs,) without the rigid rotation
    forces: Array  # (interfaces,) beyond the linear part
    inputs: Array  # (known inputs,)


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """State at the output samples within a stretch of steps."""

    turns: NDArray[np.int64]  # (shafts, n)
    fraction: Array  # (shafts, n)
    speed_hz: Array  # (shafts, n)
    signals: Array  # (signals, n)
    displacements: Array  # (interfaces, n), empty unless probed
    forces: Array  # (interfaces, n) contact and mesh forces, empty unless probed


class Stepper:
    """Integrates the model step by step.

    Parameters
    ----------
    plant : Plant
        The model.
    schedule : Schedule
        Operating point, angles and faults; the stepper reads it at each call.
    sites : mapping
        Name of each acceleration output and where it is.
    oversampling : int
        Steps per output sample.
    probed : bool
        Whether displacements and forces of the interfaces are kept.
    forces : bool
        Whether the forces on a carrying structure follow the rows of acceleration.
    """

    def __init__(
        self,
        plant: Plant,
        schedule: Schedule,
        sites: Mapping[str, Vector | RotatingSite],
        oversampling: int,
        *,
        probed: bool = False,
        forces: bool = False,
    ) -> None:
        self._plant = plant
        inner = plant.internals
        self._schedule = schedule
        self._probed = probed
        self.step = schedule.anchor_step
        self.oversampling = oversampling
        vectors, self.site_rows, rotations = _site_rows(sites)
        self._rows = _state_rows(inner, probed)
        away = () if plant.carrier is None else plant.carrier.dofs
        own = [without(vector, away) for vector in vectors]
        parts = [set_up_part(inner.system, names, own, schedule.step_s, self._rows) for names in inner.parts]
        if len(parts) == 1:
            parts.append(_nothing(inner.system))
        self._parts = (parts[0], parts[1])
        # The loop numbers interfaces part by part.
        self._place = np.argsort(np.concatenate([part.interfaces for part in parts]))
        self._carrying = Carrying(plant, schedule.step_s, vectors, self._rows, self._place, forces=forces)
        self._data = _loop_data(
            plant, parts, self._carrying.data, self._place, rotations, schedule.step_s, oversampling
        )
        shape = self._data.bearings.cosines.shape
        sizes = [size for part in parts for size in (part.part.length // 2, part.interfaces.size)]
        # Without rates of the interfaces, with them, and with forces beside the machine's own elements too.
        kinds = ((False, False), (True, False), (True, True))
        carried = (self._carrying.modes, self._carrying.interfaces)
        self._loops = [make_loop(*sizes, shape[1], rates, side, *carried) for rates, side in kinds]
        self.row_count = len(vectors) + self._carrying.data.force_index.size
        self._side = SideState(
            inner,
            [_side_part(part) for part in parts],
            self._carrying.side,
            self.row_count,
            schedule.step_s,
        )
        self._node_order = node_order(plant)
        self._memory = bearing_memory(self._data.bearings)
        self._state = self._at_rest()
        phases, speed_hz = plant.phases(schedule.turns(self.step)), schedule.segment.speed_hz(self.step)
        self._side.start(schedule.side_rows(), self._state, phases, self.step, speed_hz)

    @property
    def parts(self) -> tuple[PartSetup, ...]:
        """The parts of the system that have degrees of freedom."""
        return tuple(part for part in self._parts if part.propagator is not None)

    @property
    def force_names(self) -> tuple[str, ...]:
        """Interfaces whose forces on the carrying structure are the last rows, as far as asked for."""
        carrier = self._plant.carrier
        if carrier is None or not self._carrying.data.force_index.size:
            return ()
        return tuple(self._plant.system.interface_names[index] for index in carrier.interfaces)

    @property
    def data(self) -> Data:
        """Constants of the compiled loop."""
        return self._data

    @property
    def films(self) -> Array:
        """Oil films of all bearings, (bearings, balls), in thicknesses under 1 N."""
        return self._memory.film

    def rest(self) -> Rest:
        """Static equilibrium under the load at the present step, with the faults of that step."""
        schedule = self._schedule
        turns = schedule.turns(self.step)
        plant = self._plant.standing(turns)
        system = plant.system
        moment = Moment(turns, schedule.segment.speed_hz(self.step), schedule.contributions(self.step))
        u = plant.known_inputs(schedule.segment.load_nm(self.step))
        rest = static_equilibrium(
            plant, self._carrying.all_modes(complex_modes(plant.internals.system)), moment, u
        )
        motion = system.interfaces.T @ rest
        return Rest(rest, plant.interface_forces(motion, np.zeros(motion.size), moment), u)

    def _at_rest(self) -> tuple[Array, Array, Array]:
        """State of both parts, and of the structure that carries them, at static equilibrium."""
        rest = self.rest()
        system, states = self._plant.system, []
        phases = self._plant.phases(self._schedule.turns(self.step))
        forces = self._carrying.rest_forces(rest.x, rest.forces, phases)
        for setup in self._parts:
            if setup.propagator is None:
                states.append(np.zeros(0))
                continue
            own = rest.x[[system.dof(name) for name in setup.names]]
            z = setup.propagator.modal(own, np.zeros_like(own))
            known = rest.inputs @ setup.part.left_known
            states.append(pack_state(setup.propagator, z, known, forces[setup.interfaces]))
        return states[0], states[1], self._carrying.at_rest(rest.x, rest.forces, phases)

    def compile_all(self) -> None:
        """Compile every variant of the loop (or load it), so that no fault on the way has to wait for it."""
        drive, side = self._given()
        accel = np.zeros((self.row_count, 1))
        for loop in self._loops:
            self._run(loop, drive, side, tuple(one.copy() for one in self._state), 0, accel, 0)

    def advance(self, count: int, accel: Array, column: int) -> Motion:
        """Integrate `count` steps; accelerations go to accel[:, column : column + count]."""
        drive, side = self._given()
        loop = self._loops[2 if side.active else drive.need_rates]
        motion = self._run(loop, drive, side, self._state, count, accel, column)
        self.step += count
        return self._unpack(motion.T)

    def _given(self) -> tuple[Drive, Side]:
        """What the schedule prescribes from the present step on."""
        schedule = self._schedule
        drive = schedule.drive()
        fluctuates = schedule.profile.fluctuation_nm is not None
        return drive, self._side.update(schedule.side_rows(), self._state, fluctuates=fluctuates)

    def _run(
        self,
        loop: Callable[..., int],
        drive: Drive,
        side: Side,
        state: tuple[Array, ...],
        count: int,
        accel: Array,
        column: int,
    ) -> Array:
        """Let a variant of the loop move `state`; returns its rows at the output samples."""
        width = MOTION_COLUMNS + len(self._rows) + self._place.size + self._carrying.interfaces
        motion = np.empty((count // self.oversampling + 1, width))
        stride = 1 if side.swings else node_stride(self._node_order, self._schedule.segment)
        work = make_work(self._data, drive, self._place.size)
        samples = loop(
            *state, self._data, drive, side, self._memory, work, self.step, count, stride, accel, column,
            motion,
        )  # fmt: skip
        return motion[:samples]

    def _unpack(self, columns: Array) -> Motion:
        """Angles from the turns since the anchor and the twist of the encoders, signals, probes."""
        schedule, plant = self._schedule, self._plant
        passed, speed = columns[0], columns[1]
        given = np.concatenate([*(part.state_rows for part in self._parts), self._carrying.state_rows])
        rows = np.empty((given.size, passed.size))
        rows[given] = columns[MOTION_COLUMNS : MOTION_COLUMNS + given.size]
        tracks = [track for track, _ in plant.encoders.values()]
        shafts, signals = len(tracks), len(plant.signals)
        ratios = plant.rates[tracks, None]
        angle = schedule.anchor_phases[tracks, None] + ratios * passed + rows[:shafts] / (2 * np.pi)
        whole = np.floor(angle)
        displacements = forces = np.zeros((0, passed.size))
        if self._probed:
            count = self._place.size
            displacements, rates = rows[-2 * count : -count], rows[-count:]
            behind = columns[MOTION_COLUMNS + given.size :]
            forces = self._total_forces(displacements, rates, behind[self._place])
            if plant.carrier is not None:  # so far against the ground
                displacements[list(plant.carrier.interfaces)] -= behind[count:]
        return Motion(
            turns=schedule.anchor_turns[tracks, None] + whole.astype(np.int64),
            fraction=angle - whole,
            speed_hz=ratios * speed + rows[shafts : 2 * shafts] / (2 * np.pi),
            signals=rows[2 * shafts : 2 * shafts + signals],
            displacements=displacements,
            forces=forces,
        )

    def _total_forces(self, displacements: Array, rates: Array, deviations: Array) -> Array:
        """Contact and mesh forces from the deviations that the loop works with."""
        stiffness, damping = np.zeros((2, self._place.size, 1))
        for seat in self._plant.bearings:
            stiffness[[seat.x, seat.y]] = seat.nominal_stiffness_n_per_m
        for mesh in self._plant.meshes:
            stiffness[mesh.interface] = mesh.mean_stiffness_n_per_m
            damping[mesh.interface] = mesh.damping_ns_per_m
        for index, value in self._carrying.bare_springs():
            stiffness[index] = value
        return np.asarray(stiffness * displacements + damping * rates - deviations)


def _site_rows(
    sites: Mapping[str, Vector | RotatingSite],
) -> tuple[list[Vector], NDArray[np.int64], Array]:
    """Rows of acceleration, the row of each site, and which rows turn; a rotating site takes two rows."""
    rows: list[Vector] = []
    own, rotations = [], []
    for site in sites.values():
        own.append(len(rows))
        if isinstance(site, RotatingSite):
            rotations.append([len(rows), site.track, site.sense, site.offset_turns])
            rows += [site.x, site.y]
        else:
            rows.append(site)
    return rows, np.array(own, dtype=np.int64), np.array(rotations, dtype=np.float64).reshape(-1, 4)


def _state_rows(plant: Plant, probed: bool) -> list[StateRow]:
    """Twist of the encoders, its rate, signals; of all interfaces displacement and rate if probed."""
    encoders = [vector for _, vector in plant.encoders.values()]
    rows = [StateRow(vector) for vector in encoders]
    rows += [StateRow({}, vector) for vector in encoders]
    rows += list(plant.signals.values())
    if probed:
        system = plant.system
        columns = [
            {name: value for name, value in zip(system.dof_names, column, strict=True) if value}
            for column in system.interfaces.T.tolist()
        ]
        rows += [StateRow(column) for column in columns] + [StateRow({}, column) for column in columns]
    return rows


def set_up_part(
    system: LinearSystem,
    names: tuple[str, ...],
    sites: Sequence[Vector],
    step_s: float,
    rows: Sequence[StateRow],
) -> PartSetup:
    """Cut out a part, with the sites that feel it and the state rows that it gives."""
    part = system.part(names)
    matrix = np.array([system.direction(vector) for vector in sites])
    own = matrix[:, [system.dof(name) for name in names]]
    felt = np.flatnonzero(np.any(own != 0, axis=1))
    propagator = make_propagator(part, step_s, own[felt], rates=True)
    linear = propagator.linear
    mine = [i for i, row in enumerate(rows) if any(name in names for name in (*row.displacement, *row.rate))]
    shapes = [
        part.direction(rows[i].displacement) @ linear.shapes
        + part.direction(rows[i].rate) @ linear.shapes_rate
        for i in mine
    ]
    return PartSetup(
        names=names,
        dofs=np.array([system.dof(name) for name in names], dtype=np.int64),
        propagator=propagator,
        part=Part(
            k=pack_constants(propagator),
            length=2 * propagator.modes,
            left_known=propagator.within(propagator.left_known),
            site_known=np.ascontiguousarray(propagator.site_known),
            site_index=felt.astype(np.int64),
            state_rows=propagator.output_rows(
                np.array(shapes, dtype=np.complex128).reshape(len(mine), linear.eigenvalues.size)
            ),
        ),
        interfaces=np.array(
            [system.interface_names.index(name) for name in part.interface_names], dtype=np.int64
        ),
        state_rows=np.array(mine, dtype=np.int64),
        sites=own[felt],
    )


def _nothing(system: LinearSystem) -> PartSetup:
    """A part without degrees of freedom, in place of the second."""
    inputs = len(system.input_names)
    empty = np.zeros(0, dtype=np.int64)
    part = Part(
        k=np.zeros(0),
        length=0,
        left_known=np.zeros((inputs, 0)),
        site_known=np.zeros((0, inputs)),
        site_index=empty,
        state_rows=np.zeros((0, 0)),
    )
    return PartSetup(
        names=(),
        dofs=empty,
        propagator=None,
        part=part,
        interfaces=empty,
        state_rows=empty,
        sites=np.zeros((0, 0)),
    )


def _side_part(setup: PartSetup) -> SidePart:
    """A part as forces beside the machine's own elements need it."""
    return SidePart(setup.names, setup.propagator, setup.interfaces.size, setup.part.site_index, setup.sites)


def _loop_data(
    plant: Plant,
    parts: Sequence[PartSetup],
    carrier: Carrier,
    place: NDArray[np.int64],
    rotations: Array,
    step_s: float,
    oversampling: int,
) -> Data:
    """Constants of the loop; `place` is that of each interface in the loop's order."""
    return Data(
        first=parts[0].part,
        second=parts[1].part,
        carrier=carrier,
        bearings=bearing_data(plant, place),
        meshes=mesh_data(plant, place, step_s),
        circle=circle_table(),
        rotations=rotations,
        inertia=plant.inertia_kg_m2,
        torque_ratios=np.array(plant.torque_ratios),
        gravity=plant.gravity_m_per_s2,
        step_s=step_s,
        oversampling=oversampling,
    )
