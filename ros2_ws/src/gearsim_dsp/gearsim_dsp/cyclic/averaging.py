"""Cyclic coherence averaged over windows: long records in the memory of one window."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft

from gearsim_dsp.cyclic.coherence import CoherenceMap
from gearsim_dsp.cyclic.correlation import cyclic_spectrum
from gearsim_dsp.noise_floor import effective_averages
from gearsim_dsp.speed import Phase
from gearsim_io.errors import InputError

__all__ = ["averaged_coherence"]


def averaged_coherence(
    samples: NDArray[np.float32] | NDArray[np.float64],
    sample_rate_hz: float,
    resolution_hz: float,
    highest_alpha: float,
    window_s: float,
    phase: Phase | None = None,
) -> CoherenceMap:
    """Mean squared coherence of windows that overlap by half.

    One long window resolves cyclic frequencies finely and says most of a period; many windows cost no more
    memory than one, however long the record.

    Parameters
    ----------
    samples, sample_rate_hz, resolution_hz, highest_alpha, phase
        As in `cyclic_spectrum`. `samples` may be a memory map: one window is held at a time.
    window_s : float
        At most the record's duration.

    Returns
    -------
    CoherenceMap
        `windows` is what the overlapping windows are worth.

    Raises
    ------
    InputError
        As `cyclic_spectrum` does for one window, and when the record is shorter than that.
    """
    length = round(window_s * sample_rate_hz) if np.isfinite(window_s) else 0
    if samples.ndim != 1 or not 0 < length <= samples.size:
        seconds = samples.size / sample_rate_hz
        raise InputError("averaged_coherence", "window_s", window_s, f"above 0 and at most {seconds:.4g} s")
    starts = np.arange(0, samples.size - length + 1, max(1, length // 2), dtype=np.int64)
    phases = [None if phase is None else _cut(phase, int(start), length) for start in starts]
    spans = [part.turns[-1] - part.turns[0] for part in phases if part is not None]
    order_step = 1.0 / sfft.next_fast_len(math.ceil(2 * max(spans))) if spans else None
    total: NDArray[np.floating] | None = None
    for start, part in zip(starts, phases, strict=True):
        spectrum = cyclic_spectrum(
            samples[start : start + length],
            sample_rate_hz,
            resolution_hz,
            highest_alpha,
            part,
            order_step=order_step,
        )
        one = spectrum.coherence_map()
        total = one.values if total is None else total + one.values
    assert total is not None
    unit: Literal["Hz", "order"] = one.alpha_unit
    return CoherenceMap(
        total / total.dtype.type(starts.size),
        one.resolution_hz,
        one.alpha_step,
        unit,
        one.averages,
        one.first_bin,
        effective_averages(starts, length),
    )


def _cut(phase: Phase, start: int, length: int) -> Phase:
    """The angle over a window, with moments at its first and last sample."""
    ends = np.array([start, start + length - 1.0])
    inside = (phase.samples > ends[0]) & (phase.samples < ends[1])
    at = np.concatenate([ends[:1], phase.samples[inside], ends[1:]])
    if phase.samples[0] > ends[0] + 0.5 or phase.samples[-1] < ends[1] - 0.5:
        covered = f"samples {phase.samples[0]:.1f} to {phase.samples[-1]:.1f}"
        raise InputError("averaged_coherence", "phase", covered, "the angle over all samples")
    return Phase(at - start, np.interp(at, phase.samples, phase.turns))
