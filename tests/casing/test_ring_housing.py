"""The housing of a planetary stage: its mesh, what must hold of any structure, and the file that ships."""

import dataclasses
import math

import numpy as np
import pytest

from gearsim_io.errors import InputError
from gearsim_sim.model.casing.build import build_structure, reduce_casing
from gearsim_sim.model.casing.described import load_described
from gearsim_sim.model.casing.params import FOLDER, CasingParams
from gearsim_sim.model.casing.reduced import find_reduced
from gearsim_sim.model.casing.ring_housing import RingHousing, housing_mesh

NAME = "unsw_planetary_housing"


@pytest.fixture(scope="module")
def params():
    found = load_described(NAME)
    assert isinstance(found, RingHousing)
    return found


@pytest.fixture(scope="module")
def coarse(params):
    """Quads of 24 mm: a second of work."""
    return params.model_copy(
        update={"mesh": params.mesh.model_copy(update={"plate_size_m": 0.024}), "name": "coarse"}
    )


def test_it_weighs_what_its_plates_weigh(coarse):
    """The saddles' upper edge follows the circle; facets of the cylinder take 1 % off its wall."""
    structure = build_structure(coarse, free=True)
    cylinder, ends, saddles = coarse.cylinder, coarse.ends, coarse.saddles
    radius, reach = cylinder.radius_m, saddles.half_angle_rad
    volume = 2 * math.pi * radius * cylinder.length_m * cylinder.thickness_m
    for bore in (ends.sun_bore_radius_m, ends.carrier_bore_radius_m):
        rim = bore + ends.boss_width_m
        volume += math.pi * (rim**2 - bore**2) * ends.boss_thickness_m
        volume += math.pi * (radius**2 - rim**2) * ends.thickness_m
    below = saddles.height_m * 2 * radius * math.sin(reach)
    volume += 2 * saddles.thickness_m * (below - radius**2 * (reach + math.sin(reach) * math.cos(reach)))
    motion = structure.rigid_motion()
    moved = motion.T @ structure.mass @ motion
    assert moved[:3, :3] == pytest.approx(7850 * volume * np.eye(3), rel=0.02, abs=1e-9)


def test_free_it_moves_as_a_body_and_no_other_way(coarse):
    structure = build_structure(coarse, free=True)
    motion = structure.rigid_motion()
    forces = abs(structure.stiffness @ motion).max() / abs(structure.stiffness).max()
    assert forces < 1e-11
    # Held at one master nothing is loose: the stiffness without it has a factor of positive numbers only.
    rows = structure.masters["sun"]
    kept = np.setdiff1d(np.arange(structure.size), rows)
    held = structure.stiffness.tocsr()[kept][:, kept].toarray()
    np.linalg.cholesky(held)


def test_all_its_parts_hang_together_at_their_edges(params):
    mesh = housing_mesh(params)
    half = params.cylinder.length_m / 2
    corner = mesh.nodes_m[mesh.quads]
    for sign in (1, -1):
        end = np.all(np.isclose(corner[..., 2], sign * half), axis=1)
        wall = ~end & np.any(np.isclose(corner[..., 2], sign * half), axis=1)
        assert set(mesh.quads[wall].ravel()) & set(mesh.quads[end].ravel())
    # Each edge of a quad is shared, but for those of the bores, the feet and the saddles' sides.
    edges = np.sort(np.stack([mesh.quads, np.roll(mesh.quads, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    _, count = np.unique(edges, axis=0, return_counts=True)
    assert (count == 3).sum() > 0  # a saddle at the cylinder
    assert (count == 1).sum() < 0.1 * len(count)
    seat = next(one for one in mesh.rigids if one.centre == mesh.masters["ring"])
    assert np.abs(mesh.nodes_m[seat.nodes, 2]).max() == pytest.approx(params.seat.width_m / 2)


def test_the_file_that_ships_is_made_of_its_description(params):
    shipped = find_reduced(NAME)
    made = reduce_casing(params, shipped.modes)
    assert shipped.valid_hz == pytest.approx(made.valid_hz, rel=1e-6)
    assert [one.name for one in shipped.sites] == [one.name for one in made.sites]
    assert [one.name for one in shipped.feet] == [f"pad_{number}" for number in range(1, 5)]
    for hertz in (100.0, 900.0, 4000.0):
        w = 2 * math.pi * hertz
        push = np.zeros(shipped.size)
        push[shipped.dof("ring", "uy")] = 1.0
        rows = []
        for one in (shipped, made):
            moved = np.linalg.solve(one.stiffness - w**2 * one.mass + 1j * w * one.damping, push)
            rows.append([site.rows @ moved for site in (*one.sites, *one.feet)])
        assert rows[0] == pytest.approx(np.array(rows[1]), rel=1e-6, abs=1e-6 * np.abs(rows[1]).max())


def test_feet_carry_what_they_are_said_to(coarse):
    """Lifted by a force at the ring the feet's springs balance it."""
    reduced = reduce_casing(coarse, 10)
    push = np.zeros(reduced.size)
    push[reduced.dof("ring", "uy")] = 1000.0
    moved = np.linalg.solve(reduced.stiffness, push)
    assert sum(foot.stiffness_n_per_m * (foot.rows @ moved) for foot in reduced.feet) == pytest.approx(1000.0)


def test_descriptions_are_told_apart_and_checked(params, tmp_path):
    assert isinstance(load_described("unsw_casing"), CasingParams)
    text = (FOLDER / f"{NAME}.yaml").read_text(encoding="utf-8")
    path = tmp_path / "mine.yaml"
    path.write_text(text.replace("sun_bore_radius: {value: 34", "sun_bore_radius: {value: 99"))
    with pytest.raises(InputError, match=r"ends\.sun_bore_radius: got 0\.099 m, expected between"):
        load_described(str(path))
    with pytest.raises(InputError, match="one of unsw_casing"):
        load_described("nothing")
    assert dataclasses.is_dataclass(params.material)
