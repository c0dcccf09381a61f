"""The squared envelope spectrum of a finding, or of what comes closest to one."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.special import gammainccinv

from gearsim_bringup.diagnosis_report.lines import (
    Marks,
    drawn,
    expected_marks,
    finding_marks,
    shaft_marks,
)
from gearsim_bringup.diagnosis_report.material import LONGEST_S, Material
from gearsim_bringup.diagnosis_report.words import shaft_words
from gearsim_bringup.pages.plot import BLUE, FOUND, GREY, Plot, axis, curve, strongest
from gearsim_dsp.band_choice import choose_band
from gearsim_dsp.cyclic.envelope_spectra import squared_envelope_spectrum
from gearsim_dsp.cyclic.modulation import ModulationSpectrum
from gearsim_dsp.judges.finding import Finding
from gearsim_io.errors import InputError

__all__ = ["draw_closest_envelope", "draw_envelope", "envelope_of"]

_HARMONICS_SHOWN = 8.6
_POINTS = 4000
_WINDOW_S = 2.0
_WINDOW_TURNS = 20.0
_BAND_SHARE = 0.95
_FALLBACK_HZ = 400.0
_NOISE = "clearly above the grey line, which is what noise reaches in one place of a thousand."
_SHOWS = f"A fault shows as peaks at its frequency and multiples of it (1x, 2x ...), {_NOISE}"
_WOULD_SHOW = f"A fault would show as peaks at its line and multiples of it, {_NOISE}"


def draw_envelope(material: Material, number: int, finding: Finding) -> Plot:
    """Squared envelope spectrum of the band in which a finding shows best, with its lines."""
    scale = 1.0 if material.phase is not None else material.speed_hz
    spectrum = envelope_of(
        material, finding.channel, material.band_hz(finding), _HARMONICS_SHOWN * finding.found_hz
    )
    marks = [*finding_marks(material, number, finding), *shaft_marks(material, 3)]
    data, layout = _drawn(material, spectrum, marks, scale)
    data.append(_numbers(spectrum, finding.found_order * scale, FOUND[number % len(FOUND)]))
    low, high = spectrum.band_hz
    caption = (
        f"How the loudness of channel {finding.channel} between {low:.0f} and {high:.0f} Hz swings. "
        f"{_SHOWS}{_part(material)}"
    )
    return Plot("Squared envelope spectrum", caption, tuple(data), layout, 400)


def draw_closest_envelope(material: Material) -> Plot:
    """The same where nothing was found: the band of the family that comes closest, all families marked."""
    closest = material.closest()
    highest = max((order for _, _, order in material.expected()), default=0.0) * material.speed_hz
    top = 3.3 * highest if math.isfinite(highest) and highest > 0 else _FALLBACK_HZ
    channel = closest.channel if closest else material.channel
    if closest:
        band = (closest.band.low_hz, closest.band.high_hz)
    else:
        chosen = choose_band(
            material.samples(channel, LONGEST_S), material.rate_hz, min(2 * top, 0.2 * material.rate_hz)
        )
        half = 0.1 * material.rate_hz
        band = (chosen.band.low_hz, chosen.band.high_hz) if chosen.band else (half, 3 * half)
    spectrum = envelope_of(material, channel, band, top)
    scale = 1.0 if spectrum.unit == "order" else material.speed_hz
    marks = []
    if math.isfinite(scale):
        marks = [*expected_marks(material, 3, True), *shaft_marks(material, 3)]
    data, layout = _drawn(material, spectrum, marks, scale)
    family = "where a fault family of the nameplate came closest to being found"
    where = family if closest else "its most impulsive band"
    caption = (
        f"How the loudness of channel {channel} between {band[0]:.0f} and {band[1]:.0f} Hz swings, {where}. "
        f"{_WOULD_SHOW}{_part(material)}"
    )
    return Plot("Squared envelope spectrum", caption, tuple(data), layout, 400)


def envelope_of(
    material: Material, channel: str, band_hz: tuple[float, float], top_hz: float
) -> ModulationSpectrum:
    """Averaged squared envelope spectrum, over orders where the diagnosis had the angle."""
    seconds = min(LONGEST_S, material.record.seconds)
    speed = material.speed_hz
    window = _WINDOW_S if not math.isfinite(speed) else max(_WINDOW_S, _WINDOW_TURNS / speed)
    top_hz = min(top_hz, _BAND_SHARE * (band_hz[1] - band_hz[0]))
    phase = material.cut(seconds)
    return squared_envelope_spectrum(
        material.samples(channel, seconds),
        material.rate_hz,
        band_hz,
        top_hz if phase is None else top_hz / speed,
        window_s=min(window, 0.999 * seconds),
        phase=phase,
    )


def _drawn(
    material: Material, spectrum: ModulationSpectrum, marks: list[Marks], scale: float
) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """Depth of modulation in per cent: 1 + m cos(.) has the power m^2 / 4 at its line."""
    depth, length = strongest(200 * np.sqrt(spectrum.power), _POINTS)
    skip = max(1, round(4 / length))
    high = 1.12 * float(depth[skip:].max())
    first = 0.5 * (length - 1) * spectrum.step
    noise, stretch = strongest(200 * np.sqrt(spectrum.floor * _level_of_noise(spectrum)), 400)
    end = float(spectrum.axis[-1])
    data = [
        curve(depth, first, length * spectrum.step, "envelope spectrum", BLUE),
        curve(noise, 0.0, stretch * spectrum.step, "noise, 1 in 1000", GREY, width=1.0),
    ]
    data += drawn(marks, end, (0.0, high), scale, opacity=0.55)
    if spectrum.unit == "order":
        label = f"order of {shaft_words(material.machine.reference_shaft)} (1 = {material.speed_hz:.4g} Hz)"
    else:
        label = "frequency, Hz"
    layout = {"xaxis": axis(label, 0.0, end), "yaxis": axis("modulation, %", 0.0, high)}
    return data, layout


def _level_of_noise(spectrum: ModulationSpectrum) -> float:
    """Power over the floor that noise exceeds in one line of a thousand: a Gamma variable of mean one."""
    return float(gammainccinv(spectrum.averages, 1e-3) / spectrum.averages)


def _numbers(spectrum: ModulationSpectrum, fundamental: float, colour: str) -> dict[str, Any]:
    """1x, 2x ... at the tops of the harmonics."""
    x, y, words = [], [], []
    for k in range(1, 9):
        try:
            line = spectrum.line(k * fundamental, 0.003 * k * fundamental)
        except InputError:  # beyond the axis
            continue
        x.append(line.found)
        y.append(200 * math.sqrt(line.power))
        words.append(f"{k}x")
    return {
        "type": "scatter",
        "mode": "markers+text",
        "x": x,
        "y": y,
        "text": words,
        "textposition": "top center",
        "textfont": {"color": colour},
        "marker": {"color": colour, "size": 6},
        "hovertemplate": "%{text}: %{x:.5~g}, %{y:.3g} %<extra></extra>",
        "showlegend": False,
    }


def _part(material: Material) -> str:
    return f" Of the first {LONGEST_S:.0f} s." if material.record.seconds > LONGEST_S else ""
