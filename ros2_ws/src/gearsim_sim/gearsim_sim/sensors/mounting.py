"""Mounting resonance: the sensor on its stud, wax, magnet or held by hand is a mass on a spring.

Relative to the motion under it the sensor reads w0^2 / (s^2 + w0 s / Q + w0^2) (Serridge and Licht 1987,
section 2: an accelerometer below, at and above its mounted resonance): too much towards the resonance,
Q-fold at it, less and less above.

Made digital by keeping the poles (z = exp(s T)) and fitting the numerator to the exact magnitude up to 0.45
of the rate. The magnitude is then right within 0.2 % there for resonances below 0.49 of the rate, 0.6 % above
0.65 and 2 % between; a resonance above half the rate acts by what it lifts below.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import RootModel

from gearsim_io.quantities import Si, Strict, load_yaml
from gearsim_sim.sensors.biquad import Section, Sections

if TYPE_CHECKING:
    from gearsim_sim.sensors.rows import Row

Array = NDArray[np.float64]
MOUNTINGS = Path(__file__).parent / "mountings.yaml"
_DEGREE = 4  # of the numerator
_EXTRA_POLE = 0.6  # two poles at z = -0.6 take up what folds in near half the rate
_FIT_TO = 0.45  # of the rate
_NO_POLES = 0.57  # a resonance above that part of the rate needs no poles of its own
_LAST_ANGLE = 0.499  # of a turn: poles of a resonance beyond half the rate


class Mounting(Strict):
    """Mounted resonance: frequency, and amplification there (Q)."""

    resonance: Annotated[float, Si("Hz", ge=10, le=1e6)]
    """Frequency of the sensor on its mounting."""
    q: Annotated[float, Si("", ge=0.5, le=200)]
    """Amplification at the resonance."""
    description: str = ""
    """One line for people."""


class _Mountings(RootModel[dict[str, Mounting]]):
    pass


@cache
def mountings() -> dict[str, Mounting]:
    """The shipped ways of mounting by name."""
    return load_yaml(_Mountings, MOUNTINGS, require_source=True).root


def magnitude(frequency_hz: Array, resonance_hz: float, q: float) -> Array:
    """What the sensor reads over what moves under it."""
    ratio = frequency_hz / resonance_hz
    return np.asarray(1.0 / np.sqrt((1.0 - ratio**2) ** 2 + (ratio / q) ** 2))


@cache
def resonance(resonance_hz: float, q: float, sample_rate_hz: float) -> tuple[Section, Section]:
    """Two sections (b0, b1, b2, a1, a2), a0 = 1, with that magnitude up to 0.45 of the sample rate."""
    own = _poles(resonance_hz / sample_rate_hz, q)
    extra = (2 * _EXTRA_POLE, _EXTRA_POLE**2)
    zeros = _zeros(resonance_hz / sample_rate_hz, q, own, extra)
    # The far pair of zeros goes with the resonance, so that no section lifts the signal more than it must.
    sections = []
    for (a1, a2), pair in zip((own, extra), (zeros[2:], zeros[:2]), strict=True):
        b = np.real(np.poly(pair))
        b *= (1.0 + a1 + a2) / b.sum()
        sections.append((float(b[0]), float(b[1]), float(b[2]), a1, a2))
    return sections[0], sections[1]


def _poles(relative: float, q: float) -> tuple[float, float]:
    """a1, a2 of the resonance at `relative` of the rate."""
    if relative >= _NO_POLES:
        return 0.0, 0.0
    turn, half_width = 2 * math.pi * relative, math.pi * relative / q
    damped = cmath.sqrt(turn**2 - half_width**2)
    if damped.imag == 0:
        damped = complex(min(damped.real, 2 * math.pi * _LAST_ANGLE))
    a1 = -2.0 * math.exp(-half_width) * cmath.cos(damped).real
    return a1, math.exp(-2.0 * half_width)


def _zeros(relative: float, q: float, own: tuple[float, float], extra: tuple[float, float]) -> Array:
    """The four zeros, nearest to z = -1 first.

    |numerator|^2 is a polynomial of degree 4 in sin^2(w / 2). Written in Bernstein polynomials with
    coefficients that are not negative it has no negative value, so it can be factored.
    """
    from scipy.optimize import nnls  # here, because it takes long to load

    frequency = np.linspace(0.0, _FIT_TO, 400)
    wanted = magnitude(frequency, relative, q) ** 2
    for a1, a2 in (own, extra):
        z = np.exp(-2j * np.pi * frequency)
        wanted *= np.abs(1 + a1 * z + a2 * z * z) ** 2
    s = np.sin(np.pi * frequency) ** 2
    basis = [math.comb(_DEGREE, k) * s**k * (1 - s) ** (_DEGREE - k) for k in range(_DEGREE + 1)]
    weights, _ = nnls(np.stack(basis, axis=1) / wanted[:, None], np.ones_like(wanted))
    total = np.zeros(_DEGREE + 1)
    for k, weight in enumerate(weights):
        term = np.concatenate([np.zeros(k), [weight * math.comb(_DEGREE, k)]])  # times s^k
        for _ in range(_DEGREE - k):
            term = np.convolve(term, [1.0, -1.0])  # times 1 - s
        total += term
    roots = []
    for root in np.roots(total[::-1]):
        middle = complex(1.0 - 2.0 * root)  # z + 1 / z = 2 - 4 s
        if abs(middle.imag) < 1e-9 * abs(middle):  # real, and not between -1 and 1 but for rounding
            middle = complex(math.copysign(max(abs(middle.real), 1.0), middle.real))
        z0 = middle + cmath.sqrt(middle * middle - 1.0)
        roots.append(z0 if abs(z0) <= 1.0 else 1.0 / z0)
    roots += [0.0] * (_DEGREE - len(roots))
    return _in_pairs(np.array(roots))


def _in_pairs(roots: Array) -> Array:
    """Conjugate roots side by side, real ones in order, nearest to -1 first."""
    order = sorted(roots, key=lambda z: (round(abs(z + 1), 9), z.imag))
    real = [z for z in order if abs(z.imag) < 1e-9]
    upper = [z for z in order if z.imag >= 1e-9]
    pairs = [(z, z.conjugate()) for z in upper]
    pairs += [(real[k], real[k + 1]) for k in range(0, len(real) - 1, 2)]
    pairs.sort(key=lambda pair: abs(pair[0] + 1) + abs(pair[1] + 1))
    return np.array([z for pair in pairs for z in pair])


class MountingResonance:
    """The mounted resonance of every channel that has one."""

    def __init__(self, rows: Sequence[Row], sample_rate_hz: float) -> None:
        self._sections = Sections(
            [
                (channel, section)
                for channel, row in enumerate(rows)
                if row.mounting is not None
                for section in resonance(row.mounting.resonance, row.mounting.q, sample_rate_hz)
            ]
        )

    @property
    def active(self) -> bool:
        """False if no channel has a mounting resonance."""
        return len(self._sections) > 0

    def apply(self, block: NDArray[np.float64], first_sample: int) -> None:  # noqa: ARG002
        """Filter `block` (channels, samples), which continues the block before."""
        self._sections.apply(block)
