"""Updating of plate thickness by regions against measured frequencies (thesis 3.4).

Bayesian: what is least is the sum of squared deviations of the frequencies over their uncertainty, and of
squared changes of thickness over what one would believe of them before the test (Collins, Hart, Hasselman and
Kennedy, 1974). A few Gauss-Newton steps with exact sensitivities, each within bounds and not too long, so
that modes can be paired anew after each one; the best of all places visited is kept.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from gearsim_sim.model.casing.eigen import free_modes
from gearsim_sim.model.casing.geometry import casing_mesh
from gearsim_sim.model.casing.material import Array
from gearsim_sim.model.casing.mesh import Mesh
from gearsim_sim.model.casing.params import CasingParams
from gearsim_sim.model.casing.regions import FIELD
from gearsim_sim.model.casing.sensitivity import thickness_sensitivity
from gearsim_sim.model.casing.shell import Cells
from gearsim_sim.model.casing.structure import MeshedStructure, assemble, thicknesses_m

# A step changes no thickness by more than this share of its first value; bounds of strips and of fields.
LONGEST_STEP = 0.15
WELD_BOUND = 0.5
FIELD_BOUND = 0.1
# Before any test: rolled plate is within some 3 % of its thickness (EN 10051), a strip that stands for a
# weld's own stiffness may be anything near its plate.
WELD_STD = 0.25
FIELD_STD = 0.03
# Of a measured frequency, relative: what a thickness by strips can be asked to explain of a real casing.
FREQUENCY_STD = 0.003
SETTLED = 2e-3
ASYMMETRY = 0.05
# A measured mode without a pair costs as much as one off by so many standard deviations.
MISSED = 10.0
RIGID = 6
SPARE = 8


@dataclass(frozen=True)
class FreeModel:
    """A casing hung up freely, with its elastic modes."""

    structure: MeshedStructure
    thickness_m: Array
    """Of each region."""
    squares: Array
    """Of angular frequencies [rad^2/s^2], rigid-body modes left out."""
    shapes: Array
    """Shape (structure.size, modes)."""

    @property
    def frequencies_hz(self) -> Array:
        """Of the elastic modes, ascending."""
        return np.asarray(np.sqrt(self.squares) / (2 * np.pi))


@dataclass(frozen=True)
class Match:
    """Measured modes and the model's modes that answer to them."""

    measured_hz: Array
    modes: Cells
    """Index of the model's elastic mode beside each measured frequency, from 0."""
    mac: Array | None = None
    """Of each pair, where shapes were measured."""
    missed: int = 0
    """Measured modes to which none of the model's answers."""


Pairing = Callable[[FreeModel], Match]
Tell = Callable[[str], None]


@dataclass(frozen=True)
class Prior:
    """What may change together, and what is believed of relative changes of thickness before the test."""

    groups: Cells
    """Number of the parameter that each region follows, shape (regions,)."""
    std: Array
    """Shape (parameters,)."""
    bound: Array
    """Shape (parameters,)."""
    start: Array
    """Where the first step is taken, shape (parameters,)."""

    @property
    def spread(self) -> Array:
        """Changes of regions from those of parameters, shape (regions, parameters)."""
        return np.asarray(self.groups[:, None] == np.arange(len(self.std)), dtype=float)


@dataclass(frozen=True)
class Update:
    """A casing before and after."""

    regions: tuple[str, ...]
    change: Array
    """Relative change of each region's thickness."""
    std: Array
    """Its standard deviation after the test."""
    before: FreeModel
    after: FreeModel
    first_pairs: Match
    last_pairs: Match
    steps: int

    def deviations(self, *, after: bool) -> Array:
        """Of the model's frequencies from the measured ones, relative, pair by pair."""
        model, pairs = (self.after, self.last_pairs) if after else (self.before, self.first_pairs)
        return np.asarray(model.frequencies_hz[pairs.modes] / pairs.measured_hz - 1)


@dataclass(frozen=True)
class _Point:
    """A place on the way and what was found there."""

    cost: float
    moved: Array
    model: FreeModel
    pairs: Match
    slopes: Array


def single_prior(regions: tuple[str, ...]) -> Prior:
    """Each region by itself; wide for strips along welds, narrow for the fields of the plates.

    A casing of such a description is the same left and right, front and back, and frequencies alone cannot
    tell its sides apart: of the mirror images that fit alike, rounding would choose. A small start chooses
    the one that is stiffer at `end_a` and at the input's side.
    """
    start = [
        ASYMMETRY * (2 * ("end_a" in name) + ("input" in name or "/b1" in name or "/b2" in name))
        for name in regions
    ]
    return _prior(regions, regions, np.array(start))


def mirror_prior(regions: tuple[str, ...]) -> Prior:
    """As `single_prior`, but mirror images change together."""
    labels = tuple(_side_left_out(name) for name in regions)
    return _prior(regions, labels, np.zeros(len(set(labels))))


