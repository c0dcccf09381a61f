"""The 34-DOF gearbox once more, flat and slow, from the equations of the thesis and its errata.

Shares nothing with gearsim_sim: numbers are typed in again, matrices are filled in row by row as in
Appendix A.2.1 (corrected), forces are written out. Order of unknowns: the 22 of Appendix A, then
x_p, y_p, y_r of pedestals 1 to 4. All rotations are counted from the rigid rotation.
"""

import numpy as np

KT1 = KT2 = 580.0
KTS, KS, KM, KEC = 4.241e4, 7.42e7, 3.178e8, 300.0
CT1, CT2, CM, CEC = 10.20, 12.96, 2594.0, 0.001
RP = RG = 0.0463
KB = 1.5e8  # linear part, taken off again in `forces`
CB = (1376.8, 877.6, 877.6, 1376.8)
MP, KP, CP, MR = 12.638, 1.51056e7, 2210.7, 1.0
KR, CR = MR * (2 * np.pi * 15e3) ** 2, 2 * 0.05 * MR * 2 * np.pi * 15e3
SHAFT_ROWS = (11, 15, 19, 21)  # 1-based row of x_s1 .. x_s4 in the thesis; y is the next one


def matrices():
    """M, C, K, interface directions W (34, 9) and weight per unit of gravity (34,)."""
    m = np.zeros(34)
    m[:10] = [0.3647, 9.998e-4, 1.766e-3, 6.36e-5, 2.525e-5, 1.766e-3, 6.36e-5, 9.998e-4, 2.525e-5, 0.5881]
    m[10:22] = np.repeat([1.2638, 2.1208, 0.5134, 2.1208, 0.5134, 1.2638], 2)
    m[22:] = np.tile([MP, MP, MR], 4)
    k = np.zeros((35, 35))  # rows and columns from 1, as in the thesis
    k[1, 1:3] = KT1, -KT1
    k[2, 1:4] = -KT1, KT1 + KTS, -KTS
    k[3, [2, 3, 4, 6, 14, 18]] = -KTS, 2 * KTS + KM * RP**2, -KTS, -KM * RP * RG, -KM * RP, KM * RP
    k[4, 3:6] = -KTS, KTS + KEC, -KEC
    k[5, [4, 5]] = -KEC, KEC
    k[6, [3, 6, 7, 8, 14, 18]] = -KM * RP * RG, 2 * KTS + KM * RG**2, -KTS, -KTS, KM * RG, -KM * RG
    k[7, [6, 7, 9]] = -KTS, KEC + KTS, -KEC
    k[8, [6, 8, 10]] = -KTS, KT2 + KTS, -KT2
    k[9, [7, 9]] = -KEC, KEC
    k[10, [8, 10]] = -KT2, KT2
    k[13, [13, 11, 15]] = k[17, [17, 19, 21]] = 2 * KS, -KS, -KS
    k[14, [3, 6, 12, 14, 16, 18]] = -KM * RP, KM * RG, -KS, KM + 2 * KS, -KS, -KM
    k[18, [3, 6, 14, 18, 20, 22]] = KM * RP, -KM * RG, -KM, KM + 2 * KS, -KS, -KS
    c = np.zeros((35, 35))
    c[1, 1:3], c[2, 1:3] = (CT1, -CT1), (-CT1, CT1)
    c[10, [8, 10]], c[8, [8, 10]] = (-CT2, CT2), (CT2, -CT2)
    c[4, 4:6], c[5, 4:6] = (CEC, -CEC), (-CEC, CEC)
    c[7, [7, 9]], c[9, [7, 9]] = (CEC, -CEC), (-CEC, CEC)
    line = np.zeros(35)
    line[[3, 6, 14, 18]] = RP, -RG, -1, 1
    c += CM * np.outer(line, line)
    w = np.zeros((35, 9))
    w[:, 8] = line
    for i, row in enumerate(SHAFT_ROWS):
        gear, pedestal = (13 if i < 2 else 17), 23 + 3 * i
        for axis in (0, 1):
            s, g, p = row + axis, gear + axis, pedestal + axis
            k[s, [s, g, p]] = KS + KB, -KS, -KB
            k[p, [p, s]] = KP + KB, -KB
            c[s, [s, p]], c[p, [p, s]] = (CB[i], -CB[i]), (CB[i] + CP, -CB[i])
            w[s, 2 * i + axis], w[p, 2 * i + axis] = 1, -1
        k[[pedestal + 1, pedestal + 1, pedestal + 2, pedestal + 2], [pedestal + 1, pedestal + 2] * 2] += (
            [KR, -KR, -KR, KR]
        )  # fmt: skip
        c[[pedestal + 1, pedestal + 1, pedestal + 2, pedestal + 2], [pedestal + 1, pedestal + 2] * 2] += (
            [CR, -CR, -CR, CR]
        )  # fmt: skip
    weight = np.where(
        np.isin(np.arange(34), [*range(11, 22, 2), *range(23, 34, 3), *range(24, 34, 3)]), -m, 0.0
    )
    return np.diag(m), c[1:, 1:], k[1:, 1:], w[1:], weight


