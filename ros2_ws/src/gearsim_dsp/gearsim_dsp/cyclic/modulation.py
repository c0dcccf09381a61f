"""Power over cyclic frequency, with tests of single lines and of combs: what envelope spectra have in common.

Squared, enhanced and improved envelope spectra show a hidden period as lines at its frequency and harmonics,
with sidebands where something carries the source through a load zone. `ModulationSpectrum` holds such a
spectrum together with what its noise does, so that every line and every comb comes with the probability that
noise alone shows as much: floor by trimmed means of the neighbourhood, lines by the F distribution, combs by
Fisher's sum of logarithms, all places searched counted (see `noise_floor` and `comb`).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gearsim_dsp.comb import comb_grid, score_combs
from gearsim_dsp.noise_floor import LineTail, local_floor, search_false_alarm
from gearsim_io.errors import InputError

__all__ = ["CombTest", "LineTest", "ModulationSpectrum"]

_BLOCK_LINES = 160
_SKIP_LINES = 4
_WORTH = 60.0  # averages that the interpolated floor is worth at each of its own, counted on noise
_LINE_HALF_WIDTH = 1.6
_CELL_SHARE = 0.5  # independent looks per resolution cell of the 8th harmonic, counted on noise
_LINE_LOOKS = 1.0  # the same per cell of a single line
_LINE_ENDS = 1.7  # and for the line itself with its half-line neighbours
_REFINE_SHARE = 0.25
_PLATEAU = 0.7


@dataclass(frozen=True, slots=True)
class LineTest:
    """A line found near a place where one was expected.

    Parameters
    ----------
    expected, found : float
        On the spectrum's axis; `found` is interpolated between lines.
    power : float
    snr_db : float
        Power over the local floor.
    false_alarm : float
        Probability that noise reaches as much anywhere in the range searched.
    """

    expected: float
    found: float
    power: float
    snr_db: float
    false_alarm: float


@dataclass(frozen=True, slots=True)
class CombTest:
    """A comb of harmonics and sidebands found near an expected fundamental.

    Parameters
    ----------
    expected, found : float
        Fundamental on the spectrum's axis; `found` weighs the harmonics' interpolated tops.
    false_alarm : float
        Probability that noise shows as much at any fundamental searched.
    modulation : float
        Twice the sum of the lines' power over the floor: of a squared envelope spectrum the mean square of
        the family over the squared mean.
    harmonics : tuple of LineTest
        The first eight, as far as the axis reaches.
    sidebands : tuple of tuple of LineTest
        Lower and upper sideband of each of the first three harmonics, empty where none was asked for.
    """

    expected: float
    found: float
    false_alarm: float
    modulation: float
    harmonics: tuple[LineTest, ...]
    sidebands: tuple[tuple[LineTest, LineTest], ...]

    @property
    def snr_db(self) -> float:
        """The strongest of the first four harmonics."""
        return max((line.snr_db for line in self.harmonics[:4]), default=float("nan"))


@dataclass(frozen=True, slots=True, eq=False)
class ModulationSpectrum:
    """An envelope spectrum of some kind: power over cyclic frequency, line k at k * `step`.

    Parameters
    ----------
    power : ndarray of float64, shape (lines,)
        At least 16 lines beyond the fourth.
    step : float
        Half the resolution: spectra of signals padded to twice their length.
    unit : {"Hz", "order"}
    averages : float
        Independent averages behind each line.
    band_hz : tuple of float
        Carrier band that the modulation was sought in.
    kind : str
        "SES", "EES" or "IES".
    looks : int
        Spectra that this one was chosen from, counted in every false-alarm probability.
    floor : ndarray of float64, shape (lines,)
        Mean power of the noise, estimated from `power`.
    """

    power: NDArray[np.float64]
    step: float
    unit: Literal["Hz", "order"]
    averages: float
    band_hz: tuple[float, float]
    kind: str
    looks: int = 1
    floor: NDArray[np.float64] = field(init=False)
    _tail: NDArray[np.float64] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if self.power.ndim != 1 or not np.all(np.isfinite(self.power)):
            raise InputError("ModulationSpectrum", "power", f"shape {self.power.shape}", "a finite vector")
        if not (self.step > 0 and self.averages >= 1 and self.looks >= 1):
            found = (self.step, self.averages, self.looks)
            raise InputError(
                "ModulationSpectrum", "step, averages, looks", found, "above 0, 1 or more, 1 or more"
            )
        floor = local_floor(self.power, _BLOCK_LINES, self.averages, _SKIP_LINES)
        tail = LineTail(self.averages, self.averages * _WORTH)(self.power / floor)
        object.__setattr__(self, "floor", floor)
        object.__setattr__(self, "_tail", tail)

    @property
    def axis(self) -> NDArray[np.float64]:
        """Cyclic frequency of every line, in `unit`."""
        return np.asarray(np.arange(self.power.size) * self.step)

    @property
    def resolution(self) -> float:
        """Distance of independent lines, one over the duration (or the turns) of a window."""
        return 2.0 * self.step

    def snr_db(self) -> NDArray[np.float64]:
        """Power over the floor of every line."""
        ratio = self.power / self.floor
        return np.asarray(10 * np.log10(np.maximum(ratio, 1e-30)))

    def false_alarm(self) -> NDArray[np.float64]:
        """Probability of every line that noise alone reaches as much there (no search counted)."""
        return np.asarray(np.exp(-self._tail))

    def line(self, expected: float, half_width: float = 0.0) -> LineTest:
        """The strongest line within `expected` +- `half_width` (and half a resolution), and what it is worth.

        Raises
        ------
        InputError
            When the range leaves the axis.
        """
        reach = max(half_width, self.step)
        low, high = round((expected - reach) / self.step), round((expected + reach) / self.step)
        if low < _SKIP_LINES or high >= self.power.size - 1:
            room = (_SKIP_LINES * self.step + reach, (self.power.size - 2) * self.step - reach)
            raise InputError(
                "ModulationSpectrum.line", "expected", expected, f"{room[0]:g} to {room[1]:g} {self.unit}"
            )
        peak = low + int(np.argmax(self.power[low : high + 1] / self.floor[low : high + 1]))
        looks = (_LINE_ENDS + _LINE_LOOKS * 2 * half_width / self.resolution) * self.looks
        return LineTest(
            expected,
            self._top(peak)[0],
            float(self.power[peak]),
            float(10 * np.log10(max(float(self.power[peak] / self.floor[peak]), 1e-30))),
            search_false_alarm(float(np.exp(-self._tail[peak])), looks),
        )

    def comb(
        self,
        expected: float,
        tolerance: float,
        sideband: float = 0.0,
        shafts: tuple[float, ...] = (),
    ) -> CombTest:
        """The most improbable comb of a fundamental within `expected` * (1 +- `tolerance`).

        Parameters
        ----------
        expected : float
            Fundamental, on the axis.
        tolerance : float
            Relative: slip, and how well the speed is known.
        sideband : float
            Spacing of sidebands: the shaft's speed for a fault that turns with it, the cage's for one on an
            element; 0 for none.
        shafts : tuple of float
            Speeds whose harmonics do not count: shafts and gears modulate too.

        Raises
        ------
        InputError
            When the second harmonic leaves the axis, or all lines are the shafts'.
        """
        top = (self.power.size - 2) * self.step
        if not (expected > _SKIP_LINES * self.step and 0 <= tolerance < 0.5):
            least = _SKIP_LINES * self.step
            found = (expected, tolerance)
            expected_text = f"above {least:g} {self.unit}, and 0 to 0.5"
            raise InputError("ModulationSpectrum.comb", "expected, tolerance", found, expected_text)
        if 2 * expected * (1 + tolerance) > top:
            limit = f"at most {0.5 * top / (1 + tolerance):g} {self.unit}, half of what the spectrum spans"
            raise InputError("ModulationSpectrum.comb", "expected", expected, limit)
        usable = self._free_of(shafts)
        lines = self.power.size
        grid = comb_grid(expected, tolerance, self.step, lines, sideband, self.resolution)
        score = score_combs(self._tail[np.newaxis], usable, grid).score[0]
        index = grid.harmonics[:, :4]
        on = (index >= 0) & usable[index]
        counted = on.sum(axis=1)
        if not np.any(counted >= 2):
            raise InputError(
                "ModulationSpectrum.comb", "shafts", shafts, "two harmonics at least that are not theirs"
            )
        # Of combs about as improbable that on the lines' tops; the mean, as some lines may not count.
        height = np.log(np.maximum(self.power / self.floor, 1e-3))[index] * on
        mean = height.sum(axis=1) / np.maximum(counted, 1)
        near = (score >= _PLATEAU * score.max()) & (counted >= 2)
        best = int(np.argmax(np.where(near, mean, -np.inf)))
        looks = (1.0 + _CELL_SHARE * 16 * tolerance * expected / self.resolution) * self.looks
        return CombTest(
            expected=expected,
            found=self._refined(grid.harmonics[best], usable, float(grid.fundamentals[best])),
            false_alarm=search_false_alarm(min(1.0, float(np.exp(-score.max()))), looks),
            modulation=self._modulation(grid.harmonics[best], grid.sidebands[best], usable),
            harmonics=self._lines(expected, grid.harmonics[best]),
            sidebands=self._pairs(expected, sideband, grid.sidebands[best]),
        )

    def peaks(self, false_alarm: float = 1e-3) -> tuple[LineTest, ...]:
        """Lines that noise would show with at most that probability anywhere on the axis, strongest first."""
        looks = _LINE_LOOKS * 0.5 * self.power.size * self.looks
        limit = -np.log(-np.expm1(np.log1p(-false_alarm) / looks))
        inner = self.power[1:-1]
        top = (inner >= self.power[:-2]) & (inner > self.power[2:]) & (self._tail[1:-1] > limit)
        places = np.flatnonzero(top) + 1
        places = places[places >= _SKIP_LINES]
        tests = []
        for place in places[np.argsort(-self._tail[places], kind="stable")]:
            ratio_db = float(10 * np.log10(self.power[place] / self.floor[place]))
            p = search_false_alarm(float(np.exp(-self._tail[place])), looks)
            found = self._top(int(place))[0]
            tests.append(LineTest(found, found, float(self.power[place]), ratio_db, p))
        return tuple(tests)

    def _top(self, line: int) -> tuple[float, float]:
        """Place and height over the floor of the parabola through the logarithms around a line."""
        ratio = self.power[line - 1 : line + 2] / self.floor[line - 1 : line + 2]
        left, mid, right = np.log(np.maximum(ratio, 1e-12))
        shift = 0.5 * (right - left) / max(2 * mid - left - right, 1e-9)
        return float((line + np.clip(shift, -1, 1)) * self.step), float(ratio[1])

    def _free_of(self, shafts: tuple[float, ...]) -> NDArray[np.bool_]:
        axis = self.axis
        usable = np.ones(axis.size, dtype=np.bool_)
        usable[:_SKIP_LINES] = False
        for turn in shafts:
            if not turn > 0:
                raise InputError("ModulationSpectrum.comb", "shafts", shafts, "speeds above 0")
            width = min(_LINE_HALF_WIDTH * self.resolution, 0.25 * turn)
            usable &= np.abs(axis - np.round(axis / turn) * turn) > width
        return usable

    def _refined(self, harmonics: NDArray[np.intp], usable: NDArray[np.bool_], fallback: float) -> float:
        """Slip widens a line as the square of its number, so weak harmonics say little."""
        rows = []
        for number, index in enumerate(harmonics, start=1):
            if not 2 <= index < self.power.size - 2 or not usable[index]:
                continue
            window = self.power[index - 2 : index + 3]
            peak = int(np.argmax(window))
            if peak in (0, 4):
                continue
            place, ratio = self._top(int(index) - 2 + peak)
            if ratio > 4.0:
                rows.append((number**2 * ratio, place / number, ratio))
        if not rows:
            return fallback
        table = np.array(rows)
        weight = table[:, 0] * (table[:, 2] >= _REFINE_SHARE * table[:, 2].max())
        return float(np.sum(weight * table[:, 1]) / np.sum(weight))

    def _modulation(
        self, harmonics: NDArray[np.intp], sidebands: NDArray[np.intp], usable: NDArray[np.bool_]
    ) -> float:
        index = np.unique(np.concatenate([harmonics, sidebands.ravel()]))
        index = index[index >= 0]
        index = index[usable[index]]
        return float(2.0 * np.sum(np.maximum(self.power[index] - self.floor[index], 0.0)))

    def _lines(self, fundamental: float, harmonics: NDArray[np.intp]) -> tuple[LineTest, ...]:
        places = [(k * fundamental, int(i)) for k, i in enumerate(harmonics, start=1)]
        return tuple(self._at(expected, index) for expected, index in places if self._on_axis(index))

    def _pairs(
        self, fundamental: float, spacing: float, sidebands: NDArray[np.intp]
    ) -> tuple[tuple[LineTest, LineTest], ...]:
        pairs = []
        for number, (low, high) in enumerate(sidebands, start=1):
            if self._on_axis(int(low)) and self._on_axis(int(high)):
                place = number * fundamental
                pairs.append((self._at(place - spacing, int(low)), self._at(place + spacing, int(high))))
        return tuple(pairs)

    def _on_axis(self, index: int) -> bool:
        return _SKIP_LINES <= index < self.power.size - 1

    def _at(self, expected: float, index: int) -> LineTest:
        ratio_db = float(10 * np.log10(max(float(self.power[index] / self.floor[index]), 1e-30)))
        found = self._top(index)[0]
        p = search_false_alarm(float(np.exp(-self._tail[index])), self.looks)
        return LineTest(expected, found, float(self.power[index]), ratio_db, p)
