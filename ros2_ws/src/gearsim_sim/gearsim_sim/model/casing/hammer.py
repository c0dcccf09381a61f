"""A virtual hammer test of a casing that differs from its description. Nothing that updates imports this."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.casing.eigen import factorise
from gearsim_sim.model.casing.material import Array
from gearsim_sim.model.casing.mesh import Mesh
from gearsim_sim.model.casing.modal_test import ModalTest, TestPlan
from gearsim_sim.model.casing.params import CasingParams
from gearsim_sim.model.casing.regions import FIELD
from gearsim_sim.model.casing.structure import thicknesses_m
from gearsim_sim.model.casing.updating import FreeModel, free_model

# Relative scatter of a real casing about its drawing.
WELD_SCATTER = 0.2
FIELD_SCATTER = 0.01
MODULUS_SCATTER = 0.003
# Of measured responses: calibration of accelerometers, force and angle of blows, noise over a channel's rms.
GAIN = 0.02
BLOW = 0.01
NOISE = 0.005
# Steel hung up freely: damping of its welds, and its spread from mode to mode.
DAMPING = 0.004
DAMPING_SPREAD = 0.3
# Bungee cords: the six rigid-body modes.
CORD_HZ = 3.0
CORD_DAMPING = 0.05


@dataclass(frozen=True)
class Specimen:
    """The casing on the ropes, which only the judge of an updating may look at."""

    model: FreeModel
    change: Array
    """Relative deviation of each region's thickness from the description."""
    damping: Array
    """Of each elastic mode, of critical."""


def make_specimen(params: CasingParams, mesh: Mesh, modes: int, seed: int) -> Specimen:
    """A casing whose welds and thicknesses, and a little its steel, differ from the description.

    Strips of the same kind differ most in common (one welder, one seam), a quarter of it each by itself.
    """
    rng = np.random.default_rng(seed)
    kinds = {name: rng.normal() for name in ("floor_weld", "side_weld", "ring_weld", "end_weld")}
    change = np.array([_scatter(name, kinds, rng) for name in mesh.regions])
    steel = params.steel.model_copy(
        update={"youngs_modulus_pa": params.material.youngs_modulus_pa * (1 + MODULUS_SCATTER * rng.normal())}
    )
    real = params.model_copy(update={"steel": steel})
    model = free_model(real, mesh, thicknesses_m(params, mesh.regions) * (1 + change), modes)
    damping = DAMPING * np.exp(DAMPING_SPREAD * rng.standard_normal(modes))
    return Specimen(model, change, damping)


def _scatter(region: str, kinds: dict[str, float], rng: np.random.Generator) -> float:
    own = float(rng.normal())
    part = region.partition("/")[2]
    if part in ("", FIELD):
        return FIELD_SCATTER * own
    kind = "ring_weld" if part.startswith("b") else part.split("_")[0].rstrip("ab") + "_weld"
    kind = {"input_weld": "side_weld", "output_weld": "side_weld"}.get(kind, kind)
    return float(np.clip(WELD_SCATTER * (kinds[kind] + 0.25 * own), -0.45, 0.45))


def strike(specimen: Specimen, plan: TestPlan, frequencies_hz: Array, seed: int) -> ModalTest:
    """What a laboratory would measure on the specimen.

    Its own modes, those beyond them by their flexibility, its swaying on the cords; then calibration errors
    of accelerometers and blows, and noise, half of it common to the accelerometers.

    Parameters
    ----------
    specimen : Specimen
        With modes some way beyond the frequencies.
    plan : TestPlan
    frequencies_hz : Array, shape (lines,)
    seed : int
    """
    rng = np.random.default_rng(seed)
    exact = accelerance(specimen, plan, frequencies_hz)
    references, points, lines = exact.shape
    gains = 1 + GAIN * rng.standard_normal((references, 1, 1))
    blows = 1 + BLOW * rng.standard_normal((1, points, 1))
    level = np.sqrt(np.mean(np.abs(exact) ** 2, axis=2, keepdims=True))
    noise = (_complex(rng, (1, points, lines)) + _complex(rng, exact.shape)) / np.sqrt(2)
    return ModalTest(frequencies_hz, (exact * gains * blows) + NOISE * level * noise)


def _complex(rng: np.random.Generator, shape: tuple[int, ...]) -> NDArray[np.complex128]:
    pair = rng.standard_normal((2, *shape))
    return np.asarray((pair[0] + 1j * pair[1]) / np.sqrt(2))


def accelerance(specimen: Specimen, plan: TestPlan, frequencies_hz: Array) -> NDArray[np.complex128]:
    """Exact responses, shape (references, points, lines)."""
    model, structure = specimen.model, specimen.model.structure
    speeds = 2 * np.pi * frequencies_hz
    body = FreeModel(structure, model.thickness_m, np.zeros(6), _rigid_modes(model))
    own = np.sqrt(model.squares)
    poles = [
        (model, model.squares, 2 * specimen.damping * own),
        (body, np.full(6, (2 * np.pi * CORD_HZ) ** 2), np.full(6, 4 * np.pi * CORD_DAMPING * CORD_HZ)),
    ]
    total = _residual(model, body, plan)[:, :, None] * np.ones(len(speeds), dtype=complex)
    for moving, squares, widths in poles:
        shapes, at_references = plan.rows(moving), plan.reference_rows(moving)
        filters = 1 / (squares[:, None] - speeds**2 + 1j * widths[:, None] * speeds)
        total += np.einsum("rm,pm,mf->rpf", at_references, shapes, filters, optimize=True)
    return np.asarray(-(speeds**2) * total)


def _rigid_modes(model: FreeModel) -> Array:
    """The six rigid-body motions, orthonormal in mass."""
    motion = model.structure.rigid_motion()
    lower = np.linalg.cholesky(motion.T @ (model.structure.mass @ motion))
    return np.asarray(np.linalg.solve(lower, motion.T).T)


def _residual(model: FreeModel, body: FreeModel, plan: TestPlan) -> Array:
    """Static flexibility of the modes beyond those computed, shape (references, points)."""
    structure = model.structure
    # Far below the modes left out, far above rounding.
    shift = (2 * np.pi * 20.0) ** 2
    factor = factorise(structure.stiffness + shift * structure.mass)
    places = [structure.row(int(n), way) for n, way in zip(plan.nodes, plan.directions, strict=True)]
    kept = plan.reference_rows(model) / (model.squares + shift) @ plan.rows(model).T
    kept += plan.reference_rows(body) / shift @ plan.rows(body).T
    found = []
    for node, way in zip(plan.reference_nodes, plan.reference_directions, strict=True):
        moved = factor.solve(structure.row(int(node), way).toarray()[0])
        found.append([(place @ moved)[0] for place in places])
    return np.asarray(np.array(found) - kept)
