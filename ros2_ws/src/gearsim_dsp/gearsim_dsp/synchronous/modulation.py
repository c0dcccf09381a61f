"""Amplitude and phase modulation of a mesh harmonic over the turn of a gear.

A sound mesh puts a line at each harmonic h of its order z; a tooth that is softer or out of place changes
its amplitude and phase while it is in contact. The lines around the harmonic alone, taken on one side of the
spectrum, are an analytic signal::

    u(phi) = sum_{|k| <= K} 2 X[h z + k] exp(j 2 pi (h z + k) phi)
           = A (1 + a(phi)) exp(j (2 pi h z phi + p_0 + p(phi)))

(McFadden, J. Vib. Acoust. Stress Reliab. Des. 108 (1986) 165-170; Randall, J. Mech. Des. 104 (1982) 259-267).
A drop of a(phi) with a swing of p(phi) at one angle is a cracked tooth; a wave once per turn is run-out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft

from gearsim_dsp.synchronous.tsa import Average
from gearsim_io.errors import InputError

__all__ = ["MeshModulation", "demodulate_mesh", "mesh_envelope"]


@dataclass(frozen=True, slots=True, eq=False)
class MeshModulation:
    """Modulation of one mesh harmonic over one period of an average.

    Parameters
    ----------
    mean_amplitude : float
        A, peak value in the signal's unit.
    amplitude : ndarray of float64, shape (samples,)
        a, relative change of the amplitude about its mean over the period.
    phase_rad : ndarray of float64, shape (samples,)
        p, about its mean; the mesh's angle is this over `harmonic`.
    harmonic : int
    sideband_count : int
        Lines on either side of the harmonic that went in.
    """

    mean_amplitude: float
    amplitude: NDArray[np.float64]
    phase_rad: NDArray[np.float64]
    harmonic: int
    sideband_count: int


def demodulate_mesh(
    average: Average, mesh_order: float, harmonic: int = 1, sideband_count: int | None = None
) -> MeshModulation:
    """Amplitude and phase of a mesh harmonic over the turn.

    Parameters
    ----------
    average : Average
        Of the gear's shaft.
    mesh_order : float
        Teeth of the gear.
    harmonic : int
        The strongest one is the best choice (McFadden 1986).
    sideband_count : int, optional
        Lines kept on either side, by default as many as fit before the next harmonic's begin.

    Raises
    ------
    InputError
        When the lines asked for overlap the next harmonic's or leave the spectrum, or the sidebands are so
        strong that the amplitude passes zero, where there is no phase.
    """
    lines, centre, half = _band(average, mesh_order, harmonic, sideband_count)
    # Shifted to zero: the carrier wave is gone, what is left is its complex amplitude.
    amplitude = np.asarray(sfft.ifft(np.roll(lines, -centre)) * 2.0)
    magnitude = np.abs(amplitude)
    mean = float(np.mean(magnitude))
    phase = np.unwrap(np.angle(np.append(amplitude, amplitude[0])))
    tiny = 1e-9 * max(mean, np.finfo(np.float64).tiny)
    if not (float(magnitude.min()) > tiny and abs(phase[-1] - phase[0]) < math.pi):
        expected = f"harmonic {harmonic} of mesh order {mesh_order:g} stronger than its sidebands"
        raise InputError(
            "demodulate_mesh", "average", "a phase that does not close over the period", expected
        )
    phase = phase[:-1]
    step = average.turns_per_period
    return MeshModulation(mean, magnitude / mean - 1.0, phase - np.mean(phase), harmonic, half // step)


def mesh_envelope(
    average: Average, mesh_order: float, harmonic: int = 1, sideband_count: int | None = None
) -> NDArray[np.float64]:
    """Magnitude of the analytic signal around a mesh harmonic, in the signal's unit (for NB4)."""
    lines, _, _ = _band(average, mesh_order, harmonic, sideband_count)
    return np.asarray(np.abs(sfft.ifft(lines)) * 2.0)


def _band(
    average: Average, mesh_order: float, harmonic: int, sideband_count: int | None
) -> tuple[NDArray[np.complex128], int, int]:
    """The two-sided spectrum with only the lines around the harmonic, its index, and lines on either side."""
    if harmonic < 1:
        raise InputError("demodulate_mesh", "harmonic", harmonic, "1 or more")
    mesh = average.line(mesh_order)
    centre = average.line(harmonic * mesh_order)
    step = average.turns_per_period
    # Up to half-way to the neighbours: what belongs to the next harmonic stays out.
    most = math.ceil(mesh / 2) - 1
    half = most if sideband_count is None else sideband_count * step
    if not 1 <= half <= most:
        raise InputError("demodulate_mesh", "sideband_count", sideband_count, f"1 to {most // step}")
    size = average.values.size
    if centre + half >= size / 2:
        top = (centre + half) / step
        expected = f"more than {2 * top:g} samples per turn for harmonic {harmonic}"
        raise InputError(
            "demodulate_mesh", "average", f"{average.samples_per_turn} samples per turn", expected
        )
    lines = np.zeros(size, dtype=np.complex128)
    inside = slice(centre - half, centre + half + 1)
    lines[inside] = sfft.rfft(average.values)[inside]
    return lines, centre, half
