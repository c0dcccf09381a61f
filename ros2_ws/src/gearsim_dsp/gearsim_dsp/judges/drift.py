"""Inner races that are struck once a turn, told from their shaft by the drift of the impacts.

A ring that turns with the shaft carries its spall through the load zone once a turn. Where that zone is
narrow (a low load), one element strikes it there, and of a bearing whose elements pass about n times a turn
the envelope has all lines of the shaft: no comb tells the two apart. But what is fixed to the shaft (a bad
tooth) comes at one angle of every turn, while n elements pass in n / f turns, f being their rate in turns of
the shaft, not in one: in the turn r the impact comes at the angle ::

    a_r = a_0 + b r,     b = n / f - 1.

So the angle of every turn's impacts is measured as the lag of its squared envelope behind the mean of all
other turns (a turn's own noise would draw it to no lag), a line is fitted to the lags, weighted by how alike
they are, and its slope compared with its own standard error from the scatter about the line (White's, which
asks for no equal variances). A slope that holds gives f far better than the record's resolution would.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft
from scipy import stats

from gearsim_dsp.bands import Band, plan_bands
from gearsim_dsp.envelope import both_spectra, squared_envelopes
from gearsim_dsp.judges.bearing import severity_of
from gearsim_dsp.judges.confidence import confidence
from gearsim_dsp.judges.finding import Finding
from gearsim_dsp.judges.measured import Measured
from gearsim_dsp.kinematics import FaultFamily, fault_families
from gearsim_dsp.speed import Phase

__all__ = ["Drift", "drift_of", "drifting_races"]

_PER_TURN = 512
_LEAST_NUMBER = 3
_LEAST_TURNS = 8
_PASSES = 3
# Mean over turns against what turns that have nothing in common leave; 1 for noise.
_OVER_NOISE = 3.0
# Over standard error and in turns over the record: see docs/diagnosis.md for what sound shafts, bad teeth
# and other bearings reach.
_LEAST_SURE = 10.0
_LEAST_DRIFT = 0.002
# Impacts, not a swing of the shaft, whose shape may change: as no power is below nil, a first harmonic alone
# gives 0.5 at most. Simulated races struck once a turn have 1.2 and more.
_LEAST_SIZE = 1.0
_LEAST_GATHERED = 0.6
# From pure rolling: eleven measured records deviate by up to 0.58 %.
_MOST_DEVIATION = 0.006
_LEAST_LEVEL = 1e-6  # of the loudest band's mean square: below lie rounding and leakage
_HARMONICS = 8


@dataclass(frozen=True, slots=True)
class Drift:
    """By how much impacts come later every turn.

    Parameters
    ----------
    per_turn, error : float
        Turns per turn, and the standard error.
    turns : int
    modulation : float
        Mean square of the mean over turns, each shifted back by its drift, without what noise leaves there.
    harmonic_snr_db : tuple of float
        Of that mean's lines at multiples of the elements' number over the scatter between turns.
    gathered : float
        Share of that mean's square within an element's spacing either side of its top: what strikes at
        several places of the turn is no ring in a narrow load zone.
    """

    per_turn: float
    error: float
    turns: int
    modulation: float
    harmonic_snr_db: tuple[float, ...]
    gathered: float

    @property
    def sure(self) -> float:
        """The drift over its standard error."""
        return abs(self.per_turn) / max(self.error, 1e-12)

    @property
    def log10_chance(self) -> float:
        """Of so sure a drift where there is none: Student's t with two parameters taken out."""
        return float(stats.t.logsf(self.sure, self.turns - 2) + math.log(2.0)) / math.log(10.0)


@dataclass(frozen=True, slots=True, eq=False)
class _Place:
    """The squared envelope of one band of one channel, over its mean, turn by turn of a shaft."""

    channel: str
    band: Band
    level: float
    turns: NDArray[np.float64]

    def modulation(self) -> tuple[float, float]:
        """Mean square of the mean over turns, and what noise leaves of it."""
        return _mean_square(self.turns)


def drifting_races(measured: Measured) -> tuple[Finding, ...]:
    """The inner race on each shaft whose impacts drift, where there is one; none without the angle."""
    phase = measured.phase
    if phase is None:
        return ()
    found: list[Finding] = []
    ratios = sorted({measured.machine.shaft(one.shaft).ratio for one in measured.machine.bearings})
    for ratio in ratios:
        near = [family for family in fault_families(measured.machine) if _is_struck_once(family, ratio)]
        if near and measured.turns * ratio >= _LEAST_TURNS:
            found += _on_shaft(measured, phase, ratio, near)
    return tuple(found)


