"""What a tacho's jitter leaves of the angle: smoothing that follows the shaft and not the jitter."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import make_smoothing_spline

from gearsim_dsp.speed import Phase
from gearsim_io.errors import InputError

__all__ = ["smoothed_phase"]

_FEWEST_PULSES = 12


def smoothed_phase(phase: Phase) -> Phase:
    """The angle with the jitter of its pulses taken out.

    Parameters
    ----------
    phase : Phase
        One knot for each pulse, mended (`speed.phase_from_pulses`), 12 or more.

    Returns
    -------
    Phase
        The same turns at smoothed moments; the same angle where smoothing would turn it back.

    Notes
    -----
    A cubic smoothing spline of the pulses' moments over the angle. Its stiffness minimises generalised
    cross-validation (Craven and Wahba, Numer. Math. 31 (1978) 377-403), which needs no knowledge of the
    jitter but that it is independent from pulse to pulse: errors of a disc's marks, which come again in
    each turn, are kept as if the shaft did them (see `encoder.line_errors`).
    """
    if phase.samples.size < _FEWEST_PULSES:
        expected = f"{_FEWEST_PULSES} pulses or more"
        raise InputError("smoothed_phase", "phase", f"{phase.samples.size} pulses", expected)
    # About the straight line: cross-validation of the whole would drown in rounding.
    span, first = phase.turns[-1] - phase.turns[0], phase.samples[0]
    even = first + (phase.turns - phase.turns[0]) * ((phase.samples[-1] - first) / span)
    at = (phase.turns - phase.turns[0]) * ((phase.turns.size - 1) / span)
    moments = even + make_smoothing_spline(at, phase.samples - even)(at)
    if np.any(np.diff(moments) <= 0):
        return phase
    return Phase(np.asarray(moments, dtype=np.float64), phase.turns)
