"""Pictures of a modal test: MAC before and after updating, and frequency responses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from gearsim_sim.model.casing.from_test import TestedUpdate
from gearsim_sim.model.casing.modal_test import ModalTest, TestPlan
from gearsim_sim.model.casing.updating import FreeModel

DRAWN = 3


def draw_macs(tested: TestedUpdate, path: Path) -> None:
    """MAC of identified modes against the model's, before and after, pairs marked."""
    figure = Figure(figsize=(12, 5.2), layout="constrained")
    places = figure.subplots(1, 2, sharey=True)
    update = tested.update
    measured = tested.identified.frequencies_hz
    for axes, after, pairs in ((places[0], False, update.first_pairs), (places[1], True, update.last_pairs)):
        values = tested.macs(after=after)
        # Modes count from 1, as in the table.
        edges = (0.5, values.shape[1] + 0.5, 0.5, len(values) + 0.5)
        image = axes.imshow(values, origin="lower", aspect="auto", vmin=0, vmax=1, extent=edges)
        rows = np.searchsorted(measured, pairs.measured_hz)
        axes.plot(pairs.modes + 1, rows + 1, "s", color="none", markeredgecolor="red", markersize=7)
        mean = 0.0 if pairs.mac is None else float(pairs.mac.mean())
        name = "after" if after else "before"
        axes.set_title(f"{name} updating: {len(rows)} pairs, mean MAC {mean:.2f}")
        axes.set_xlabel("mode of the model")
    places[0].set_ylabel("identified mode")
    figure.colorbar(image, ax=list(places), label="MAC")
    figure.savefig(path, dpi=100, metadata={"Software": None})


def draw_responses(tested: TestedUpdate, test: ModalTest, path: Path) -> None:
    """Accelerance at each reference itself: test, model before and after, with the damping identified.

    Where nobody struck the reference itself the point with the largest response stands in.
    """
    count = min(DRAWN, len(test.accelerance))
    figure = Figure(figsize=(11, 1 + 2.4 * count), layout="constrained")
    places = figure.subplots(count, 1, sharex=True, squeeze=False).ravel()
    damping, lines, plan = float(np.median(tested.identified.damping)), test.frequencies_hz, tested.plan
    points = np.where(plan.references < 0, _loudest(test), plan.references)
    band = tested.identified.frequencies_hz
    inside = (lines > 0.7 * band[0]) & (lines <= 1.1 * band[-1])
    lines = lines[inside]
    for k, axes in enumerate(places):
        measured = np.abs(test.accelerance[k, points[k], inside])
        axes.semilogy(lines, measured, "k", linewidth=1.2, label="test")
        for model, name, colour in (
            (tested.update.before, "before", "#c9a227"),
            (tested.update.after, "after", "#2f6690"),
        ):
            level = _response(model, plan, k, int(points[k]), lines, damping)
            axes.semilogy(lines, level, color=colour, linewidth=0.9, label=name)
        axes.set_ylabel(f"{_way(plan.reference_directions[k])}: accelerance [1/kg]")
        axes.set_xlim(lines[0], lines[-1])
    places[0].legend(frameon=False, ncols=3)
    places[-1].set_xlabel("frequency [Hz]")
    figure.savefig(path, dpi=100, metadata={"Software": None})


def _loudest(test: ModalTest) -> np.ndarray:
    """The point of the largest response to each reference."""
    return np.asarray(np.argmax(np.abs(test.accelerance).mean(axis=2), axis=1))


def _way(direction: np.ndarray) -> str:
    axis = int(np.argmax(np.abs(direction)))
    return "xyz"[axis]


def _response(
    model: FreeModel, plan: TestPlan, reference: int, point: int, lines: np.ndarray, damping: float
) -> np.ndarray:
    """Of elastic modes and rigid-body motion, shape (lines,)."""
    structure, speeds = model.structure, 2 * np.pi * lines
    ends = [
        structure.row(int(plan.reference_nodes[reference]), plan.reference_directions[reference]),
        structure.row(int(plan.nodes[point]), plan.directions[point]),
    ]
    first, second = ((row @ model.shapes)[0] for row in ends)
    filters = 1 / (
        model.squares[:, None] - speeds**2 + 2j * damping * np.sqrt(model.squares)[:, None] * speeds
    )
    motion = structure.rigid_motion()
    one, other = ((row @ motion)[0] for row in ends)
    rigid = one @ np.linalg.solve(motion.T @ (structure.mass @ motion), other)
    return np.asarray(np.abs(rigid - speeds**2 * ((first * second) @ filters)))
