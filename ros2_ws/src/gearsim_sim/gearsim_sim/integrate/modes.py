"""Exact modal form of a damped linear system, for any viscous damping.

M x'' + C x' + K x = f becomes z_m' = lambda_m z_m + (left f)_m with complex modes. Real modes would not
do: single dampers (flywheels, encoders, mesh) make the damping non-proportional. A rigid mode with a
double eigenvalue of zero has no such form (it is a Jordan block); it is kept out, and the caller moves
it by closed formulas.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eig, eigh

from gearsim_sim.model.assembly import LinearSystem

# A mode counts as rigid if its squared frequency is below this fraction of the highest one. Rounding
# puts rigid modes near 1e-16; the slowest elastic mode of a gearbox is near 1e-8.
_RIGID = 1e-12
_COUPLING = 1e-9


@dataclass(frozen=True, eq=False)
class ComplexModes:
    """Modes of a LinearSystem; one of each conjugate pair, and real ones.

    The motion of mode coordinates z is x = Re(shapes z), x' = Re(shapes_rate z), and
    z' = eigenvalues z + left f for a force f on the degrees of freedom. In `shapes` the conjugate of a
    pair is included by a factor 2.
    """

    eigenvalues: NDArray[np.complex128]  # (m,) [1/s]
    shapes: NDArray[np.complex128]  # (n, m)
    shapes_rate: NDArray[np.complex128]  # (n, m)
    left: NDArray[np.complex128]  # (m, n)
    from_position: NDArray[np.complex128]  # (m, n) z = from_position x + from_rate x'
    from_rate: NDArray[np.complex128]  # (m, n)
    rigid_modes: NDArray[np.float64]  # (n, r), orthonormal in the mass
    compliance: NDArray[np.float64]  # (n, n) x'' = compliance f + Re(acceleration z): the inverse mass
    acceleration: NDArray[np.complex128]  # (n, m)


def complex_modes(system: LinearSystem) -> ComplexModes:
    """The modes of `system` without its rigid ones.

    Raises
    ------
    ValueError
        If a damper or an interface moves with a rigid mode: then it would not be free.
    """
    squared, shapes = eigh(system.stiffness, system.mass)
    is_rigid = np.abs(squared) < _RIGID * squared[-1]
    if np.any(squared[~is_rigid] < 0):
        raise ValueError("the stiffness matrix is indefinite")
    rigid, elastic = shapes[:, is_rigid], shapes[:, ~is_rigid]
    _check_free(system, rigid)
    omega = np.sqrt(squared[~is_rigid])
    damping = elastic.T @ system.damping @ elastic
    # State [omega y, y'] in energy units, so that the matrix is nearly normal and its modes well separated.
    size = omega.size
    matrix = np.block([[np.zeros((size, size)), np.diag(omega)], [-np.diag(omega), -damping]])
    values, right = eig(matrix)
    inverse: NDArray[np.complex128] = np.linalg.inv(right)
    keep = values.imag >= 0
    factor = np.where(values[keep].imag > 0, 2.0, 1.0)
    position, rate = right[:size, keep] * factor, right[size:, keep] * factor
    momentum = elastic.T @ system.mass
    return ComplexModes(
        eigenvalues=values[keep],
        shapes=elastic @ (position / omega[:, None]),
        shapes_rate=elastic @ rate,
        left=np.asarray(inverse[keep, size:] @ elastic.T, dtype=np.complex128),
        from_position=inverse[keep, :size] @ (omega[:, None] * momentum),
        from_rate=np.asarray(inverse[keep, size:] @ momentum, dtype=np.complex128),
        rigid_modes=rigid,
        compliance=shapes @ shapes.T,
        acceleration=-elastic @ (omega[:, None] * position + damping @ rate),
    )


def _check_free(system: LinearSystem, rigid: NDArray[np.float64]) -> None:
    """Nothing but known inputs may act on a rigid mode."""
    for name, matrix in (("damper", system.damping), ("interface", system.interfaces.T)):
        scale = np.max(np.abs(matrix), initial=0.0) * np.max(np.abs(rigid), initial=0.0)
        if rigid.size and np.max(np.abs(matrix @ rigid), initial=0.0) > _COUPLING * scale:
            raise ValueError(f"a {name} acts on a rigid mode")
