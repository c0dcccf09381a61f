"""What a synchronous average says of a shaft's wheels: the tooth that stands out, and all teeth together."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft
from scipy import special
from scipy.ndimage import uniform_filter1d

from gearsim_dsp.angle.resample import full_rate
from gearsim_dsp.judges.measured import Measured, wheels_on
from gearsim_dsp.synchronous.signals import mesh_lines
from gearsim_dsp.synchronous.tsa import Average
from gearsim_io.nameplate import Machine

__all__ = ["ChannelSigns", "ShaftSigns", "energy_by_angle", "shaft_signs", "standing_tooth"]

Array = NDArray[np.float64]

_SAMPLES_PER_TOOTH = 64  # mesh harmonics up to 32
_SIDEBANDS = 2
_SHAFT_HARMONICS = 6  # what shafts and couplings do belongs to the shaft judge
_NEAR_TEETH = 2.5
# 69 sound gearboxes with 4 to 9 turns reach 1.4 times the next tooth, 18 with a spall have 9 and more.
_LEAST_TURNS = 5.0
_MOST_DECADES = 60.0
_NOISE_DOUBT = 0.1  # of the noise's energy: how well some dozens of averaged turns tell it
_LEAST_FUNDAMENTAL = 0.1  # of the strongest mesh line: less is some other machine part at these orders
_TINY = float(np.finfo(np.float64).tiny)


@dataclass(frozen=True, slots=True, eq=False)
class ChannelSigns:
    """One channel over the turn of one shaft.

    Parameters
    ----------
    channel : str
    regular_rms, difference_rms, noise_rms : float
        Of the regular signal, of the difference signal, and what of the latter is random.
    mesh_rms : ndarray, shape (8,)
        Lines 1 to 8 of the mesh, their first two sidebands not counted.
    profile : ndarray, shape (samples,)
        Mean square of the difference signal over one pitch around each angle.
    difference : ndarray, shape (samples,)
    doubt : ndarray, shape (samples,)
        What of the profile may be random at each angle, by the scatter of the single turns there.
    fm4 : float
    """

    channel: str
    regular_rms: float
    difference_rms: float
    noise_rms: float
    mesh_rms: Array
    profile: Array
    difference: Array
    doubt: Array
    fm4: float


@dataclass(frozen=True, slots=True, eq=False)
class ShaftSigns:
    """The teeth of the wheels that turn at one speed.

    Parameters
    ----------
    ratio : float
        Speed over the reference shaft's.
    teeth : int
        Of the wheel judged.
    channels : tuple of ChannelSigns
    place : float
        Angle of the tooth that stands out most, in turns.
    over_rest, over_median : float
        Energy of that tooth over that of the strongest other one, and over the median angle.
    log10_chance : float
        Logarithm of the probability that teeth as uneven as the others have one so far out.
    best : ChannelSigns
        That shows it best.
    turns : int
        Averaged.
    """

    ratio: float
    teeth: int
    channels: tuple[ChannelSigns, ...]
    place: float
    over_rest: float
    over_median: float
    log10_chance: float
    best: ChannelSigns
    turns: int

    @property
    def over_doubt(self) -> float:
        """Energy of the tooth over what impacts that have nothing to do with the turn may leave there."""
        at = round(self.place * self.best.profile.size) % self.best.profile.size
        return float(self.best.profile[at] / max(float(self.best.doubt[at]), _TINY))

    @property
    def spread(self) -> float:
        """Difference signal without its strongest tenth over the regular signal: teeth uneven all round."""
        return _median(
            [
                math.sqrt(max(_trimmed(one.profile) - one.noise_rms**2, 0.0)) / max(one.regular_rms, _TINY)
                for one in self._clear
            ]
        )

    @property
    def harmonics(self) -> float:
        """Mesh harmonics 2 to 8 over the fundamental."""
        return _median(
            [
                float(np.sqrt(np.sum(one.mesh_rms[1:] ** 2)) / max(one.mesh_rms[0], _TINY))
                for one in self._clear
            ]
        )

    @property
    def mesh_is_heard(self) -> bool:
        """The lines of this mesh make up most of what is regular, and stand out of the noise."""
        heard = [
            float(np.sqrt(np.sum(one.mesh_rms**2))) >= max(0.7 * one.regular_rms, 3.0 * one.noise_rms)
            and one.mesh_rms[0] >= _LEAST_FUNDAMENTAL * float(one.mesh_rms.max())
            for one in self._clear
        ]
        return bool(2 * sum(heard) > len(heard))

    @property
    def _clear(self) -> list[ChannelSigns]:
        """Channels on which the mesh stands well above the noise; the clearest where it does on none."""
        clear = [one for one in self.channels if one.regular_rms > 5.0 * one.noise_rms]
        top = max(self.channels, key=lambda one: one.regular_rms / max(one.noise_rms, _TINY))
        # Those that hear the mesh at a tenth of the loudest at least: the others hear something else.
        loudest = max((one.regular_rms for one in clear), default=0.0)
        return [one for one in clear if one.regular_rms >= 0.1 * loudest] or [top]


def shaft_signs(measured: Measured, ratio: float) -> list[ShaftSigns]:
    """One entry for each number of teeth on the shafts of this speed; empty without enough turns."""
    wheels = wheels_on(measured.machine, ratio)
    if measured.phase is None or measured.turns * ratio < _LEAST_TURNS or not wheels:
        return []
    counts = sorted({teeth for _, _, teeth in wheels})
    regular = sorted({*counts, *_stage_orders(measured.machine, ratio)})
    dense = min(full_rate(measured.phase, ratio=ratio), _SAMPLES_PER_TOOTH * counts[-1])
    samples = int(sfft.next_fast_len(max(dense, 8 * counts[-1]), real=True))
    averages = {name: measured.average(name, ratio, samples) for name in measured.channels}
    found = []
    for teeth in counts:
        channels = tuple(
            _signs(name, average, regular, teeth)
            for name, average in averages.items()
            if average is not None and float(np.ptp(average.values)) > 0
        )
        if channels:
            count = next(average.count for average in averages.values() if average is not None)
            found.append(_combined(ratio, teeth, channels, count))
    return found


def _stage_orders(machine: Machine, ratio: float) -> list[int]:
    """Mesh orders of planetary stages whose carrier turns at this speed: the ring stands, its teeth pass."""
    return [
        stage.ring_teeth
        for stage in machine.planetary_stages
        if stage.fixed_member == "ring" and abs(machine.shaft(stage.carrier_shaft).ratio / ratio - 1.0) < 1e-6
    ]


def _signs(name: str, average: Average, regular: list[int], teeth: int) -> ChannelSigns:
    orders = [float(order) for order in regular if 2 * order < average.values.size]
    lines = mesh_lines(average, orders, _SIDEBANDS, shaft_harmonics=_SHAFT_HARMONICS)
    spectrum = sfft.rfft(average.values)
    size = average.values.size
    power = 2.0 * np.abs(spectrum / size) ** 2
    power[0] = 0.0
    difference = sfft.irfft(np.where(lines, 0.0, spectrum), size)
    regular_rms = math.sqrt(float(power[lines].sum()))
    share = float(np.count_nonzero(~lines)) / lines.size
    noise = average.noise_rms * math.sqrt(share)
    mesh = np.array([math.sqrt(power[k * teeth]) if k * teeth < power.size else 0.0 for k in range(1, 9)])
    width = max(1, round(size / teeth))
    profile = energy_by_angle(difference, teeth)
    square = max(float(np.mean(difference**2)), _TINY)
    return ChannelSigns(
        name,
        regular_rms,
        math.sqrt(square),
        noise,
        mesh,
        profile,
        np.asarray(difference),
        np.asarray(uniform_filter1d(average.std**2, width, mode="wrap")) * (share / average.count),
        float(np.mean(difference**4)) / square**2,
    )


def _combined(ratio: float, teeth: int, channels: tuple[ChannelSigns, ...], count: int) -> ShaftSigns:
    """The clearest of the single channels and of those together that hear more than noise."""
    profiles = {one.channel: one.profile / max(float(np.median(one.profile)), _TINY) for one in channels}
    hearing = [one.channel for one in channels if one.difference_rms > 1.5 * one.noise_rms]
    if len(hearing) > 1:
        profiles["together"] = np.exp(np.mean([np.log(profiles[name] + _TINY) for name in hearing], axis=0))
    # In units of the profiles' medians, as the profiles are.
    noise = {one.channel: one.noise_rms**2 / max(float(np.median(one.profile)), _TINY) for one in channels}
    noise["together"] = float(np.median([noise[name] for name in hearing])) if hearing else 1.0
    stands = {
        name: standing_tooth(profile, teeth, min(1.0, noise[name])) for name, profile in profiles.items()
    }
    # Of single channels one in several stands out more by chance; together they are the surer witness.
    name = "together" if "together" in stands else max(stands, key=lambda key: stands[key][1])
    place, over_rest, over_median, chance = stands[name]
    best = max(channels, key=lambda one: stands[one.channel][1])
    return ShaftSigns(ratio, teeth, channels, place, over_rest, over_median, chance, best, count)


def energy_by_angle(signal: Array, teeth: int) -> Array:
    """Mean square of one turn of a signal over a pitch around each angle."""
    width = max(1, round(signal.size / teeth))
    return np.asarray(uniform_filter1d(signal**2, width, mode="wrap"))


def standing_tooth(profile: Array, teeth: int, noise: float) -> tuple[float, float, float, float]:
    """Place of the strongest tooth [turns], its energy over the next one's and the median, and the chance.

    Parameters
    ----------
    profile : ndarray, shape (n,)
        Energy by angle, in units of its median.
    teeth : int
    noise : float
        Part of it that is not the teeth's.

    Returns
    -------
    tuple of float
        The last one as the logarithm of the probability that teeth as uneven as the others give it.
    """
    size = profile.size
    top = int(np.argmax(profile))
    away = np.abs((np.arange(size) - top + size // 2) % size - size // 2)
    others = profile[away > _NEAR_TEETH * size / teeth]
    rest = float(others.max(initial=_TINY))
    peak = float(profile[top])
    chance = _log10_chance(peak, others, 2 * teeth, noise) if others.size else 0.0
    return top / size, peak / rest, peak / max(float(np.median(profile)), _TINY), chance


def _log10_chance(peak: float, others: Array, places: int, noise: float) -> float:
    """log10 of the probability that the highest of so many energies reaches the peak by chance.

    Two chances, of which the larger counts. Errors of sound teeth are Gaussian, so what they add to the noise
    is distributed as their mean times chi^2 with one degree of freedom. And noise alone, whose energies are
    Gamma distributed with the shape that their 16 % quantile over their median tells.
    """
    uneven = max(float(np.mean(others)) - noise, 0.0) + _NOISE_DOUBT * noise
    by_teeth = float(special.erfc(math.sqrt(max(peak - noise, 0.0) / max(2.0 * uneven, _TINY))))
    low, median = np.quantile(others, [0.16, 0.5])
    shapes, ratios, medians = _gamma_shapes()
    shape = float(np.interp(low / max(float(median), _TINY), ratios, shapes))
    middle = float(np.interp(shape, shapes, medians))
    by_noise = float(special.gammaincc(shape, middle * peak / max(float(median), _TINY)))
    chance = places * max(by_teeth, by_noise)
    return float(min(0.0, math.log10(max(chance, 10.0**-_MOST_DECADES))))


@cache
def _gamma_shapes() -> tuple[Array, Array, Array]:
    """Shapes, and for each the 16 % quantile over the median (ascending) and the median."""
    shapes = np.geomspace(0.4, 400.0, 200)
    medians = np.asarray(special.gammaincinv(shapes, 0.5), dtype=np.float64)
    ratios = np.asarray(special.gammaincinv(shapes, 0.16), dtype=np.float64) / medians
    return shapes, ratios, medians


def _trimmed(profile: Array) -> float:
    """Mean of the lower nine tenths."""
    return float(np.mean(np.sort(profile)[: max(1, round(0.9 * profile.size))]))


def _median(values: list[float]) -> float:
    return float(np.median(values))
