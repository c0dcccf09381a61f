"""Modes that masters leave out, gathered into a few shapes that follow them: residual vectors.

What the modes left out do when the masters accelerate is, at low frequency, `D u_m''` with the 24 columns
of `D` (see `reduction`). Some combinations of these columns, made orthogonal to the modes kept and to each
other, serve as further modes: the reduced matrices keep their form, and the error falls by far more than with
as many true modes (residual vectors, after Rose, 1991, and Dickens, Nakagawa and Wittbrodt, 1997).

All is done in the space of the 24 columns. With P the projection that takes the kept modes away,
`K D = P A`, the residual of a reduced mode (masters u, amplitudes p of the combinations W) is

    P A c - M D d,    c = W p - lambda u,    d = lambda W p

and its eigenvalue misses at most `r' K^-1 r / (1 - lambda / lambda_c)`, lambda_c being the first mode left
out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from gearsim_sim.model.casing.material import Array

# Directions of D that are smaller than this beside the largest are rounding.
_NOTHING = 1e-9


@dataclass(frozen=True)
class Leftover:
    """What some number of kept modes leaves of the columns D, as products over the masters' displacements."""

    stiffness: Array
    """D' K D = A' D."""
    mass: Array
    """D' M D."""
    follow: Array
    """D' M K^-1 M D."""
    cutoff: float
    """Eigenvalue of the first mode left out."""

    def without(self, squares: Array, coupling: Array) -> Leftover:
        """The same if modes of these eigenvalues and `coupling` (modes, masters) are left out too."""
        if not len(squares):
            return self
        scaled = [coupling.T @ (coupling / squares[:, None] ** power) for power in (1, 2, 3)]
        return Leftover(
            self.stiffness + scaled[0], self.mass + scaled[1], self.follow + scaled[2], float(squares[0])
        )

    def combinations(self, importance: Array, count: int) -> tuple[Array, Array]:
        """The `count` best combinations of columns, shape (masters, <= count), and their eigenvalues.

        Orthonormal in mass, diagonal in stiffness.

        Parameters
        ----------
        importance : Array, shape (masters, any)
            Motions of the masters whose following shapes are to be met, scaled by how much each matters.
            Those combinations are taken that hold most of the energy of all (principal components).
        count : int
        """
        values, vectors = np.linalg.eigh(importance @ importance.T)
        real = values > _NOTHING * values[-1]
        half = vectors[:, real] * np.sqrt(values[real])
        energies, turn = np.linalg.eigh(half.T @ self.stiffness @ half)
        best = np.argsort(-energies)[:count]
        chosen = half @ turn[:, best[energies[best] > _NOTHING * energies[-1]]]
        mass, stiffness = chosen.T @ self.mass @ chosen, chosen.T @ self.stiffness @ chosen
        squares, mix = scipy.linalg.eigh(stiffness, mass) if chosen.size else (np.zeros(0), np.zeros((0, 0)))
        return chosen @ mix, squares

    def most_below(self, square: float, boundary: Array, squares: Array, coupling: Array) -> int:
        """At most so many eigenvalues of the whole structure lie below `square`, which is below the cut-off.

        Those of the modes given, and the negative ones of the masters' dynamic stiffness (Sylvester's law;
        Wittrick and Williams, 1971). To the latter each further mode adds `-square^2 a a' / (lambda_d -
        square)`; all of them together no more than the three moments known and a bound of the rest.

        Parameters
        ----------
        square : float
        boundary : Array, shape (masters, masters)
            Stiffness less `square` times mass of the masters alone.
        squares, coupling : Array, shape (modes,), (modes, masters)
            Of all modes up to the cut-off, masters held.
        """
        rest = self.cutoff / (self.cutoff - square)
        added = self.stiffness + square * self.mass + square**2 * rest * self.follow
        added = added + coupling.T @ (coupling / (squares - square)[:, None])
        scale = 1 / np.sqrt(np.abs(np.diag(boundary)) + square**2 * np.abs(np.diag(added)))
        values = np.linalg.eigvalsh((boundary - square**2 * added) * scale[:, None] * scale)
        return int(np.sum(squares < square) + np.sum(values < 0))

    def errors(self, squares: Array, masters: Array, amplitudes: Array, shapes: Array) -> Array:
        """Relative error of each frequency, an upper one to first order; NaN from the cut-off on.

        Parameters
        ----------
        squares : Array, shape (n,)
            Eigenvalues of the reduced structure, mass-normalised with
        masters, amplitudes : Array, shape (masters, n), (combinations, n)
            Parts of its modes.
        shapes : Array, shape (masters, combinations)
        """
        follow = shapes @ amplitudes
        c, d = follow - squares * masters, squares * follow
        energy = np.einsum("ij,ij->j", c, self.stiffness @ c - 2 * self.mass @ d)
        energy += np.einsum("ij,ij->j", d, self.follow @ d)
        result = np.full(len(squares), np.nan)
        below = (squares < self.cutoff) & (squares > 0)
        missed = np.maximum(energy[below], 0) / (1 - squares[below] / self.cutoff)
        result[below] = missed / squares[below] / 2
        result[squares <= 0] = 0.0
        return result


def reduced_modes(mass: Array, stiffness: Array) -> tuple[Array, Array]:
    """Eigenvalues and mass-normalised shapes of the reduced structure."""
    squares, shapes = scipy.linalg.eigh(stiffness, mass)
    return np.asarray(squares), np.asarray(shapes)
