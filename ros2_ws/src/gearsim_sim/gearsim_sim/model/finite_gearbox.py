"""The parallel-shaft gearbox with finite-element shafts: 58 degrees of freedom, on the ground.

What is not of the shafts (bearings, mesh, errors, angles) is that of the lumped model. Degrees of freedom are
the own modes of each free shaft in x, in y and in torsion, see `finite_shaft`; every place on a shaft is a
combination of them, and bearings, mesh, couplings and torques act on such places as they do on lumped masses.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from gearsim_io.errors import InputError
from gearsim_sim.model.assembly import Assembly, LinearSystem, Vector, combined
from gearsim_sim.model.finite_shaft import (
    COUPLING,
    ENCODER,
    END,
    FAR,
    FLYWHEEL,
    NEAR,
    WHEEL,
    Disc,
    OwnModes,
    bending,
    modes_kept,
    torsion,
    wheel_disc,
    wheel_stiffness,
)
from gearsim_sim.model.gear_mesh import add_mesh
from gearsim_sim.model.parallel_shaft import make_parallel_shaft
from gearsim_sim.model.plant import BASE_INPUTS, Plant, StateRow
from gearsim_sim.model.shafts import Plane, Shaft
from gearsim_sim.params.finite_shafts import FiniteShaft, FiniteShafts
from gearsim_sim.params.parallel import BEARINGS, ParallelParams

# Bearings of each shaft in the order near its coupling, far from it.
_SEATS = ((1, 2), (4, 3))
_NAMES = ("in", "out")


@dataclass(frozen=True)
class ShaftPlaces:
    """Places on a shaft as combinations of its coordinates, by the names of `finite_shaft`."""

    x: Mapping[str, Vector]
    y: Mapping[str, Vector]
    twist: Mapping[str, Vector]
    whole: Vector  # one radian of the whole shaft
    weight: Vector  # pull of unit gravity against y


def make_finite_gearbox(params: ParallelParams, seed: int) -> Plant:
    """Assemble the model; `seed` gives the gears their random errors.

    Raises
    ------
    InputError
        If the section of the shafts is missing, the teeth are, or fewer modes exist than asked for.
    """
    of = params.model.finite_shafts
    if of is None:
        raise InputError(params.where, "finite_shafts", "nothing", "a section with the shafts' dimensions")
    if params.model.teeth is None:
        raise InputError(
            params.where, "teeth", "nothing", "this section, which tells how large the wheels are"
        )
    lumped = make_parallel_shaft(params.model_copy(update={"pedestals": False}), seed)
    own = (of.input, of.output)
    discs = [wheel_disc(wheel, of) for wheel in lumped.wheels]
    assembly = Assembly()
    places = _add_shafts(assembly, params, of, discs)
    system = _assemble(assembly, params, places, own, lumped.meshes[0].mean_stiffness_n_per_m)
    rigid = combined((places[0].whole, 1.0), (places[1].whole, params.speed_ratio))
    in_x = tuple(name for name in system.dof_names if name.startswith("x_"))
    names = (params.input_shaft, params.output_shaft)
    return replace(
        lumped,
        system=system,
        parts=(in_x, tuple(name for name in system.dof_names if name not in in_x)),
        rigid=system.direction(rigid),
        encoders={names[i]: (i, places[i].twist[ENCODER]) for i in range(2)},
        sites={
            f"b{number}_{axis}": getattr(places[i], axis)[place]
            for i in range(2)
            for number, place in zip(_SEATS[i], (NEAR, FAR), strict=True)
            for axis in "xy"
        },
        signals={f"{names[i]}_torque": _torque(places[i], own[i], i) for i in range(2)},
        shafts=tuple(
            _shaft(shaft, places[i], own[i], wheel_stiffness(own[i], of, discs[i]), i)
            for i, shaft in enumerate(lumped.shafts)
        ),
    )


def _add_shafts(
    assembly: Assembly, params: ParallelParams, of: FiniteShafts, discs: Sequence[Disc]
) -> tuple[ShaftPlaces, ShaftPlaces]:
    """Coordinates of both shafts with their springs and dampers."""
    own = (of.input, of.output)
    bends = [bending(own[i], of, discs[i]) for i in range(2)]
    twists = [torsion(own[i], of, discs[i]) for i in range(2)]
    every = [bends[0], bends[0], twists[0], bends[1], bends[1], twists[1]]
    available = sum(len(one.mass) - len(one.masters) for one in every)
    if of.modes > available:
        raise InputError(
            params.where, "finite_shafts.modes", of.modes, f"at most {available}, or shorter elements"
        )
    kept = modes_kept(every, int(of.modes))
    found = []
    for i in range(2):
        modes = [part.reduced(kept[3 * i + j]) for j, part in enumerate(every[3 * i : 3 * i + 3])]
        vectors = [
            _coordinates(assembly, f"{axis}_{_NAMES[i]}", part, of.damping_ratio)
            for axis, part in zip(("x", "y", "theta"), modes, strict=True)
        ]
        x, y, twist = (rows for rows, _ in vectors)
        found.append(ShaftPlaces(x, y, twist, vectors[2][1], combined((vectors[1][1], -1.0))))
    return found[0], found[1]


def _coordinates(
    assembly: Assembly, prefix: str, modes: OwnModes, damping_ratio: float
) -> tuple[dict[str, Vector], Vector]:
    """Enter own modes; returns the places over them, and the pull of unit acceleration."""
    names = [f"{prefix}_{number}" for number in range(1, modes.omega.size + 1)]
    for name, omega in zip(names, modes.omega.tolist(), strict=True):
        assembly.inertia(name, 1.0)
        if omega > 0:
            assembly.spring({name: 1.0}, omega**2)
            assembly.damper({name: 1.0}, 2 * damping_ratio * omega)
    rows: dict[str, Vector] = {
        place: dict(zip(names, row.tolist(), strict=True)) for place, row in modes.rows.items()
    }
    return rows, dict(zip(names, modes.weight.tolist(), strict=True))


def _assemble(
    assembly: Assembly,
    params: ParallelParams,
    places: tuple[ShaftPlaces, ShaftPlaces],
    own: tuple[FiniteShaft, FiniteShaft],
    mesh_stiffness_n_per_m: float,
) -> LinearSystem:
    """Bearings, mesh, dampers of couplings and known inputs, in the order of the lumped model."""
    model = params.model
    seats = {
        number: (places[i], place)
        for i in range(2)
        for number, place in zip(_SEATS[i], (NEAR, FAR), strict=True)
    }
    for i, shaft in enumerate(own):
        twist = places[i].twist
        assembly.damper(
            combined((twist[FLYWHEEL], 1.0), (twist[COUPLING], -1.0)), shaft.flywheel.damping_nms_per_rad
        )
        assembly.damper(
            combined((twist[END], 1.0), (twist[ENCODER], -1.0)), shaft.encoder.damping_nms_per_rad
        )
    for number in range(1, 5):
        shaft_places, place = seats[number]
        for axis in "xy":
            across = getattr(shaft_places, axis)[place]
            assembly.spring(across, params.rolling_bearings[number - 1].nominal_stiffness_n_per_m)
            assembly.damper(across, model.seats[BEARINGS[number - 1]].damping_ns_per_m)
            assembly.interface(f"b{number}_{axis}", across)
    along = combined(
        (places[0].twist[WHEEL], model.pinion.base_radius_m),
        (places[1].twist[WHEEL], -model.gear.base_radius_m),
        (places[0].y[WHEEL], -1.0),
        (places[1].y[WHEEL], 1.0),
    )
    add_mesh(assembly, mesh_stiffness_n_per_m, model.mesh.damping_ns_per_m, along)
    weight = combined((places[0].weight, 1.0), (places[1].weight, 1.0))
    columns = (places[0].twist[FLYWHEEL], combined((places[1].twist[FLYWHEEL], -1.0)), weight)
    for name, column in zip(BASE_INPUTS, columns, strict=True):
        assembly.known_input(name, column)
    return assembly.build()


def _torque(places: ShaftPlaces, shaft: FiniteShaft, output: int) -> StateRow:
    """Torque through the coupling in the direction of the power [N m]."""
    sign = -1.0 if output else 1.0
    twist = combined((places.twist[FLYWHEEL], sign), (places.twist[COUPLING], -sign))
    end = shaft.flywheel
    return StateRow(combined((twist, end.stiffness_nm_per_rad)), combined((twist, end.damping_nms_per_rad)))


def _shaft(
    lumped: Shaft, places: ShaftPlaces, own: FiniteShaft, stiffness: tuple[float, float], output: int
) -> Shaft:
    """The shaft for faults of shafts: same names, other places."""
    near, far = (BEARINGS[number - 1] for number in _SEATS[output])
    at = {lumped.wheel: WHEEL, near: NEAR, far: FAR}
    flywheel, coupling = places.twist[FLYWHEEL], places.twist[COUPLING]
    assert lumped.coupling is not None
    return replace(
        lumped,
        planes={name: Plane(places.x[at[name]], places.y[at[name]]) for name in lumped.planes},
        bends={near: stiffness[0], far: stiffness[1]},
        coupling=replace(
            lumped.coupling,
            driver=coupling if output else flywheel,
            driven=flywheel if output else coupling,
            stiffness_nm_per_rad=own.flywheel.stiffness_nm_per_rad,
        ),
    )