def _is_struck_once(family: FaultFamily, ratio: float) -> bool:
    """A ring on a shaft of that speed that a whole number of elements passes in a turn, within tolerance."""
    number = round(family.order / ratio)
    on_shaft = family.fault in ("inner_race", "outer_race") and math.isclose(family.sideband_order, ratio)
    return on_shaft and number >= _LEAST_NUMBER and _deviation(family, number * ratio) <= family.tolerance


def _deviation(family: FaultFamily, order: float) -> float:
    return abs(order / family.order - 1.0)


def _on_shaft(
    measured: Measured, phase: Phase, ratio: float, families: list[FaultFamily]
) -> Iterator[Finding]:
    """The likeliest of the races that the drift in the clearest place can mean."""
    machine = measured.machine
    channels = {name for family in families for name in machine.bearing(family.component).channels}
    places = [
        place
        for name in sorted(channels & set(measured.channels))
        for place in _places(measured, name, phase, ratio)
    ]
    loudest = max((place.level for place in places), default=0.0)
    places = [place for place in places if place.level > _LEAST_LEVEL * loudest]
    best: tuple[tuple[float, float], FaultFamily, _Place, Drift] | None = None
    for family in families:
        own = [p for p in places if p.channel in machine.bearing(family.component).channels]
        place = max(own, key=lambda p: p.modulation()[0], default=None)
        if place is None:
            continue
        size, noise = place.modulation()
        if size + noise < _OVER_NOISE * noise:
            continue
        number = round(family.order / ratio)
        drift = drift_of(place.turns, number)
        off = _deviation(family, number * ratio / (1.0 + drift.per_turn))
        if off > _MOST_DEVIATION or not _holds(drift):
            continue
        # The shaft takes such impacts to all its bearings: only of like ones the louder is meant.
        merit = -round(off, 4), place.level * math.sqrt(drift.modulation)
        if best is None or merit > best[0]:
            best = merit, family, place, drift
    if best is not None:
        yield _finding(measured, ratio, *best[1:])


def _holds(drift: Drift) -> bool:
    """Impacts, sure to drift, by more than the angle wobbles, and at one place of the turn."""
    return (
        drift.modulation >= _LEAST_SIZE
        and drift.sure >= _LEAST_SURE
        and abs(drift.per_turn) * drift.turns >= _LEAST_DRIFT
        and drift.gathered >= _LEAST_GATHERED
    )


def _places(measured: Measured, channel: str, phase: Phase, ratio: float) -> list[_Place]:
    """The bank's bands of one channel."""
    samples = measured.channels[channel]
    plan, _ = plan_bands(samples.size, measured.sample_rate_hz, measured.speed.value_hz, measured.machine)
    if plan is None:
        return []
    lows = np.array([band.low_hz for band in plan.bank])
    envelopes = squared_envelopes(both_spectra(samples, measured.sample_rate_hz)[1], lows, plan.width_hz)
    values = envelopes.values
    at = envelopes.first + envelopes.stride * np.arange(values.shape[1])
    turns = ratio * np.interp(at, phase.samples, phase.turns)
    whole = int(turns[-1] - turns[0])
    if whole < _LEAST_TURNS:
        return []
    grid = turns[0] + np.arange(whole * _PER_TURN) / _PER_TURN
    found = []
    for band, row in zip(plan.bank, values, strict=True):
        level = float(row.mean(dtype=np.float64))
        if level > 0:
            cut = np.interp(grid, turns, row / level - 1.0).reshape(whole, _PER_TURN)
            found.append(_Place(channel, band, level, cut))
    return found


def drift_of(turns: NDArray[np.float64], number: int) -> Drift:
    """The drift of what is periodic in the rows.

    Parameters
    ----------
    turns : ndarray, shape (turns, samples)
        One turn of the shaft in each row, without mean.
    number : int
        Lags are looked for up to half of the `number`-th part of a turn either way: then another element
        strikes.

    Returns
    -------
    Drift
    """
    count, samples = turns.shape
    lines = sfft.rfft(turns, axis=1)
    number_of_turn = np.arange(count) - 0.5 * (count - 1)
    slope, error = 0.0, math.inf
    for _ in range(_PASSES):
        lag, weight = _lags(_shifted_back(lines, slope, number_of_turn), samples, number)
        more, error = _line(number_of_turn, lag, weight)
        slope += more
    back = _shifted_back(lines, slope, number_of_turn)
    size, _noise = _mean_square(sfft.irfft(back, samples, axis=1))
    mean = back.mean(axis=0)
    scatter = np.mean(np.abs(back - mean) ** 2, axis=0) / max(count - 1, 1)
    top = [k * number for k in range(1, _HARMONICS + 1) if k * number < lines.shape[1]]
    ratio = np.abs(mean[top]) ** 2 / np.maximum(scatter[top], 1e-300)
    snr = tuple(float(10 * np.log10(max(value, 1e-3))) for value in ratio)
    return Drift(slope, error, count, size, snr, _gathered(sfft.irfft(mean, samples), number))


