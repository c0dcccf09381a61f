"""The errata of thesis chapter 7 and appendix C, one by one.

Each test builds what is printed and shows that it cannot be meant; `docs/errata.md` lists them.
"""

import math

import numpy as np
import pytest
from oracles import plain_planetary as plain
from oracles.plain_planetary import PRINTED, READING, TABLE_7_6, asymmetry, eigenvalues, printed_stiffness

from gearsim_sim.model.planet_meshes import wheel_error
from gearsim_sim.params import load_planetary_params


def test_the_unchanged_blocks_are_the_oracle():
    _, _, stiffness = plain.matrices(**READING)
    unchanged = printed_stiffness(flipped_rows())
    assert np.abs(unchanged - stiffness).max() < 1e-15 * np.abs(stiffness).max()


def test_errata_k_r12_transposed():
    """The printed block is 36 % asymmetric and makes the machine grow by itself at 0.1 1/s."""

    def change(where, angle, block):
        if where != "r21":
            return block
        s, c = np.sin(angle + plain.ALPHA), np.cos(angle + plain.ALPHA)
        rp = plain.RP
        return plain.KM * np.array(
            [[-s * s, -c * s, -rp * s], [-s * c, c * c, rp * c], [-rp * s, rp * c, rp**2]]
        )

    printed = printed_stiffness(change)
    assert asymmetry(printed) == pytest.approx(0.36, abs=5e-3)
    mass, damping, _ = plain.matrices(**PRINTED)
    assert eigenvalues(mass, damping, printed).real.max() == pytest.approx(0.107, abs=2e-3)


def flipped_rows(*rows):
    """A change of sign of the gear's own equations in C.2."""

    def change(where, _angle, block):
        if where not in ("s11", "s12", "r11", "r12"):
            return block
        return np.diag([-1.0 if row in rows else 1.0 for row in range(3)]) @ block

    return change


def test_errata_c2_signs_of_y_and_theta():
    """With - in the equations of y and theta of sun and ring, action is not reaction."""
    assert asymmetry(printed_stiffness(flipped_rows())) < 1e-15
    for row in (1, 2):
        printed = printed_stiffness(flipped_rows(row))
        assert np.linalg.norm(printed - printed.T) / np.linalg.norm(printed) > 0.01
    y_and_theta = printed_stiffness(flipped_rows(1, 2))
    mass, damping, _ = plain.matrices(**READING)
    assert eigenvalues(mass, damping, y_and_theta).real.max() > 1000  # it flies apart


def test_errata_c2_sine_in_the_planets_y_equation():
    """sin psi_i where (7.29) has cos psi_i."""

    def change(where, angle, block):
        if where != "c21":
            return block
        block = block.copy()
        block[1, 2] = -plain.RC * plain.KP * np.sin(angle)
        return block

    printed = printed_stiffness(change)
    assert np.linalg.norm(printed - printed.T) / np.linalg.norm(printed) > 1e-3
    assert np.abs(printed @ TABLE_7_6).max() > 1e6  # the rigid mode would meet a force


def test_errata_c_c11_holds_stiffness():
    """K in two entries of a damping block: 1.2e8 beside 425 N s/m."""
    _, damping, _ = plain.matrices(**READING)
    printed = damping.copy()
    for angle in plain.PSI:
        printed[0, 2] -= plain.RC * (plain.KP - plain.CP) * np.sin(angle)
        printed[1, 2] += plain.RC * (plain.KP - plain.CP) * np.cos(angle)
    # Over three planets evenly spaced the two slips cancel; over any one they do not.
    one = damping.copy()
    one[1, 2] += plain.RC * (plain.KP - plain.CP)
    assert np.abs(printed - printed.T).max() < 1e-6
    assert asymmetry(one) > 0.99


def test_errata_sun_inertia_in_the_third_row():
    """m_s(3, 3) = m_s would make phi^T M phi 177 instead of 0.374."""
    mass, _, _ = plain.matrices(**READING)
    assert TABLE_7_6 @ mass @ TABLE_7_6 == pytest.approx(0.374, abs=5e-4)
    mass[8, 8] = plain.MS
    assert TABLE_7_6 @ mass @ TABLE_7_6 == pytest.approx(177, rel=5e-3)


def planet_rows(third_sun, third_ring, angle=0.0):
    s, r = angle - plain.ALPHA, angle + plain.ALPHA
    return (
        np.array([np.sin(s), -np.cos(s), third_sun]),
        np.array([np.sin(r), -np.cos(r), third_ring]),
    )


def test_errata_error_does_no_work_on_the_rigid_mode():
    """(7.38) and rows 12, 15, 18 of Table C.1: R_s, -R_r give 0.31 and -0.94 J per newton; R_p, -R_p none."""
    gears = (
        np.array([np.sin(plain.ALPHA), np.cos(plain.ALPHA), plain.RS]) @ TABLE_7_6[6:9],
        np.array([-np.sin(plain.ALPHA), np.cos(plain.ALPHA), plain.RR]) @ TABLE_7_6[3:6],
    )
    for thirds, work in (((plain.RP, -plain.RP), (0, 0)), ((plain.RS, -plain.RR), (0.3125, -0.9374))):
        rows = planet_rows(*thirds)
        got = [row @ TABLE_7_6[9:12] + gear for row, gear in zip(rows, gears, strict=True)]
        assert got == pytest.approx(work, abs=1e-4)


