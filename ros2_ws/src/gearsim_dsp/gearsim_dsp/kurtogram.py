"""The fast kurtogram: kurtosis of the complex envelope over a binary-ternary tree of bands.

Antoni, Mech. Syst. Signal Process. 21 (2007) 108-124, with the filters of his published program: 17 taps,
cut-off 0.4, for two bands and 25 taps for three. Here the tree is walked in the frequency domain: a filter is
a product, decimation a folding, and each node costs one inverse FFT of its own length. Circular convolution
touches only samples at the beginning, which the method drops anyway, so the values are those of the
time-domain programs when the length is a multiple of 3 * 2^levels.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft
from scipy.signal import firwin

from gearsim_io.errors import InputError

__all__ = ["Kurtogram", "KurtogramNode", "fast_kurtogram", "largest_level"]

_ORDER = 16
_CUTOFF = 0.4
_LEAST_SAMPLES = 128

_Lines = NDArray[np.complexfloating]


@dataclass(frozen=True, slots=True)
class KurtogramNode:
    """One band: `level` is log2 of the number of bands side by side (1.58 for three)."""

    level: float
    low_hz: float
    high_hz: float
    kurtosis: float
    mean_square: float
    segment_kurtosis: float

    @property
    def width_hz(self) -> float:
        """Width of the band."""
        return self.high_hz - self.low_hz


@dataclass(frozen=True, slots=True)
class Kurtogram:
    """All nodes, level by level, from low to high frequency.

    `kurtosis` of a node is the excess kurtosis of its complex envelope over the whole signal (0 for Gaussian
    noise), `segment_kurtosis` the median of the same over segments, which a single spike does not move, and
    `mean_square` the power of its envelope in the signal's unit squared.
    """

    nodes: tuple[KurtogramNode, ...]
    samples: int

    @property
    def strongest(self) -> KurtogramNode:
        """The node of the largest kurtosis, without any guard (see `band_choice` for those)."""
        return max(self.nodes, key=lambda node: node.kurtosis)


def largest_level(samples: int) -> int:
    """How deep the tree may go so that the narrowest band still has 128 samples."""
    return max(1, int(np.log2(max(samples, 2) / _LEAST_SAMPLES)))


def fast_kurtogram(
    samples: NDArray[np.float32] | NDArray[np.float64],
    sample_rate_hz: float,
    levels: int = 7,
    segments: int = 8,
) -> Kurtogram:
    """Kurtosis of every band of the tree.

    Parameters
    ----------
    samples : ndarray, shape (n,)
        Some samples at the end are left out (less than 1 % of long signals), for the sake of fast FFTs.
    sample_rate_hz : float
    levels : int
        Depth: the narrowest bands are sample_rate / 2^(levels + 1) wide.
    segments : int
        Parts of the signal for `segment_kurtosis`.

    Raises
    ------
    InputError
        When the signal is too short for so many levels.
    """
    x: NDArray[np.float32] | NDArray[np.float64] = samples
    unit = 3 << levels
    if x.ndim != 1 or levels < 1 or levels > largest_level(x.size):
        expected = f"1 to {largest_level(x.size)} for {x.size} samples in a vector"
        raise InputError("fast_kurtogram", "levels", levels, expected)
    pieces = x.size // unit
    while sfft.next_fast_len(pieces) != pieces:
        pieces -= 1
    count = pieces * unit
    x = x[:count] - x.dtype.type(np.mean(x[:count].astype(np.float64)))
    tree = _Tree(x, float(sample_rate_hz), levels, segments)
    return Kurtogram(tuple(tree.nodes()), count)


class _Tree:
    def __init__(
        self,
        x: NDArray[np.float32] | NDArray[np.float64],
        sample_rate_hz: float,
        levels: int,
        segments: int,
    ) -> None:
        self._x, self._rate, self._levels, self._segments = x, sample_rate_hz, levels, segments
        low = firwin(_ORDER + 1, _CUTOFF)
        h = low * np.exp(2j * np.pi * np.arange(_ORDER + 1) * 0.125)
        n = np.arange(2, _ORDER + 2)
        g = h[(1 - n) % _ORDER] * (-1.0) ** (1 - n)
        self._skips = (h.size - 1, g.size - 1)
        taps = 3 * _ORDER // 2 + 1
        third = firwin(taps, 2 / 3 * _CUTOFF) * np.exp(2j * np.pi * np.arange(taps) * 0.25 / 3)
        thirds = [third * np.exp(2j * np.pi * np.arange(taps) * k / 6) for k in range(3)]
        complex_type = np.result_type(x.dtype, np.complex64)
        self._pair = _responses((h, g), 1, 0.5, x.size, complex_type)
        self._triple = _responses(thirds, 2, 1 / 3, x.size, complex_type)

    def nodes(self) -> Iterator[KurtogramNode]:
        square = self._x.astype(np.float64) ** 2
        part = square.size // self._segments
        second, fourth = _powers(square[: part * self._segments].reshape(self._segments, part))
        segment = float(np.median(_excess(second, fourth))) - 1.0
        power = float(np.mean(square))
        whole = float(np.mean(square**2)) / max(power**2, 1e-300) - 3.0
        yield KurtogramNode(0.0, 0.0, self._rate / 2, whole, power, segment)
        lines = sfft.fft(self._x)[np.newaxis]
        for level in range(1, self._levels + 1):
            parent = lines
            lines = self._halves(parent)
            yield from self._judged(lines, float(level), self._skips)
            if level < self._levels:
                thirds = float(level + np.log2(3) - 1)
                yield from self._judged(self._split_in_three(parent), thirds, (_ORDER,))

    def _halves(self, lines: _Lines) -> _Lines:
        """The lower and the upper half of every node, decimated by two (samples 1, 3, 5 ...)."""
        halves = _filtered(lines, self._pair)
        # The upper half lies mirrored around a quarter of the rate: times (-1)^n for n = 1, 2, ...
        upper = halves[1::2]
        halves[1::2] = np.roll(upper, upper.shape[1] // 2, axis=1)
        np.negative(halves[1::2], out=halves[1::2])
        return halves

    def _split_in_three(self, lines: _Lines) -> _Lines:
        return _filtered(lines, self._triple)

    def _judged(self, lines: _Lines, level: float, skips: tuple[int, ...]) -> Iterator[KurtogramNode]:
        """Nodes of one level; row k of `lines` drops its first skips[k % len(skips)] samples."""
        z = sfft.ifft(lines, axis=1)
        bands = z.shape[0]
        values = np.empty((3, bands))
        for first, skip in enumerate(skips):
            values[:, first :: len(skips)] = self._moments(z[first :: len(skips), skip:])
        width = self._rate / 2 / bands
        for k, (whole, median, power) in enumerate(values.T.tolist()):
            yield KurtogramNode(level, k * width, (k + 1) * width, whole, power, median)

    def _moments(self, z: _Lines) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Excess kurtosis, its median over the segments, and mean square of each row."""
        square = _centred_square(z)
        length = square.shape[1]
        part = length // self._segments
        if part < 8:
            second, fourth = _powers(square)
            whole = _excess(second, fourth)
            return whole, whole, second
        used = part * self._segments
        second, fourth = _powers(square[:, :used].reshape(square.shape[0], self._segments, part))
        median = np.median(_excess(second, fourth), axis=1)
        rest = square[:, used:].astype(np.float64)
        all_second = (part * second.sum(axis=1) + rest.sum(axis=1)) / length
        all_fourth = (part * fourth.sum(axis=1) + np.square(rest).sum(axis=1)) / length
        return _excess(all_second, all_fourth), median, all_second


