"""Finite-element shafts: closed forms of beams and rods, the reduction, and the gearbox of 58 coordinates."""

import math

import numpy as np
import pytest
from scipy.linalg import eigh

from gearsim_io.errors import InputError
from gearsim_sim.integrate.modes import complex_modes
from gearsim_sim.model.beam import RoundBar, assembled, bending_element, nodes_between, torsion_element
from gearsim_sim.model.finite_gearbox import make_finite_gearbox
from gearsim_sim.model.finite_shaft import bending, modes_kept, torsion, wheel_disc, wheel_stiffness
from gearsim_sim.model.parallel_shaft import make_parallel_shaft
from gearsim_sim.params import load_parallel_params

BAR = RoundBar(0.024, 206e9, 0.3, 7850.0)
LENGTH = 0.3


@pytest.fixture(scope="module")
def params():
    return load_parallel_params().model_copy(update={"pedestals": False})


@pytest.fixture(scope="module")
def shafts(params):
    return params.model.finite_shafts


@pytest.fixture(scope="module")
def lumped(params):
    return make_parallel_shaft(params, 3)


@pytest.fixture(scope="module")
def finite(params):
    return make_finite_gearbox(params, 3)


@pytest.fixture(scope="module")
def components(lumped, shafts):
    found = []
    for wheel, shaft in zip(lumped.wheels, (shafts.input, shafts.output), strict=True):
        disc = wheel_disc(wheel, shafts)
        bent = bending(shaft, shafts, disc)
        found += [bent, bent, torsion(shaft, shafts, disc)]
    return found


def pinned_timoshenko_hz(n):
    """Of a pinned beam: sin(n pi z / L) in deflection and cos in slope solve the equations exactly."""
    k = n * math.pi / LENGTH
    bend, shear = BAR.youngs_modulus_pa * BAR.second_moment_m4, BAR.shear_stiffness_n
    mass = BAR.density_kg_per_m3 * BAR.area_m2
    turning = BAR.density_kg_per_m3 * BAR.second_moment_m4
    stiffness = np.array([[shear * k**2, -shear * k], [-shear * k, bend * k**2 + shear]])
    squares = eigh(stiffness, np.diag([mass, turning]), eigvals_only=True)
    return math.sqrt(squares[0]) / (2 * math.pi)


def test_a_pinned_beam_has_timoshenkos_frequencies():
    mass, stiffness = assembled([bending_element(BAR, LENGTH / 60)] * 60, 2)
    free = [i for i in range(122) if i not in (0, 120)]
    squares = eigh(stiffness[np.ix_(free, free)], mass[np.ix_(free, free)], eigvals_only=True)
    exact = [pinned_timoshenko_hz(n) for n in range(1, 6)]
    assert np.sqrt(squares[:5]) / (2 * math.pi) == pytest.approx(exact, rel=1e-3)
    # Euler's beam is 10 % higher in the fifth already: shear and rotary inertia are in it.
    euler = (5 * math.pi / LENGTH) ** 2 * math.sqrt(
        BAR.youngs_modulus_pa * BAR.second_moment_m4 / (BAR.density_kg_per_m3 * BAR.area_m2)
    )
    assert euler / (2 * math.pi) > 1.1 * exact[4]


def test_a_free_rod_twists_at_multiples_of_half_a_wave():
    mass, stiffness = assembled([torsion_element(BAR, LENGTH / 80)] * 80, 1)
    found = np.sqrt(np.maximum(eigh(stiffness, mass, eigvals_only=True), 0))[:4] / (2 * math.pi)
    speed = math.sqrt(BAR.shear_modulus_pa / BAR.density_kg_per_m3)
    assert found[0] < 0.1
    assert found[1:] == pytest.approx([n * speed / (2 * LENGTH) for n in (1, 2, 3)], rel=2e-3)


def test_a_beam_moves_and_turns_as_a_whole_without_force_and_has_its_mass():
    lengths, ends = nodes_between([0.1, 0.07, 0.13], 0.02)
    assert ends == [5, 9, 16]
    mass, stiffness = assembled([bending_element(BAR, one) for one in lengths], 2)
    z = np.concatenate([[0.0], np.cumsum(lengths)])
    lift, tilt = np.zeros((2, 34))
    lift[::2], tilt[::2], tilt[1::2] = 1.0, z, 1.0
    scale = np.abs(stiffness).max()
    assert np.abs(stiffness @ lift).max() < 1e-12 * scale
    assert np.abs(stiffness @ tilt).max() < 1e-12 * scale
    whole = BAR.density_kg_per_m3 * BAR.area_m2 * 0.3
    assert lift @ mass @ lift == pytest.approx(whole, rel=1e-12)
    assert lift @ mass @ tilt == pytest.approx(whole * 0.15, rel=1e-12)


def test_42_modes_with_16_masters_reach_8700_hz(components):
    """Thesis Table 4.1 and 4.4.2; the next one is far above, so that the cut is clean."""
    kept = modes_kept(components, 42)
    assert sum(kept) == 42
    assert kept[:3] == kept[3:]
    assert sum(len(one.masters) for one in components) == 16
    squares = np.sort(np.concatenate([one.held_squares()[0] for one in components]))
    highest, next_one = np.sqrt(squares[41:43]) / (2 * np.pi)
    assert highest == pytest.approx(8700, rel=0.01)
    assert next_one > 1.2 * highest


