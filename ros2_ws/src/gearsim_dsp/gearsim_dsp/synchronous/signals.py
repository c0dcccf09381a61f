"""What is regular in a synchronous average and what is left: regular, residual and difference signal.

Sound gears fill the lines of the shaft's first harmonics, the mesh harmonics, and the sidebands next to
these. What a single tooth does is spread over all lines (Stewart 1977; definitions as in Lebold et al.,
Review of vibration analysis methods for gearbox diagnostics and prognostics, Proc. 54th MFPT (2000)
623-634)::

    regular     mean, shaft harmonics, mesh harmonics and their sidebands
    difference  average - regular                                          for FM4, M6A, M8A
    residual    as difference, with the sidebands left in                  for NA4
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft

from gearsim_dsp.synchronous.tsa import Average
from gearsim_io.errors import InputError

__all__ = ["difference_signal", "mesh_lines", "regular_signal", "residual_signal"]


def regular_signal(
    average: Average, mesh_orders: Sequence[float], sideband_count: int = 1, *, shaft_harmonics: int = 2
) -> NDArray[np.float64]:
    """Mean, shaft harmonics, mesh harmonics and `sideband_count` sidebands on either side of these.

    Parameters
    ----------
    average : Average
    mesh_orders : sequence of float
        Teeth of each gear on the averaged shaft (for a planet carrier: of the ring); all harmonics count.
    sideband_count : int
        Sidebands a turn of the shaft apart.
    shaft_harmonics : int

    Returns
    -------
    ndarray of float64, shape (samples,)
        Over one period, in the signal's unit.

    Raises
    ------
    InputError
        When a mesh order is not periodic in the average, or nothing would be left outside.
    """
    return _kept(average, mesh_lines(average, mesh_orders, sideband_count, shaft_harmonics=shaft_harmonics))


def difference_signal(
    average: Average, mesh_orders: Sequence[float], sideband_count: int = 1, *, shaft_harmonics: int = 2
) -> NDArray[np.float64]:
    """The average less its regular signal; parameters as there."""
    regular = mesh_lines(average, mesh_orders, sideband_count, shaft_harmonics=shaft_harmonics)
    return _kept(average, ~regular)


def residual_signal(
    average: Average, mesh_orders: Sequence[float], sideband_count: int = 0, *, shaft_harmonics: int = 2
) -> NDArray[np.float64]:
    """The average less mean, shaft and mesh harmonics; sidebands stay unless told. Parameters as above."""
    return difference_signal(average, mesh_orders, sideband_count, shaft_harmonics=shaft_harmonics)


def mesh_lines(
    average: Average, mesh_orders: Sequence[float], sideband_count: int, *, shaft_harmonics: int = 2
) -> NDArray[np.bool_]:
    """Which lines of the average's spectrum are regular; bool of shape (samples // 2 + 1,)."""
    if sideband_count < 0 or shaft_harmonics < 0:
        counts = (sideband_count, shaft_harmonics)
        raise InputError("mesh_lines", "sideband_count, shaft_harmonics", counts, "0 or more")
    lines = np.zeros(average.values.size // 2 + 1, dtype=np.bool_)
    step = average.turns_per_period
    lines[: (shaft_harmonics + 1) * step : step] = True
    for order in mesh_orders:
        fundamental = average.line(order)
        if fundamental == 0:
            raise InputError("mesh_lines", "mesh_orders", order, "above 0")
        for offset in range(-sideband_count, sideband_count + 1):
            places = np.arange(fundamental, lines.size + sideband_count * step, fundamental) + offset * step
            lines[places[(places >= 0) & (places < lines.size)]] = True
    if bool(lines.all()):
        got = f"{sideband_count} at mesh orders {list(mesh_orders)}"
        raise InputError("mesh_lines", "sideband_count", got, "lines left between the sidebands")
    return lines


def _kept(average: Average, lines: NDArray[np.bool_]) -> NDArray[np.float64]:
    spectrum = sfft.rfft(average.values)
    return np.asarray(sfft.irfft(np.where(lines, spectrum, 0.0), average.values.size))
