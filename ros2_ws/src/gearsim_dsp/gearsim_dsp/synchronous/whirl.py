"""How the centre of a wheel runs round after the blow of one planet's tooth, from one sensor that stands.

In the plane that turns with the carrier a tooth of a planet always strikes in one direction, and what the sun
(or ring) does after it is the same at each of its blows: a motion z(t) = x + i y of the centre, whose part at
each frequency runs round forward (with the carrier) and backward. A sensor that stands in space hears it from
another direction each time, for the carrier has turned by a in between. Its analytic signal is::

    y(t; a) = F(t) exp(i a) + B(t) exp(-i a) + C(t)

F and B are the forward and the backward whirl; C turns with nothing (twist, a gearbox beside). With the
carrier at three or more places when the same tooth comes round they follow by least squares from all its
turns: coherent averages over the turn of the planet, as those of McFadden and Smith (Proc. Inst. Mech. Eng. C
199 (1985) 65-70), with the carrier's place known. No filter on the way, of sensor, path or analysis, changes
|F| / |B|: both went through it.

The mesh repeats each pitch in F, B and C, but for errors of the wheels that come and go once a turn. What is
so in the other teeth is taken away.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft

from gearsim_dsp.speed import Phase

__all__ = ["BINS_PER_TOOTH", "ToothBlow", "blow_of_tooth", "push_of_tooth", "unlike_the_rest", "whirl_parts"]

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

BINS_PER_TOOTH = 16
_BEFORE_TEETH, _WINDOW_TEETH = 0.75, 2  # around the place of the tooth: the blow and what rings after it
_BESIDE_TEETH = 2  # on either side of these, which the blow may still reach
_WAVES = 1
_REWEIGHTED = 5
_OVERSAMPLING = 16  # of the band's envelope: a straight line between its samples errs by 0.5 % at most
_LEAST_TURNS = 8
_END_S = 0.02
_WORST_CONDITION = 30.0


@dataclass(frozen=True, slots=True, eq=False)
class ToothBlow:
    """Energy of one tooth's blow, and what other teeth show of the same.

    Parameters
    ----------
    energy : ndarray, shape (..., parts)
        Mean square around the tooth of what the other teeth do not do, in the signal's unit squared.
    floor, scatter : ndarray, shape (..., parts)
        Mean and standard deviation of the same at the other teeth: noise and errors of sound teeth.
    """

    energy: Floats
    floor: Floats
    scatter: Floats

    @property
    def net(self) -> Floats:
        """Energy above the floor, at least half the scatter."""
        least = 0.5 * self.scatter + np.finfo(np.float64).tiny
        return np.asarray(np.maximum(self.energy - self.floor, least))

    @property
    def variance(self) -> Floats:
        """Of `net`; blow E, floor b, scatter s: s^2 of the noise and 2 s^2 E / b of noise by blow."""
        floor = np.maximum(self.floor, np.finfo(np.float64).tiny)
        return np.asarray(self.scatter**2 * (1.0 + 2.0 * self.net / floor))


def whirl_parts(
    signal: NDArray[np.floating],
    sample_rate_hz: float,
    phase: Phase,
    *,
    planet_ratio: float,
    carrier_ratio: float,
    teeth: int,
    bands_hz: Sequence[tuple[float, float]],
) -> Complexes | None:
    """Coherent averages over the turn of a planet: forward, backward and unturned part in each band.

    Parameters
    ----------
    signal : ndarray, shape (n,)
    sample_rate_hz : float
    phase : Phase
        Of the reference shaft.
    planet_ratio, carrier_ratio : float
        Turns of a planet against the carrier, and of the carrier against the sensor, in one turn of the
        reference shaft. A sensor on the carrier has 0, and only the unturned part.
    teeth : int
        Of the planet.
    bands_hz : sequence of tuple of float
        Below half the sampling rate.

    Returns
    -------
    ndarray of complex, shape (2, bands, 3 or 1, teeth * 16), or None
        Analytic signals, from the first and from the second half of the record: what only one of them shows
        is no tooth. None with too few turns, or where the carrier comes back to fewer than three places.
    """
    spare = round(_END_S * sample_rate_hz)
    turns = np.interp([2 * spare, signal.size - 1 - 2 * spare], phase.samples, phase.turns) * planet_ratio
    first, last = math.ceil(turns[0]), math.floor(turns[1])
    if last - first < _LEAST_TURNS:
        return None
    bins = teeth * BINS_PER_TOOTH
    planet = (first + np.arange((last - first) * bins) / bins).reshape(last - first, bins)
    at = np.interp(planet / planet_ratio, phase.turns, phase.samples)
    middle = (last - first) // 2
    halves = slice(0, middle), slice(middle, None)
    weights = [_least_squares(planet[half] * (carrier_ratio / planet_ratio)) for half in halves]
    spectrum = sfft.rfft(_without_ends(signal, spare))
    found = []
    for band in bands_hz:
        values = _analytic_at(spectrum, signal.size, (band[0] / sample_rate_hz, band[1] / sample_rate_hz), at)
        for half, weight in zip(halves, weights, strict=True):
            if weight is None:
                return None
            found.append(np.einsum("bpk,kb->pb", weight, values[half]))
    return np.array(found).reshape(len(bands_hz), 2, -1, bins).transpose(1, 0, 2, 3)


def blow_of_tooth(parts: Complexes, teeth: int, place: float) -> ToothBlow:
    """What one tooth does in coherent averages over the turn of its planet.

    Parameters
    ----------
    parts : ndarray of complex, shape (..., teeth * 16)
        Of `whirl_parts`.
    teeth : int
    place : float
        Where the tooth strikes, in turns of the planet.
    """
    bins = parts.shape[-1]
    turned = np.roll(parts, -round((place - _BEFORE_TEETH / teeth) * bins), axis=-1)
    by_tooth = turned.reshape(*parts.shape[:-1], teeth, bins // teeth)
    size = _WINDOW_TEETH
    others = np.arange(size + _BESIDE_TEETH, teeth - _BESIDE_TEETH)
    waves = np.exp(2j * np.pi * np.outer(np.arange(teeth), np.arange(-_WAVES, _WAVES + 1)) / teeth)
    fit = waves @ np.linalg.pinv(waves[others])
    rest = by_tooth - np.einsum("to,...ob->...tb", fit, by_tooth[..., others, :])
    square = np.mean(np.abs(rest) ** 2, axis=-1)
    # Where the fit goes on through the gap it misses more than in the teeth that it was made of.
    seen = 1.0 - np.real(np.diagonal(fit[others]))
    unseen = float(np.mean(1.0 + np.sum(np.abs(fit[:size]) ** 2, axis=1)))
    quiet = square[..., others] / seen * unseen
    windows = np.lib.stride_tricks.sliding_window_view(quiet, size, axis=-1).mean(axis=-1)
    return ToothBlow(square[..., :size].mean(axis=-1), quiet.mean(axis=-1), windows.std(axis=-1))


def push_of_tooth(parts: Complexes, teeth: int, place: float) -> tuple[float, float]:
    """Where the carrier stands when a tooth's blow moves the wheel to and fro along the sensor's axis.

    A motion along one line is a forward and a backward whirl of one size; the line's direction is half the
    angle between them, so it is known up to half a turn.

    Parameters
    ----------
    parts : ndarray of complex, shape (bands, 3, teeth * 16)
        Of `whirl_parts`, of one half of the record or their mean.
    teeth : int
    place : float
        Where the tooth strikes, in turns of the planet.

    Returns
    -------
    turn : float
        Of the carrier, 0 to 0.5.
    straightness : float
        1 for a motion along one line, 0 for a circle or for bands that disagree.
    """
    bins = parts.shape[-1]
    begin = round((place - _BEFORE_TEETH / teeth) * bins)
    window = np.roll(unlike_the_rest(parts, teeth), -begin, axis=-1)[..., : _WINDOW_TEETH * BINS_PER_TOOTH]
    forward, backward = window[..., 0, :], window[..., 1, :]
    product = complex(np.sum(np.conj(forward) * backward))
    power = 0.5 * float(np.sum(np.abs(forward) ** 2 + np.abs(backward) ** 2))
    turn = float(np.mod(np.angle(product) / (4.0 * math.pi), 0.5))
    return turn, abs(product) / power if power > 0 else 0.0


def unlike_the_rest(parts: Complexes, teeth: int) -> Complexes:
    """What each tooth does that the others do not, with few bad teeth wherever they are; shape as `parts`.

    The waves that the teeth have in common are fitted with weights: a tooth that differs more than most, and
    its neighbours, count the less the more energy is left of them (iteratively reweighted least squares).
    """
    by_tooth = parts.reshape(-1, teeth, parts.shape[-1] // teeth)
    waves = np.exp(2j * np.pi * np.outer(np.arange(teeth), np.arange(-_WAVES, _WAVES + 1)) / teeth)
    weight = np.ones(teeth)
    rest = by_tooth
    for _ in range(_REWEIGHTED):
        weighted = waves.conj().T * weight
        fit = waves @ np.linalg.solve(weighted @ waves, weighted)
        rest = by_tooth - np.einsum("to,pob->ptb", fit, by_tooth)
        energy = np.mean(np.abs(rest) ** 2, axis=2)
        energy /= np.maximum(np.median(energy, axis=1, keepdims=True), np.finfo(np.float64).tiny)
        mean = energy.mean(axis=0)
        mean = np.max([np.roll(mean, k) for k in (-1, 0, 1)], axis=0)
        weight = 1.0 / np.maximum(mean / np.median(mean), 1.0)
    return rest.reshape(parts.shape)


def _least_squares(carrier_turns: Floats) -> Complexes | None:
    """Weights of turns in the parts, shape (bins, parts, turns); None where they cannot be told apart."""
    if not np.ptp(carrier_turns):
        return np.full((carrier_turns.shape[1], 1, carrier_turns.shape[0]), 1.0 / carrier_turns.shape[0])
    turned = np.exp(2j * np.pi * carrier_turns.T)
    design = np.stack([turned, np.conj(turned), np.ones_like(turned)], axis=-1)
    adjoint = design.conj().transpose(0, 2, 1)
    gram = adjoint @ design
    if float(np.linalg.cond(gram).max()) > _WORST_CONDITION:
        return None
    return np.asarray(np.linalg.solve(gram, adjoint))


def _without_ends(signal: NDArray[np.floating], spare: int) -> Floats:
    """Faded in and out, for a jump from the end to the beginning would be one more blow."""
    faded = np.asarray(signal, dtype=np.float64) - float(np.mean(signal))
    fade = 0.5 - 0.5 * np.cos(np.pi * (np.arange(spare) + 0.5) / spare)
    faded[:spare] *= fade
    faded[faded.size - spare :] *= fade[::-1]
    return faded


def _analytic_at(spectrum: Complexes, samples: int, band: tuple[float, float], at: Floats) -> Complexes:
    """Analytic signal of a band at fractional samples: its slow envelope interpolated, then turned back."""
    low, high = (round(edge * samples) for edge in band)
    width = high - low
    size = sfft.next_fast_len(_OVERSAMPLING * width)
    lines = np.zeros(size, dtype=np.complex128)
    lines[:width] = spectrum[low:high] * np.sin(np.pi * (np.arange(width) + 0.5) / width)
    middle = width // 2
    slow = sfft.ifft(np.roll(lines, -middle)) * (2.0 * size / samples)
    place = np.arange(size) * (samples / size)
    turning = np.exp(2j * np.pi * ((low + middle) / samples) * at)
    return np.asarray((np.interp(at, place, slow.real) + 1j * np.interp(at, place, slow.imag)) * turning)
