"""Lines that electricity puts into a vibration signal, named as what they are: supply and inverter.

The supply's lines lie at whole multiples of 50 or 60 Hz, to within the 0.2 % that grids keep. An
inverter's carrier is a strong, narrow line in the kilohertz range that comes with its double, both
unrelated to the shafts, and stands alone: lines of gears that a resonance lifts come in numbers, a shaft's
speed apart. Lines that are nothing beside the signal are leakage and rounding, not electricity.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft

from gearsim_dsp.noise_floor import local_floor
from gearsim_dsp.spectra import good_length

__all__ = ["ElectricalLines", "find_electrical_lines", "supply_like_combs"]

_SUPPLIES_HZ = (50.0, 60.0)
_SUPPLY_DRIFT = 0.002
_SUPPLY_DB = 13.0
_SUPPLY_HARMONICS = 12
_FEWEST_LINES = 4
_CARRIER_DB = 30.0
_DOUBLE_DB = 20.0
_CARRIER_GRID_HZ = 500.0
_CARRIER_ERROR = 5e-4
_ALONE_HZ = 45.0
_ALONE_DB = 12.0
_SERIES_NUMBER = 24  # 25 Hz with 32 teeth: 4000 Hz is the fifth harmonic, 20,000 Hz the 25th
_SERIES_DB = 25.0  # of a harmonic's neighbours below it
_LEAST_SHARE = 1e-9  # of a carrier in the signal's power
_LONGEST = 1 << 20
_BLOCK_LINES = 256


@dataclass(frozen=True, slots=True)
class ElectricalLines:
    """Lines found, in Hz; `supply_hz` is 0 where no supply shows."""

    supply_hz: float
    supply_lines_hz: tuple[float, ...]
    carriers_hz: tuple[float, ...]


def find_electrical_lines(
    samples: NDArray[np.float32] | NDArray[np.float64],
    sample_rate_hz: float,
    line_frequency_hz: float = 0.0,
    machine_lines_hz: Sequence[float] = (),
    machine_error: float = 1e-3,
) -> ElectricalLines:
    """Look for supply and inverter lines.

    Parameters
    ----------
    samples : ndarray, shape (n,)
        Finite values; at most the first 2^20 are used. Below two seconds nothing is found.
    sample_rate_hz : float
    line_frequency_hz : float
        Supply of the nameplate, 0: both 50 and 60 Hz are tried.
    machine_lines_hz : sequence of float
        Fundamentals of the machine (shafts, meshes, fault lines found); their multiples are not electrical.
    machine_error : float
        Relative uncertainty of these.
    """
    power, height_db, step_hz = _heights(samples, sample_rate_hz)
    if power.size == 0:
        return ElectricalLines(0.0, (), ())
    known = _Known([f for f in machine_lines_hz if f > 0], machine_error, step_hz)
    supplies = (line_frequency_hz,) if line_frequency_hz > 0 else _SUPPLIES_HZ
    found = [_supply(height_db, step_hz, supply, known) for supply in supplies]
    best = int(np.argmax([len(lines_hz) for lines_hz in found]))
    enough = len(found[best]) >= _FEWEST_LINES
    return ElectricalLines(
        supplies[best] if enough else 0.0,
        tuple(found[best]) if enough else (),
        tuple(_carriers(height_db, power / max(float(power.sum()), 1e-300), step_hz, known)),
    )


def supply_like_combs(
    samples: NDArray[np.float32] | NDArray[np.float64],
    sample_rate_hz: float,
    range_hz: tuple[float, float],
    machine_lines_hz: Sequence[float] = (),
    machine_error: float = 1e-3,
) -> tuple[tuple[float, int], ...]:
    """Combs of narrow lines that belong to no shaft, as those of a supply whose frequency is read wrong.

    Parameters
    ----------
    samples, sample_rate_hz, machine_lines_hz, machine_error
        As of `find_electrical_lines`.
    range_hz : tuple of float
        Of the fundamental.

    Returns
    -------
    tuple of (float, int)
        Fundamental in Hz and number of lines among its first twelve multiples, most lines first.
    """
    _, height_db, step_hz = _heights(samples, sample_rate_hz)
    known = _Known([f for f in machine_lines_hz if f > 0], machine_error, step_hz)
    peaks = _peaks(height_db, _SUPPLY_DB) * step_hz if height_db.size else np.zeros(0)
    low, high = range_hz
    peaks = peaks[peaks <= _SUPPLY_HARMONICS * high]
    peaks = np.array([p for p in peaks if not known.explains(float(p))])
    found: list[tuple[float, int]] = []
    for number in range(1, _SUPPLY_HARMONICS + 1):
        for trial in peaks / number:
            multiple = np.round(peaks / trial)
            fits = (multiple >= 1) & (multiple <= _SUPPLY_HARMONICS)
            fits &= np.abs(peaks - multiple * trial) <= 0.75 * step_hz
            if low <= trial <= high and np.count_nonzero(fits) >= _FEWEST_LINES:
                # All lines together tell the fundamental better than the one it was tried by.
                best = float(np.sum(peaks[fits] * multiple[fits]) / np.sum(multiple[fits] ** 2))
                found.append((best, int(np.count_nonzero(fits))))
    return tuple(sorted(found, key=lambda one: (-one[1], one[0])))


def _heights(
    samples: NDArray[np.float32] | NDArray[np.float64], sample_rate_hz: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Power and height over the floor [dB] of each line, and their distance; empty below two seconds."""
    count = good_length(min(int(samples.size), _LONGEST))
    if count < 2 * sample_rate_hz:
        return np.zeros(0), np.zeros(0), 1.0
    x = np.asarray(samples[:count], dtype=np.float64)
    window = np.hanning(count + 1)[:-1]
    lines = sfft.rfft((x - x.mean()) * window)
    power = lines.real**2 + lines.imag**2
    floor = local_floor(power, _BLOCK_LINES, 1.0, 4)
    return power, 10 * np.log10(np.maximum(power / floor, 1e-3)), sample_rate_hz / count


