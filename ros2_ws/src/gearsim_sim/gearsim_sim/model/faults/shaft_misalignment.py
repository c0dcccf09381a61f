"""Misaligned coupling: a force of order 1, 2, 3, ... on the bearings and a ripple of the coupling's twist.

Forces and twist of the coupling are those of `JawCoupling` under the nominal load's torque, beyond those
of the same coupling in line. A shaft that turns clockwise is the mirror image of one that turns the other
way. The coupling hangs beyond a bearing: with the overhang a over the distance of the bearings, 1 + a of
the force acts on the near bearing's seat and -a on the far one's.
"""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np

from gearsim_io.errors import InputError
from gearsim_sim.model.assembly import Vector, combined
from gearsim_sim.model.contributions import Contribution
from gearsim_sim.model.faults.kind import FaultKind
from gearsim_sim.model.faults.on_shaft import coupled_shaft_names, shaft_of
from gearsim_sim.model.jaw_coupling import JawCoupling, Spectrum
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.rotating_force import RotatingForce
from gearsim_sim.model.shafts import Coupling, Shaft
from gearsim_sim.params.fields import Count, SiKeyed, Strict

ORDERS = 6
# Amplitudes below this fraction of the greatest are left out.
_NEGLIGIBLE = 1e-9


class ShaftMisalignmentParams(Strict):
    """How far and in which direction the shafts are out of line, and the coupling between them."""

    offset_m: Annotated[float, SiKeyed("m", ge=0, le=5e-3)] = 0.2e-3
    """Parallel offset of the shafts."""
    angle_rad: Annotated[float, SiKeyed("rad", ge=0, le=0.2)] = 0.01
    """Angle between the shafts."""
    direction_rad: Annotated[float, SiKeyed("rad", ge=-2 * math.pi, le=2 * math.pi)] = math.pi / 2
    """Direction of both, from x towards y."""
    # A jaw coupling of its size; one jaw's cushion is worn.
    elements: Count = 3
    """Elastic elements of the coupling, 2 to 12."""
    radius_m: Annotated[float, SiKeyed("m", gt=0, le=1)] = 0.03
    """Radius of the elements' circle."""
    element_stiffness_n_per_m: Annotated[float, SiKeyed("N/m", gt=0, le=1e9)] = 2e6
    """Tangential stiffness of an element."""
    unevenness: Annotated[float, SiKeyed("", ge=0, lt=1)] = 0.1
    """By how much the first element is softer, as a share."""
    overhang_ratio: Annotated[float, SiKeyed("", ge=0, le=2)] = 0.3
    """Distance of the coupling from the near bearing over that of the bearings."""


def place(
    params: ShaftMisalignmentParams,
    component: str,
    plant: Plant,
    seed: int,  # noqa: ARG001
) -> tuple[Contribution, ...]:
    """Harmonics of the forces on both seats and of the twist."""
    shaft = shaft_of(plant, component)
    coupling = shaft.coupling
    assert coupling is not None
    torque = abs(coupling.torque_per_load) * plant.limits.load_nm
    if torque <= 0:
        raise InputError(
            shaft.name, "component", shaft.name, "a coupling that carries a torque at nominal load"
        )
    if not 2 <= params.elements <= 12:
        raise InputError(shaft.name, "elements", params.elements, "2 to 12")
    count = int(params.elements)
    stiffness = [params.element_stiffness_n_per_m] * count
    stiffness[0] *= 1 - params.unevenness
    jaws = JawCoupling(tuple(stiffness), params.radius_m, torque)
    direction = params.direction_rad if shaft.sense > 0 else math.pi - params.direction_rad
    fx, fy, twist = jaws.harmonics(params.offset_m, params.angle_rad, direction, ORDERS)
    sign = 1.0 if coupling.drives_shaft else -1.0
    forces = _rows(shaft, _on_seats(shaft, coupling, "x", params.overhang_ratio), sign * shaft.sense * fx)
    forces += _rows(shaft, _on_seats(shaft, coupling, "y", params.overhang_ratio), sign * fy)
    k = coupling.stiffness_nm_per_rad
    return (*forces, *_rows(shaft, combined((coupling.driver, k), (coupling.driven, -k)), twist))


def _on_seats(shaft: Shaft, coupling: Coupling, axis: str, overhang: float) -> Vector:
    near, far = (getattr(shaft.planes[name], axis) for name in (coupling.near, coupling.far))
    return combined((near, 1 + overhang), (far, -overhang))


def _rows(shaft: Shaft, direction: Vector, amplitudes: Spectrum) -> tuple[RotatingForce, ...]:
    """Re a exp(i n phi) with phi the angle of the shaft in its own sense: the mirror image turns alike."""
    least = _NEGLIGIBLE * float(np.max(np.abs(amplitudes), initial=0.0))
    return tuple(
        RotatingForce(direction, shaft.track, float(order), float(a.real), -float(a.imag))
        for order, a in enumerate(amplitudes)
        if abs(a) > least
    )


KIND = FaultKind(
    name="shaft_misalignment",
    summary="coupling out of line: forces on the bearings at 1, 2, 3 ... times the speed",
    params_model=ShaftMisalignmentParams,
    components=coupled_shaft_names,
    place=place,
    look_for="lines at one, two and three times the shaft's speed, the second often the strongest, "
    "across the coupling's end of the shaft",
)
