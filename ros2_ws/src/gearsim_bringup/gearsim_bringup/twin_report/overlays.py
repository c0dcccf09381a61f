"""Waveforms and spectra of the record with those of the models laid over them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft

from gearsim_bringup.pages.plot import Plot, axis, curve, extremes, strongest
from gearsim_bringup.twin_report.sides import Mark, Side, Sides, drawn
from gearsim_dsp.angle.resample import to_angle
from gearsim_dsp.cyclic.envelope_spectra import squared_envelope_spectrum
from gearsim_dsp.cyclic.modulation import ModulationSpectrum
from gearsim_dsp.spectra import welch_psd
from gearsim_io.errors import InputError
from gearsim_twin.compare.places import band_text

__all__ = ["draw_density", "draw_envelope", "draw_orders", "draw_waveforms"]

_TURNS = 4.0
_FALLBACK_S = 0.25
_PAIRS = 1500
_POINTS = 2500
_LEAST_TOP, _MOST_TOP, _RATE_SHARE = 12.0, 400.0, 0.4
_WINDOW_S, _WINDOW_TURNS = 2.0, 20.0
_ENVELOPE_MULTIPLES = 4.6
_BAND_SHARE = 0.95


def draw_waveforms(sides: Sides) -> Plot:
    """The loudest turns of each, one above the other on one scale."""
    speed = sides.speed_hz
    seconds = _TURNS / speed if math.isfinite(speed) and speed > 0 else _FALLBACK_S
    order = sorted(sides.all, key=lambda side: side.name != "measured")
    rows = [(side, _loudest(side, sides.channel, seconds)) for side in order]
    top = 1.05 * max(float(np.max(np.abs(values))) for _, values in rows) or 1.0
    data, layout = [], {}
    for row, (side, values) in enumerate(rows):
        shown, stride = extremes(values, _PAIRS)
        number = "" if row == 0 else str(row + 1)
        data.append(
            curve(shown, 0.0, stride / side.rate_hz, side.name, side.colour, width=0.8, yaxis=f"y{number}")
        )
        high = 1.0 - row / len(rows)
        layout[f"yaxis{number}"] = axis(
            sides.unit, -top, top, domain=[high - 0.92 / len(rows), high], nticks=4
        )
    layout["xaxis"] = axis(
        "time, s", 0.0, min(values.size / side.rate_hz for side, values in rows), anchor=f"y{len(rows)}"
    )
    caption = (
        f"Channel {sides.channel}, {_turns_words(speed)} where each is loudest, all on one scale. Angles of "
        "record and models do not match: compare shapes, heights and spacings, not moments."
    )
    return Plot("Waveforms", caption, tuple(data), layout, 420)


def _turns_words(speed_hz: float) -> str:
    return f"{_TURNS:.0f} turns" if math.isfinite(speed_hz) else f"{_FALLBACK_S:g} s"


def _loudest(side: Side, channel: str, seconds: float) -> NDArray[np.float64]:
    """The stretch of so many seconds with the greatest value a tenth after its beginning."""
    x = side.samples(channel)
    count = min(x.size, max(16, round(seconds * side.rate_hz)))
    before = count // 10
    peak = int(np.argmax(np.abs(x[before : x.size - (count - before) + 1]))) + before
    return x[peak - before : peak - before + count]


def draw_density(sides: Sides) -> Plot:
    """Power spectral densities over the whole range."""
    rate = sides.all[0].rate_hz
    data = []
    levels = []
    for side in sides.all:
        seconds = side.view.record.seconds
        psd = welch_psd(side.samples(sides.channel), side.rate_hz, max(rate / 8192, 1 / seconds))
        level, length = strongest(psd.density[1:], _POINTS)
        step = psd.step_hz * length
        data.append(
            curve(
                level,
                psd.step_hz + 0.5 * (step - psd.step_hz),
                step,
                side.name,
                side.colour,
                width=side.width,
            )
        )
        levels.append(level)
    low, high = _ends(np.concatenate(levels))
    unit = "power density" if sides.unit == "as recorded" else f"({sides.unit})²/Hz"
    layout = {
        "xaxis": axis("frequency, Hz", 0.0, rate / 2),
        "yaxis": axis(unit, low, high, type="log", exponentformat="power", dtick=1),
    }
    caption = (
        f"Channel {sides.channel}. Broad hills are resonances of machine and sensor; where the models lie "
        "below everywhere the record has noise or a source that they lack."
    )
    return Plot("Power spectra", caption, tuple(data), layout, 400)


def draw_orders(sides: Sides) -> Plot:
    """Amplitudes of the signals at equal angles of the reference shaft."""
    marks = sides.marks(("orders", "torsional"))
    top = _top_order(sides, marks)
    data, levels = [], []
    for side in sides.all:
        phase = side.phase
        if phase is None:
            raise InputError("order spectrum", "speed", "not known", "a tacho, an encoder or a nominal speed")
        per_turn = int(sfft.next_fast_len(math.ceil(2.6 * top), real=True))
        orders, amplitude = to_angle(side.samples(sides.channel), phase, per_turn).spectrum()
        step = float(orders[1])
        level, length = strongest(amplitude[1 : round(top / step) + 1], _POINTS)
        data.append(
            curve(
                level,
                step + 0.5 * (length - 1) * step,
                length * step,
                side.name,
                side.colour,
                width=side.width,
            )
        )
        levels.append(level)
    low, high = _ends(np.concatenate(levels), 1e-5)
    data += drawn(marks, top, (low, high))
    reference = sides.exhibit.machine.reference_shaft
    layout = {
        "xaxis": axis(f"order of {reference} (1 = {sides.speed_hz:.4g} Hz)", 0.0, top),
        "yaxis": axis(sides.unit, low, high, type="log", exponentformat="power", dtick=1),
    }
    caption = (
        f"Channel {sides.channel} sampled at equal angles. Dashed: where record and tuned model differ most "
        "surely; shafts and meshes can be switched on in the legend."
    )
    return Plot("Order spectra", caption, tuple(data), layout, 400)


def _top_order(sides: Sides, marks: Sequence[Mark]) -> float:
    speed = sides.speed_hz
    if not (math.isfinite(speed) and speed > 0):
        raise InputError("order spectrum", "speed", "not known", "a tacho, an encoder or a nominal speed")
    known = [mark.orders[min(2, len(mark.orders) - 1)] for mark in marks]
    rate = min(side.rate_hz for side in sides.all)
    return min(max([_LEAST_TOP, *(1.15 * order for order in known)]), _MOST_TOP, _RATE_SHARE * rate / speed)


def draw_envelope(sides: Sides) -> Plot:
    """Squared envelope spectra of the band that differs most surely."""
    channel, band = sides.envelope
    marks = sides.marks(("envelope", "cyclic"))
    top = _top_envelope(sides, band, marks)
    found = [_spectrum(side, channel, band, top) for side in sides.all]
    data = []
    high = 0.0
    for side, spectrum in zip(sides.all, found, strict=True):
        depth, length = strongest(200 * np.sqrt(spectrum.power), _POINTS)
        skip = max(1, round(4 / length))
        high = max(high, 1.12 * float(depth[skip:].max()))
        first = 0.5 * (length - 1) * spectrum.step
        data.append(_line(side, depth, first, length * spectrum.step))
    end = float(found[0].axis[-1])
    data += drawn(marks, end, (0.0, high))
    reference = sides.exhibit.machine.reference_shaft
    layout = {
        "xaxis": axis(f"order of {reference} (1 = {sides.speed_hz:.4g} Hz)", 0.0, end),
        "yaxis": axis("modulation, %", 0.0, high),
    }
    caption = (
        f"How the loudness of channel {channel} in the band {band_text(band)} swings: impacts show as peaks "
        "at their rate and its multiples. A model is right where its peaks are as high as those measured."
    )
    return Plot("Envelope spectra", caption, tuple(data), layout, 400)


def _top_envelope(sides: Sides, band_hz: tuple[float, float], marks: Sequence[Mark]) -> float:
    speed = sides.speed_hz
    wanted = _ENVELOPE_MULTIPLES * max([2.0, *(mark.orders[0] for mark in marks if not mark.hidden)])
    return min(wanted, _BAND_SHARE * (band_hz[1] - band_hz[0]) / speed)


def _spectrum(side: Side, channel: str, band_hz: tuple[float, float], top: float) -> ModulationSpectrum:
    seconds = side.view.record.seconds
    window = min(max(_WINDOW_S, _WINDOW_TURNS / side.view.speed_hz), 0.999 * seconds)
    return squared_envelope_spectrum(
        side.samples(channel), side.rate_hz, band_hz, top, window_s=window, phase=side.phase
    )


def _line(side: Side, values: NDArray[np.float64], first: float, step: float) -> dict[str, Any]:
    return curve(values, first, step, side.name, side.colour, width=side.width)


def _ends(level: NDArray[np.float64], least: float = 1e-9) -> tuple[float, float]:
    """Ends of a logarithmic axis that one empty line does not stretch."""
    positive = level[level > 0]
    if positive.size == 0:
        return 1e-12, 1.0
    high = 2 * float(positive.max())
    return max(float(np.quantile(positive, 0.01)) / 2, high * least), high
