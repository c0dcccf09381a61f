"""Pictures of an updating: where thickness changed, and how frequencies came nearer."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from gearsim_bringup.casing_pictures.draw import VIEWS, paint
from gearsim_bringup.casing_pictures.surface import outside
from gearsim_sim.model.casing.material import Array
from gearsim_sim.model.casing.mesh import Mesh
from gearsim_sim.model.casing.updating import Update

_RING = (0.62, 0.62, 0.62)


def draw_thickness(mesh: Mesh, change: Array, path: Path, title: str) -> None:
    """Relative change of thickness of each region on the mesh, from above and below; rings grey."""
    figure = Figure(figsize=(13, 6.2), layout="constrained")
    faces, regions = outside(mesh)
    most = max(1.0, 100 * float(np.abs(change).max()))
    scale = ScalarMappable(Normalize(-most, most), colormaps["RdBu_r"])
    colours = np.array([_RING if k < 0 else scale.to_rgba(100 * change[k])[:3] for k in regions.tolist()])
    places = figure.subplots(1, len(VIEWS))
    for axes, view in zip(places, VIEWS, strict=True):
        paint(axes, view, mesh.nodes_m, faces, colours, line_width=0.2)
    figure.colorbar(scale, ax=list(places), shrink=0.7, label="change of thickness [%]")
    figure.suptitle(title)
    figure.savefig(path, dpi=110, metadata={"Software": None})


def draw_deviations(update: Update, path: Path) -> None:
    """Deviation of each paired frequency before and after."""
    figure = Figure(figsize=(10, 4.2), layout="constrained")
    axes = figure.subplots()
    # Frequencies of either side: one that has a pair on one side only has one bar.
    sides = (update.first_pairs.measured_hz, update.last_pairs.measured_hz)
    measured = np.unique(np.concatenate(sides))
    for after, shift, colour in ((False, -0.2, "#c9a227"), (True, 0.2, "#2f6690")):
        off = 100 * update.deviations(after=after)
        name = "after" if after else "before"
        label = f"{name}: mean {np.abs(off).mean():.2f} %, worst {np.abs(off).max():.2f} %"
        axes.bar(np.searchsorted(measured, sides[after]) + shift, off, 0.4, color=colour, label=label)
    axes.set_xticks(np.arange(len(measured)), [f"{hz:.0f}" for hz in measured], rotation=45)
    axes.axhline(0, color="black", linewidth=0.8)
    axes.set_xlabel("measured frequency [Hz]")
    axes.set_ylabel("model less test [%]")
    axes.legend(frameon=False)
    figure.savefig(path, dpi=110, metadata={"Software": None})
