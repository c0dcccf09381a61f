"""The 18-DOF planetary insert once more, block by block from thesis (7.18) to (7.34), corrected.

Shares nothing with gearsim_sim: numbers are typed in again, each 3 x 3 block is written out as Appendix
C.2 has it, with its errata mended. Order of unknowns: x, y, theta of carrier, ring, sun, planets.
`damp` and `inertia` choose how Tables C.3 and C.4 are read.
"""

import numpy as np

ALPHA = np.radians(20)
RS, RR, RP, RC = 0.040 * np.cos(ALPHA), 0.080 * np.cos(ALPHA), 0.020 * np.cos(ALPHA), 0.060
MC, JC, MS, JS, MR, MP, JP = 1.978001, 0.004544, 0.638885, 0.000592, 2.239868, 0.128018, 0.000034
KM, CM, KP, CP = 3e8, 620.0, 1.2e8, 425.0
KBR, KBRT, KBS, CBS, KSC = 1e9, 5.65e6, 1e7, 5.235e3, 1e9
PSI = 2 * np.pi * np.arange(3) / 3
# Table 7.6, in the thesis's scale; its zeros are printed as 1e-14.
TABLE_7_6 = np.array(
    [
        *(0, 0, -5.542051, 0, 0, 0, 0, 0, -16.62615),
        *(0, -0.332523, 16.626152, 0.2879734, 0.1662615, 16.626152, -0.287973, 0.1662615, 16.626152),
    ]
)
READING = {"ring_inertia": 0.0194, "ring_damping": 4733.0, "ring_torsional_damping": 33.1}
PRINTED = {"ring_inertia": 0.57, "ring_damping": 1.695e5, "ring_torsional_damping": 0.0}


def mesh_blocks(psi, rj, rp, sign):
    """Blocks of gear and planet over k, for (7.24): sign +1 sun, -1 ring; psi is psi_ji."""
    s, c = np.sin(psi), np.cos(psi)
    own = np.array([[s * s, -c * s, -rj * s], [-s * c, c * c, rj * c], [-rj * s, rj * c, rj**2]])
    cross = np.array(
        [[-s * s, c * s, -sign * rp * s], [s * c, -c * c, sign * rp * c], [rj * s, -rj * c, sign * rj * rp]]
    )
    planet = np.array(
        [
            [s * s, -c * s, sign * rp * s],
            [-s * c, c * c, -sign * rp * c],
            [sign * rp * s, -sign * rp * c, rp**2],
        ]
    )
    return own, cross, planet


def carrier_blocks(psi, kx, ky):
    """(7.25) to (7.29), all with k or all with c."""
    s, c = np.sin(psi), np.cos(psi)
    own = np.array(
        [
            [kx, 0, -RC * kx * s],
            [0, ky, RC * ky * c],
            [-RC * kx * s, RC * ky * c, RC**2 * (kx * s**2 + ky * c**2)],
        ]
    )
    cross = np.array([[-kx, 0, 0], [0, -ky, 0], [RC * kx * s, -RC * ky * c, 0]])
    return own, cross, np.diag([kx, ky, 0.0])


def assembled(sun, ring, pin, support, psi=PSI):
    """Sum of all blocks for mesh values `sun`, `ring` (per planet), bearing value `pin`, supports (9,)."""
    n = len(psi)
    whole = np.zeros((9 + 3 * n, 9 + 3 * n))
    sun, ring = np.broadcast_to(sun, n), np.broadcast_to(ring, n)
    for i, angle in enumerate(psi):
        at = slice(9 + 3 * i, 12 + 3 * i)
        pairs = (
            (slice(6, 9), [sun[i] * b for b in mesh_blocks(angle - ALPHA, RS, RP, 1)]),
            (slice(3, 6), [ring[i] * b for b in mesh_blocks(angle + ALPHA, RR, RP, -1)]),
            (slice(0, 3), carrier_blocks(angle, pin, pin)),
        )
        for place, (own, cross, planet) in pairs:
            whole[place, place] += own
            whole[place, at] += cross
            whole[at, place] += cross.T
            whole[at, at] += planet
    whole[:9, :9] += np.diag(support)
    return whole


def matrices(*, ring_inertia, ring_damping, ring_torsional_damping, psi=PSI):
    """M, C, K with the stiff spring between carrier and sun."""
    mass = np.diag([MC, MC, JC, MR, MR, ring_inertia, MS, MS, JS, *[MP, MP, JP] * len(psi)])
    stiffness = assembled(KM, KM, KP, [0, 0, 0, KBR, KBR, KBRT, KBS, KBS, 0], psi)
    for axis in (0, 1):
        stiffness[np.ix_([axis, 6 + axis], [axis, 6 + axis])] += KSC * np.array([[1, -1], [-1, 1]])
    support = [0, 0, 0, ring_damping, ring_damping, ring_torsional_damping, CBS, CBS, 0]
    return mass, assembled(CM, CM, CP, support, psi), stiffness


def error_force(sun_error, ring_error, sun_rate, ring_rate, psi=PSI):
    """F_a of (7.36), the planet's rows with + R_p: sums over planets of errors (N,) and their rates."""
    force = np.zeros(9 + 3 * len(psi))
    for i, angle in enumerate(psi):
        s, r = angle - ALPHA, angle + ALPHA
        fs = KM * sun_error[i] + CM * sun_rate[i]
        fr = KM * ring_error[i] + CM * ring_rate[i]
        force[6:9] += fs * np.array([-np.sin(s), np.cos(s), RS])
        force[3:6] += fr * np.array([-np.sin(r), np.cos(r), RR])
        planet = fs * np.array([np.sin(s), -np.cos(s), RP]) + fr * np.array([np.sin(r), -np.cos(r), -RP])
        force[9 + 3 * i : 12 + 3 * i] += planet
    return force


def eigenvalues(mass, damping, stiffness):
    n = len(mass)
    inverse = np.linalg.inv(mass)
    lower = np.hstack([-inverse @ stiffness, -inverse @ damping])
    return np.linalg.eigvals(np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), lower]))


def asymmetry(matrix):
    """Largest asymmetric entry over the largest entry, for rows in SI."""
    return np.abs(matrix - matrix.T).max() / np.abs(matrix).max()


def printed_stiffness(change):
    """K of the oracle with the blocks of the pairs changed by `change(where, block) -> block`."""
    whole = np.zeros((18, 18))
    whole[:9, :9] += np.diag([0, 0, 0, KBR, KBR, KBRT, KBS, KBS, 0])
    for axis in (0, 1):
        whole[np.ix_([axis, 6 + axis], [axis, 6 + axis])] += KSC * np.array([[1, -1], [-1, 1]])
    for i, angle in enumerate(PSI):
        at = slice(9 + 3 * i, 12 + 3 * i)
        sun = [KM * b for b in mesh_blocks(angle - ALPHA, RS, RP, 1)]
        ring = [KM * b for b in mesh_blocks(angle + ALPHA, RR, RP, -1)]
        carrier = carrier_blocks(angle, KP, KP)
        for name, place, (own, cross, planet) in (
            ("s", slice(6, 9), sun), ("r", slice(3, 6), ring), ("c", slice(0, 3), carrier),
        ):  # fmt: skip
            whole[place, place] += change(f"{name}11", angle, own)
            whole[place, at] += change(f"{name}12", angle, cross)
            whole[at, place] += change(f"{name}21", angle, cross.T)
            whole[at, at] += change(f"{name}22", angle, planet)
    return whole