@dataclass(frozen=True, slots=True)
class _Known:
    """Lines of the machine; `explains` is also true where their multiples lie too dense to tell."""

    fundamentals_hz: Sequence[float]
    error: float
    step_hz: float

    def explains(self, place_hz: float) -> bool:
        reach = self.error * place_hz + 1.5 * self.step_hz
        for fundamental in self.fundamentals_hz:
            number = round(place_hz / fundamental)
            if number < 1:
                continue
            if abs(place_hz - number * fundamental) < min(reach, 0.25 * fundamental):
                return True
        return False


def _supply(height_db: NDArray[np.float64], step_hz: float, supply_hz: float, known: _Known) -> list[float]:
    """Most lines that are multiples of one frequency near the nominal one and belong to no shaft."""
    peaks = _peaks(height_db, _SUPPLY_DB) * step_hz
    top = _SUPPLY_HARMONICS * supply_hz * (1 + _SUPPLY_DRIFT)
    peaks = np.array([p for p in peaks[peaks <= top] if not known.explains(float(p))])
    best: list[float] = []
    if peaks.size < _FEWEST_LINES:
        return best
    drift = _SUPPLY_DRIFT * supply_hz
    for trial in np.arange(supply_hz - drift, supply_hz + drift, 0.25 * step_hz / _SUPPLY_HARMONICS):
        number = np.round(peaks / trial)
        fits = (number >= 1) & (np.abs(peaks - number * trial) <= 0.75 * step_hz)
        if np.count_nonzero(fits) > len(best):
            best = [float(p) for p in peaks[fits]]
    return best


def _peaks(height_db: NDArray[np.float64], least_db: float) -> NDArray[np.float64]:
    """Positions of local maxima in lines, interpolated by a parabola."""
    left, mid, right = height_db[:-2], height_db[1:-1], height_db[2:]
    at = np.flatnonzero((mid > left) & (mid >= right) & (mid >= least_db))
    curve = np.maximum(2 * mid[at] - left[at] - right[at], 1e-12)
    return np.asarray(at + 1 + np.clip(0.5 * (right[at] - left[at]) / curve, -0.5, 0.5))


def _carriers(
    height_db: NDArray[np.float64], share: NDArray[np.float64], step_hz: float, known: _Known
) -> list[float]:
    """Strong narrow lines at multiples of 500 Hz that stand alone and come with their doubles."""
    found = []
    for place in _peaks(height_db, _CARRIER_DB) * step_hz:
        setting = max(3, round(place / _CARRIER_GRID_HZ)) * _CARRIER_GRID_HZ
        if abs(place - setting) > _CARRIER_ERROR * setting or known.explains(float(place)):
            continue
        line = round(place / step_hz)
        if share[line - 1 : line + 2].sum() < _LEAST_SHARE or not _alone(height_db, line, step_hz):
            continue
        if _in_a_series(height_db, place / step_hz):
            continue
        double = round(2 * place / step_hz)
        around = height_db[double - 2 : double + 3]
        if around.size and around.max() >= _DOUBLE_DB:
            found.append(float(place))
    return found


def _in_a_series(height_db: NDArray[np.float64], place: float) -> bool:
    """True for one of many harmonics, as of a gear mesh: whole parts of it and their multiples stand beside.

    A carrier has lines at its own multiples only. `place` in lines.
    """
    least = float(height_db[round(place)]) - _SERIES_DB
    for number in range(2, _SERIES_NUMBER + 1):
        near = np.array([k for k in range(number - 3, number + 4) if k > 0 and k != number])
        at = np.round(near * place / number).astype(np.intp)
        if at[-1] + 2 >= height_db.size or at[0] < 4:
            continue
        top = np.maximum(height_db[at], np.maximum(height_db[at - 1], height_db[at + 1]))
        if np.count_nonzero(top >= max(least, _SUPPLY_DB)) >= max(4, near.size - 1):
            return True
    return False


def _alone(height_db: NDArray[np.float64], line: int, step_hz: float) -> bool:
    """True when nothing within 45 Hz, but for the line's own skirt, comes within 12 dB of it."""
    reach, skirt = max(8, round(_ALONE_HZ / step_hz)), 4
    low = height_db[max(0, line - reach) : max(0, line - skirt)]
    high = height_db[line + skirt + 1 : line + reach + 1]
    top = float(height_db[max(0, line - 1) : line + 2].max())
    beside = max(float(low.max(initial=-np.inf)), float(high.max(initial=-np.inf)))
    return beside < top - _ALONE_DB
