"""Slip of the cage, and the play of the balls in its pockets.

Without slip the cage turns with the mean speed of both races. Oil drags at the balls, and what drives
them, traction in the load zone, grows with the load: the cage lags by a share of its speed that falls
with the load (Harris, Rolling Bearing Analysis, ch. 14; one to two per cent are usual, Randall and Antoni
2011). Here

    rate = (1 - s) kinematic rate,   s = s_0 / (1 + F / F_1)

with the radial force F on the bearing, averaged over time, and the force F_1 that halves the slip.

On top of that the cage runs now ahead, now behind, within the play that the load zone leaves it, and each
ball within its pocket. Both are angles that stay within given bounds: smooth random functions of the way the
cage has gone, not of time, that vary from knot to knot. Their phase does not walk away
from the mean; the lines of the bearing in the spectrum widen at high harmonics but keep their place. The
`walk` in addition lets the slip itself wander about its mean: then the phase walks without limit, as in
pseudo-cyclostationary models, and lines widen at every harmonic.

The random functions are drawn from a counter: the value at a knot is a hash of the function's key and the
number of the knot, and a quintic joins the knots, with continuous slope and curvature. So they never
repeat, need no memory, and are bounded exactly.
"""

from __future__ import annotations

import hashlib

_MASK = (1 << 64) - 1
_KEY_BITS = 52  # keys travel in tables of float64


def jitter_key(seed: int, name: str) -> int:
    """Key of a random function, a function of seed and name."""
    digest = hashlib.sha256(f"{seed} {name}".encode()).digest()
    return int.from_bytes(digest[:8], "little") >> (64 - _KEY_BITS)


def knot_value(key: int, knot: int) -> float:
    """Value of a random function at a knot, even in [-1, 1): splitmix64 of Steele et al. (2014)."""
    state = (key + (knot + 1) * 0x9E3779B97F4A7C15) & _MASK
    state = ((state ^ (state >> 30)) * 0xBF58476D1CE4E5B9) & _MASK
    state = ((state ^ (state >> 27)) * 0x94D049BB133111EB) & _MASK
    return ((state ^ (state >> 31)) >> 11) * 2.0**-52 - 1.0


def jitter(key: int, position: float, first_knot: int = 0) -> float:
    """A smooth random function of the position in knots, >= 0, within [-1, 1); position 0 is `first_knot`."""
    whole = int(position)
    u = position - whole
    knot = first_knot + whole
    rise = u * u * u * (10.0 - u * (15.0 - 6.0 * u))
    return knot_value(key, knot) * (1.0 - rise) + knot_value(key, knot + 1) * rise


def mean_slip(slip: float, load_n: float, halving_load_n: float) -> float:
    """Share of the kinematic speed that the cage lags by."""
    return slip / (1 + load_n / halving_load_n)
