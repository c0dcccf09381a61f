"""Craig-Bampton reduction: exact in statics and rigid-body motion, with a few modes for the rest.

Craig and Bampton (1968). With masters m held, the remaining displacements are
`u_s = Psi u_m + Phi q`: Psi the static shapes of unit master displacements, Phi the lowest modes. What the
modes left out would add follows the masters' acceleration without delay at low frequency,
`- D u_m''` with `D = K_ss^-1 A - Phi Lambda^-1 Phi' A` and `A = M_sm + M_ss Psi`: the correction of sensors.

The same D tells how good the reduction is. A mode of the reduced structure with eigenvalue `lambda` and unit
modal mass misses, to first order in what was left out, at most

    d lambda / lambda = lambda u_m' (A' D) u_m / (1 - lambda / lambda_c)

where lambda_c is the first mode left out: every left-out mode adds `lambda^2 (a_d' u_m)^2 /
(lambda_d - lambda)`, and none has `lambda_d` below lambda_c. `valid_hz` is the frequency up to which half of
that (the error of the frequency) stays below `ACCURACY`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg
from scipy.sparse import csc_array, csr_array

from gearsim_io.errors import InputError
from gearsim_sim.model.casing.eigen import lowest_modes
from gearsim_sim.model.casing.held import held_factor
from gearsim_sim.model.casing.material import Array
from gearsim_sim.model.casing.shell import Cells
from gearsim_sim.model.casing.structure import Structure

ACCURACY = 0.006

Tell = Callable[[str, float], None]


@dataclass(frozen=True)
class Reduction:
    """A reduced structure, and what recovers the displacements of the whole one."""

    masters: tuple[str, ...]
    mass: Array
    stiffness: Array
    cutoff_hz: float
    """Of the first mode left out, masters held."""
    frequencies_hz: Array
    """Own frequencies of the reduced structure."""
    errors: Array
    """Estimated upper error of each of them, relative; NaN from the cut-off on."""
    valid_hz: float
    held: Cells
    """Rows of the masters' displacements."""
    others: Cells
    static: Array
    """Psi, shape (others, masters)."""
    shapes: Array
    """Phi, shape (others, modes)."""
    delayed: Array
    """-D, shape (others, masters): displacement over acceleration of the masters [s^2]."""

    def rows(self, row: csr_array) -> tuple[Array, Array]:
        """Recovery and correction of a sensor given by its row over all displacements."""
        dense = row.toarray()[0]
        masters, rest = dense[self.held], dense[self.others]
        rows = np.concatenate([masters + rest @ self.static, rest @ self.shapes])
        return rows, np.asarray(rest @ self.delayed)

    def expand(self, coordinates: Array) -> Array:
        """Displacements of the whole structure from reduced coordinates, shape (size, ...)."""
        whole = np.zeros((len(self.held) + len(self.others), *coordinates.shape[1:]))
        count = len(self.held)
        whole[self.held] = coordinates[:count]
        whole[self.others] = self.static @ coordinates[:count] + self.shapes @ coordinates[count:]
        return whole


def craig_bampton(structure: Structure, modes: int, tell: Tell = lambda _step, _done: None) -> Reduction:
    """Reduce a structure to its masters and `modes` modes.

    Parameters
    ----------
    structure : Structure
    modes : int
    tell : callable
        Hears which step begins and what share of the work (about) is done.

    Raises
    ------
    InputError
        If the structure has mechanisms with its masters held, or fewer displacements than modes asked for.
    """
    held = np.concatenate(list(structure.masters.values()))
    others = np.setdiff1d(np.arange(structure.size), held)
    if not 0 <= modes < len(others) - 1:
        raise InputError(structure.name, "modes", modes, f"fewer than {len(others) - 1}")
    parts = _Parts(structure, held, others)
    tell("factor of the stiffness", 0.0)
    factor = held_factor(parts.k_ss, structure.name, others)
    tell("static shapes", 0.15)
    static = -factor.solve(parts.k_sm)
    tell("modes", 0.2)
    squares, shapes = lowest_modes(parts.k_ss, parts.m_ss, modes + 1, factor=factor)
    tell("corrections", 0.9)
    kept, shapes = squares[:modes], shapes[:, :modes]
    coupling = parts.m_sm + parts.m_ss @ static
    follow = shapes.T @ coupling
    delayed = factor.solve(coupling) - shapes @ (follow / kept[:, None])
    # Rounding leaves some of the kept modes in it.
    delayed -= shapes @ (shapes.T @ (parts.m_ss @ delayed))
    mass, stiffness = parts.reduced(static, coupling, follow, kept)
    lowest, own = scipy.linalg.eigh(stiffness, mass)
    missed = _estimate(lowest, own[: len(held)], coupling.T @ delayed, float(squares[modes]))
    frequencies = np.sqrt(np.maximum(lowest, 0)) / (2 * np.pi)
    cutoff = float(np.sqrt(squares[modes]) / (2 * np.pi))
    bad = np.flatnonzero(~(missed <= ACCURACY))
    return Reduction(
        masters=tuple(structure.masters),
        mass=mass,
        stiffness=stiffness,
        cutoff_hz=cutoff,
        frequencies_hz=frequencies,
        errors=missed,
        valid_hz=min(cutoff, float(frequencies[bad[0]])) if len(bad) else cutoff,
        held=held,
        others=others,
        static=static,
        shapes=shapes,
        delayed=-delayed,
    )


class _Parts:
    """Matrices of a structure split into masters (m) and others (s)."""

    def __init__(self, structure: Structure, held: Cells, others: Cells) -> None:
        stiffness, mass = structure.stiffness.tocsr(), structure.mass.tocsr()
        k_s, m_s = stiffness[others], mass[others]
        self.k_ss, self.m_ss = csc_array(k_s[:, others]), csc_array(m_s[:, others])
        self.k_sm, self.m_sm = k_s[:, held].toarray(), m_s[:, held].toarray()
        self.k_mm, self.m_mm = stiffness[held][:, held].toarray(), mass[held][:, held].toarray()

    def reduced(self, static: Array, coupling: Array, follow: Array, kept: Array) -> tuple[Array, Array]:
        """Mass and stiffness; their parts that are one or zero are so exactly (thesis 4.3.2, step 6)."""
        masters, count = len(self.k_mm), len(self.k_mm) + len(kept)
        mass, stiffness = np.zeros((count, count)), np.zeros((count, count))
        m_bb = self.m_mm + self.m_sm.T @ static + static.T @ coupling
        k_bb = self.k_mm + self.k_sm.T @ static
        mass[:masters, :masters] = (m_bb + m_bb.T) / 2
        stiffness[:masters, :masters] = (k_bb + k_bb.T) / 2
        mass[masters:, :masters], mass[:masters, masters:] = follow, follow.T
        diagonal: Any = range(masters, count)
        mass[diagonal, diagonal] = 1.0
        stiffness[diagonal, diagonal] = kept
        return mass, stiffness


def _estimate(squares: Array, masters: Array, residual: Array, cutoff: float) -> Array:
    """Relative error of each frequency by the formula above, NaN beyond the first mode left out."""
    energy = np.einsum("ij,ik,kj->j", masters, residual, masters)
    result = np.full(len(squares), np.nan)
    below = squares < cutoff
    result[below] = squares[below] * np.maximum(energy[below], 0) / (1 - squares[below] / cutoff) / 2
    return result
