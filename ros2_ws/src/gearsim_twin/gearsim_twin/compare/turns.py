"""What single teeth do: the average over the turn of a gear, without the lines that all its teeth make alike.

A crack, a pit or a tooth out of its place is met once a turn, so that its power is spread over very many
multiples of the turn, each of them weak. Averaging over turns with the angle (McFadden, Mech. Syst. Signal
Process. 1 (1987) 83-95) takes the noise from all of them at once; the meshes with their first two sidebands,
or with planets all that equal planets bring, are left out. Of the rest, band by band:

teeth  - its mean square, dB of the unit squared; what noise leaves is taken off
knock  - its kurtosis over the turn, dB: many teeth a little wrong come to 4.8 dB, a single one to more
planet - as teeth, of the multiples of a planet's own turn alone
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft

from gearsim_dsp.angle.resample import to_angle
from gearsim_dsp.gear_kinematics import gear_wheels
from gearsim_dsp.planet_kinematics import planetary_orders
from gearsim_io.nameplate import Machine
from gearsim_twin.compare.frame import Frame
from gearsim_twin.compare.lines import DB, LEAST_STD_DB, jackknife
from gearsim_twin.compare.material import Material
from gearsim_twin.compare.places import Place

__all__ = ["KINDS", "figure_of", "turn_places"]

KINDS = ("teeth", "knock", "planet")

_PER_LINE = 2.5
_MOST_LINES = 6000
_FEWEST_TURNS, _GROUPS = 4, 8
_FEWEST_LINES = 12
_SLOW = 3  # multiples of a turn that belong to the shaft and not to teeth
_SIDEBANDS = 2
_WHOLE = 1e-6
_CLEAR_SIGMA = 3.0
_MOST_TURNS = 2
_KNOCK_CLEAR_DB = 10.0


def turn_places(frame: Frame, materials: Sequence[Material]) -> list[Place]:
    """Places of all channels; none where no gear turns often enough in each record."""
    if not frame.has_orders or not (frame.machine.gear_meshes or frame.machine.planetary_stages):
        return []
    turns = min(
        (float(m.phase.turns[-1] - m.phase.turns[0]) for m in materials if m.phase is not None), default=0.0
    )
    found = []
    for ratio, label in _turning(frame.machine):
        if turns * ratio < _FEWEST_TURNS + 0.5:
            continue
        for band in _bands(frame, ratio):
            for kind in KINDS:
                lines = _mask(frame, ratio, kind, _lines_of(frame.speed_hz * ratio, band))
                if np.count_nonzero(lines) >= _FEWEST_LINES:
                    found += [
                        Place("transient", channel, kind, ratio, "order", ratio, label, band)
                        for channel in frame.channels
                    ]
    return found


def figure_of(material: Material, place: Place) -> tuple[float, float, float, float]:
    """Level, standard deviation, height over noise, and height that is clear.

    Nothing is said where noise is not left behind, so that noise has no part in the levels.
    """
    nothing = (math.nan, math.inf, math.nan, 0.0)
    average = _average(material, place.channel, place.at)
    if average is None or place.band_hz is None:
        return nothing
    parts, noise = average
    turn_hz = material.speed_hz * place.at
    first, last = _lines_of(turn_hz, place.band_hz)
    last = min(last, parts.shape[1])
    mask = _mask(material.frame, place.at, place.kind, (first, last))
    if not np.any(mask):
        return nothing
    parts = parts[:, first:last] * mask[:, None]
    chance = float(np.sum(noise[first:last][mask]))
    power = float(0.5 * np.sum(parts.mean(axis=0) ** 2))
    height = 10 * math.log10(max(power, 1e-300) / max(chance, 1e-300))
    clear = _CLEAR_SIGMA * DB / math.sqrt(int(np.count_nonzero(mask)))
    if height <= (_KNOCK_CLEAR_DB if place.kind == "knock" else clear):
        return nothing
    if place.kind == "knock":
        value, pseudo = jackknife(parts, _kurtosis_db)
    else:
        value, pseudo = jackknife(parts, lambda mean: _power_db(mean, chance))
    std = max(float(pseudo.std(ddof=1)) / math.sqrt(parts.shape[0]), LEAST_STD_DB)
    return value, std, height, clear


def _turning(machine: Machine) -> list[tuple[float, str]]:
    """Turns of wheels and carriers that are averaged over, no one a multiple of another, and their names."""
    named: dict[float, list[str]] = {}
    for stage in machine.planetary_stages:
        named.setdefault(round(planetary_orders(machine, stage).ring_on_carrier, 9), []).append(stage.name)
    for wheel in gear_wheels(machine):
        named.setdefault(round(wheel.turn_order, 9), []).append(wheel.shaft)
    kept: dict[float, list[str]] = {}
    for ratio, names in named.items():
        if ratio > 0 and not any(_multiple(ratio, other) for other in kept):
            kept[ratio] = names
    return [(ratio, ", ".join(dict.fromkeys(names))) for ratio, names in kept.items()][:_MOST_TURNS]


def _multiple(order: float, of: float) -> bool:
    return abs(order / of - round(order / of)) < _WHOLE


def _bands(frame: Frame, ratio: float) -> list[tuple[float, float]]:
    """Carrier bands, and what lies below them."""
    low = (_SLOW + 0.5) * ratio * frame.speed_hz
    return [(low, frame.bands_hz[0][0]), *frame.bands_hz] if low < frame.bands_hz[0][0] else [*frame.bands_hz]


def _lines_of(turn_hz: float, band: tuple[float, float]) -> tuple[int, int]:
    """First line of a band, and the one after its last."""
    first = max(_SLOW + 1, math.ceil(band[0] / turn_hz))
    return first, max(first, min(_MOST_LINES, math.ceil(band[1] / turn_hz)))


@lru_cache(maxsize=128)  # a frame is itself: one for each plan
def _mask(frame: Frame, ratio: float, kind: str, lines: tuple[int, int]) -> NDArray[np.bool_]:
    """Which of the lines of a turn count, read-only."""
    machine = frame.machine
    order = np.asarray(np.arange(*lines) * ratio, dtype=np.float64)
    use = np.ones(order.size, dtype=np.bool_)
    spins = []
    for stage in machine.planetary_stages:
        orders = planetary_orders(machine, stage)
        use &= ~_near(order, orders.planet_pass, 0.25 * ratio)
        use &= ~_near(order, orders.mesh, 0.25 * ratio)
        spins.append(orders.planet_spin)
    for wheel in gear_wheels(machine):
        for side in range(-_SIDEBANDS, _SIDEBANDS + 1):
            use &= ~_near(np.asarray(order - side * wheel.turn_order), wheel.mesh_order, 0.25 * ratio)
    if kind == "planet":
        own = np.zeros(order.size, dtype=np.bool_)
        for spin in spins:
            own |= _near(order, spin, _WHOLE * ratio) & (spin > ratio)
        use &= own
    use.flags.writeable = False
    return use


def _near(order: NDArray[np.float64], base: float, within: float) -> NDArray[np.bool_]:
    """Whether orders are next to a multiple of `base`."""
    return np.asarray(np.abs(order - np.round(order / base) * base) < within)


def _average(
    material: Material, channel: str, ratio: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Lines of groups of turns (groups, lines, real and imaginary), and noise in each line's mean square."""
    key = ("turns", channel, ratio)
    if key not in material._kept:
        material._kept[key] = _averaged(material, channel, ratio)
    return material._kept[key]  # type: ignore[return-value]


