"""Craig-Bampton: exact statics and rigid-body motion, frequencies within the error it states, sensors."""

from __future__ import annotations

import numpy as np
import pytest
from pyyeti import cb
from pyyeti.nastran import n2p
from scipy.sparse.linalg import spsolve
from small_casing import small_params, small_structure

from gearsim_io.errors import InputError
from gearsim_sim.model.casing.build import finish, reduce_casing
from gearsim_sim.model.casing.eigen import free_modes, signs
from gearsim_sim.model.casing.reduced import load_reduced, save_reduced
from gearsim_sim.model.casing.reduction import allowed_errors, craig_bampton
from gearsim_sim.model.casing.sites import SitePlace, parse_site, recover_sites

MODES = 60


@pytest.fixture(scope="module")
def free():
    return craig_bampton(small_structure(free=True), MODES)


@pytest.fixture(scope="module")
def mounted():
    return craig_bampton(small_structure(free=False), MODES)


@pytest.fixture(scope="module")
def exact():
    structure = small_structure(free=True)
    return free_modes(structure.stiffness, structure.mass, MODES + 20)


def test_statics_are_exact(mounted):
    structure = small_structure(free=False)
    rng = np.random.default_rng(1)
    force = np.zeros(structure.size)
    force[mounted.held] = rng.normal(size=24)
    full = spsolve(structure.stiffness, force)
    reduced = np.linalg.solve(mounted.stiffness, np.concatenate([force[mounted.held], np.zeros(MODES)]))
    assert np.allclose(mounted.expand(reduced), full, atol=1e-9 * np.abs(full).max())


def test_rigid_body_motion_is_exact(free):
    structure = small_structure(free=True)
    motion = structure.rigid_motion()
    coordinates = np.vstack([motion[free.held], np.zeros((MODES, 6))])
    assert np.allclose(free.expand(coordinates), motion, atol=1e-8)
    whole = motion.T @ (structure.mass @ motion)
    assert np.allclose(coordinates.T @ free.mass @ coordinates, whole, atol=1e-8 * whole.max())
    assert np.abs(free.stiffness @ coordinates).max() < 1e-9 * np.abs(free.stiffness).max()


def test_frequencies_approach_the_full_model_from_above_within_the_stated_error(free, exact):
    full = np.sqrt(exact[0][6:]) / (2 * np.pi)
    found, stated = free.frequencies_hz[6:], free.errors[6:]
    inside = found < free.valid_hz
    assert 10 < inside.sum() < len(inside)
    off = found[inside] / full[: inside.sum()] - 1
    assert (off > -1e-9).all()
    # The estimate is an upper bound to first order; modes that swap places may exceed it by a little.
    assert (off <= 1.5 * stated[inside] + 1e-7).all()
    assert (off <= allowed_errors(full[: inside.sum()])).all()
    assert np.median(stated[inside] / np.maximum(off, 1e-12)) < 3


def test_the_frequency_up_to_which_it_is_valid_is_neither_beyond_the_truth_nor_far_below(exact):
    reduction = craig_bampton(small_structure(free=True), 30)
    found = reduction.frequencies_hz[6:]
    full = np.sqrt(exact[0][6 : 6 + len(found)]) / (2 * np.pi)
    bad = full[found > full * (1 + allowed_errors(full))]
    # It is not sought beyond the first mode left out.
    limit = min(bad[0], reduction.cutoff_hz)
    # Without the modes computed beyond those kept it was 3.4 % below.
    assert 0.99 * limit < reduction.valid_hz <= limit


def test_more_modes_bring_it_nearer_and_residual_vectors_still_more(exact):
    full = np.sqrt(exact[0][6:36]) / (2 * np.pi)

    def worst(modes: int, residuals: int) -> float:
        reduction = craig_bampton(small_structure(free=True), modes, residuals=residuals)
        return float(np.abs(reduction.frequencies_hz[6:36] / full - 1).max())

    plain = [worst(modes, 0) for modes in (40, 60, 120)]
    assert plain[0] > plain[1] > plain[2]
    assert worst(60, 12) < plain[1] / 3


def test_the_independent_check_of_craig_bampton_models_is_clean(free, tmp_path):
    structure = small_structure(free=True)
    places = np.array(list(structure.positions_m.values()))
    uset = n2p.addgrid(None, np.arange(1, 5), "b", 0, places, 0)
    with (tmp_path / "report.txt").open("w") as report:
        out = cb.cbcheck(
            report,
            free.mass,
            free.stiffness,
            np.arange(24),
            np.arange(6),
            uset=uset,
            uref=[0, 0, 0],
            rb_norm=True,
        )
    stiffness, mass = out.k, out.m
    assert np.abs(stiffness[:24, 24:]).max() == 0
    assert np.array_equal(mass[24:, 24:], np.eye(MODES))
    rigid = out.rbs[:24]
    assert np.abs(stiffness[:24, :24] @ rigid).max() < 1e-7 * np.abs(stiffness[:24, :24]).max()