def _gathered(turn: NDArray[np.float64], number: int) -> float:
    square = np.roll(turn**2, turn.size // 2 - int(np.argmax(turn)))
    reach = turn.size // number
    near = square[turn.size // 2 - reach : turn.size // 2 + reach + 1]
    return float(near.sum() / max(float(square.sum()), 1e-300))


def _shifted_back(
    lines: NDArray[np.complex128], slope: float, number_of_turn: NDArray[np.float64]
) -> NDArray[np.complex128]:
    order = np.arange(lines.shape[1])
    turned: NDArray[np.complex128] = lines * np.exp(2j * np.pi * slope * order * number_of_turn[:, None])
    return turned


def _lags(
    lines: NDArray[np.complex128], samples: int, number: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lag of each turn behind the mean of the others, in turns, and how alike they are there (0: not)."""
    count = lines.shape[0]
    others = (lines.sum(axis=0) - lines) / (count - 1)
    alike = sfft.irfft(lines * np.conj(others), samples, axis=1)
    reach = samples // (2 * number)
    offsets = np.arange(-reach, reach + 1)
    near = alike[:, offsets]
    top = near.argmax(axis=1)
    inside = (top > 0) & (top < 2 * reach)
    top = np.clip(top, 1, 2 * reach - 1)
    row = np.arange(count)
    left, mid, right = near[row, top - 1], near[row, top], near[row, top + 1]
    shift = 0.5 * (right - left) / np.maximum(2 * mid - left - right, 1e-300)
    return (offsets[top] + np.clip(shift, -0.5, 0.5)) / samples, np.maximum(mid, 0.0) * inside


def _line(x: NDArray[np.float64], y: NDArray[np.float64], weight: NDArray[np.float64]) -> tuple[float, float]:
    """Slope of the weighted straight line and its standard error (White, Econometrica 48 (1980) 817-838)."""
    total = float(weight.sum())
    if total <= 0:
        return 0.0, math.inf
    w = weight / total
    dx, dy = x - np.sum(w * x), y - np.sum(w * y)
    spread = float(np.sum(w * dx**2))
    if spread <= 0:
        return 0.0, math.inf
    slope = float(np.sum(w * dx * dy)) / spread
    rest = dy - slope * dx
    error = math.sqrt(float(np.sum((w * dx * rest) ** 2)) * x.size / (x.size - 2)) / spread
    return slope, error


def _mean_square(turns: NDArray[np.float64]) -> tuple[float, float]:
    """Mean square of the mean over turns beyond what noise leaves of it, and that."""
    count = turns.shape[0]
    of_mean = float(np.mean(turns.mean(axis=0) ** 2))
    noise = max(float(np.mean(turns**2)) - of_mean, 0.0) / (count - 1)
    return of_mean - noise, noise


def _finding(measured: Measured, ratio: float, family: FaultFamily, place: _Place, drift: Drift) -> Finding:
    number = round(family.order / ratio)
    order = number * ratio / (1.0 + drift.per_turn)
    features = {"drift": 1.0}
    shaft = measured.machine.bearing(family.component).shaft
    details: dict[str, object] = {
        "channel": place.channel,
        "band_hz": [place.band.low_hz, place.band.high_hz],
        "band_choice": place.band.why,
        "frequency_hz": order * measured.speed.value_hz,
        "harmonic_snr_db": [round(value, 2) for value in drift.harmonic_snr_db],
        "sideband_snr_db": [],
        "false_alarm_probability": 10.0**drift.log10_chance,
        "modulation": drift.modulation,
        "covered_by": f"{number} x {shaft}",
        "drift_turns_per_turn": drift.per_turn,
        "drift_error": drift.error,
        "speed_source": measured.speed.source,
        "features": features,
    }
    return Finding(
        family.component,
        family.fault,
        family.order,
        order,
        order * measured.speed.value_hz,
        max(drift.harmonic_snr_db),
        confidence(family.fault, features),
        severity_of(drift.modulation),
        place.channel,
        details,
    )
