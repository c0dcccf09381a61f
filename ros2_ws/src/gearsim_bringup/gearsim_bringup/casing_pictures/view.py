"""A direction to look from, without perspective; y is up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearsim_sim.model.casing.material import Array

_LIGHT = np.array([0.35, 0.8, 0.5]) / np.linalg.norm([0.35, 0.8, 0.5])
_DARKEST = 0.62


@dataclass(frozen=True)
class View:
    """Looking at the origin from an azimuth about y (0: from +z) and an elevation."""

    azimuth_deg: float
    elevation_deg: float

    @property
    def axes(self) -> Array:
        """Directions to the right, upward and towards the onlooker, by rows."""
        a, e = np.deg2rad([self.azimuth_deg, self.elevation_deg])
        towards = np.array([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])
        right = np.array([np.cos(a), 0.0, -np.sin(a)])
        return np.stack([right, np.cross(towards, right), towards])

    def project(self, points_m: Array) -> Array:
        """Points as seen: right, up, nearness; shape (points, 3)."""
        return np.asarray(points_m @ self.axes.T)

    def brightness(self, corners_m: Array) -> Array:
        """Between `_DARKEST` and 1 for each face, from its corners (faces, 4, 3); both sides alike."""
        normal = np.cross(corners_m[:, 2] - corners_m[:, 0], corners_m[:, 3] - corners_m[:, 1])
        length = np.maximum(np.linalg.norm(normal, axis=1), 1e-30)
        return np.asarray(_DARKEST + (1 - _DARKEST) * np.abs(normal @ _LIGHT) / length)
