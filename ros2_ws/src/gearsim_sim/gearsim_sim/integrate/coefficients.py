"""Coefficients of the cubic exponential scheme, packed flat for the compiled kernel.

Within a step h the force of each mode is taken as the cubic through its values at the new and the three
last instants, and z' = lambda z + F is solved exactly for that:

    z_{n+1} = e^{lambda h} z_n + sum_{j=0..3} c_j F_{n+1-j},
    c_j = h int_0^1 e^{lambda h (1 - s)} l_j(s) ds,   l_j the Lagrange polynomials on 1, 0, -1, -2.

The scheme is of fourth order in h; the linear part is exact at any h.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.integrate.modes import ComplexModes, complex_modes
from gearsim_sim.model.assembly import LinearSystem

LANES = 8  # doubles in one vector register of 512 bits; all strides are multiples of it
_NODES = (1.0, 0.0, -1.0, -2.0)


def padded(count: int) -> int:
    """The least multiple of LANES that is not below `count`."""
    return -(-count // LANES) * LANES


def cubic_weights(rates: NDArray[np.complex128], step_s: float) -> NDArray[np.complex128]:
    """c_j for each rate, shape (4, modes), by quadrature that is exact to rounding up to |rate h| = 40."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    s = 0.5 * (nodes + 1)
    growth = np.exp(np.multiply.outer(rates * step_s, 1 - s))
    result = np.empty((4, rates.size), dtype=np.complex128)
    for j, own in enumerate(_NODES):
        basis = np.ones_like(s)
        for other in _NODES:
            if other != own:
                basis *= (s - other) / (own - other)
        result[j] = growth @ (0.5 * weights * basis) * step_s
    return result


@dataclass(frozen=True, eq=False)
class Propagator:
    """One step of the scheme for a linear system with interfaces, as flat float64 arrays.

    Complex rows are stored as all real parts, then all imaginary parts, each padded to `modes`.
    """

    step_s: float
    modes: int  # padded number of complex mode coordinates
    interfaces: int  # number of interface directions
    sites: int  # number of acceleration outputs
    decay: NDArray[np.float64]  # (2 modes,) e^{lambda h}
    weights: NDArray[np.float64]  # (4 * 2 modes,) c_0 .. c_3
    left: NDArray[np.float64]  # (interfaces * 2 modes,) modal force per interface force
    left_known: NDArray[np.float64]  # (inputs, 2 modes) modal force per known input
    rows: NDArray[np.float64]  # (row_count * 2 modes,) interface displacements, rates if asked, sites
    rates: bool  # whether interface rates are among the rows
    compliance: NDArray[np.float64]  # (row_count * interfaces,) rows per interface force within the step
    site_known: NDArray[np.float64]  # (sites, inputs) acceleration per known input
    linear: ComplexModes

    @property
    def motions(self) -> int:
        """Rows that describe the interfaces: displacements, and rates if asked."""
        return self.interfaces * (2 if self.rates else 1)

    @property
    def row_count(self) -> int:
        """Rows of the output product: interface motions, then sites."""
        return self.motions + self.sites

    @property
    def ratios(self) -> NDArray[np.float64]:
        """c_1 to c_3 over c_0, flat (3 * 2 modes,); zero where modes are filled up."""
        first, *others = (one[: self.modes] + 1j * one[self.modes :] for one in self.weights.reshape(4, -1))
        safe = np.where(first == 0, 1.0, first)
        return _flat_complex(np.array(others, dtype=np.complex128) / safe, self.modes).ravel()

    def within(self, modal: NDArray[np.float64]) -> NDArray[np.float64]:
        """What modal forces (rows, 2 modes) at the new instant add to the mode coordinates in the step."""
        half = self.modes
        first = self.weights[:half] + 1j * self.weights[half : 2 * half]
        return _flat_complex((modal[:, :half] + 1j * modal[:, half:]) * first, half)

    def output_rows(self, shapes: NDArray[np.complex128]) -> NDArray[np.float64]:
        """Rows (k, 2 modes) that give Re(shapes z) from flat mode coordinates; shapes is (k, m)."""
        return flat_rows(shapes, self.modes)

    def modal(self, x: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
        """Flat mode coordinates of a state (x, x') without rigid part."""
        z = self.linear.from_position @ x + self.linear.from_rate @ v
        return _flat_complex(z[None, :], self.modes).ravel()


def flat_rows(matrix: NDArray[np.complex128], modes: int) -> NDArray[np.float64]:
    """Re(matrix z) as a real matrix on [Re z, Im z] padded to `modes`; shape (rows, 2 modes)."""
    rows, count = matrix.shape
    result = np.zeros((rows, 2 * modes))
    result[:, :count] = matrix.real
    result[:, modes : modes + count] = -matrix.imag
    return result


def _flat_complex(matrix: NDArray[np.complex128], modes: int) -> NDArray[np.float64]:
    """Rows of complex numbers as [real parts, imaginary parts], padded; shape (rows, 2 modes)."""
    rows, count = matrix.shape
    result = np.zeros((rows, 2 * modes))
    result[:, :count] = matrix.real
    result[:, modes : modes + count] = matrix.imag
    return result


def make_propagator(
    system: LinearSystem, step_s: float, sites: NDArray[np.float64], *, rates: bool = False
) -> Propagator:
    """Everything constant in the scheme.

    Parameters
    ----------
    system : LinearSystem
        Matrices, interfaces and known inputs.
    step_s : float
        Integration step h.
    sites : ndarray, shape (sites, n)
        Each row is the combination of degrees of freedom whose acceleration is put out.
    rates : bool
        Whether the interface forces need the rates W^T x' too.
    """
    lin = complex_modes(system)
    modes = padded(lin.eigenvalues.size)
    c = cubic_weights(lin.eigenvalues, step_s)
    modal_force = lin.left @ system.interfaces
    shapes = [system.interfaces.T @ lin.shapes]
    if rates:
        shapes.append(system.interfaces.T @ lin.shapes_rate)
    rows = np.vstack([*shapes, sites @ lin.acceleration])
    compliance = (rows @ (c[0][:, None] * modal_force)).real
    direct = sites @ lin.compliance
    compliance[len(rows) - len(sites) :] += direct @ system.interfaces
    return Propagator(
        step_s=step_s,
        modes=modes,
        interfaces=system.interfaces.shape[1],
        sites=len(sites),
        decay=_flat_complex(np.exp(lin.eigenvalues * step_s)[None, :], modes).ravel(),
        weights=_flat_complex(c, modes).ravel(),
        left=_flat_complex(modal_force.T, modes).ravel(),
        left_known=_flat_complex((lin.left @ system.inputs).T, modes),
        rows=flat_rows(rows, modes).ravel(),
        rates=rates,
        compliance=compliance.ravel(),
        site_known=direct @ system.inputs,
        linear=lin,
    )
