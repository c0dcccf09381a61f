"""A coupling of a few elastic elements between two shafts that are not in line.

N elements (jaws, pins, packs of discs) at the radius R carry the torque T by their tangential compression

    d_k = R psi + e . t_k - R (beta^2 / 4) sin 2(alpha_k - direction),   f_k = k_k max(d_k, 0),
    sum f_k R = T,   alpha_k = phi + 2 pi k / N,   t_k = (-sin alpha_k, cos alpha_k).

e is the parallel offset of the shafts, beta the angle between them; the last term is the error of a
universal joint, tan(theta_2) = tan(theta_1) cos(beta), to second order, which Xu and Marangoni (J. Sound
Vib. 176, 1994, 663) take as the cause of the even orders. psi, the twist, follows from the torque. The
driven shaft feels the force sum f_k t_k and the twist.

What comes out: with equal elements that all carry, an offset gives a force that stands still, N k e / 2
(Gibbons, 1976, takes this reaction as the whole effect); elements of unequal stiffness modulate it at
twice the speed (the cyclic stiffness of Redmond, J. Sound Vib. 329, 2010, 700) and make the torque's own
share rotate (once per turn); an angle gives N times the speed with N = 3, and elements that lift off
because the offset is larger than the torque's compression give multiples of N.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Spectrum = NDArray[np.complex128]
_POINTS = 720  # a multiple of usual numbers of elements, so that kinks keep their symmetry


@dataclass(frozen=True)
class JawCoupling:
    """Geometry and stiffness of the coupling.

    Attributes
    ----------
    stiffness_n_per_m : tuple of float
        Tangential stiffness of each element.
    radius_m : float
        Where the elements are.
    torque_nm : float
        What is carried, > 0.
    """

    stiffness_n_per_m: tuple[float, ...]
    radius_m: float
    torque_nm: float

    def forces(
        self, angle_rad: Array, offset_m: float, angular_rad: float, direction_rad: float
    ) -> tuple[Array, Array, Array]:
        """Force (x, y) on the driven shaft [N] and twist [rad] at angles of the coupling; each (points,)."""
        stiffness = np.array(self.stiffness_n_per_m)[:, None]
        count = stiffness.size
        alpha = angle_rad[None, :] + 2 * np.pi * np.arange(count)[:, None] / count
        along_x, along_y = -np.sin(alpha), np.cos(alpha)
        given = offset_m * (np.cos(direction_rad) * along_x + np.sin(direction_rad) * along_y)
        given -= self.radius_m * (angular_rad**2 / 4) * np.sin(2 * (alpha - direction_rad))
        twist = self._twist(stiffness, given)
        pressed = stiffness * np.maximum(self.radius_m * twist + given, 0.0)
        return np.sum(pressed * along_x, axis=0), np.sum(pressed * along_y, axis=0), twist

    def _twist(self, stiffness: Array, given: Array) -> Array:
        """The psi at which the elements carry the torque.

        Their sum is convex and piecewise linear in psi: Newton's method from above comes down without
        overshoot, and ends after as many steps as there are pieces.
        """
        wanted = self.torque_nm / self.radius_m
        twist = (wanted / np.sum(stiffness) + np.max(-given, axis=0)) / self.radius_m
        for _ in range(4 * given.shape[0]):
            compression = self.radius_m * twist + given
            touching = compression > 0
            sum_force = np.sum(stiffness * compression * touching, axis=0)
            slope = np.sum(stiffness * touching, axis=0) * self.radius_m
            twist = twist - (sum_force - wanted) / slope
        return np.asarray(twist)

    def harmonics(
        self, offset_m: float, angular_rad: float, direction_rad: float, orders: int
    ) -> tuple[Spectrum, Spectrum, Spectrum]:
        """Complex amplitudes a_n, n = 0..orders, of a value Re sum a_n exp(i n phi); each (orders + 1,).

        Of the force in x and y and of the twist, beyond those of the coupling in line.
        """
        angle = 2 * np.pi * np.arange(_POINTS) / _POINTS
        bent = self.forces(angle, offset_m, angular_rad, direction_rad)
        straight = self.forces(angle, 0.0, 0.0, 0.0)
        result = []
        for one, other in zip(bent, straight, strict=True):
            spectrum = np.fft.rfft(one - other)[: orders + 1] / _POINTS
            spectrum[1:] *= 2
            result.append(spectrum)
        return result[0], result[1], result[2]

    def lifts_off(self, offset_m: float, angular_rad: float) -> bool:
        """Whether an element loses touch within a turn."""
        count = len(self.stiffness_n_per_m)
        angle = 2 * np.pi * np.arange(_POINTS) / _POINTS
        alpha = angle[None, :] + 2 * np.pi * np.arange(count)[:, None] / count
        given = -offset_m * np.sin(alpha) - self.radius_m * (angular_rad**2 / 4) * np.sin(2 * alpha)
        twist = self._twist(np.array(self.stiffness_n_per_m)[:, None], given)
        return bool(np.any(self.radius_m * twist + given <= 0))
