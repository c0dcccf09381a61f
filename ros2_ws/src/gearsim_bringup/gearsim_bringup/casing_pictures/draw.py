"""Pictures of a casing: its mesh by regions, and its mode shapes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from gearsim_bringup.casing_pictures.surface import outside
from gearsim_bringup.casing_pictures.view import View
from gearsim_sim.model.casing.material import Array
from gearsim_sim.model.casing.mesh import Mesh
from gearsim_sim.model.casing.shell import Cells
from gearsim_sim.model.casing.structure import MeshedStructure

COLUMNS = 4
# Largest displacement drawn, over the casing's longest side.
STRETCH = 0.07
# Together they show every plate from outside, the floor too.
VIEWS = (View(azimuth_deg=30, elevation_deg=32), View(azimuth_deg=215, elevation_deg=-32))
_RING = "#8d8d8d"
_GROUPS = (
    ("plates", "#c9d7e8"),
    ("floor", "#a7bfa1"),
    ("strips along welds", "#d9936a"),
    ("rim", "#b7a6d1"),
)


def draw_mesh(mesh: Mesh, path: Path) -> None:
    """The mesh from two sides: fields of the plates, strips along welds, rim, rings and masters."""
    figure = Figure(figsize=(13, 6.2), layout="constrained")
    faces, regions = outside(mesh)
    colours = np.array([to_rgb(_colour(mesh, region)) for region in regions.tolist()])
    for axes, view in zip(figure.subplots(1, 2), VIEWS, strict=True):
        paint(axes, view, mesh.nodes_m, faces, colours, line_width=0.2)
        places = view.project(mesh.nodes_m[list(mesh.masters.values())])
        # Those of the wall in front alone: names of the others would stand on the wrong wall.
        for name, (across, up, near) in zip(mesh.masters, places.tolist(), strict=True):
            if near > places[:, 2].mean():
                axes.text(across, up, name, fontsize=11, ha="center", va="center", weight="bold")
    used = {_colour(mesh, region) for region in np.unique(regions).tolist()}
    groups = (*_GROUPS, ("rings with eccentric discs", _RING))
    legend = [Patch(color=colour, label=name) for name, colour in groups if colour in used]
    figure.legend(handles=legend, loc="outside lower center", ncols=len(legend), frameon=False)
    figure.suptitle(f"{len(mesh.quads)} shell elements, {len(mesh.hexes)} solid elements")
    figure.savefig(path, dpi=110, metadata={"Software": None})


def draw_modes(structure: MeshedStructure, frequencies_hz: Array, shapes: Array, path: Path) -> None:
    """Mode shapes, exaggerated, coloured by how far each place moves.

    Parameters
    ----------
    structure : MeshedStructure
    frequencies_hz : Array, shape (modes,)
    shapes : Array, shape (structure.size, modes)
    path : Path
    """
    rows = -(-len(frequencies_hz) // COLUMNS)
    figure = Figure(figsize=(3.3 * COLUMNS, 3.1 * rows), layout="constrained")
    places = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
    nodes, (faces, _) = structure.mesh.nodes_m, outside(structure.mesh)
    longest = float(np.ptp(nodes, axis=0).max())
    for k, axes in enumerate(places):
        axes.set_axis_off()
        if k >= len(frequencies_hz):
            continue
        moved = (structure.ties @ shapes[:, k]).reshape(-1, 6)[:, :3]
        size = np.linalg.norm(moved, axis=1)[faces].mean(axis=1)
        colours = colormaps["viridis"](size / size.max())[:, :3]
        stretched = nodes + moved * (STRETCH * longest / size.max())
        paint(axes, VIEWS[0], stretched, faces, colours, line_width=0.0)
        axes.set_title(f"{k + 1}: {frequencies_hz[k]:.0f} Hz", fontsize=10)
    figure.savefig(path, dpi=90, metadata={"Software": None})


def _colour(mesh: Mesh, region: int) -> str:
    if region < 0:
        return _RING
    plate, _, part = mesh.regions[region].partition("/")
    whole = plate if plate in ("floor", "rim") else "plates"
    return dict(_GROUPS)["strips along welds" if part.endswith("weld") else whole]


def paint(axes: Axes, view: View, nodes_m: Array, faces: Cells, colours: Array, line_width: float) -> None:
    """Faces from the farthest to the nearest, those turned away from the light darker."""
    seen = view.project(nodes_m)
    order = np.argsort(seen[faces][:, :, 2].mean(axis=1))
    shaded = colours * view.brightness(nodes_m[faces])[:, None]
    edges = "#20202090" if line_width else shaded[order]
    polygons = list(seen[faces[order]][:, :, :2])
    # Without lines of their own colour thin gaps would show between faces.
    axes.add_collection(
        PolyCollection(polygons, facecolors=shaded[order], edgecolors=edges, linewidths=line_width or 0.3)
    )
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_axis_off()