def _prior(regions: tuple[str, ...], labels: tuple[str, ...], start: Array) -> Prior:
    names = list(dict.fromkeys(labels))
    groups = np.array([names.index(label) for label in labels])
    welds = np.array([not _is_field(regions[labels.index(name)]) for name in names])
    std, bound = np.where(welds, WELD_STD, FIELD_STD), np.where(welds, WELD_BOUND, FIELD_BOUND)
    return Prior(groups, std, bound, start)


def _side_left_out(region: str) -> str:
    for pattern, common in ((r"end_[ab]", "end"), (r"b[1-4]_weld", "ring_weld"), (r"(in|out)put", "side")):
        region = re.sub(pattern, common, region)
    return region


def _is_field(region: str) -> bool:
    return "/" not in region or region.endswith(f"/{FIELD}")


def free_model(params: CasingParams, mesh: Mesh, thickness_m: Array, modes: int) -> FreeModel:
    """Elastic modes of the casing with these thicknesses; `mesh` without pads."""
    structure = assemble(mesh, thickness_m, params.material, params.name)
    squares, shapes = free_modes(structure.stiffness, structure.mass, modes + RIGID)
    return FreeModel(structure, thickness_m, squares[RIGID:], shapes[:, RIGID:])


def update_thickness(
    params: CasingParams,
    pairing: Pairing,
    modes: int,
    prior_of: Callable[[tuple[str, ...]], Prior],
    *,
    frequency_std: float = FREQUENCY_STD,
    most_steps: int = 8,
    tell: Tell = lambda _step: None,
) -> Update:
    """Change thicknesses so that the model's frequencies come near the measured ones.

    Parameters
    ----------
    params : CasingParams
    pairing : callable
        Says of a model which of its modes answer to which measured frequencies; asked after every step.
    modes : int
        Elastic modes of the model to compute, some more than are measured.
    prior_of : callable
        The prior from the names of the mesh's regions: `single_prior` or `mirror_prior`.
    frequency_std : float
        Relative standard deviation of measured frequencies.
    most_steps : int
    tell : callable
        Hears of each step.
    """
    mesh = hung_up(params)
    first = thicknesses_m(params, mesh.regions)
    prior = prior_of(mesh.regions)
    tell("modes before")
    before = free_model(params, mesh, first, modes)
    moved, best = prior.start, None
    for step in range(1, most_steps + 1):
        tell(f"step {step} of at most {most_steps}")
        model = free_model(params, mesh, first * (1 + prior.spread @ moved), modes)
        pairs = pairing(model)
        slopes, gap = _linearised(params, model, pairs, first)
        slopes = slopes @ prior.spread
        cost = float(np.sum((gap / frequency_std) ** 2) + np.sum((moved / prior.std) ** 2))
        cost += pairs.missed * MISSED**2
        if best is None or cost < best.cost:
            best = _Point(cost, moved, model, pairs, slopes)
        new = _best_step(slopes, gap, moved, prior, frequency_std)
        if np.abs(new - moved).max() < SETTLED:
            break
        moved = new
    assert best is not None
    information = best.slopes.T @ best.slopes / frequency_std**2 + np.diag(1 / prior.std**2)
    std = prior.spread @ np.sqrt(np.diag(np.linalg.inv(information)))
    change = prior.spread @ best.moved
    return Update(mesh.regions, change, std, before, best.model, pairing(before), best.pairs, step)


def hung_up(params: CasingParams) -> Mesh:
    """The mesh of a casing without its pads."""
    return dataclasses.replace(casing_mesh(params), pads=())


def _linearised(params: CasingParams, model: FreeModel, pairs: Match, first_m: Array) -> tuple[Array, Array]:
    """Slopes of the paired modes' ln f over changes relative to `first_m`, and what their ln f lack."""
    squares, shapes = model.squares[pairs.modes], model.shapes[:, pairs.modes]
    relative = thickness_sensitivity(model.structure, model.thickness_m, params.material, squares, shapes)
    gap = np.log(pairs.measured_hz / model.frequencies_hz[pairs.modes])
    return relative * (first_m / model.thickness_m), gap


def _best_step(slopes: Array, gap: Array, moved: Array, prior: Prior, frequency_std: float) -> Array:
    """Changes that are most likely if frequencies follow the slopes, within bounds and a step's length."""
    rows = np.concatenate([slopes / frequency_std, np.diag(1 / prior.std)])
    right = np.concatenate([(gap + slopes @ moved) / frequency_std, np.zeros(len(moved))])
    low = np.maximum(-prior.bound, moved - LONGEST_STEP)
    high = np.minimum(prior.bound, moved + LONGEST_STEP)
    return np.asarray(lsq_linear(rows, right, bounds=(low, high), tol=1e-12).x)