def test_the_correction_is_what_the_modes_left_out_add():
    """With the masters moving as they do under a bearing force, at frequencies between resonances.

    Without residual vectors, which take most of what there is to correct.
    """
    structure = small_structure(free=True)
    free = craig_bampton(structure, MODES, residuals=0)
    force = np.zeros(structure.size)
    force[structure.masters["b3"][1]] = 1.0
    held = np.diag(free.stiffness)[24:]
    middles = (free.frequencies_hz[6:30] + free.frequencies_hz[7:31]) / 2
    for frequency in middles[::6]:
        square = (2 * np.pi * frequency) ** 2
        full = spsolve((structure.stiffness - square * structure.mass).tocsc(), force)
        masters = full[free.held]
        modes = square * (free.mass[24:, :24] @ masters) / (held - square)
        plain = (free.expand(np.concatenate([masters, modes])) - full)[free.others]
        better = plain - square * (free.delayed @ masters)
        # What is left out responds as 1 / (1 - (f / f_c)^2); the correction takes the first term of it away.
        left = (frequency / free.cutoff_hz) ** 2
        assert np.linalg.norm(better) < 1.2 * left * np.linalg.norm(plain)


def test_sites_are_rows_of_the_whole(free):
    structure, params = small_structure(free=True), small_params()
    top = params.box.height_m - params.box.shaft_height_m
    places = [parse_site(f"top:0,{top},{params.box.width_m / 2}:y")]
    places += [SitePlace("skew", (params.box.length_m / 2, 0.0, 0.0), (0.6, 0.0, 0.8))]
    rng = np.random.default_rng(2)
    coordinates, motion = rng.normal(size=24 + MODES), rng.normal(size=24)
    whole = free.expand(coordinates)
    late = np.zeros(structure.size)
    late[free.others] = free.delayed @ motion
    sites = recover_sites(structure, free, places, params.mesh.plate_size_m)
    for place, site in zip(places, sites, strict=True):
        node, distance = structure.mesh.nearest(np.array(place.position_m))
        assert distance < params.mesh.plate_size_m
        moved = (structure.ties @ whole)[6 * node : 6 * node + 3] @ place.direction
        assert site.rows @ coordinates == pytest.approx(moved, rel=1e-9)
        moved = (structure.ties @ late)[6 * node : 6 * node + 3] @ place.direction
        assert site.correction @ motion == pytest.approx(moved, rel=1e-9)


def test_forces_at_bearings_move_everything_as_in_the_full_model(free):
    """With hysteretic damping (8 % of the stiffness), so that no frequency is too near to a resonance."""
    structure = small_structure(free=True)
    force = np.zeros(structure.size)
    force[structure.masters["b3"][1]] = 1.0
    for frequency in (40.0, 0.2 * free.valid_hz, 0.4 * free.valid_hz):
        square = (2 * np.pi * frequency) ** 2
        full = spsolve((structure.stiffness * (1 + 0.08j) - square * structure.mass).tocsc(), force)
        dynamic = free.stiffness * (1 + 0.08j) - square * free.mass
        moved = free.expand(np.linalg.solve(dynamic, free_force(free, force)))
        # Own frequencies off by 0.3 % move the response at resonance by 2 * 0.003 / 0.08.
        assert np.abs(moved - full).max() < 0.075 * np.abs(full).max()


def free_force(reduction, force):
    return np.concatenate([force[reduction.held], np.zeros(len(reduction.mass) - 24)])


def test_too_few_modes_for_a_band_are_told_with_about_how_many_it_takes():
    with pytest.raises(
        InputError, match=r"modes: got 10 \(valid up to \d+ Hz\), expected about \d+ for 4000 Hz"
    ):
        reduce_casing(small_params(), modes=10, band_hz=4000.0)


def test_misplaced_sensors_are_told_before_the_work():
    steps = []
    with pytest.raises(InputError, match=r"sensor far: got .* mm off the nearest node"):
        reduce_casing(
            small_params(), extra_sites=[parse_site("far:9,9,9:y")], tell=lambda step, _: steps.append(step)
        )
    assert steps == ["mesh and matrices"]


@pytest.mark.parametrize(
    "text", ["top", "top:1,2:y", "top:1,2,3:q", "top:1,2,nan:y", ":1,2,3:y", "t:0,0,0:0,0,0"]
)
def test_sites_that_make_no_sense_are_refused(text):
    with pytest.raises(InputError, match="sensor"):
        parse_site(text)


def test_directions_are_unit_vectors():
    assert parse_site("a:0,0,0:-x").direction == (-1.0, 0.0, 0.0)
    assert parse_site("a:0,0,0:3,0,4").direction == pytest.approx((0.6, 0.0, 0.8))


def test_signs_of_modes_do_not_hang_on_the_solver(mounted):
    shapes = mounted.shapes
    assert (signs(shapes) == 1).all()
    assert (signs(-shapes) == -1).all()


def test_a_reduced_casing_survives_its_file(mounted, tmp_path):
    structure, params = small_structure(free=False), small_params()
    casing = finish(structure, mounted, (), params.damping_ratio, None, {})
    save_reduced(casing, tmp_path / "small.npz")
    again = load_reduced(tmp_path / "small.npz")
    speeds, _ = again.own_modes
    assert np.allclose(speeds / (2 * np.pi), mounted.frequencies_hz, rtol=1e-9)
    assert again.provenance["cutoff_hz"] == mounted.cutoff_hz