def test_elements_are_short_enough(shafts, lumped, components):
    """Halving them moves no held mode that is kept by more than 0.1 %."""
    finer = shafts.model_copy(update={"element_length_m": shafts.element_length_m / 2})
    disc = wheel_disc(lumped.wheels[0], finer)
    for own, part in zip(
        components[1:3], (bending(finer.input, finer, disc), torsion(finer.input, finer, disc)), strict=True
    ):
        kept = np.sqrt(own.held_squares()[0])
        kept = kept[kept < 2 * np.pi * 8800]
        assert kept == pytest.approx(np.sqrt(part.held_squares()[0])[: kept.size], rel=1e-3)


def test_reduction_keeps_statics_whole_motion_and_low_modes(components):
    for part, modes in zip(components[:3], (9, 9, 3), strict=True):
        own = part.reduced(modes)
        full = np.sqrt(np.maximum(eigh(part.stiffness, part.mass, eigvals_only=True), 0.0))
        rigid = 1 if part is components[2] else 2
        assert np.count_nonzero(own.omega == 0) == rigid
        assert own.omega[rigid : rigid + 4] == pytest.approx(full[rigid : rigid + 4], rel=2e-3)
        # Mass and whole motion: a unit acceleration pulls with the mass of all.
        whole = np.zeros(len(part.mass))
        whole[:: 1 if part is components[2] else 2] = 1.0
        assert own.weight @ own.weight == pytest.approx(whole @ part.mass @ whole, rel=1e-9)
        for row in own.rows.values():
            assert row @ own.weight == pytest.approx(1.0, rel=1e-9)


def test_the_wheel_is_as_stiff_against_its_bearings_as_the_lumped_one(lumped, shafts, params):
    """Thesis Table A.1: 7.42e7 N/m to each side; a simply supported beam with shear as closed form."""
    disc = wheel_disc(lumped.wheels[0], shafts)
    near, far = wheel_stiffness(shafts.input, shafts, disc)
    span = shafts.input.near_span_m + shafts.input.far_span_m
    bar = RoundBar(shafts.diameter_m, shafts.youngs_modulus_pa, shafts.poissons_ratio, 7850.0)
    give = span**3 / (48 * bar.youngs_modulus_pa * bar.second_moment_m4) + span / (4 * bar.shear_stiffness_n)
    assert near + far == pytest.approx(1 / give, rel=1e-6)
    assert near == pytest.approx(params.model.shafts.bending_stiffness_n_per_m, rel=0.01)
    assert far == pytest.approx(near, rel=1e-6)


def test_the_gearbox_has_58_coordinates_and_turns_freely(finite, lumped):
    system = finite.system
    assert len(system.dof_names) == 58
    assert np.array_equal(system.mass, np.eye(58))
    modes = complex_modes(system)  # refuses dampers or interfaces that act on the rigid rotation
    assert modes.rigid_modes.shape[1] == 1
    turning = modes.rigid_modes[:, 0] / np.linalg.norm(modes.rigid_modes)
    assert abs(turning @ finite.rigid) == pytest.approx(np.linalg.norm(finite.rigid), rel=1e-9)
    for part in finite.parts:
        system.part(part)  # refuses what joins both
    assert finite.inertia_kg_m2 == pytest.approx(lumped.inertia_kg_m2, rel=2e-3)
    assert finite.torque_ratios == pytest.approx(lumped.torque_ratios, rel=1e-9)
    for shaft, (_, twist) in finite.encoders.items():
        ratio = system.direction(twist) @ finite.rigid
        assert ratio == pytest.approx(1.0, rel=1e-9), shaft


def test_the_weight_is_that_of_shafts_wheels_couplings_and_rings(finite, lumped, shafts):
    total = 0.0
    for wheel, own in zip(lumped.wheels, (shafts.input, shafts.output), strict=True):
        length = own.coupling_overhang_m + own.near_span_m + own.far_span_m + own.encoder_overhang_m
        total += math.pi / 4 * shafts.diameter_m**2 * length * shafts.density_kg_per_m3
        total += wheel_disc(wheel, shafts).mass_kg + own.coupling_mass_kg + 2 * shafts.ring_mass_kg
    # Coordinates have unit mass: what gravity pulls at is the motion of all by 1 m.
    weight = finite.system.inputs[:, 2]
    assert weight @ weight == pytest.approx(total, rel=1e-6)
    inside = [finite.system.dof_names[i] for i in np.flatnonzero(weight)]
    assert all(name.startswith("y_") for name in inside)


def test_what_is_missing_or_too_much_is_said(params, shafts):
    model = params.model
    for change, field in (
        ({"finite_shafts": None}, "finite_shafts"),
        ({"teeth": None}, "teeth"),
        ({"finite_shafts": shafts.model_copy(update={"modes": 5000})}, "finite_shafts.modes"),
    ):
        spoilt = params.model_copy(update={"model": model.model_copy(update=change)})
        with pytest.raises(InputError) as caught:
            make_finite_gearbox(spoilt, 3)
        assert caught.value.field == field