def _averaged(
    material: Material, channel: str, ratio: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    if material.phase is None:
        return None
    turn_hz = material.speed_hz * ratio
    lines = min(_MOST_LINES, math.ceil(material.frame.top_hz / turn_hz) + 1)
    per_turn = int(sfft.next_fast_len(math.ceil(_PER_LINE * lines), real=True))
    signal = to_angle(material.samples(channel), material.phase, per_turn, ratio=ratio)
    count = signal.values.size // per_turn
    if count < _FEWEST_TURNS:
        return None
    values = signal.values[: count * per_turn].reshape(count, per_turn)
    each = sfft.rfft(values, axis=1)[:, :lines] * (2.0 / per_turn)
    noise = 0.5 * each.var(axis=0, ddof=1) / count
    groups = min(_GROUPS, count)
    edges = np.linspace(0, count, groups + 1).astype(np.intp)
    parts = np.add.reduceat(each, edges[:-1], axis=0) / np.diff(edges)[:, None]
    return np.stack([parts.real, parts.imag], axis=-1), np.asarray(noise)


def _power_db(mean: NDArray[np.float64], noise: float) -> float:
    return 10 * math.log10(max(0.5 * float(np.sum(mean**2)) - noise, 0.1 * noise, 1e-300))


def _kurtosis_db(mean: NDArray[np.float64]) -> float:
    """Of the real part of an analytic signal over the turn, through its envelope: 3 <a^4> / (2 <a^2>^2)."""
    envelope = np.abs(sfft.ifft(mean[:, 0] + 1j * mean[:, 1], 2 * mean.shape[0])) ** 2
    return 10 * math.log10(
        max(1.5 * float(np.mean(envelope**2)) / max(float(np.mean(envelope)) ** 2, 1e-300), 1e-300)
    )
