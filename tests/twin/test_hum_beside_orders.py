"""Hum on multiples of 50 Hz beside orders of a shaft at 25 Hz: the shaft's angle tells one from the other."""

from __future__ import annotations

import numpy as np
import pytest

from gearsim_twin.causes.lines import MachineLines, SlowPart
from gearsim_twin.causes.mains_interference import find_hum

RATE_HZ, SECONDS = 2080.0, 1.6
T = np.arange(int(RATE_HZ * SECONDS)) / RATE_HZ
PARTS = {1: 1.0, 3: 0.5, 5: 0.3}


def _part(shaft_hz: float, hum: float, orders: float, swell: float = 0.0) -> tuple[SlowPart, MachineLines]:
    """Hum and even orders of a shaft, whose level may swell by a share once in the record."""
    turns = shaft_hz * T + 0.3
    x = 1e-3 * np.random.default_rng(4).standard_normal(T.size)
    for k, part in PARTS.items():
        x += hum * part * np.cos(2 * np.pi * k * 50.0 * T + k)
        level = 1 + swell * np.cos(2 * np.pi * T / SECONDS)
        x += orders * part * level * np.cos(2 * np.pi * 2 * k * turns + 0.7 * k)
    known = MachineLines((shaft_hz,), 2e-5, counted=True)
    return SlowPart(x - x.mean(), RATE_HZ, turns, (1.0,)), known


@pytest.mark.parametrize("shaft_hz", [24.93, 25.04, 25.11])
def test_hum_beside_orders_is_found(shaft_hz: float) -> None:
    slow, known = _part(shaft_hz, hum=0.02, orders=0.02)
    hum = find_hum(slow, known)
    assert hum is not None
    assert hum.frequency_hz == pytest.approx(50.0, abs=0.02)
    assert hum.amplitude[1] == pytest.approx(0.02, rel=0.15)


@pytest.mark.parametrize("swell", [0.0, 0.3])
@pytest.mark.parametrize("shaft_hz", [24.93, 25.0, 25.04])
def test_orders_alone_are_no_hum(shaft_hz: float, swell: float) -> None:
    assert find_hum(*_part(shaft_hz, hum=0.0, orders=0.05, swell=swell)) is None


def test_hum_on_an_order_is_not_told() -> None:
    """Where both stay together for the whole record nothing tells them apart."""
    assert find_hum(*_part(25.001, hum=0.02, orders=0.02)) is None


def test_without_marks_an_order_near_by_is_the_machines() -> None:
    slow, known = _part(25.04, hum=0.02, orders=0.0)
    assert find_hum(slow, MachineLines(known.fundamentals_hz, 1e-3)) is None


def test_short_records_of_60_hz() -> None:
    slow, known = _part(25.0, hum=0.0, orders=0.05)
    hummed = slow.signal + sum(0.02 * a * np.cos(2 * np.pi * k * 60.0 * T) for k, a in PARTS.items())
    hum = find_hum(SlowPart(hummed, RATE_HZ, slow.turns, (1.0,)), known)
    assert hum is not None
    assert hum.frequency_hz == pytest.approx(60.0, abs=0.01)