def _responses(
    taps: Sequence[NDArray[np.complex128]], advance: int, gain: float, count: int, kind: np.dtype[Any]
) -> list[_Lines]:
    """Frequency responses over `count` lines, times the advance by so many samples, times a gain."""
    responses: list[_Lines] = []
    for filter_taps in taps:
        early = np.zeros(count, dtype=kind)
        early[np.arange(filter_taps.size) - advance] = gain * filter_taps
        responses.append(sfft.fft(early, overwrite_x=True))
    return responses


def _filtered(lines: _Lines, responses: list[_Lines]) -> _Lines:
    """Every row through every filter, decimated by their number: rows of the first node, then the second.

    The response of a filter over fewer lines is every so-manieth value of that over more.
    """
    rows, count = lines.shape
    folds = len(responses)
    kept = count // folds
    result = np.empty((rows, folds, kept), dtype=lines.dtype)
    part = np.empty((rows, kept), dtype=lines.dtype)
    for k, response in enumerate(responses):
        short = response[:: response.size // count]
        target = result[:, k]
        np.multiply(lines[:, :kept], short[:kept], out=target)
        for fold in range(1, folds):
            some = slice(fold * kept, (fold + 1) * kept)
            np.multiply(lines[:, some], short[some], out=part)
            target += part
    return result.reshape(rows * folds, kept)


def _centred_square(z: _Lines) -> NDArray[np.floating]:
    centred = z - z.mean(axis=-1, keepdims=True)
    return np.asarray(centred.real**2 + centred.imag**2)


def _powers(square: NDArray[np.floating]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Means over the last axis of |z|^2 and of |z|^4."""
    second = square.mean(axis=-1, dtype=np.float64)
    fourth = np.einsum("...i,...i->...", square, square) / square.shape[-1]
    return second, np.asarray(fourth, dtype=np.float64)


def _excess(second: NDArray[np.float64], fourth: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(fourth / np.maximum(second**2, np.finfo(np.float64).tiny) - 2.0)
