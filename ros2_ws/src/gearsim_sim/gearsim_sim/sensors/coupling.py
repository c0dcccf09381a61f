"""The coupling between a shaft and its encoder: a torsional spring that lets the encoder swing.

Twist d of the encoder against the shaft: d'' + (w0 / Q) d' + w0^2 d = - (shaft's angular acceleration),
w0^2 = stiffness of the coupling over inertia of the encoder. The shaft's speed is a straight line between
samples, so each step is exact.
"""

from __future__ import annotations

import cmath
import math
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_io.quantities import Si, Strict
from gearsim_sim.sensors.biquad import Section, Sections

Array = NDArray[np.float64]


class Coupling(Strict):
    """Torsional resonance of an encoder on its coupling: frequency, and amplification there (Q)."""

    resonance: Annotated[float, Si("Hz", ge=1, le=1e6)]
    """Torsional resonance of the encoder on its coupling."""
    q: Annotated[float, Si("", ge=0.5, le=200)] = 20.0
    """Amplification at the resonance (assumed: 20)."""


def sections(resonance_hz: float, q: float, sample_rate_hz: float) -> tuple[Section, Section]:
    """Acceleration of the shaft to the twist, and to its rate, one sample later."""
    w, step = 2 * math.pi * resonance_hz, 1.0 / sample_rate_hz
    decay = 0.5 * w / q
    root = cmath.sqrt(decay * decay - w * w)  # e^{(-decay +- root) t}
    if abs(root) < 1e-9 * w:
        root = complex(1e-6 * w)  # critically damped: the two poles side by side
    fade, ch, sh = math.exp(-decay * step), cmath.cosh(root * step), cmath.sinh(root * step) / root
    free = np.array(  # d, d' one step later
        [
            [(ch + decay * sh).real, sh.real],
            [-w * w * sh.real, (ch - decay * sh).real],
        ]
    )
    free *= fade
    drive = np.array([-(1.0 - free[0, 0]) / w**2, -free[0, 1]])
    a1, a2 = -float(np.trace(free)), float(np.linalg.det(free))
    made = []
    for row in range(2):
        b0 = float(drive[row])
        made.append((b0, float(free[row] @ drive) + a1 * b0, 0.0, a1, a2))
    return made[0], made[1]


class SwingingEncoder:
    """Turns the angle of a shaft into that of the encoder, with state; it starts without a swing.

    Raises
    ------
    InputError
        A resonance above a quarter of the sample rate.
    """

    def __init__(self, name: str, coupling: Coupling, sample_rate_hz: float) -> None:
        if coupling.resonance > 0.25 * sample_rate_hz:
            expected = f"at most a quarter of the sample rate, {0.25 * sample_rate_hz:g} Hz"
            raise InputError(f"sensor {name}", "coupling.resonance", coupling.resonance, expected)
        twist, rate = sections(coupling.resonance, coupling.q, sample_rate_hz)
        self._rate_hz = sample_rate_hz
        self._sections = Sections([(0, twist), (1, rate)])
        self._last = np.zeros((2, 1))

    def swing(self, fraction: Array, turns_per_sample: Array) -> tuple[Array, Array]:
        """Angle and speed of the encoder; the first sample is the last one of the call before."""
        acceleration = np.diff(turns_per_sample) * self._rate_hz**2
        block = np.stack([acceleration, acceleration])
        self._sections.apply(block)
        motion = np.concatenate([self._last, block], axis=1)
        self._last = motion[:, -1:].copy()
        return fraction + motion[0], turns_per_sample + motion[1] / self._rate_hz
