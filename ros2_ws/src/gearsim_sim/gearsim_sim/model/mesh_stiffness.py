"""The stiffness of a mesh over the tooth phase, by the choice that the machine's YAML makes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearsim_sim.model.gear_mesh import stiffness_series
from gearsim_sim.model.periodic import PeriodicSeries
from gearsim_sim.model.tooth import stiffness as teeth
from gearsim_sim.model.tooth.pair import GearPair
from gearsim_sim.params.parallel import MeshStiffness

_NO_PULSE = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class StiffnessCurve:
    """Mean, smooth part and rectangular part (see `gear_mesh.Mesh.pulse`) of a mesh stiffness."""

    mean_n_per_m: float
    series: PeriodicSeries
    pulse: tuple[float, float, float] = _NO_PULSE


def stiffness_curve(mesh: MeshStiffness, pair: GearPair | None, *, variation: bool) -> StiffnessCurve:
    """Stiffness over the tooth phase in pitches, 0 in the middle of double contact.

    Parameters
    ----------
    mesh : MeshStiffness
        Its `stiffness_model` decides; numbers of the other choices are not used.
    pair : GearPair or None
        The teeth; the loader has seen to it that they are there if they are needed.
    variation : bool
        Off: the mean alone.
    """
    harmonics = int(mesh.harmonics)
    if mesh.stiffness_model == "tabulated" or pair is None:
        return StiffnessCurve(mesh.mean_stiffness_n_per_m, stiffness_series(mesh, variation=variation))
    if mesh.stiffness_model == "potential_energy":
        series = teeth.stiffness_series(pair, harmonics)
        return StiffnessCurve(series.mean, series if variation else constant(series.mean))
    edges, levels = teeth.stepped_levels(pair, teeth.smith_pair_stiffness(pair))
    mean = pair.contact_ratio * teeth.smith_pair_stiffness(pair)
    if not variation or edges.size == 1:
        return StiffnessCurve(mean, constant(mean))
    # The upper level lasts from the second edge round to the first.
    pulse = (float(edges[1]), float(1 - edges[1] + edges[0]), float(levels[1] - levels[0]))
    return StiffnessCurve(mean, constant(float(levels[0])), pulse)


def constant(value: float) -> PeriodicSeries:
    """A series without lines."""
    empty = np.zeros(0)
    return PeriodicSeries(mean=value, orders=np.zeros(0, dtype=np.int64), cosine=empty, sine=empty)
