"""The squared cyclic coherence of one record or averaged over windows, with its law under noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import special

from gearsim_io.errors import InputError

__all__ = ["CoherenceMap"]


@dataclass(frozen=True, slots=True, eq=False)
class CoherenceMap:
    """Squared coherence; rows are carrier frequencies, columns cyclic frequencies.

    Parameters
    ----------
    values : ndarray of float32 or float64, shape (bins, alphas)
        |g|^2 in 0..1, see `correlation`.
    resolution_hz : float
        Width of a bin; bin k covers [k, k + 1) * resolution_hz.
    alpha_step : float
        Column j is at the cyclic frequency j * `alpha_step`, half the resolution in it.
    alpha_unit : {"Hz", "order"}
    averages : float
        Independent lines behind the coherence of one window.
    first_bin : int
        Bins before it have no line below them at the highest cyclic frequencies.
    windows : float
        Independent windows that `values` is the mean of.
    """

    values: NDArray[np.floating]
    resolution_hz: float
    alpha_step: float
    alpha_unit: Literal["Hz", "order"]
    averages: float
    first_bin: int
    windows: float = 1.0

    @property
    def frequency_hz(self) -> NDArray[np.float64]:
        """Centres of the bins, shape (bins,)."""
        return np.asarray((np.arange(self.values.shape[0]) + 0.5) * self.resolution_hz)

    @property
    def alpha(self) -> NDArray[np.float64]:
        """Cyclic frequencies in `alpha_unit`, shape (alphas,)."""
        return np.asarray(np.arange(self.values.shape[1]) * self.alpha_step)

    def bins(self, band_hz: tuple[float, float] | None = None) -> slice:
        """The bins whose centres lie in a band [low, high), or all from `first_bin`.

        Raises
        ------
        InputError
            When there is none.
        """
        if band_hz is None:
            return slice(self.first_bin, self.values.shape[0])
        first, last = (int(np.ceil(edge / self.resolution_hz - 0.5)) for edge in band_hz)
        first, last = max(first, 0), min(last, self.values.shape[0])
        if not first < last:
            top = self.values.shape[0] * self.resolution_hz
            expected = f"a band inside 0..{top:g} Hz that holds a bin of {self.resolution_hz:g} Hz"
            raise InputError("CoherenceMap", "band_hz", band_hz, expected)
        return slice(first, last)

    def threshold(self, false_alarm: float) -> float:
        """The value that stationary Gaussian noise exceeds with that probability in one place.

        Of one window 1 - |g|^2 is U^(1 / (averages - 1)); a mean of several is nearly Gamma-distributed.
        """
        if not 0 < false_alarm < 1:
            raise InputError("CoherenceMap", "false_alarm", false_alarm, "a probability between 0 and 1")
        if self.windows == 1.0:
            return float(-np.expm1(np.log(false_alarm) / (self.averages - 1.0)))
        return float(special.gammainccinv(self.windows, false_alarm) / (self.windows * self.averages))

    def for_picture(self, columns: int, false_alarm: float = 1e-3) -> tuple[NDArray[np.float64], float]:
        """The map with fewer columns, each the largest of its neighbours, NaN where noise reaches as much.

        Parameters
        ----------
        columns : int
            At most as many as the map has.
        false_alarm : float
            Probability that noise is shown at all in one column of one bin.

        Returns
        -------
        values : ndarray of float64, shape (bins, columns)
        step : float
            Width of a column in `alpha_unit`; the first begins at 0.
        """
        count = self.values.shape[1]
        if not 1 <= columns <= count:
            raise InputError("CoherenceMap", "columns", columns, f"1 to {count}")
        each = count // columns
        groups = self.values[:, : columns * each].reshape(-1, columns, each)
        largest = groups.max(axis=2).astype(np.float64)
        # Columns lie half a resolution apart: half of a group's are looks of their own, its ends a bit more.
        looks = 1.0 if each == 1 else 0.5 * each + 0.7
        chance = self.threshold(-np.expm1(np.log1p(-false_alarm) / looks))
        return np.where(largest > chance, largest, np.nan), each * self.alpha_step
