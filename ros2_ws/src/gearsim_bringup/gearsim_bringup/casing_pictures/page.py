"""All pictures of a casing into a folder."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from gearsim_bringup.casing_pictures.draw import draw_mesh, draw_modes
from gearsim_sim.model.casing.build import build_structure
from gearsim_sim.model.casing.described import Described
from gearsim_sim.model.casing.eigen import free_modes, lowest_modes


def draw_casing(
    params: Described, out: Path, modes: int, *, mounted: bool, tell: Callable[[str], None]
) -> tuple[list[Path], list[float]]:
    """Write `mesh.png` and `modes.png`; the files, and the frequencies of the modes drawn [Hz].

    Rigid-body modes of a casing that hangs freely are left out; on pads they are modes like all others.
    """
    out.mkdir(parents=True, exist_ok=True)
    tell("mesh")
    structure = build_structure(params, free=not mounted)
    draw_mesh(structure.mesh, out / "mesh.png")
    tell(f"{modes} modes")
    if structure.mesh.pads:
        squares, shapes = lowest_modes(structure.stiffness, structure.mass, modes)
    else:
        squares, shapes = free_modes(structure.stiffness, structure.mass, modes + 6)
        squares, shapes = squares[6:], shapes[:, 6:]
    frequencies = np.sqrt(squares) / (2 * np.pi)
    tell("drawing")
    draw_modes(structure, frequencies, shapes, out / "modes.png")
    return [out / "mesh.png", out / "modes.png"], frequencies.tolist()
