"""The checks themselves: pairs with the modal test, differences of reductions, a deck for other programs."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from small_casing import small_params, small_structure

from gearsim_sim.model.casing.build import reduce_casing
from gearsim_sim.model.casing.checks import (
    MODES,
    REFERENCE,
    casing_checks,
    element_checks,
    modal_test_check,
    reference_check,
    rigid_checks,
    ships,
)
from gearsim_sim.model.casing.compare import SAME, difference, site_receptance
from gearsim_sim.model.casing.export import write_deck_of
from gearsim_sim.model.casing.measured import TABLE_3_1, pair_in_order
from gearsim_sim.model.casing.nastran import read_frequencies_hz
from gearsim_sim.model.casing.params import load_casing


def test_pairs_keep_their_order_and_find_what_was_measured():
    measured, numbers = (np.array(column, dtype=float) for column in zip(*TABLE_3_1, strict=True))
    rng = np.random.default_rng(4)
    model = np.interp(np.arange(1, 41), numbers, measured)
    pairs = pair_in_order(model)
    assert np.array_equal(pairs.modes, numbers)
    assert np.abs(pairs.deviations).max() < 1e-12
    for _ in range(20):
        model = np.sort(model * (1 + rng.normal(0, 0.03, 40)))
        pairs = pair_in_order(model)
        assert (np.diff(pairs.modes) > 0).all()
        assert pairs.modes[0] == 1
        assert np.abs(pairs.modes - numbers).max() <= 2
        # No single pair can be bettered between its neighbours.
        price = 0.01 * (pairs.modes - numbers)
        cost = np.sum(pairs.deviations**2 + price**2)
        straight = np.sum((model[numbers.astype(int) - 1] / measured - 1) ** 2)
        assert cost <= straight + 1e-12


def test_the_same_casing_made_twice_is_the_same_and_another_is_not():
    params = small_params()
    first, again = (reduce_casing(params, modes=15) for _ in range(2))
    assert difference(first, again) < SAME
    walls = {"wall_thickness_m": params.box.wall_thickness_m * 1.001}
    thicker = params.model_copy(update={"box": params.box.model_copy(update=walls)})
    assert difference(first, reduce_casing(thicker, modes=15)) > 100 * SAME
    assert difference(first, reduce_casing(params, modes=16)) == float("inf")


def test_signs_of_modes_make_no_difference():
    casing = reduce_casing(small_params(), modes=15)
    turn = np.ones(casing.size)
    turn[24::2] = -1
    turned = dataclasses.replace(
        casing,
        mass=casing.mass * turn[:, None] * turn,
        stiffness=casing.stiffness * turn[:, None] * turn,
        damping=casing.damping * turn[:, None] * turn,
        sites=tuple(dataclasses.replace(site, rows=site.rows * turn) for site in casing.sites),
    )
    assert difference(casing, turned) < 1e-9
    assert site_receptance(dataclasses.replace(casing, sites=()), 100.0).shape == (24, 24)


def test_elements_pass_their_checks():
    found = list(element_checks())
    assert len(found) == 4
    assert all(check.met for check in found), found


def test_a_casing_with_a_wrong_mass_fails_its_check():
    params = small_params()
    rings = params.rings.model_copy(update={"thickness_m": params.rings.thickness_m * 1.1})
    other = params.model_copy(update={"rings": rings})
    checks = {check.name: check for check in rigid_checks(small_structure(free=True), other)}
    assert checks["rigid-body forces"].met
    assert not checks["mass"].met


def test_a_coarse_casing_passes_what_does_not_hang_on_the_mesh():
    params = small_params().model_copy(update={"name": "coarse"})
    steps = []
    found = {check.name: check for check in casing_checks(params, finer=False, tell=steps.append)}
    assert found["rigid-body modes beyond or short of six"].met
    reductions = [check for name, check in found.items() if name.startswith("reduction")]
    assert len(reductions) == 3
    assert all(check.met for check in reductions), reductions
    assert any(str(MODES) in step for step in steps)


def test_descriptions_that_ship_are_known_and_those_changed_are_not():
    for name in ("unsw_casing", "unsw_casing_updated"):
        params = load_casing(name)
        assert ships(params)
        assert not ships(params.model_copy(update={"damping_ratio": 0.05}))
    assert not ships(small_params().model_copy(update={"name": "coarse"}))


def test_the_modal_test_asks_more_of_an_updated_casing():
    measured, numbers = (np.array(column, dtype=float) for column in zip(*TABLE_3_1, strict=True))
    model = 1.02 * np.interp(np.arange(1, 41), numbers, measured)
    assert modal_test_check(model, updated=False).met
    assert not modal_test_check(model, updated=True).met


def test_one_mode_too_far_from_the_other_programs_is_enough_to_fail():
    frequencies = np.loadtxt(REFERENCE, delimiter=",", comments="#")[:, 1]
    assert len(frequencies) == MODES
    assert (np.diff(frequencies) > 0).all()
    assert reference_check(frequencies * 1.009).met
    frequencies[70] *= 0.98
    assert not reference_check(frequencies).met


def test_a_deck_holds_the_whole_mesh(tmp_path):
    structure = small_structure(free=False)
    mesh = structure.mesh
    text = write_deck_of(structure, small_params(), tmp_path / "c.bdf").read_text()
    lines = text.splitlines()
    assert max(map(len, lines)) <= 72 + 8
    heads = [line[:8].strip() for line in lines]
    assert heads.count("GRID*") == len(mesh.nodes_m)
    assert heads.count("RBE2*") == len(mesh.rigids)
    assert heads.count("RBE3*") == len(mesh.averages)
    assert heads.count("CELAS2*") == 3 * sum(len(pad.nodes) for pad in mesh.pads)
    from pyyeti.nastran import bulk

    grids = bulk.rdgrids(str(tmp_path / "c.bdf"))
    assert np.allclose(grids[np.argsort(grids[:, 0]), 2:5], mesh.nodes_m, atol=1e-9)


def test_frequencies_are_read_from_another_programs_output(tmp_path):
    (tmp_path / "x.F06").write_text(
        "  nonsense 1 2 3 4 5\n          R E A L   E I G E N V A L U E S\n MODE EXTRACTION\n\n"
        "   1   1   1.0E+00   1.0E+00   1.591549E-01   1.0   1.0\n"
        "   2   2   4.0E+00   2.0E+00   3.183099E-01   1.0   4.0\n\n   7   7   1.0  1.0  9.0 1 1\n"
    )
    assert read_frequencies_hz(tmp_path / "x.F06") == pytest.approx([0.1591549, 0.3183099])
