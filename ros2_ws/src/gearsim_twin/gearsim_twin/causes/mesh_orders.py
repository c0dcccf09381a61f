"""Lines at whole orders of the shafts, and the orders at which teeth mesh."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearsim_dsp.speed import Phase

if TYPE_CHECKING:
    from gearsim_io.nameplate import Machine
    from gearsim_twin.view import View

Array = NDArray[np.float64]

_RATE_SHARE = 0.4


def finest_marks(view: View) -> Phase | None:
    """The angle by an encoder, from its first mark on, or that of the view where none is finer."""
    phase = view.phase
    for train in view.record.encoders:
        if phase is not None and train.samples.size > max(phase.samples.size, 2):
            ratio = abs(view.machine.shaft(train.shaft).ratio)
            turns = np.arange(train.samples.size) / (train.lines_per_revolution * ratio)
            return Phase(train.samples, turns)
    return phase


def mesh_orders(machine: Machine) -> dict[str, float]:
    """Orders of the reference shaft at which teeth mesh, by name of the pair or stage."""
    orders = {
        m.name: abs(m.driving_teeth * machine.shaft(m.driving_shaft).ratio) for m in machine.gear_meshes
    }
    for stage in machine.planetary_stages:
        ratios = stage.member_ratios()
        shaft = {"carrier": stage.carrier_shaft, "sun": stage.sun_shaft, "ring": stage.ring_shaft}
        turning = machine.shaft(shaft[stage.input_member]).ratio
        orders[stage.name] = abs((ratios["ring"] - ratios["carrier"]) * stage.ring_teeth * turning)
    return orders


def order_amplitudes(view: View, channel: str, top_order: float) -> tuple[Array, float] | None:
    """Amplitude spectrum of a channel over orders, and the distance of its lines; None without an angle.

    Hann-windowed over whole turns of the reference shaft, up to `top_order` or what the rate allows.
    """
    if view.phase is None or view.turns < 4:
        return None
    most = _RATE_SHARE * view.record.sample_rate_hz / view.speed_hz
    signal = view.angle(channel, int(np.ceil(2.6 * min(top_order, most))))
    if signal is None:
        return None
    per_turn = int(np.ceil(2.6 * min(top_order, most)))
    count = int(signal.values.size // per_turn)
    x = np.asarray(signal.values[: count * per_turn], dtype=np.float64)
    window = np.hanning(x.size + 1)[:-1]
    spectrum = 2 * np.abs(np.fft.rfft((x - x.mean()) * window)) / window.sum()
    return spectrum, 1.0 / count


def at_order(spectrum: Array, step: float, order: float) -> float:
    """Amplitude of the line at an order, 0 beyond the spectrum."""
    line = round(order / step)
    if line < 2 or line + 2 >= spectrum.size:
        return 0.0
    return float(spectrum[line - 1 : line + 2].max())