class Plain:
    """Right-hand side; `factor`, `clearance` of the balls, Fourier series of mesh and errors, `spall`."""

    def __init__(self, *, factor, clearance, stiffness, errors, load=50.0, speed=10.0, turns=0.0, spall=None):
        self.m, self.c, self.k, self.w, self.weight = matrices()
        self.minv = 1 / np.diag(self.m)
        self.factor, self.clearance, self.spall = factor, clearance, spall
        self.stiffness, self.errors = (
            stiffness,
            errors,
        )  # (orders, cos, sin) per turn; mean of stiffness is KM
        self.speed, self.turns0 = speed, turns
        self.constant = 9.80665 * self.weight
        self.constant[0] += load
        self.constant[9] -= load

    def forces(self, t, q, rate):
        """What acts along W beyond the linear part of C and K, in the model's nine directions."""
        turns = self.turns0 + self.speed * t
        g = np.empty(9)
        for i in range(4):
            sense = -1 if i < 2 else 1  # input clockwise, output counter-clockwise
            cage = sense * 2 * np.pi * 0.5 * (1 - 7.12 / 38.5) * turns
            phi = cage + 2 * np.pi * np.concatenate([np.arange(12), np.arange(12) + 0.5]) / 12
            delta = q[2 * i] * np.cos(phi) + q[2 * i + 1] * np.sin(phi) - self.clearance
            if self.spall is not None and self.spall["bearing"] == i:
                delta[:12] -= self.drop(phi[:12], sense * 2 * np.pi * turns)
            f = self.factor * np.maximum(delta, 0) ** 1.5
            g[2 * i : 2 * i + 2] = KB * q[2 * i] - f @ np.cos(phi), KB * q[2 * i + 1] - f @ np.sin(phi)
        orders, cosine, sine = self.stiffness
        km = KM + np.cos(2 * np.pi * orders * turns) @ cosine + np.sin(2 * np.pi * orders * turns) @ sine
        orders, cosine, sine = self.errors
        c, s = np.cos(2 * np.pi * orders * turns), np.sin(2 * np.pi * orders * turns)
        error, slope = (
            c @ cosine + s @ sine,
            2 * np.pi * self.speed * (c @ (orders * sine) - s @ (orders * cosine)),
        )
        g[8] = -(km * (q[8] + error) + CM * (rate[8] + slope)) + KM * q[8] + CM * rate[8]
        return g

    def drop(self, phi, shaft):
        """Path of the ball's centre over the edges, for a spall on the race of radius `radius`."""
        inner, radius, width = self.spall["inner"], self.spall["radius"], self.spall["width"]
        off = phi - self.spall["at"] - (shaft if inner else 0)
        beta = np.maximum(width / 2 / radius - np.abs(np.angle(np.exp(1j * off))), 0)
        race = radius * (1 - np.cos(beta))
        return 3.56e-3 - np.sqrt(3.56e-3**2 - (radius * np.sin(beta)) ** 2) + (race if inner else -race)

    def acceleration(self, t, x, v):
        g = self.forces(t, self.w.T @ x, self.w.T @ v)
        return self.minv * (self.constant + self.w @ g - self.c @ v - self.k @ x)

    def __call__(self, t, state):
        return np.concatenate([state[34:], self.acceleration(t, state[:34], state[34:])])
