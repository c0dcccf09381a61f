"""Exact sensitivities, and thicknesses found again from frequencies."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from coarse_casing import write_coarse_casing
from ruamel.yaml import YAML
from small_casing import small_params

from gearsim_sim.model.casing.against_thesis import BASIS, pair_with_thesis, update_to_thesis
from gearsim_sim.model.casing.against_thesis import MODES as THESIS_MODES
from gearsim_sim.model.casing.eigen import free_modes
from gearsim_sim.model.casing.geometry import casing_mesh
from gearsim_sim.model.casing.material import STEEL
from gearsim_sim.model.casing.mesh import Mesh
from gearsim_sim.model.casing.params import load_casing
from gearsim_sim.model.casing.plates import rectangle
from gearsim_sim.model.casing.sensitivity import thickness_sensitivity
from gearsim_sim.model.casing.structure import assemble, thicknesses_m
from gearsim_sim.model.casing.updated_file import description_path, updated_description, write_description
from gearsim_sim.model.casing.updating import (
    FIELD_BOUND,
    WELD_BOUND,
    Match,
    free_model,
    hung_up,
    mirror_prior,
    update_thickness,
)

MODES = 20


def _mesh():
    return dataclasses.replace(casing_mesh(small_params()), pads=())


def test_sensitivities_are_the_slopes_of_frequencies():
    params, mesh = small_params(), _mesh()
    first = thicknesses_m(params, mesh.regions)
    # Without symmetry, or modes that cross would differ.
    first = first * (1 + 0.05 * np.cos(np.arange(len(first)) ** 2))
    model = free_model(params, mesh, first, MODES)
    found = thickness_sensitivity(model.structure, first, params.material, model.squares, model.shapes)
    step = 1e-4
    for region in ("end_a/b1_weld", "floor/field", "rim/field"):
        k = next(i for i, name in enumerate(mesh.regions) if name in (region, region.split("/")[0]))
        logs = []
        for sign in (1, -1):
            moved = first.copy()
            moved[k] *= 1 + sign * step
            logs.append(np.log(free_model(params, mesh, moved, MODES).frequencies_hz))
        slope = (logs[0] - logs[1]) / (2 * step)
        # Central differences err by step^2 times third derivatives, the larger the nearer two modes are.
        np.testing.assert_allclose(found[:, k], slope, atol=2e-5, err_msg=region)


def test_scaling_all_plates_scales_bending_as_the_thickness():
    """A plate without membrane forces and shear: d ln f / d ln t = 1, a little less with shear."""
    flat, quads = rectangle(np.linspace(0, 0.3, 13), np.linspace(0, 0.2, 9))
    nodes = np.column_stack([flat, np.zeros(len(flat))])
    mesh = Mesh(nodes, quads, np.zeros(len(quads), int), ("plate",), np.zeros((0, 8), int))
    thickness = np.array([0.002])
    structure = assemble(mesh, thickness, STEEL, "plate")
    squares, shapes = free_modes(structure.stiffness, structure.mass, 14)
    found = thickness_sensitivity(structure, thickness, STEEL, squares[6:], shapes[:, 6:])
    np.testing.assert_allclose(found, 1.0, atol=0.01)
    assert (found < 1).all()


@pytest.fixture(scope="module")
def altered():
    """A casing whose welds at the rings and the floor differ, alike on both sides."""
    params, mesh = small_params(), _mesh()
    first = thicknesses_m(params, mesh.regions)
    change = np.array(
        [-0.3 * ("/b" in name) + 0.2 * (name.startswith("end") and "floor" in name) for name in mesh.regions]
    )
    truth = free_model(params, mesh, first * (1 + change), MODES)

    def pairing(_model):
        return Match(truth.frequencies_hz, np.arange(MODES))

    return params, change, pairing


def test_frequencies_tell_where_thickness_differs(altered):
    params, change, pairing = altered
    found = update_thickness(params, pairing, MODES, mirror_prior, frequency_std=1e-3, most_steps=8)
    assert np.abs(found.deviations(after=False)).mean() > 0.02
    assert np.abs(found.deviations(after=True)).max() < 2e-3
    # Frequencies are exact here: what is left is what the prior pulls towards nothing, within 3 deviations.
    assert (np.abs(found.change - change) < 3 * found.std + 1e-9).all()
    rings = np.array(["/b" in name for name in found.regions])
    np.testing.assert_allclose(found.change[rings], -0.3, atol=0.03)
    assert (found.std[rings] < 0.02).all()


def test_bounds_hold(altered):
    params, _, pairing = altered

    def far(model):
        match = pairing(model)
        return Match(match.measured_hz * 1.5, match.modes)

    found = update_thickness(params, far, MODES, mirror_prior, most_steps=6)
    limits = np.array([WELD_BOUND if "weld" in name else FIELD_BOUND for name in found.regions])
    assert (np.abs(found.change) <= limits + 1e-12).all()
    assert np.isclose(np.abs(found.change), limits).any()


def test_an_updated_description_is_one_that_builds_the_updated_casing(tmp_path):
    coarse = write_coarse_casing(tmp_path)
    params = load_casing(str(coarse))
    update = update_to_thesis(params, 2, mirrored=False, tell=lambda _step: None)
    off = [np.abs(update.deviations(after=after)).mean() for after in (False, True)]
    assert off[1] < off[0]
    path = tmp_path / "updated.yaml"
    write_description(updated_description(description_path(str(coarse)), update, BASIS), path)
    assert [file.name for file in tmp_path.glob("*.part")] == []
    again = load_casing(str(path))
    assert again.name == "coarse_updated"
    thickness = thicknesses_m(again, update.regions)
    np.testing.assert_allclose(thickness, update.after.thickness_m, atol=1e-7)
    kept = YAML(typ="safe").load(path.read_text())
    assert kept["box"] == YAML(typ="safe").load(coarse.read_text())["box"]


def test_the_updated_casing_that_ships_meets_the_modal_test_of_the_thesis():
    params = load_casing("unsw_casing_updated")
    mesh = hung_up(params)
    model = free_model(params, mesh, thicknesses_m(params, mesh.regions), THESIS_MODES)
    pairs = pair_with_thesis(model)
    off = np.abs(model.frequencies_hz[pairs.modes] / pairs.measured_hz - 1)
    # Goals of the project; the thesis reached 1.32 % and 6.75 %.
    assert len(off) == 17
    assert off.mean() <= 0.010
    assert off.max() <= 0.04
