"""An isotropic elastic material."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Material:
    """Linear elastic, the same in all directions."""

    youngs_modulus_pa: float
    poisson_ratio: float
    density_kg_per_m3: float

    @property
    def shear_modulus_pa(self) -> float:
        """G = E / 2 (1 + nu)."""
        return self.youngs_modulus_pa / (2 * (1 + self.poisson_ratio))

    @property
    def plane_stress(self) -> Array:
        """Stresses xx, yy, xy over strains xx, yy, gamma_xy of a thin sheet, shape (3, 3)."""
        nu = self.poisson_ratio
        scale = self.youngs_modulus_pa / (1 - nu**2)
        return scale * np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])

    @property
    def solid(self) -> Array:
        """Stresses xx, yy, zz, xy, yz, zx over strains (gammas for shear), shape (6, 6)."""
        nu, shear = self.poisson_ratio, self.shear_modulus_pa
        lame = self.youngs_modulus_pa * nu / ((1 + nu) * (1 - 2 * nu))
        matrix = np.zeros((6, 6))
        matrix[:3, :3] = lame
        matrix[range(3), range(3)] += 2 * shear
        matrix[range(3, 6), range(3, 6)] = shear
        return matrix


STEEL = Material(206e9, 0.3, 7850.0)
