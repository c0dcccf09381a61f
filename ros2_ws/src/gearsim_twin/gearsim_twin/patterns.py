"""What lines that no cause explains have in common: a spacing, what they lie beside, the middle of a band.

What stands out of a model's spectrum is a list of lines. That they are the multiples of one frequency, or lie
in pairs beside lines that the machine has anyway, says more of their origin than each of them: an oil whirl
that modulates a bearing's lines shows nowhere at its own frequency.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from gearsim_twin.compare.frame import Frame
from gearsim_twin.compare.material import Material
from gearsim_twin.compare.merged import Discrepancy
from gearsim_twin.compare.places import band_text, hz_text
from gearsim_twin.compare.tones import peaks_of
from gearsim_twin.compare.windows import WindowSpectra, cut, spectra_of
from gearsim_twin.view import View

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

__all__ = ["Lines", "centre_of", "family_of", "lines_beside", "patterns", "patterns_of", "spacing_of"]

Array = NDArray[np.float64]
# Of a record, so that lines a few hertz apart are parted.
_PART = 2
# A line of the record stands out of the model's by so much, or the model has it as well.
_EXCESS = 10.0**0.6
# What carries sidebands is stronger than they are, by this factor at least.
_CARRIER = 2.0
_NEAR_BINS, _NEAR_SHARE = 0.5, 1e-3
_DIVISORS, _MULTIPLES, _LEAST_LINES = 8, 16, 3
# Chance makes such a pattern of as many lines once in a hundred.
_CHANCE = 0.01
_LOWEST_BINS, _WIDEST = 5.0, 0.25
_MOVES = 0.02
_ALIKE = 0.03
_CHANNELS = 2
_KNOWN = 0.02


@dataclass(frozen=True, slots=True)
class Lines:
    """Sharp lines of a spectrum, all arrays of shape (n,).

    Attributes
    ----------
    at : ndarray
        Position, in Hz or orders.
    power : ndarray
    strange : ndarray of bool
        Which of them the model lacks.
    step : float
        Distance of two bins.
    """

    at: Array
    power: Array
    strange: NDArray[np.bool_]
    step: float

    def without(self, base: float) -> Lines:
        """The same without the strange multiples of a frequency."""
        number = np.maximum(np.round(self.at / base), 1.0)
        kept = ~self.strange | (np.abs(self.at - number * base) > 2.0 * _near(self, self.at))
        return Lines(self.at[kept], self.power[kept], self.strange[kept], self.step)


def lines_beside(measured: WindowSpectra, simulated: WindowSpectra) -> Lines:
    """Lines of a record, and which of them a simulation with as much noise lacks."""
    bins, _ = peaks_of(measured)
    mean, model = _line(measured.mean), _line(simulated.mean)
    inside = bins[bins < model.size - 3]
    power = mean[inside]
    # The model's line may lie a bin or two beside.
    other = np.max(model[inside[:, None] + np.arange(-2, 3)], axis=1, initial=0.0)
    at = np.array([_refined(measured.mean, k) for k in inside.tolist()]) * measured.step
    return Lines(at, power, power > _EXCESS * other, measured.step)


def family_of(lines: Lines) -> float | None:
    """The greatest frequency of which most of the strange lines are multiples; None where there is none.

    Positions count within a bin. Of n lines so many may be multiples of some frequency by chance: patterns
    that Poisson's distribution gives in a hundredth of cases are none.
    """
    strange = lines.at[lines.strange]
    best: tuple[float, float] | None = None
    for line in strange.tolist():
        for divisor in range(1, _DIVISORS + 1):
            base = line / divisor
            if base < _LOWEST_BINS * lines.step:
                break
            number = np.round(strange / base)
            hit = (
                (number >= 1)
                & (number <= _MULTIPLES)
                & (np.abs(strange - number * base) < _near(lines, strange))
            )
            count = np.unique(number[hit]).size
            if count < _LEAST_LINES or 2 * count < float(number[hit].max()):
                continue
            inside = float(np.count_nonzero(strange < (_MULTIPLES + 0.5) * base))
            expected = inside * min(1.0, 2.0 * float(np.mean(_near(lines, strange[hit]))) / base)
            chance = float(stats.poisson.sf(count - 2, expected)) * _DIVISORS
            if chance < _CHANCE and (best is None or chance < best[0] * 0.999):
                weight = lines.power[lines.strange][hit]
                fitted = float(
                    np.sum(weight * number[hit] * strange[hit]) / np.sum(weight * number[hit] ** 2)
                )
                best = (chance, fitted)
    return None if best is None else best[1]


def spacing_of(lines: Lines) -> float | None:
    """The distance at which strange lines lie beside stronger ones of the machine; None where there is none.

    A pair to both sides of one line tells it, or three lines do; two anywhere are alike by chance too often.
    """
    rows = []
    for at, power in zip(lines.at[lines.strange], lines.power[lines.strange], strict=True):
        carriers = lines.at[~lines.strange & (lines.power > _CARRIER * power)]
        for side in (carriers[carriers < at][-1:], carriers[carriers > at][:1]):
            apart = np.abs(side - at)
            if side.size and _LOWEST_BINS * lines.step < float(apart[0]) < _WIDEST * at:
                rows.append((float(apart[0]), float(at), float(side[0]), float(np.sign(at - side[0]))))
    if not rows:
        return None
    apart, owner, carrier, side = np.array(rows).T
    best: tuple[int, float] | None = None
    for middle in apart.tolist():
        hit = np.abs(apart - middle) < 2.0 * _NEAR_BINS * lines.step
        both = any(np.unique(side[hit & (carrier == one)]).size == 2 for one in carrier[hit].tolist())
        count = np.unique(owner[hit]).size + both
        if count >= _LEAST_LINES and (best is None or count > best[0]):
            best = (count, float(np.mean(apart[hit])))
    return None if best is None else best[1]


def centre_of(
    measured: WindowSpectra, simulated: WindowSpectra, band_hz: tuple[float, float]
) -> tuple[float, float, float] | None:
    """Centre of the power that a record has beyond a model in a band, and where it begins and ends up.

    Returns
    -------
    tuple of float or None
        Frequencies over the whole record, in its first and in its last third.
    """
    low, high = (round(edge / measured.step) for edge in band_hz)
    high = min(high, simulated.floor.size, measured.floor.size)
    if high - low < 4:
        return None
    f = np.arange(low, high) * measured.step
    model = simulated.mean[low:high]

    def centre(power: Array) -> float:
        excess = np.maximum(power - model, 0.0)
        return float(np.sum(excess * f) / max(float(np.sum(excess)), 1e-300))

    third = max(1, measured.windows // 3)
    parts = (measured.power, measured.power[:third], measured.power[-third:])
    whole, first, last = (centre(part[:, low:high].mean(axis=0)) for part in parts)
    return whole, first, last


def patterns_of(
    context_of: Callable[[], Context], frame: Frame, rest: Sequence[Discrepancy]
) -> tuple[str, ...]:
    """What differences that nothing explains have in common, on the channels that show them best.

    Parameters
    ----------
    context_of : callable
        The records beside the final model; asked only where something is left.
    frame : Frame
    rest : sequence of Discrepancy
    """
    channels = dict.fromkeys(place.channel for each in rest for place in each.places)
    context = context_of() if rest else None
    if context is None or not context.noisy_views:
        return ()
    found: list[str] = []
    for channel in [each for each in channels if each in frame.channels][:_CHANNELS]:
        bands = [
            (min(p.at - 0.5 * p.width for p in mine), max(p.at + 0.5 * p.width for p in mine))
            for each in rest
            if each.domain == "psd" and each.size_db > 0
            if (mine := [p for p in each.places if p.channel == channel])
        ]
        found += patterns(context.views, context.noisy_views, frame, channel, bands)
    return tuple(found)


def patterns(
    measured: Sequence[View],
    simulated: Sequence[View],
    frame: Frame,
    channel: str,
    bands_hz: Sequence[tuple[float, float]] = (),
) -> tuple[str, ...]:
    """What is told of strange lines and bands of one channel, a phrase each.

    Parameters
    ----------
    measured, simulated : sequence of View
        Records, and the model under their conditions with the sensors' noise.
    frame : Frame
    channel : str
    bands_hz : sequence of (low, high)
        Where the record has more noise than the model.
    """
    pairs = [
        (Material(real, frame), Material(model, frame))
        for real, model in zip(measured, simulated, strict=True)
    ]
    speed_hz = float(np.median([real.speed_hz for real, _ in pairs]))
    found = []
    sides = [[_spectra(each, channel) for each in pair] for pair in pairs]
    lines = [lines_beside(*side) for side in sides]
    if (family := _common(lines, family_of)) is not None:
        found.append(f"lines at multiples of {_told(family, speed_hz)} of {channel}")
        lines = [each.without(family) for each in lines]
    spacing = _common(lines, spacing_of)
    if spacing is not None and not _is_known(spacing / speed_hz, frame):
        found.append(f"lines {_told(spacing, speed_hz)} beside others of {channel}")
    for band in frame.bands_hz if frame.has_orders else ():
        spectra = [[each.envelope_spectra(channel, band) for each in pair] for pair in pairs]
        turning = [lines_beside(*side) for side in spectra]
        if (order := _common(turning, family_of)) is not None:
            where = f"in the {band_text(band)} envelope of {channel}"
            found.append(f"modulation at multiples of {_told(order * speed_hz, speed_hz)} {where}")
    short = [[each.time_spectra(channel) for each in pair] for pair in pairs]
    found += [told for band in bands_hz if (told := _band(short, band, channel)) is not None]
    return tuple(found)


def _is_known(order: float, frame: Frame) -> bool:
    """Whether it is the distance of lines that the machine makes itself."""
    turns = [abs(shaft.ratio) for shaft in frame.machine.shafts] + [family.order for family in frame.families]
    return any(abs(order - k * turn) < _KNOWN * order for turn in turns for k in (1, 2, 3))


def _band(sides: Sequence[Sequence[WindowSpectra]], band: tuple[float, float], channel: str) -> str | None:
    centres = [centre for one, other in sides if (centre := centre_of(one, other, band)) is not None]
    if not centres:
        return None
    whole, first, last = np.median(np.array(centres), axis=0).tolist()
    moves = all(abs(c[2] - c[1]) > _MOVES * whole and (c[2] > c[1]) == (last > first) for c in centres)
    where = f", moving from {hz_text(first)} to {hz_text(last)} within each record" if moves else ""
    return f"the excess of noise of {channel} has its middle at {hz_text(whole)}{where}"


def _common(lines: Sequence[Lines], pattern: Callable[[Lines], float | None]) -> float | None:
    """What all records show alike."""
    values = [pattern(each) for each in lines]
    known = np.array([value for value in values if value is not None])
    if known.size < len(values) or np.ptp(known) > _ALIKE * float(np.mean(known)):
        return None
    return float(np.mean(known))


def _spectra(material: Material, channel: str) -> WindowSpectra:
    x = material.samples(channel)
    length = x.size // _PART
    return spectra_of(cut(x, length), material.rate_hz / length)


def _line(mean: Array) -> Array:
    return np.asarray(np.convolve(mean, np.ones(5), "same"))


def _near(lines: Lines, at: Array) -> Array:
    return np.asarray(_NEAR_BINS * lines.step + _NEAR_SHARE * at)


def _refined(mean: Array, k: int) -> float:
    """Place of a line between bins: of a Hann window the logarithms of three bins are nearly a parabola."""
    left, middle, right = np.log(np.maximum(mean[k - 1 : k + 2], 1e-300))
    bend = 2 * middle - left - right
    return k + (0.5 * float(right - left) / float(bend) if bend > 0 else 0.0)


def _told(hz: float, speed_hz: float) -> str:
    return f"{hz_text(hz)}" + (f" (order {hz / speed_hz:.3g})" if speed_hz == speed_hz else "")
