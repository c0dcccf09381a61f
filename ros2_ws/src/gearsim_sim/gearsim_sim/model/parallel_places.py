"""Shafts and mounts of the parallel-shaft gearbox, for faults of shafts and structure."""

from __future__ import annotations

from collections.abc import Mapping

from gearsim_sim.model.shafts import Coupling, Mount, Plane, Shaft
from gearsim_sim.params.parallel import BEARINGS, ParallelParams


def parallel_shafts(params: ParallelParams, senses: tuple[float, float]) -> tuple[Shaft, ...]:
    """Input and output shaft: wheel and two bearings each, a coupling between flywheel and shaft."""
    model = params.model
    ends = (
        Coupling(
            near=BEARINGS[0],
            far=BEARINGS[1],
            driver={"theta_f1": 1.0},
            driven={"theta_s1": 1.0},
            stiffness_nm_per_rad=model.flywheel_1.stiffness_nm_per_rad,
            torque_per_load=params.speed_ratio,
            drives_shaft=True,
        ),
        Coupling(
            near=BEARINGS[3],
            far=BEARINGS[2],
            driver={"theta_s4": 1.0},
            driven={"theta_f2": 1.0},
            stiffness_nm_per_rad=model.flywheel_2.stiffness_nm_per_rad,
            torque_per_load=1.0,
            drives_shaft=False,
        ),
    )
    names = (params.input_shaft, params.output_shaft)
    wheels = ((f"{params.mesh.name}.pinion", "pin"), (f"{params.mesh.name}.gear", "ge"))
    bending = model.shafts.bending_stiffness_n_per_m
    return tuple(
        Shaft(
            name=names[i],
            track=i,
            rate=(1.0, params.speed_ratio)[i],
            sense=senses[i],
            planes=_planes(*wheels[i], (1 + 2 * i, 2 + 2 * i)),
            bends={BEARINGS[number]: bending for number in (2 * i, 2 * i + 1)},
            coupling=ends[i],
        )
        for i in range(2)
    )


def _planes(wheel: str, body: str, seats: tuple[int, int]) -> Mapping[str, Plane]:
    planes = {wheel: Plane({f"x_{body}": 1.0}, {f"y_{body}": 1.0})}
    for number in seats:
        planes[BEARINGS[number - 1]] = Plane({f"x_s{number}": 1.0}, {f"y_s{number}": 1.0})
    return planes


def parallel_mounts(params: ParallelParams) -> Mapping[str, Mount]:
    """The pedestals' bases; none where the outer races are held by the ground."""
    if not params.pedestals:
        return {}
    pedestal = params.model.pedestal
    return {
        name: Mount({f"y_p{number}": 1.0}, pedestal.stiffness_n_per_m, pedestal.damping_ns_per_m)
        for number, name in enumerate(BEARINGS, 1)
    }
