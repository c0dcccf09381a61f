"""Pictures of a modal test: MAC before and after updating, and frequency responses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from gearsim_sim.model.casing.from_test import TestedUpdate
from gearsim_sim.model.casing.modal_test import ModalTest
from gearsim_sim.model.casing.updating import FreeModel

DRAWN = 3


def draw_macs(tested: TestedUpdate, path: Path) -> None:
    """MAC of identified modes against the model's, before and after, pairs marked."""
    figure = Figure(figsize=(12, 5.2), layout="constrained")
    places = figure.subplots(1, 2, sharey=True)
    update = tested.update
    measured = tested.identified.frequencies_hz
    for axes, after, pairs in ((places[0], False, update.first_pairs), (places[1], True, update.last_pairs)):
        image = axes.imshow(tested.macs(after=after), origin="lower", aspect="auto", vmin=0, vmax=1)
        rows = np.searchsorted(measured, pairs.measured_hz)
        axes.plot(pairs.modes, rows, "s", color="none", markeredgecolor="red", markersize=7)
        mean = 0.0 if pairs.mac is None else float(pairs.mac.mean())
        name = "after" if after else "before"
        axes.set_title(f"{name} updating: {len(rows)} pairs, mean MAC {mean:.2f}")
        axes.set_xlabel("mode of the model")
    places[0].set_ylabel("identified mode")
    figure.colorbar(image, ax=list(places), label="MAC")
    figure.savefig(path, dpi=100, metadata={"Software": None})


def draw_responses(tested: TestedUpdate, test: ModalTest, path: Path) -> None:
    """Accelerance at each reference itself: test, model before and after, with the damping identified."""
    figure = Figure(figsize=(11, 8), layout="constrained")
    places = figure.subplots(DRAWN, 1, sharex=True)
    damping = float(np.median(tested.identified.damping))
    lines = test.frequencies_hz
    for k, axes in enumerate(places):
        point = int(tested.plan.references[k])
        axes.semilogy(lines, np.abs(test.accelerance[k, point]), color="black", linewidth=1.2, label="test")
        for model, name, colour in (
            (tested.update.before, "before", "#c9a227"),
            (tested.update.after, "after", "#2f6690"),
        ):
            level = _driving(model, tested, point, lines, damping)
            axes.semilogy(lines[1:], level[1:], color=colour, linewidth=0.9, label=name)
        axes.set_ylabel(f"{'xyz'[k]}: accelerance [1/kg]")
        axes.set_xlim(100, lines[-1])
    places[0].legend(frameon=False, ncols=3)
    places[-1].set_xlabel("frequency [Hz]")
    figure.savefig(path, dpi=100, metadata={"Software": None})


def _driving(
    model: FreeModel, tested: TestedUpdate, point: int, lines: np.ndarray, damping: float
) -> np.ndarray:
    """Elastic modes and rigid-body motion, shape (lines,)."""
    structure, speeds = model.structure, 2 * np.pi * lines
    row = structure.row(int(tested.plan.nodes[point]), tested.plan.directions[point])
    shape = (row @ model.shapes)[0]
    filters = 1 / (
        model.squares[:, None] - speeds**2 + 2j * damping * np.sqrt(model.squares)[:, None] * speeds
    )
    motion = structure.rigid_motion()
    own = (row @ motion)[0]
    rigid = own @ np.linalg.solve(motion.T @ (structure.mass @ motion), own)
    return np.asarray(np.abs(rigid - speeds**2 * (shape**2 @ filters)))
