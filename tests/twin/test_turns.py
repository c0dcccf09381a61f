"""What single teeth do, averaged over the turn of a gear: closed forms, noise, and a single bad tooth."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from compare_signals import LINES, RATE_HZ, SECONDS, SPEED_HZ, lines, measured, noise, plan_of, record, view

from gearsim_twin.compare.features import Features, Plan
from gearsim_twin.compare.places import Place
from gearsim_twin.compare.turns import KINDS

ORDERS = np.arange(400, 720)


@cache
def _plan() -> Plan:
    """What is compared of machines with lines of turn and mesh; tests need what single teeth do alone."""
    whole = plan_of(view(record(lines() + noise(1))))
    return Plan(whole.frame, tuple(place for place in whole.of("transient") if place.kind in KINDS))


def _teeth(seed: int, scale: float = 0.02) -> np.ndarray:
    """Every multiple of the turn between 4 and 7.2 kHz, with random amplitudes and phases: many bad teeth."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(SECONDS * RATE_HZ)) / RATE_HZ
    amplitude = rng.standard_normal((2, ORDERS.size)) * scale
    spectrum = np.zeros(t.size // 2 + 1, dtype=np.complex128)
    spectrum[ORDERS * round(SECONDS) * round(SPEED_HZ)] = 0.5 * t.size * (amplitude[0] - 1j * amplitude[1])
    return np.asarray(np.fft.irfft(spectrum, t.size))


def _knocks(size: float) -> np.ndarray:
    """One short burst at 5 kHz a turn."""
    t = np.arange(int(SECONDS * RATE_HZ)) / RATE_HZ
    since = np.mod(SPEED_HZ * t + 0.3, 1.0) / SPEED_HZ
    return size * np.exp(-since / 5e-4) * np.sin(2 * np.pi * 5000.0 * since)


def _at(found: Features, kind: str, hz: float, channel: str = "b1_y") -> tuple[float, float]:
    def fits(place: Place) -> bool:
        inside = place.band_hz is not None and place.band_hz[0] < hz < place.band_hz[1]
        return place.domain == "transient" and place.kind == kind and place.channel == channel and inside

    (row,) = (k for k, place in enumerate(found.places) if fits(place))
    return float(found.level_db[row]), float(found.std_db[row])


def _own(signal: np.ndarray, hz: float) -> np.ndarray:
    """The part of a signal that repeats every turn, in the band around `hz` as the plan has it."""
    bands = {place.band_hz for place in _plan().of("transient") if place.kind == "teeth"}
    (band,) = (band for band in bands if band is not None and band[0] < hz < band[1])
    spectrum = np.fft.rfft(signal)
    at = np.fft.rfftfreq(signal.size, 1 / RATE_HZ)
    order = np.round(at / SPEED_HZ)
    mesh = np.abs(order - 32 * np.round(order / 32)) <= 2
    spectrum[(at < band[0]) | (at >= band[1]) | mesh | (order < 4)] = 0.0
    return np.asarray(np.fft.irfft(spectrum, signal.size))


def test_lines_between_the_meshes_are_added_up_and_meshes_are_not() -> None:
    teeth = _teeth(2)
    strong = tuple((order, 5 * a) for order, a in LINES if order in (32, 64, 33, 31))
    strong += ((512, 4.0), (511, 0.8), (514, 0.5))
    found = measured(record(lines(table=strong) + teeth), _plan())
    own = 10 * np.log10(np.mean(_own(teeth, 5000.0) ** 2))
    assert _at(found, "teeth", 5000.0)[0] == pytest.approx(own, abs=0.1)


def test_averaging_hears_teeth_below_the_noise_and_tells_how_surely() -> None:
    """Noise of 50 turns is averaged to a fiftieth; the level's own scatter is the deviation told."""
    teeth = _teeth(3, 2.5e-3)
    own = 10 * np.log10(np.mean(_own(teeth, 5000.0) ** 2))
    rough = [noise(seed, 0.4) for seed in range(10)]
    assert 10 * np.log10(np.mean(_own(rough[0], 5000.0) ** 2)) > own - 5  # lines of the turn alone
    found = [_at(measured(record(lines() + teeth + x), _plan()), "teeth", 5000.0) for x in rough]
    level, told = np.array(found).T
    assert np.mean(level) == pytest.approx(own, abs=0.7)
    assert np.std(level, ddof=1) == pytest.approx(np.sqrt(np.mean(told**2)), rel=0.6)


def test_one_bad_tooth_knocks_and_many_do_not() -> None:
    many = _at(measured(record(lines() + _teeth(4) + noise(5, 0.01)), _plan()), "knock", 5000.0)[0]
    one = _at(measured(record(lines() + _knocks(0.5) + noise(5, 0.01)), _plan()), "knock", 5000.0)[0]
    assert many == pytest.approx(10 * np.log10(3.0), abs=0.7)  # random amplitudes: as Gaussian noise
    own = _own(_knocks(0.5), 5000.0)
    assert one == pytest.approx(10 * np.log10(np.mean(own**4) / np.mean(own**2) ** 2), abs=0.5)
    assert one > many + 6.0


def test_a_knock_in_noise_is_not_told() -> None:
    found = measured(record(lines() + _knocks(0.002) + noise(6, 0.2)), _plan())
    assert np.isnan(_at(found, "knock", 5000.0)[0])
