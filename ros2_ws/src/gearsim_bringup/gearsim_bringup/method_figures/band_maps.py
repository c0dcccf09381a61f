"""What kurtogram, autogram and protrugram share in their pictures: maps of bands and spectra of envelopes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PatchCollection
from matplotlib.colors import Normalize
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from gearsim_bringup.method_figures.style import mark
from gearsim_dsp.bands import Band
from gearsim_dsp.envelope import envelope_spectrum, squared_envelopes, suppress_lines, window_spectrum

__all__ = ["draw_choice", "draw_envelope", "draw_map"]

Cell = tuple[float, float, float, float]  # level, low_hz, high_hz, value


def draw_map(axes: Axes, cells: Iterable[Cell], label: str) -> None:
    """A tree of bands: level downwards, frequency to the right, the value as colour."""
    rows = list(cells)
    levels = sorted({row[0] for row in rows})
    values = np.array([row[3] for row in rows])
    patches = [
        Rectangle((row[1] / 1e3, levels.index(row[0]) - 0.5), (row[2] - row[1]) / 1e3, 1.0) for row in rows
    ]
    norm = Normalize(0.0, float(values.max()))
    cells_drawn = PatchCollection(patches, cmap="viridis", norm=norm, linewidth=0.0)
    cells_drawn.set_array(values)
    axes.add_collection(cells_drawn)
    axes.set_xlim(0, max(row[2] for row in rows) / 1e3)
    axes.set_ylim(len(levels) - 0.5, -0.5)
    axes.set_yticks(range(len(levels)), [f"{level:.3g}" for level in levels])
    axes.set_xlabel("frequency [kHz]")
    axes.set_ylabel("level")
    axes.grid(visible=False)
    assert axes.figure is not None
    axes.figure.colorbar(ScalarMappable(norm, mpl.colormaps["viridis"]), ax=axes, label=label, pad=0.02)


def draw_choice(axes: Axes, levels: Sequence[float], low_hz: float, high_hz: float, colour: str) -> None:
    """A frame around one band of a map whose levels are those given."""
    level = np.log2(levels_top_hz(axes) / (high_hz - low_hz))
    row = int(np.argmin(np.abs(np.array(sorted(set(levels))) - level)))
    place = (low_hz / 1e3, row - 0.5)
    frame = Rectangle(place, (high_hz - low_hz) / 1e3, 1.0, fill=False, edgecolor=colour, linewidth=2.2)
    axes.add_patch(frame)


def levels_top_hz(axes: Axes) -> float:
    """Half the sampling rate: where the map's axis ends."""
    return 1e3 * float(axes.get_xlim()[1])


def draw_envelope(
    axes: Axes, signal: NDArray[np.float64], rate_hz: float, band: Band, fault_hz: float, colour: str
) -> None:
    """Squared envelope spectrum of the band with the fault's first four lines."""
    spectrum = suppress_lines(window_spectrum(signal, rate_hz))
    low_hz = max(band.low_hz, 2 * spectrum.step_hz)
    width_hz = band.high_hz - low_hz - 2 * spectrum.step_hz
    power, step_hz = envelope_spectrum(squared_envelopes(spectrum, np.array([low_hz]), width_hz))
    at = np.arange(power.shape[1]) * step_hz
    shown = (at > 2) & (at < 4.5 * fault_hz)
    axes.plot(at[shown], 10 * np.log10(power[0][shown] + 1e-12), color=colour, linewidth=0.7)
    for k in (1, 2, 3, 4):
        mark(axes, k * fault_hz, f"{k} x")
    axes.set_ylim(-60, None)
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel("modulation [dB]")