def test_errata_7_20_and_7_23_damping_like_stiffness():
    """Extra cos psi and a missing delta_j on the damping: power could come out of a damper."""

    def damping(cosine, delta):
        whole = np.zeros((6, 6))
        angle = np.radians(120) + plain.ALPHA
        own, cross, planet = mesh = plain.mesh_blocks(angle, plain.RR, plain.RP, -1)
        whole[:3, :3], whole[:3, 3:], whole[3:, :3], whole[3:, 3:] = own, cross, cross.T, planet
        assert len(mesh) == 3
        whole[2] *= np.cos(angle) if cosine else 1
        whole[5] *= -1 if delta else 1
        return plain.CM * whole

    right = damping(False, False)
    assert np.array_equal(right, right.T)
    for printed in (damping(True, False), damping(False, True)):
        power = np.linalg.eigvalsh((printed + printed.T) / 2)
        assert power[0] < -1e-5 * power[-1]
    assert np.linalg.eigvalsh(right)[0] > -1e-12 * plain.CM


def test_errata_7_24_displacement_of_the_gear():
    """With y_i, x_i (the planet's own) the mesh would not feel the gear move, which feels its force."""
    own, cross, planet = plain.mesh_blocks(0.3, plain.RS, plain.RP, 1)
    pair = np.block([[own, cross], [cross.T, planet]])
    force = np.array([-np.sin(0.3), np.cos(0.3), plain.RS, np.sin(0.3), -np.cos(0.3), plain.RP])
    felt = np.array([0, 0, plain.RS, 0, 0, plain.RP])  # (y_p - y_p) cos - (x_p - x_p) sin + rotations
    assert pair == pytest.approx(np.outer(force, force))
    printed = np.outer(force, felt)
    assert np.linalg.norm(printed - printed.T) > 0.01 * np.linalg.norm(printed)


def test_errata_7_25_radius_is_constant():
    """R_c with a dot is zero: then a damper would brake the free rotation of everything."""
    own, cross, planet = plain.carrier_blocks(0.0, plain.CP, plain.CP)
    motion = np.concatenate([TABLE_7_6[:3], TABLE_7_6[9:12]])
    right = np.block([[own, cross], [cross.T, planet]])
    assert np.abs(right @ motion).max() < 1e-4
    own, cross = own.copy(), cross.copy()
    own[:, 2] = own[2] = cross[2] = 0
    printed = np.block([[own, cross], [cross.T, planet]])
    assert motion @ printed @ motion > 10


def test_errata_7_34_six_blocks():
    """C_b of five blocks has 15 rows; the machine has 18."""
    assert sum([3] * 5) != plain.matrices(**READING)[0].shape[0] == sum([3] * 6)


def test_errata_7_15_sign():
    """- R_c sin(a) gives -5.06, + gives the printed 1.89; (7.14) is right: 1.64."""
    sun, ring, planet = (
        math.sqrt(tip**2 - base**2) for tip, base in ((42, 37.588), (78, 75.175), (22, 18.794))
    )
    across, pitch = 60 * math.sin(plain.ALPHA), 2 * math.pi * math.cos(plain.ALPHA)
    assert (sun + planet - across) / pitch == pytest.approx(1.64, abs=5e-3)
    assert (planet - ring + across) / pitch == pytest.approx(1.89, abs=5e-3)
    assert (planet - ring - across) / pitch == pytest.approx(-5.06, abs=5e-3)


def test_errata_table_7_6_sun_is_not_fixed():
    """Its own numbers: the sun turns three times as far as the carrier."""
    assert TABLE_7_6[8] / TABLE_7_6[2] == pytest.approx(3, rel=1e-6)


def test_errata_ring_inertia_and_damper():
    """What the printed J_r and c_br would mean, and that the readings chosen do not."""
    gyration = math.sqrt(0.57 / plain.MR)
    assert gyration == pytest.approx(0.50, abs=5e-3)  # metres, of a ring of 0.08 m
    assert 1.695e5 / (2 * math.sqrt(plain.KBR * plain.MR)) == pytest.approx(1.79, abs=5e-3)
    assert pytest.approx(0.03, rel=1e-9) == 1.695e5 / plain.KBRT
    assert math.sqrt(READING["ring_inertia"] / plain.MR) < 0.105
    assert READING["ring_damping"] / (2 * math.sqrt(plain.KBR * plain.MR)) == pytest.approx(0.05, rel=1e-3)
    torsional = 2 * math.sqrt(plain.KBRT * READING["ring_inertia"])
    assert READING["ring_torsional_damping"] / torsional == pytest.approx(0.05, rel=1e-2)


def test_errata_7_41_and_7_42_are_one_line():
    """Two definitions of the same error; (7.41) goes on as (7.43), 1 um / k, and is the one taken."""
    first = [1e-6 / k for k in (1, 2)]
    second = [4e-6 / 4 ** (k - 1) for k in (1, 2)]
    assert abs(second[0] / first[0] - 1) > 1  # not to be had at once
    params = load_planetary_params().with_physics(runout=False, tooth_surface=False)
    error = wheel_error(params, 20, seed=1, wheel=2)
    profile = np.isin(error.orders, 20 * np.arange(1, 11))
    amplitude = np.hypot(error.cosine, error.sine)[profile]
    assert amplitude == pytest.approx(1e-6 / np.arange(1, 11))
    runout = wheel_error(load_planetary_params(), 20, seed=1, wheel=2)
    assert np.hypot(runout.cosine, runout.sine)[:3] == pytest.approx(20e-6 / np.arange(1, 4) ** 2)
