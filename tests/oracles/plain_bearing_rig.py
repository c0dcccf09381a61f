"""The MFPT rig of 2, 4 and 5 degrees of freedom once more, flat and slow.

Shares nothing with gearsim_sim: numbers are typed in again, matrices are filled in row by row, forces are
written out. Order of unknowns: x_s, y_s, x_p, y_p, y_r as far as the model has them.
"""

import numpy as np

MS, CB, KB = 2.0, 1340.0, 9e7  # KB: linear part, taken off again in `forces`
MP, KP, CP = 5.0, 9.7e7, 2200.0
MR = 0.5
KR, CR = MR * (2 * np.pi * 4000.0) ** 2, 2 * 0.03 * MR * 2 * np.pi * 4000.0
LOAD, G = 270 * 0.45359237 * 9.80665, 9.80665
BALLS, D, PITCH = 8, 0.235 * 0.0254, 1.245 * 0.0254
CLEARANCE = 3e-6


def matrices(dofs):
    """M, C, K, interface directions W (dofs, 2) and standing forces (dofs,)."""
    m = np.array([MS, MS, MP, MP, MR])
    c, k, w = np.zeros((5, 5)), np.zeros((5, 5)), np.zeros((5, 2))
    k[0, [0, 2]], k[2, [0, 2]] = (KB, -KB), (-KB, KB + KP)
    k[1, [1, 3]], k[3, [1, 3, 4]], k[4, [3, 4]] = (KB, -KB), (-KB, KB + KP + KR, -KR), (-KR, KR)
    c[0, [0, 2]], c[2, [0, 2]] = (CB, -CB), (-CB, CB + CP)
    c[1, [1, 3]], c[3, [1, 3, 4]], c[4, [3, 4]] = (CB, -CB), (-CB, CB + CP + CR, -CR), (-CR, CR)
    w[[0, 2], 0], w[[1, 3], 1] = (1, -1), (1, -1)
    if dofs == 4:  # without the resonator the pedestal feels nothing of it
        k[3, 3], c[3, 3] = KB + KP, CB + CP
    standing = np.array([0.0, -LOAD - MS * G, 0.0, -MP * G, -MR * G])
    return np.diag(m[:dofs]), c[:dofs, :dofs], k[:dofs, :dofs], w[:dofs], standing[:dofs]


class Plain:
    """Right-hand side; `factor` of the balls, `spall` (inner, at [rad], width [m]) or None."""

    def __init__(self, dofs, *, factor, speed=25.0, turns=0.0, spall=None):
        self.dofs, self.factor, self.speed, self.turns0, self.spall = dofs, factor, speed, turns, spall
        self.m, self.c, self.k, self.w, self.standing = matrices(dofs)
        self.minv = 1 / np.diag(self.m)

    def forces(self, t, q):
        """What acts along W beyond the linear part of K."""
        shaft = 2 * np.pi * (self.turns0 + self.speed * t)
        phi = 0.5 * (1 - D / PITCH) * shaft + 2 * np.pi * np.arange(BALLS) / BALLS
        delta = q[0] * np.cos(phi) + q[1] * np.sin(phi) - CLEARANCE - self.drop(phi, shaft)
        f = self.factor * np.maximum(delta, 0) ** 1.5
        return KB * q - np.array([f @ np.cos(phi), f @ np.sin(phi)])

    def drop(self, phi, shaft):
        """Path of the balls' centres over the edges of the spall."""
        if self.spall is None:
            return np.zeros(BALLS)
        inner, at, width = self.spall
        radius = (PITCH - D) / 2 if inner else (PITCH + D) / 2
        off = np.angle(np.exp(1j * (phi - at - (shaft if inner else 0))))
        beta = np.maximum(width / 2 / radius - np.abs(off), 0)
        race = radius * (1 - np.cos(beta))
        return D / 2 - np.sqrt((D / 2) ** 2 - (radius * np.sin(beta)) ** 2) + (race if inner else -race)

    def acceleration(self, t, x, v):
        g = self.forces(t, self.w.T @ x)
        return self.minv * (self.standing + self.w @ g - self.c @ v - self.k @ x)

    def __call__(self, t, state):
        x, v = state[: self.dofs], state[self.dofs :]
        return np.concatenate([v, self.acceleration(t, x, v)])
