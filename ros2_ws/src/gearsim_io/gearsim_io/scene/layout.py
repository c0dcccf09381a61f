"""How the views are arranged, so that one glance tells what happened, when and where."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.encodings import TextLogColumn, TimelineColumn

from gearsim_io.scene import style
from gearsim_io.scene.canvas import TIMELINE
from gearsim_io.scene.scene import Zoom

TORQUE = "torque"
"""Kind of the samples that are torques."""
_HIDDEN = rrb.PlotLegend(visible=False)


@dataclass(frozen=True, slots=True)
class Focus:
    """What the views put in front.

    Parameters
    ----------
    channel : str
        Channel of the alarm that says most, or the first.
    channels : tuple of str
        All channels.
    parts : str
        What the front channel sits close to, for the title of its spectrum.
    zooms : tuple of Zoom
    limit : float
        The front channel is drawn from minus to plus this value; 0 leaves it to the viewer.
    speed_span_hz : tuple of float
        Range of the speed's axis; infinite values leave it to the viewer.
    unit, axis_unit : str
        Of the signals, and of the spectra's axis.
    coloured : bool
        The front channel is drawn in colour, the others in grey.
    kinds : frozenset of str
        Short names of the messages that there are, and `TORQUE`; views of what is missing are left out.
        Empty: all but torque.
    """

    channel: str
    channels: tuple[str, ...]
    parts: str = ""
    zooms: tuple[Zoom, ...] = ()
    limit: float = 0.0
    speed_span_hz: tuple[float, float] = (-math.inf, math.inf)
    unit: str = "m/s^2"
    axis_unit: str = "order"
    coloured: bool = True
    kinds: frozenset[str] = frozenset()

    def has(self, *kinds: str) -> bool:
        """Whether there are messages of one of these kinds."""
        return not self.kinds or bool(self.kinds & set(kinds))

    @property
    def ordered(self) -> tuple[str, ...]:
        """All channels, the front one first."""
        return (self.channel, *(name for name in self.channels if name != self.channel))


def blueprint(focus: Focus, picture: bool = False) -> Any:
    """The arrangement of all views; a picture has no time panel."""
    rows = [
        _row(
            (3, rrb.StateTimelineView(origin="/state", name="Machine and alarms over time"))
            if focus.has("AlarmState", "GroundTruth")
            else None,
            (2, rrb.TextDocumentView(origin="/summary", name="Summary")),
        ),
        _row((1, _waveforms(focus)), *[(1, _zoom(zoom, focus)) for zoom in focus.zooms]),
        _row(
            (3, _spectra(focus)) if focus.has("Spectrum") else None,
            (2, _faults()) if focus.has("Features") else None,
        ),
        _row(
            (4, _kurtosis(focus)) if focus.has("Features") else None,
            (3, _operating_point(focus)) if focus.has("TachoBatch", "Features", TORQUE) else None,
            (8, _log()) if focus.has("Alarm") else None,
        ),
    ]
    shares = [4 if focus.has("AlarmState", "GroundTruth") else 1, 4, 5, 4]
    filled = [(row, share) for row, share in zip(rows, shares, strict=True) if row is not None]
    return rrb.Blueprint(
        rrb.Vertical(*[row for row, _ in filled], row_shares=[share for _, share in filled]),
        rrb.TimePanel(state="hidden" if picture else "collapsed", timeline=TIMELINE, play_state="following"),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
        rrb.TopPanel(state="hidden"),
        auto_views=False,
    )


def _row(*views: tuple[int, Any] | None) -> Any:
    """Views side by side, None if there are none."""
    there = [view for view in views if view is not None]
    if not there:
        return None
    return rrb.Horizontal(*[view for _, view in there], column_shares=[share for share, _ in there])


def _waveforms(focus: Focus) -> Any:
    views = [
        rrb.TimeSeriesView(
            origin=f"/{style.entity('accel', channel)}",
            contents=["$origin/**", "/marks/accel/**"] if channel == focus.channel else "$origin/**",
            name=f"Acceleration {channel} [{focus.unit}]",
            plot_legend=_HIDDEN,
            axis_y=_symmetric(focus) if channel == focus.channel else None,
        )
        for channel in focus.ordered
    ]
    return rrb.Tabs(*views, active_tab=0)


def _symmetric(focus: Focus) -> Any:
    return rrb.ScalarAxis(range=(-focus.limit, focus.limit)) if focus.limit else None


def _zoom(zoom: Zoom, focus: Focus) -> Any:
    span = rr.TimeRange(
        start=rr.TimeRangeBoundary.absolute(seconds=zoom.start_s),
        end=rr.TimeRangeBoundary.absolute(seconds=zoom.end_s),
    )
    return rrb.TimeSeriesView(
        origin=f"/{style.entity('zoom', zoom.name)}",
        name=f"{zoom.name}: {zoom.channel} from {zoom.start_s:.2f} to {zoom.end_s:.2f} s [{focus.unit}]",
        plot_legend=_HIDDEN,
        axis_x=rrb.TimeAxis(view_range=span),
        axis_y=_symmetric(focus),
    )


def _spectra(focus: Focus) -> Any:
    axis = "multiples of shaft speed" if focus.axis_unit == "order" else focus.axis_unit
    views = [
        rrb.BarChartView(
            origin=f"/{style.entity('spectrum', channel)}",
            name=f"Envelope spectrum {channel}"
            + (f", lines of {focus.parts}" if channel == focus.channel and focus.parts else "")
            + f" [over {axis}]",
            plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.RightTop, visible=True),
        )
        for channel in focus.ordered
    ]
    return rrb.Tabs(*views, active_tab=0)


def _faults() -> Any:
    return rrb.TimeSeriesView(
        origin="/faults",
        name="Fault lines over the noise floor, best channel [dB]",
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.LeftTop, visible=True),
    )


def _kurtosis(focus: Focus) -> Any:
    name = f"Kurtosis [1]: {focus.channel} in blue, other channels grey" if focus.coloured else "Kurtosis [1]"
    return rrb.TimeSeriesView(
        origin="/kurtosis",
        contents=["$origin/**", "/marks/kurtosis/**"],
        name=name,
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.LeftTop, visible=not focus.coloured),
    )


def _operating_point(focus: Focus) -> Any:
    """Speed, and torque where it is measured."""
    if TORQUE not in focus.kinds:
        return _speed(focus)
    legend = rrb.PlotLegend(corner=rrb.Corner2D.RightBottom, visible=True)
    torque = rrb.TimeSeriesView(origin="/load", name="Operating point: torque [N m]", plot_legend=legend)
    return rrb.Tabs(_speed(focus), torque, active_tab=0)


def _speed(focus: Focus) -> Any:
    low, high = focus.speed_span_hz
    margin = 0.05 * (high if math.isfinite(high) else 0.0)
    ranged = math.isfinite(low) and math.isfinite(high)
    return rrb.TimeSeriesView(
        origin="/speed",
        name="Operating point: speed [Hz]",
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.RightBottom, visible=True),
        axis_y=rrb.ScalarAxis(range=(low - margin, high + margin)) if ranged else None,
    )


def _log() -> Any:
    columns = rrb.TextLogColumns(
        timeline_columns=[TimelineColumn(TIMELINE, visible=False)],
        text_log_columns=[TextLogColumn("Body")],
    )
    return rrb.TextLogView(origin="/alarms", name="Alarm log", columns=columns)
