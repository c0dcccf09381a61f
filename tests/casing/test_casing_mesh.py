"""The casing's mesh and its ties: geometry by volume, welds and bores that carry rigid-body motion."""

from __future__ import annotations

import numpy as np
import pytest
from pyyeti.nastran import n2p
from small_casing import small_params, small_structure

from gearsim_io.errors import InputError
from gearsim_sim.model.casing.eigen import free_modes
from gearsim_sim.model.casing.geometry import MASTERS, bore_centres_m, casing_mesh
from gearsim_sim.model.casing.params import load_casing
from gearsim_sim.model.casing.shell import local_frames
from gearsim_sim.model.casing.structure import thicknesses_m
from gearsim_sim.model.casing.ties import mean_motion
from gearsim_sim.model.casing.volume import mass_kg


def test_mean_motion_is_that_of_rbe3():
    rng = np.random.default_rng(5)
    node, sources, weights = rng.normal(size=3), rng.normal(size=(6, 3)), rng.uniform(0.5, 2, 6)
    grids = np.vstack([node, sources])
    uset = n2p.addgrid(None, np.arange(1, 8), "b", 0, grids, 0)
    independent = [item for k in range(6) for item in ([123, weights[k]], [k + 2])]
    oracle = n2p.formrbe3(uset, 1, 123456, independent)
    assert np.allclose(mean_motion(node, sources, weights), oracle, atol=1e-12)


def test_a_casing_that_hangs_freely_has_six_rigid_body_modes_and_no_more():
    structure = small_structure(free=True)
    squares, _ = free_modes(structure.stiffness, structure.mass, 10)
    frequencies = np.sqrt(np.abs(squares)) / (2 * np.pi)
    assert frequencies[5] < 0.1
    assert frequencies[6] > 100


def test_rigid_body_motion_costs_nothing_and_carries_all_mass():
    structure, params = small_structure(free=True), small_params()
    motion = structure.rigid_motion()
    assert np.abs(structure.stiffness @ motion).max() < 1e-11 * np.abs(structure.stiffness.data).max()
    inertia = motion.T @ (structure.mass @ motion)
    assert np.allclose(np.diag(inertia)[:3], mass_kg(params), rtol=0.01)
    # Left and right, and the two end walls, are alike: the centre of mass lies on the y axis.
    assert abs(inertia[0, 4]) < 1e-9
    assert abs(inertia[1, 5]) < 1e-9


def test_pads_hold_the_casing_with_their_stiffness():
    structure, params = small_structure(free=False), small_params()
    motion = structure.rigid_motion()
    stiffness = motion.T @ (structure.stiffness @ motion)
    assert stiffness[1, 1] == pytest.approx(4 * params.pads.vertical_n_per_m, rel=1e-6)
    assert stiffness[0, 0] == pytest.approx(4 * params.pads.lateral_n_per_m, rel=1e-6)


def test_bores_are_where_the_shafts_are():
    params = small_params()
    mesh = casing_mesh(params)
    apart = mesh.nodes_m[mesh.masters["b3"]] - mesh.nodes_m[mesh.masters["b1"]]
    # Base circles of 46.3 mm with 20 degrees: the centre distance of the rig's wheels.
    assert apart == pytest.approx([2 * 0.0463 / np.cos(np.deg2rad(20)), 0, 0], abs=1e-5)
    for name in MASTERS:
        centre = bore_centres_m(params)[name]
        assert np.allclose(mesh.nodes_m[mesh.masters[name]], centre)
        bore = next(r for r in mesh.rigids if r.centre == mesh.masters[name])
        distance = np.linalg.norm(mesh.nodes_m[bore.nodes][:, :2] - centre[:2], axis=1)
        assert np.allclose(distance, params.rings.bore_radius_m)


def test_elements_are_not_turned_inside_out_and_lie_flat():
    mesh = casing_mesh(small_params())
    frames, flat = local_frames(mesh.nodes_m[mesh.quads])
    sides = np.roll(flat, -1, axis=1) - flat
    turn = (
        sides[..., 0] * np.roll(sides, -1, axis=1)[..., 1]
        - sides[..., 1] * np.roll(sides, -1, axis=1)[..., 0]
    )
    assert (turn > 0).all()
    centred = mesh.nodes_m[mesh.quads] - mesh.nodes_m[mesh.quads].mean(axis=1, keepdims=True)
    assert np.abs(np.einsum("eij,ej->ei", centred, frames[:, 2])).max() < 1e-12


def test_every_region_has_elements_and_may_have_a_thickness():
    params = small_params()
    mesh = casing_mesh(params)
    assert set(mesh.quad_regions) == set(range(len(mesh.regions)))
    thin = params.model_copy(update={"thickness_m": {"floor/field": 0.004}})
    thickness = dict(zip(mesh.regions, thicknesses_m(thin, mesh.regions), strict=True))
    assert thickness["floor/field"] == 0.004
    assert thickness["floor/input_weld"] == params.box.floor_thickness_m
    assert thickness["end_a/field"] == params.box.wall_thickness_m
    wrong = params.model_copy(update={"thickness_m": {"lid/field": 0.004}})
    with pytest.raises(InputError, match="lid/field"):
        thicknesses_m(wrong, mesh.regions)


def test_descriptions_that_do_not_fit_are_refused(tmp_path):
    with pytest.raises(InputError, match="one of unsw_casing"):
        load_casing("no_such")
    from gearsim_sim.model.casing.params import FOLDER

    text = (FOLDER / "unsw_casing.yaml").read_text()
    for line, change, told in (
        ("bore_radius", "bore_radius: {value: 60, unit: mm, source: test}", "rings.disc_radius"),
        ("wall_thickness", "wall_thickness: {value: 3, unit: kg, source: test}", "wall_thickness"),
        ("damping_ratio", 'damping_ratio: {value: 1.5, unit: "1", source: test}', "damping_ratio"),
        ("weld_width", "weld_width: {value: 25, unit: mm}", "source"),
    ):
        lines = [
            row[: len(row) - len(row.lstrip())] + change if row.strip().startswith(line + ":") else row
            for row in text.splitlines()
        ]
        path = tmp_path / f"{line}.yaml"
        path.write_text("\n".join(lines))
        with pytest.raises(InputError, match=told):
            load_casing(str(path))
