"""Condition indicators of gears, on a synchronous average and what is left of it.

With d, r, g the difference, residual and regular signal of the average, m_k the k-th central moment::

    FM0   peak-to-peak of the average over the sum of the mesh harmonics' amplitudes   Stewart (1977)
    FM4   m4(d) / m2(d)^2: 3 for noise, large for one bad tooth                        Stewart (1977)
    M6A   m6(d) / m2(d)^3: 15 for noise; M8A = m8(d) / m2(d)^4: 105                    Martin (1989)
    NA4   m4(r) over the squared mean of m2(r) over the records so far                 Zakrajsek et al. (1993)
    NB4   NA4 of the envelope of the signal around a mesh harmonic                     Zakrajsek et al. (1994)
    ER    RMS of d over RMS of g                                                       Swansson (1980)
    SLF   first sidebands of the mesh fundamental, summed, over the RMS                McClintic et al. (2000)

Collected in Lebold et al., Proc. 54th MFPT (2000) 623-634, and in Sait and
Sharaf-Eldeen, Rotating Machinery, Structural Dynamics, Proc. 29th IMAC 5 (2011) 307-324. FM4, M6A and M8A
tell one bad tooth from many; they fall again when damage spreads, while NA4 and NB4 keep growing, since they
are referred to what was before.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_dsp.features import crest_factor, kurtosis, rms
from gearsim_dsp.synchronous.modulation import mesh_envelope
from gearsim_dsp.synchronous.signals import difference_signal, regular_signal, residual_signal
from gearsim_dsp.synchronous.tsa import Average
from gearsim_io.errors import InputError

__all__ = [
    "GearIndicators",
    "energy_ratio",
    "fm0",
    "fm4",
    "gear_indicators",
    "m6a",
    "m8a",
    "na4",
    "nb4",
    "sideband_level",
    "variance",
]

Samples = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class GearIndicators:
    """All indicators of one gear in one record; NaN where a signal they divide by is nil.

    `residual_variance` and `envelope_variance` are what later records need as `earlier_residual` and
    `earlier_envelope`.
    """

    rms: float
    kurtosis: float
    crest_factor: float
    fm0: float
    fm4: float
    m6a: float
    m8a: float
    na4: float
    nb4: float
    energy_ratio: float
    sideband_level: float
    residual_variance: float
    envelope_variance: float


def gear_indicators(
    average: Average,
    mesh_order: float,
    *,
    other_mesh_orders: Sequence[float] = (),
    sideband_count: int = 1,
    earlier_residual: Sequence[float] = (),
    earlier_envelope: Sequence[float] = (),
) -> GearIndicators:
    """All indicators of one gear.

    Parameters
    ----------
    average : Average
        Of the gear's shaft.
    mesh_order : float
        Teeth of the gear.
    other_mesh_orders : sequence of float
        Teeth of further gears on the shaft: regular as well.
    sideband_count : int
        Sidebands that are regular.
    earlier_residual, earlier_envelope : sequence of float
        Variances of earlier records of the healthy or ageing gear, for NA4 and NB4.
    """
    orders = (mesh_order, *other_mesh_orders)
    difference = difference_signal(average, orders, sideband_count)
    residual = residual_signal(average, orders)
    envelope = mesh_envelope(average, mesh_order)
    return GearIndicators(
        rms=rms(average.values),
        kurtosis=kurtosis(average.values),
        crest_factor=crest_factor(average.values),
        fm0=fm0(average, [mesh_order]),
        fm4=fm4(difference),
        m6a=m6a(difference),
        m8a=m8a(difference),
        na4=na4(residual, earlier_residual),
        nb4=nb4(envelope, earlier_envelope),
        energy_ratio=energy_ratio(difference, regular_signal(average, orders, sideband_count)),
        sideband_level=sideband_level(average, mesh_order),
        residual_variance=variance(residual),
        envelope_variance=variance(envelope),
    )


def fm0(average: Average, mesh_orders: Sequence[float]) -> float:
    """Peak-to-peak value of the average over the summed amplitudes of all harmonics of the meshes."""
    _, amplitude = average.spectrum()
    top = (average.values.size - 1) // 2
    lines = {k for order in mesh_orders for k in range(average.line(order), top + 1, average.line(order))}
    total = float(np.sum(amplitude[sorted(lines)]))
    return float(np.ptp(average.values)) / total if total > 0 else math.nan


def fm4(difference: Samples) -> float:
    """Kurtosis of the difference signal; NaN for a signal that is nil."""
    return kurtosis(difference)


def m6a(difference: Samples) -> float:
    """Sixth moment over the cube of the second; 15 for Gaussian noise, 2.5 for a sine."""
    return _moment_ratio(difference, 6)


def m8a(difference: Samples) -> float:
    """Eighth moment over the fourth power of the second; 105 for Gaussian noise, 4.375 for a sine."""
    return _moment_ratio(difference, 8)


def na4(residual: Samples, earlier_variances: Sequence[float] = ()) -> float:
    """Fourth moment of the residual over the squared mean variance of all records up to this one.

    Parameters
    ----------
    residual : ndarray of float64
    earlier_variances : sequence of float
        `variance` of the residuals of earlier records. With those of a sound gear alone the reference stays
        where it was (NA4*, Decker et al. 1994).

    Notes
    -----
    Without earlier records it is the kurtosis. A residual that grows to c times its level without a change of
    shape gives c^4 times its kurtosis once many earlier ones are behind it.
    """
    now = variance(residual)
    reference = float(np.mean(np.append(_checked(earlier_variances), now)))
    x = residual - np.mean(residual)
    return float(np.mean(x**4)) / reference**2 if reference > 0 else math.nan


def nb4(envelope: Samples, earlier_variances: Sequence[float] = ()) -> float:
    """NA4 of the envelope around a mesh harmonic (`modulation.mesh_envelope`); parameters as there."""
    return na4(envelope, earlier_variances)


def energy_ratio(difference: Samples, regular: Samples) -> float:
    """RMS of the difference signal over that of the regular one: grows with wear and heavy damage."""
    level = rms(regular)
    return rms(difference) / level if level > 0 else math.nan


def sideband_level(average: Average, mesh_order: float) -> float:
    """Amplitudes of the first sidebands of the mesh fundamental, both sides summed, over the RMS."""
    _, amplitude = average.spectrum()
    centre = average.line(mesh_order)
    step = average.turns_per_period
    if not step <= centre < amplitude.size - step:
        raise InputError("sideband_level", "mesh_order", mesh_order, "sidebands inside the spectrum")
    level = rms(average.values)
    return float(amplitude[centre - step] + amplitude[centre + step]) / level if level > 0 else math.nan


def variance(signal: Samples) -> float:
    """Mean square about the mean, in the signal's unit squared."""
    return rms(signal) ** 2


def _moment_ratio(signal: Samples, power: int) -> float:
    x = signal - np.mean(signal)
    second = float(np.mean(x**2))
    return float(np.mean(x**power)) / second ** (power / 2) if second > 0 else math.nan


def _checked(variances: Sequence[float]) -> Samples:
    values = np.asarray(variances, dtype=np.float64)
    if values.ndim != 1 or not np.all(np.isfinite(values)) or np.any(values < 0):
        raise InputError("na4", "earlier_variances", variances, "finite values, 0 or more")
    return values
