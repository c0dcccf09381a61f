"""Craig-Bampton reduction: exact in statics and rigid-body motion, with a few modes for the rest.

Craig and Bampton (1968). With masters m held, the remaining displacements are
`u_s = Psi u_m + Phi q`: Psi the static shapes of unit master displacements, Phi the lowest modes and, among
the number of modes asked for, some residual vectors (see `follow`). What is left out follows the masters'
acceleration without delay at low frequency, `- D u_m''` with `D = K_ss^-1 A - Phi Lambda^-1 Phi' A` and
`A = M_sm + M_ss Psi`: the correction of sensors.

How many residual vectors there are is chosen so that the reduction is valid as far up as possible: every mode
of the whole structure below `valid_hz` has its counterpart within `ACCURACY`. That is certain, not estimated:
eigenvalues of the whole structure are counted, see `Leftover.most_below`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csc_array, csr_array

from gearsim_io.errors import InputError
from gearsim_sim.model.casing.eigen import signs
from gearsim_sim.model.casing.follow import Leftover, reduced_modes
from gearsim_sim.model.casing.held import held_factor
from gearsim_sim.model.casing.material import Array
from gearsim_sim.model.casing.shell import Cells
from gearsim_sim.model.casing.slices import sliced_modes
from gearsim_sim.model.casing.structure import Structure

# Largest error of an own frequency, relative, up to each frequency [Hz]; the last one holds beyond too.
ACCURACY = ((1000.0, 0.001), (2000.0, 0.003), (4000.0, 0.006))

# Modes computed beyond those kept, over their number: what they add is then known, and only what lies still
# higher must be bounded. Measured on the shipped casing: valid up to 4.03 kHz in place of 3.50.
BEYOND = 0.1

# Eigenvalues below that of 1 Hz are those of rigid-body motion, which is exact.
_RIGID = (2 * np.pi) ** 2

Tell = Callable[[str, float], None]


def allowed_errors(frequencies_hz: Array) -> Array:
    """The largest relative error that `ACCURACY` allows at each frequency."""
    steps, limits = (np.array(column) for column in zip(*ACCURACY, strict=True))
    step = np.searchsorted(steps, frequencies_hz, side="right")
    return np.asarray(limits[np.minimum(step, len(limits) - 1)])


@dataclass(frozen=True)
class Reduction:
    """A reduced structure, and what recovers the displacements of the whole one."""

    masters: tuple[str, ...]
    mass: Array
    stiffness: Array
    cutoff_hz: float
    """Of the first mode left out, masters held."""
    residuals: int
    """How many of the modes are residual vectors: the last ones."""
    frequencies_hz: Array
    """Own frequencies of the reduced structure."""
    errors: Array
    """Estimated error of each of them as a mode of the whole, relative; NaN from the cut-off on."""
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
        size = len(self.held) + len(self.others)
        whole = np.zeros((size, *coordinates.shape[1:]), dtype=coordinates.dtype)
        count = len(self.held)
        whole[self.held] = coordinates[:count]
        whole[self.others] = self.static @ coordinates[:count] + self.shapes @ coordinates[count:]
        return whole


def craig_bampton(
    structure: Structure,
    modes: int,
    tell: Tell = lambda _step, _done: None,
    residuals: int | None = None,
) -> Reduction:
    """Reduce a structure to its masters and `modes` modes.

    Parameters
    ----------
    structure : Structure
    modes : int
    tell : callable
        Hears which step begins and what share of the work (about) is done.
    residuals : int, optional
        How many of the modes are residual vectors; by default what serves best.

    Raises
    ------
    InputError
        If the structure has mechanisms with its masters held, or fewer displacements with mass than modes
        asked for.
    """
    held = np.concatenate(list(structure.masters.values()))
    others = np.setdiff1d(np.arange(structure.size), held)
    parts = _Parts(structure, held, others)
    most = _most_modes(structure, parts)
    if not 0 <= modes <= most:
        raise InputError(structure.name, "modes", modes, f"at most {most}")
    tell("factor of the stiffness", 0.0)
    factor = held_factor(parts.k_ss, structure.name, others)
    tell("static shapes", 0.15)
    static = -factor.solve(parts.k_sm)
    tell("modes", 0.2)
    found = min(modes + int(np.ceil(BEYOND * modes)), most) + 1
    squares, shapes = sliced_modes(parts.k_ss, parts.m_ss, found, factor=factor)
    tell("residual vectors", 0.9)
    work = _Work(parts, static, modes, squares, shapes, factor)
    counts = range(0, min(len(held), modes // 2) + 1, 2) if residuals is None else (residuals,)
    best = max((work.choice(count) for count in counts), key=lambda choice: choice.valid)
    return work.finish(structure, held, others, best)


def _most_modes(structure: Structure, parts: _Parts) -> int:
    """How many modes can be kept: one more must be found, and displacements without mass add none."""
    # The solver finds fewer than there are.
    most = int(np.sum(parts.m_ss.diagonal() > 0)) - 2
    if most < 0:
        what = f"{most + 2} of {structure.size} displacements with mass beside those of the masters"
        raise InputError(structure.name, "masters", what, "two or more")
    return most


@dataclass(frozen=True)
class _Choice:
    """A reduction with some number of residual vectors."""

    kept: int
    combinations: Array
    mass: Array
    stiffness: Array
    errors: Array
    squares: Array
    cutoff: float
    valid: float
    """Eigenvalue up to which it holds."""


class _Work:
    """What all choices of residual vectors share."""

    def __init__(
        self, parts: _Parts, static: Array, modes: int, squares: Array, shapes: Array, factor: Any
    ) -> None:
        self.parts, self.static, self.squares, self.shapes = parts, static, squares, shapes
        self.modes = modes
        coupling = parts.m_sm + parts.m_ss @ static
        self.coupling = coupling
        self.pull = shapes.T @ coupling
        self.rest = self._without_modes(factor.solve(coupling), shapes)
        moved = parts.m_ss @ self.rest
        again = self._without_modes(factor.solve(moved), shapes)
        # Here all modes found are taken away, those beyond the ones asked for too.
        self.leftover = Leftover(
            _even(coupling.T @ self.rest),
            _even(moved.T @ self.rest),
            _even(moved.T @ again),
            float(squares[-1]),
        )

    def _without_modes(self, columns: Array, shapes: Array) -> Array:
        for _ in range(2):  # once more, for what rounding leaves
            columns = columns - shapes @ (shapes.T @ (self.parts.m_ss @ columns))
        return np.asarray(columns)

    def choice(self, residuals: int) -> _Choice:
        kept = self.modes - residuals
        out = self.squares[kept:], self.pull[kept:]
        left = self.leftover.without(*out)
        m_bb, k_bb = self.parts.boundary(self.static, self.coupling)
        combinations, own = left.combinations(self._importance(m_bb, k_bb, kept), residuals)
        if len(own) < residuals:  # there are no more that are independent: true modes take their places
            return self.choice(len(own))
        follow = np.vstack([self.pull[:kept], (left.stiffness @ combinations).T])
        mass, stiffness = _blocks(m_bb, k_bb, follow, np.concatenate([self.squares[:kept], own]))
        squares, vectors = reduced_modes(mass, stiffness)
        count = len(m_bb)
        errors = left.errors(squares, vectors[:count], vectors[count + kept :], combinations)
        valid = self._valid(left.cutoff, (m_bb, k_bb), squares)
        return _Choice(kept, combinations, mass, stiffness, errors, squares, left.cutoff, valid)

    def _valid(self, cutoff: float, boundary: tuple[Array, Array], squares: Array) -> float:
        """Up to here the whole structure has no mode that the reduced one misses by more than is allowed.

        Eigenvalues of the reduced structure are never too low. The k-th one is low enough if no more than k
        of the whole structure lie below it less what is allowed. Never beyond the first mode left out.
        """
        mass, stiffness = boundary

        def most_below(square: float) -> int:
            return self.leftover.most_below(square, stiffness - square * mass, self.squares, self.pull)

        allowed = allowed_errors(np.sqrt(np.maximum(squares, 0)) / (2 * np.pi))
        sure = 0.0
        for k, least in enumerate((squares * (1 - allowed) ** 2).tolist()):
            if least >= cutoff:
                break
            if squares[k] > _RIGID and most_below(least) > k:
                return _last(most_below, k, sure, least)
            sure = max(sure, least)
        return sure

    def _importance(self, m_bb: Array, k_bb: Array, kept: int) -> Array:
        """Motions of the masters in own modes without residual vectors, scaled so that errors count alike."""
        squares, vectors = reduced_modes(*_blocks(m_bb, k_bb, self.pull[:kept], self.squares[:kept]))
        inside = (squares > 0) & (squares < self.squares[kept])
        return np.asarray(vectors[: len(m_bb), inside] * np.sqrt(squares[inside]))

    def finish(self, structure: Structure, held: Cells, others: Cells, choice: _Choice) -> Reduction:
        kept, combinations = choice.kept, choice.combinations
        out = self.shapes[:, kept:]
        rest = self.rest + out @ (self.pull[kept:] / self.squares[kept:, None])
        vectors = rest @ combinations
        turned = signs(vectors) if vectors.size else np.ones(0)
        factors = np.concatenate([np.ones(len(held) + kept), turned])
        shapes = np.hstack([self.shapes[:, :kept], vectors * turned])
        mass = choice.mass * factors[:, None] * factors
        count = len(held)
        own = np.diag(choice.stiffness)[count + kept :]
        delayed = rest - vectors @ (vectors.T @ self.coupling / own[:, None])
        return Reduction(
            masters=tuple(structure.masters),
            mass=mass,
            stiffness=choice.stiffness,
            cutoff_hz=float(np.sqrt(choice.cutoff) / (2 * np.pi)),
            residuals=combinations.shape[1],
            frequencies_hz=np.sqrt(np.maximum(choice.squares, 0)) / (2 * np.pi),
            errors=choice.errors,
            valid_hz=float(np.sqrt(choice.valid) / (2 * np.pi)),
            held=held,
            others=others,
            static=self.static,
            shapes=shapes,
            delayed=-delayed,
        )


def _last(count: Callable[[float], int], most: int, low: float, high: float) -> float:
    """The largest value whose count is at most `most`, between one where it is and one where it is not."""
    while high - low > 1e-6 * high:
        middle = (low + high) / 2
        low, high = (middle, high) if count(middle) <= most else (low, middle)
    return low


class _Parts:
    """Matrices of a structure split into masters (m) and others (s)."""

    def __init__(self, structure: Structure, held: Cells, others: Cells) -> None:
        stiffness, mass = structure.stiffness.tocsr(), structure.mass.tocsr()
        k_s, m_s = stiffness[others], mass[others]
        self.k_ss, self.m_ss = csc_array(k_s[:, others]), csc_array(m_s[:, others])
        self.k_sm, self.m_sm = k_s[:, held].toarray(), m_s[:, held].toarray()
        self.k_mm, self.m_mm = stiffness[held][:, held].toarray(), mass[held][:, held].toarray()

    def boundary(self, static: Array, coupling: Array) -> tuple[Array, Array]:
        """Mass and stiffness of the masters alone."""
        mass = self.m_mm + self.m_sm.T @ static + static.T @ coupling
        return _even(mass), _even(self.k_mm + self.k_sm.T @ static)


def _even(matrix: Array) -> Array:
    return np.asarray((matrix + matrix.T) / 2)


def _blocks(m_bb: Array, k_bb: Array, follow: Array, squares: Array) -> tuple[Array, Array]:
    """Reduced mass and stiffness; parts that are one or zero are so exactly (thesis 4.3.2, step 6)."""
    masters, count = len(m_bb), len(m_bb) + len(squares)
    mass, stiffness = np.zeros((count, count)), np.zeros((count, count))
    mass[:masters, :masters], stiffness[:masters, :masters] = m_bb, k_bb
    mass[masters:, :masters], mass[:masters, masters:] = follow, follow.T
    diagonal: Any = range(masters, count)
    mass[diagonal, diagonal] = 1.0
    stiffness[diagonal, diagonal] = squares
    return mass, stiffness
