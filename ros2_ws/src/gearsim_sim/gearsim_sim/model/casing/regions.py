"""Which part of a plate a quad belongs to: the strip along a weld, or the field between them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gearsim_sim.model.casing.material import Array
from gearsim_sim.model.casing.shell import Cells

FIELD = "field"


def line(axis: int, at_m: float) -> tuple[int, float]:
    """A weld along the line on which the plane coordinate `axis` is `at_m`."""
    return axis, at_m


def split(
    plate: str,
    centres_m: Array,
    straight: Mapping[str, tuple[int, float]],
    round_: Mapping[str, tuple[tuple[float, float], float]],
    width_m: float,
) -> tuple[tuple[str, ...], Cells]:
    """Names of a plate's regions, and the region of each quad.

    Parameters
    ----------
    plate : str
        Begins the names, as in `floor/weld_a`.
    centres_m : Array, shape (quads, 2)
        Middles of the quads in the plate's plane.
    straight : Mapping
        Welds along lines, see `line`.
    round_ : Mapping
        Welds round holes: centre and radius.
    width_m : float
        A quad nearer to a weld than this belongs to the nearest one.
    """
    distances = [np.abs(centres_m[:, axis] - at) for axis, at in straight.values()]
    distances += [
        np.abs(np.linalg.norm(centres_m - np.array(centre), axis=1) - radius)
        for centre, radius in round_.values()
    ]
    names: Sequence[str] = [FIELD, *straight, *round_]
    everywhere = np.full(len(centres_m), width_m)
    region = np.argmin(np.stack([everywhere, *distances]), axis=0)
    return tuple(f"{plate}/{name}" for name in names), region
