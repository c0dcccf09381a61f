"""CWRU: the recorder's filter, which no model has, and the kurtogram that it fools."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, GREY, HEALTHY, mark, new_figure
from gearsim_bringup.stories.views import learnt_and_held_out, view_at
from gearsim_dsp.kurtogram import KurtogramNode, fast_kurtogram
from gearsim_twin.causes.antialias_rolloff import edge_of_band, lowpass_db
from gearsim_twin.causes.spectra_beside import Beside, beside
from gearsim_twin.view import View

__all__ = ["RECORDS", "Filtered", "draw", "tell"]

RECORDS = ("cwru/97_Normal_0.mat", "cwru/135_0.mat")
_CHANNEL, _LEVEL = "drive_end", 7
_LEAST_SHARE = 1e-5  # of the power: less is no band to look for impacts in
_SEED, _QUIET = 1, 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Filtered:
    """Of one record: the filter's corner, order and depth by two thirds of it, and errors on the last third.

    Attributes
    ----------
    corner_hz, order, depth_db : float
    flat_db, filtered_db : float
        Rms error of the levels above the corner for a model whose chain is flat, and for one with the filter.
    maximum, chosen : KurtogramNode
        The plain maximum of the kurtogram, and the largest below the corner that holds power.
    share : float
        Of the plain maximum in the power.
    """

    corner_hz: float
    order: float
    depth_db: float
    flat_db: float
    filtered_db: float
    maximum: KurtogramNode
    chosen: KurtogramNode
    share: float


def tell(records: Measured) -> dict[str, Filtered]:
    """The filter and the kurtogram of each record.

    Raises
    ------
    EnvironmentLackError
        If a record is in no data folder.
    """
    return {name: _filtered(view_at(records, name)) for name in RECORDS}


def _filtered(view: View) -> Filtered:
    first, last = map(_beside_flat, learnt_and_held_out(view))
    rate = view.record.sample_rate_hz
    edge = edge_of_band(first, rate)
    assert edge is not None
    corner, order, depth = (float(value) for value in edge.values)
    kurtogram = fast_kurtogram(view.signal(_CHANNEL), rate, _LEVEL)
    power = float(np.var(view.signal(_CHANNEL)))
    able = [
        node
        for node in kurtogram.nodes
        if node.high_hz <= corner and node.mean_square > _LEAST_SHARE * 2 * power
    ]
    maximum = max(kurtogram.nodes, key=lambda node: node.kurtosis)
    return Filtered(
        corner,
        order,
        depth,
        _error_db(last, corner, np.zeros(last.frequency_hz.size)),
        _error_db(last, corner, lowpass_db(last.frequency_hz, corner, order, depth)),
        maximum,
        max(able, key=lambda node: node.kurtosis),
        maximum.mean_square / (2 * power),
    )


def _beside_flat(view: View) -> Beside:
    """The record's levels beside those of a chain that passes all frequencies alike."""
    noise = np.random.default_rng(_SEED).standard_normal(view.record.data.shape).astype(np.float32)
    silent = dataclasses.replace(view.record, data=noise * np.float32(_QUIET))
    found = beside(view, dataclasses.replace(view, record=silent), _CHANNEL)
    assert found is not None
    return found


def _error_db(data: Beside, corner_hz: float, loss_db: NDArray[np.float64]) -> float:
    """Rms error above the corner of levels that go on as in the third of an octave below it, less a loss."""
    before = (data.frequency_hz > corner_hz / 2 ** (1 / 3)) & (data.frequency_hz < corner_hz)
    above = data.frequency_hz >= corner_hz
    expected = float(np.median(data.measured_db[before])) + loss_db[above]
    return float(np.sqrt(np.mean((data.measured_db[above] - expected) ** 2)))


def draw(records: Measured) -> Figure:
    """Levels with the filter's curve, and where the kurtogram looks."""
    told = tell(records)
    figure = new_figure("CWRU: the end of the band is the recorder's", 4.2)
    for axes, name in zip(figure.subplots(1, 2), RECORDS, strict=True):
        one, data = told[name], _beside_flat(view_at(records, name))
        axes.plot(data.frequency_hz / 1e3, data.measured_db, color=HEALTHY, linewidth=0.9, label="measured")
        before = (data.frequency_hz > one.corner_hz / 2 ** (1 / 3)) & (data.frequency_hz < one.corner_hz)
        level = float(np.median(data.measured_db[before]))
        above = data.frequency_hz >= one.corner_hz / 2 ** (1 / 3)
        curve = level + lowpass_db(data.frequency_hz[above], one.corner_hz, one.order, one.depth_db)
        axes.plot(
            data.frequency_hz[above] / 1e3, np.full(int(above.sum()), level), color=GREY, label="flat chain"
        )
        axes.plot(data.frequency_hz[above] / 1e3, curve, color=FAULTY, label="with the filter")
        low, high = one.maximum.low_hz / 1e3, one.maximum.high_hz / 1e3
        axes.axvspan(
            low, high, color=FAULTY, alpha=0.15, label=f"plain maximum: {one.share:.0e} of the power"
        )
        axes.axvspan(
            one.chosen.low_hz / 1e3, one.chosen.high_hz / 1e3, color=HEALTHY, alpha=0.2, label="chosen"
        )
        mark(axes, one.corner_hz / 1e3, f"{one.corner_hz / 1e3:.1f} kHz")
        axes.set_xlim(0.0, 24.0)
        axes.set_xlabel(f"frequency [kHz], {name.removeprefix('cwru/')}")
        axes.legend(loc="lower left", fontsize=7.5)
    return figure
