"""How strongly the averaged spectra of one channel show a fault family."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from gearsim_dsp.comb import CombGrid, comb_grid, score_combs
from gearsim_dsp.evidence import ChannelSpectra
from gearsim_dsp.family_evidence import BandLevel, FamilyEvidence, proves, weight
from gearsim_dsp.kinematics import FaultFamily
from gearsim_dsp.noise_floor import LineTail, local_floor, search_false_alarm
from gearsim_dsp.shaft_lines import (
    ShaftMultiple,
    SpectrumView,
    covering_multiple,
    other_shafts,
    over_shaft,
    strongest_other_multiple,
)
from gearsim_dsp.speed import ShaftSpeed
from gearsim_io.nameplate import Machine

__all__ = ["BandLevel", "FamilyEvidence", "FamilySearch"]

_BLOCK_LINES = 160
_SKIP_LINES = 4
_LINE_HALF_WIDTH = 1.6
_MOST_DOMINANCE = 1000.0
_CLEAR = 12.0
# Powers of a band over that of the channel, and over that of the loudest channel, below which it holds only
# leakage and rounding: sensors and converters do not reach so far down.
_LEAST_OF_OWN, _LEAST_OF_ALL = 1e-7, 1e-8
_REFINE_SHARE = 0.25
_PLATEAU = 0.7
_TOP_HARMONICS = 4
_OWN_SIDEBANDS = 4
_SHAFT_SIDEBANDS = 1
_CELL_SHARE = 0.5  # independent looks per resolution cell of the 8th harmonic, counted on noise


class FamilySearch:
    """Looks for fault families in the averaged spectra of one channel.

    Parameters
    ----------
    machine : Machine
    spectra : ChannelSpectra
    speed : ShaftSpeed
        Where the spectra's axis counts nameplate speed, its value corrects the axis and its interval widens
        the search.
    looks : int
        Channels times families searched in all, for the false-alarm probability.
    loudest : float
        Greatest mean square of a channel (`ChannelSpectra.whole`); bands that are nothing beside it are left
        out.
    """

    def __init__(
        self,
        machine: Machine,
        spectra: ChannelSpectra,
        speed: ShaftSpeed,
        looks: int,
        loudest: float = 0.0,
    ) -> None:
        self._spectra = spectra
        self._looks = looks
        self._scale = speed.value_hz / spectra.axis_speed_hz
        self._doubt = max(speed.relative_error, 0.0)
        self._resolution = 1.0 / spectra.turns
        least = max(_LEAST_OF_OWN * spectra.whole, _LEAST_OF_ALL * loudest)
        self._filled = spectra.level > least
        floor = local_floor(spectra.power, _BLOCK_LINES, spectra.averages, _SKIP_LINES)
        self._machine = machine
        turns = [shaft.ratio for shaft in machine.shafts]
        ratio, tail = self._with_mean(spectra.power / floor)
        self._view = SpectrumView(ratio, tail, spectra.power - floor, self._free_of(turns))
        self._over_shafts: dict[ShaftMultiple, SpectrumView] = {}
        self._top_width = 2 * round(self._resolution / spectra.order_step) + 1
        self._explained = np.zeros(spectra.power.shape[1], dtype=np.bool_)

    def _with_mean(self, ratio: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Rows of the bands and, when there are several side by side, one for the mean of these.

        Weak lines are in many bands.
        """
        averages = self._spectra.averages
        worth = 0.45 * _BLOCK_LINES / 2
        tail = LineTail(averages, averages * worth)(ratio)
        independent = np.array([band.why != "between" for band in self._spectra.bands])
        bands = int(np.count_nonzero(independent))
        if bands < 2:
            return ratio, tail
        mean = np.asarray(ratio[independent].mean(axis=0, keepdims=True), dtype=np.float64)
        mean /= local_floor(mean, _BLOCK_LINES, averages * bands, _SKIP_LINES)
        mean_tail = LineTail(averages * bands, averages * bands * worth)(mean)
        return np.vstack([ratio, mean]), np.vstack([tail, mean_tail])

    def _free_of(self, shaft_orders: Iterable[float]) -> NDArray[np.bool_]:
        """False at harmonics of the shafts; gear meshes with their sidebands are among these."""
        order = self._axis()
        usable = order > 0.0
        usable[:_SKIP_LINES] = False
        for shaft_order in shaft_orders:
            turn = shaft_order * self._scale
            number = np.round(order / turn)
            width = _LINE_HALF_WIDTH * self._resolution + self._doubt * order
            usable &= np.abs(order - number * turn) > np.minimum(width, 0.25 * turn)
        return np.asarray(usable)

    def _axis(self) -> NDArray[np.float64]:
        lines = np.arange(self._spectra.power.shape[1], dtype=np.float64)
        return np.asarray(lines * self._spectra.order_step)

    def judge(self, family: FaultFamily) -> FamilyEvidence:
        """Evidence of a family on this channel; where a shaft covers it, the better of two ways to look.

        Where harmonics that can be parted from the shafts' prove the family, all count for its size.
        """
        plain = self._judged(family, None)
        multiple = covering_multiple(self._machine, family, self._resolution / self._scale, self._doubt)
        if multiple is None:
            return replace(plain, modulation=self._filled_size(plain)) if proves(plain) else plain
        if proves(plain):
            size = max(plain.modulation, self._whole_size(plain, multiple))
            plain = replace(plain, modulation=size, covered_by=multiple)
        return max(plain, self._judged(family, multiple), key=weight)

    def _whole_size(self, found: FamilyEvidence, multiple: ShaftMultiple) -> float:
        """Modulation with the lines that fall on the shaft's, as far as they are above its other lines."""
        grid = self._grid(found.family, found.found_order * self._scale, 0.0)
        sizes = self._modulation(self._view_of(multiple), grid, 0)
        return float(sizes[self._spectra.bands.index(found.band)])

    def _filled_size(self, found: FamilyEvidence) -> float:
        """Modulation with harmonics that fall on a shaft's taken as high as the next one that does not.

        Impacts have harmonics that fall off with their number; what falls on a shaft's line cannot be seen.
        """
        grid = self._grid(found.family, found.found_order * self._scale, 0.0)
        row = self._view.excess[self._spectra.bands.index(found.band)]
        more = above = 0.0
        for line in grid.harmonics[0][::-1]:
            if line < 0:
                continue
            if not self._view.usable[line]:
                more += above
            elif not self._explained[line]:
                above = 2.0 * max(float(row[line]), 0.0)
        return found.modulation + more

    def _judged(self, family: FaultFamily, multiple: ShaftMultiple | None) -> FamilyEvidence:
        half_width = family.tolerance + self._doubt
        grid = self._grid(family, family.order * self._scale, half_width)
        view = self._view_of(multiple)
        scores = score_combs(view.tail, view.usable, grid)
        row, best = self._peak(view, grid, scores.score, multiple is not None)
        trials = scores.score.shape[0] * self._independent_orders(family, half_width)
        p = search_false_alarm(min(1.0, float(np.exp(-scores.score[row].max()))), trials * self._looks)
        modulation = self._modulation(view, grid, best)
        band = self._band(scores.score[:, best], modulation, trials)
        found = self._refined(view, grid, best, row)
        harmonics, sidebands = self._snr_db(view, grid, best, band)
        spectra = self._spectra
        return FamilyEvidence(
            family=family,
            channel=spectra.channel,
            band=spectra.bands[band],
            found_order=found / self._scale,
            found_hz=found * spectra.axis_speed_hz,
            harmonic_snr_db=harmonics,
            sideband_snr_db=sidebands,
            snr_db=max(harmonics[:4], default=float("nan")),
            false_alarm_probability=p,
            modulation=float(modulation[band]) if self._filled[band] else 0.0,
            dominance=self._over_others(view, family, found, band, float(modulation[band]), multiple)
            if p < 0.01
            else 0.0,
            by_band=self._by_band(scores.score[:, best] - np.log(trials), modulation),
            windows=spectra.windows,
            covered_by=multiple,
        )

    def _over_others(
        self,
        view: SpectrumView,
        family: FaultFamily,
        found: float,
        band: int,
        modulation: float,
        multiple: ShaftMultiple | None,
    ) -> float:
        dominance = self._dominance(view, family, found, band, modulation)
        if multiple is None:
            return dominance
        return min(dominance, self._dominance_on_shaft(multiple, band, modulation))

    def _view_of(self, multiple: ShaftMultiple | None) -> SpectrumView:
        """The spectra as a family is judged on them, without lines that are explained already."""
        view = self._view
        if multiple is not None:
            if multiple not in self._over_shafts:
                self._over_shafts[multiple] = over_shaft(
                    view,
                    self._spectra.power,
                    self._spectra.order_step,
                    self._lines_wide,
                    multiple.shaft_order * self._scale,
                    multiple.number,
                    self._free_of(other_shafts(self._machine, multiple, self._resolution / self._scale)),
                )
            view = self._over_shafts[multiple]
        return replace(view, usable=view.usable & ~self._explained)

    @property
    def _lines_wide(self) -> int:
        return max(1, round(_LINE_HALF_WIDTH * self._resolution / self._spectra.order_step))

    def _dominance_on_shaft(self, multiple: ShaftMultiple, band: int, modulation: float) -> float:
        """The modulation over that of the shaft's strongest other multiple nearby."""
        rival = strongest_other_multiple(
            self._view.excess[band],
            self._spectra.order_step,
            self._lines_wide,
            multiple.shaft_order * self._scale,
            multiple.number,
        )
        return min(modulation / max(rival, 1e-12), _MOST_DOMINANCE)

    def _grid(self, family: FaultFamily, order: float, half_width: float) -> CombGrid:
        lines = self._spectra.power.shape[1]
        sideband = family.sideband_order * self._scale
        return comb_grid(order, half_width, self._spectra.order_step, lines, sideband, self._resolution)

    def _peak(
        self, view: SpectrumView, grid: CombGrid, score: NDArray[np.float64], over: bool
    ) -> tuple[int, int]:
        """Row and candidate of the best comb; of candidates about as improbable, that on the lines' tops.

        Next to a shaft's line, where the true ones cannot be used, its flanks can: where lines are not
        measured `over` a shaft, the first usable ones count, less what stands higher within a resolution.
        """
        row = int(np.argmax(score.max(axis=1)))
        near = score[row] >= _PLATEAU * score[row].max()
        index = grid.harmonics[:, : _TOP_HARMONICS if over else None]
        on = (index >= 0) & view.usable[index]
        on &= np.cumsum(on, axis=1) <= _TOP_HARMONICS
        top = np.log(np.maximum(view.ratio[row], 1e-3))
        height = (top if over else 2 * top - maximum_filter1d(top, self._top_width))[index] * on
        # The mean, not the sum: a candidate must not lose because one of its lines falls on the shaft's.
        mean = height.sum(axis=1) / np.maximum(on.sum(axis=1), 1)
        return row, int(np.argmax(np.where(near & (on.sum(axis=1) >= 2), mean, -np.inf)))

    def _independent_orders(self, family: FaultFamily, half_width: float) -> float:
        return 1.0 + _CELL_SHARE * 2 * half_width * family.order * 8 / self._resolution

    def _modulation(self, view: SpectrumView, grid: CombGrid, at: int) -> NDArray[np.float64]:
        """Mean square of a comb's lines, per band: a line of power m^2 / 4 is a cosine of mean square m^2 /
        2.
        """
        index = np.concatenate([grid.harmonics[at], grid.sidebands[at].ravel()])
        index = np.unique(index[(index >= 0)])
        index = index[view.usable[index]]
        return np.asarray(2.0 * np.maximum(view.excess[:, index], 0.0).sum(axis=1))

    def _by_band(self, score: NDArray[np.float64], modulation: NDArray[np.float64]) -> tuple[BandLevel, ...]:
        amplitude = self._spectra.level * np.sqrt(2 * modulation)
        rows = zip(self._spectra.bands, amplitude.tolist(), score[: modulation.size].tolist(), strict=True)
        return tuple(BandLevel(band, level, value > _CLEAR) for band, level, value in rows)

    def _band(self, score: NDArray[np.float64], modulation: NDArray[np.float64], trials: float) -> int:
        """The band with the largest modulation among those where the comb itself is significant."""
        bands = modulation.size
        clear = (score[:bands] - np.log(trials) > _CLEAR) & self._filled
        if not np.any(clear):
            return int(np.argmax(np.where(self._filled, score[:bands], -1.0)))
        return int(np.argmax(np.where(clear, modulation, -1.0)))

    def _refined(self, view: SpectrumView, grid: CombGrid, at: int, row: int) -> float:
        """Fundamental on the axis from the interpolated peaks of the strongest harmonics.

        Slip widens a line as the square of its number, so harmonics that have lost more than 6 dB against the
        strongest say little; those left weigh by the square of their number and by their power.
        """
        spectrum = view.ratio[row]
        peaks = []
        for number, index in enumerate(grid.harmonics[at], start=1):
            if not 2 <= index < spectrum.size - 2 or not view.usable[index]:
                continue
            window = spectrum[index - 2 : index + 3]
            peak = int(np.argmax(window))
            if peak in (0, 4) or window[peak] < 4.0:
                continue
            left, mid, right = np.log(np.maximum(window[peak - 1 : peak + 2], 1e-12))
            shift = 0.5 * (right - left) / max(2 * mid - left - right, 1e-9)
            order = (index - 2 + peak + shift) * self._spectra.order_step / number
            peaks.append((number, order, float(window[peak])))
        if not peaks:
            return float(grid.fundamentals[at])
        table = np.array(peaks)
        weight = table[:, 0] ** 2 * table[:, 2] * (table[:, 2] >= _REFINE_SHARE * table[:, 2].max())
        return float(np.sum(weight * table[:, 1]) / np.sum(weight))

    def _snr_db(
        self, view: SpectrumView, grid: CombGrid, at: int, band: int
    ) -> tuple[tuple[float, ...], tuple[float, ...]]:
        ratio = view.ratio[band]
        harmonics = [self._db(ratio, i) for i in grid.harmonics[at] if i >= 0]
        pairs = [[self._db(ratio, i) for i in pair if i >= 0] for pair in grid.sidebands[at]]
        return tuple(harmonics), tuple(max(pair) for pair in pairs if pair)

    @staticmethod
    def _db(ratio: NDArray[np.float64], index: np.intp) -> float:
        return float(10 * np.log10(max(float(ratio[index]), 1e-3)))

    def _dominance(
        self, view: SpectrumView, family: FaultFamily, found: float, band: int, modulation: float
    ) -> float:
        """The family's modulation over that of the strongest comb made of lines it does not explain.

        Combs between 0.5 and 2 times the order, all with eight harmonics.
        """
        unexplained = view.usable & ~self._lines_of(family, found)
        candidates = np.arange(0.5 * found, 2.0 * found, self._resolution / 16)
        index = np.round(candidates[:, None] * np.arange(1, 9) / self._spectra.order_step).astype(np.intp)
        inside = index < view.excess.shape[1]
        index = np.where(inside, index, 0)
        power = np.maximum(view.excess[band, index], 0.0) * (inside & unexplained[index])
        rival = float(np.max(2.0 * power.sum(axis=1), initial=0.0))
        return min(modulation / max(rival, 1e-12), _MOST_DOMINANCE)

    def explain(self, family: FaultFamily, found_order: float) -> None:
        """Take the lines of a family that was found out of the search for others."""
        self._explained |= self._lines_of(family, found_order * self._scale)

    def _lines_of(self, family: FaultFamily, found: float) -> NDArray[np.bool_]:
        """Harmonics of the fundamental, with sidebands of the shaft's and of the family's own spacing."""
        order = self._axis()
        width = _LINE_HALF_WIDTH * self._resolution + 0.002 * order
        shifts = {0.0}
        if family.order < 1.0:
            return np.asarray(np.abs(order - np.maximum(1.0, np.round(order / found)) * found) < width)
        own = family.sideband_order * self._scale
        shifts |= {k * self._scale for k in range(-_SHAFT_SIDEBANDS, _SHAFT_SIDEBANDS + 1)}
        shifts |= {k * own for k in range(-_OWN_SIDEBANDS, _OWN_SIDEBANDS + 1)}
        lines = np.zeros(order.size, dtype=np.bool_)
        for shift in shifts:
            number = np.maximum(1.0, np.round((order - shift) / found))
            lines |= np.abs(order - shift - number * found) < width
        return lines
