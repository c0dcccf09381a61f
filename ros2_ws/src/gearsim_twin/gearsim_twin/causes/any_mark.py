"""What stands still on the carrier, with its angle from a mark of which nobody knows where it stands.

Drawn errors of planetary gears leave no phases to lay a record over the model by, and a tacho's mark may be
anywhere on its shaft. A mark that is late by an angle turns line k of every channel by k times as much; so
the angle is looked for at which an answer explains most of what deviates. Planets are alike then: on a
carrier that stands a third of a turn further the next of three is in the place of the first, and only
sensors that turn with it know.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import fft as sfft

from gearsim_twin.causes.turn_lines import Complex, Deviation

__all__ = ["AtMark", "at_any_mark"]

_PER_LINE = 8  # angles per line that is looked at: a sixteenth of the highest one's turn off at most
# Of chi^2: the best of n angles by chance has 2 ln n more than one, of a hundred times as many 9 more.
_MORE_LOOKS = 9.0


@dataclass(frozen=True, slots=True, eq=False)
class AtMark:
    """An answer at its best angle: its size, what that takes of the weighted squares, and its lines there."""

    amplitude: float
    drop: float
    turned: Complex


def at_any_mark(own: Deviation, answer: Complex, signed: bool) -> AtMark | None:
    """The size and the angle of the mark at which an answer explains most; None where none does.

    Parameters
    ----------
    own : Deviation
    answer : ndarray of complex128, shape (channels, lines)
        What the effect adds at a unit size, by the model's mark.
    signed : bool
        Whether the opposite effect exists.
    """
    weight = np.where(np.isfinite(own.variance), 1.0 / own.variance, 0.0)
    norm = float(np.sum(np.abs(answer) ** 2 * weight))
    if norm <= 0:
        return None
    product = np.sum(np.conj(answer) * own.values * weight, axis=0)
    count = int(sfft.next_fast_len(_PER_LINE * product.size))
    corr = np.real(sfft.ifft(product, count)) * count
    at = int(np.argmax(np.abs(corr) if signed else corr))
    amplitude = float(corr[at]) / norm
    drop = amplitude**2 * norm - _MORE_LOOKS
    if drop <= 0 or (amplitude < 0 and not signed):
        return None
    turned = amplitude * answer * np.exp(-2j * np.pi * np.arange(product.size) * at / count)
    return AtMark(amplitude, drop, turned)
