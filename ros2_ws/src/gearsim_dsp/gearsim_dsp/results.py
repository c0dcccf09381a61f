"""What a diagnosis says: features, spectra, alarms. The classes mirror `gearsim_msgs` and know no ROS.

Stamps are integer nanoseconds on the stream's own time axis, never wall time; `frame_id` is the name
of the machine.
Field names are those of the messages with the unit appended, so `speed_hz` here is `speed` there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_io.health import Level

__all__ = [
    "Alarm",
    "AlarmState",
    "FeatureValue",
    "Features",
    "Level",
    "Spectrum",
    "SpectrumMarker",
    "TrendValue",
    "Trends",
]


@dataclass(frozen=True, slots=True)
class FeatureValue:
    """One scalar condition indicator; `component` is empty where it speaks of the whole channel."""

    name: str
    component: str
    value: float
    unit: str


@dataclass(frozen=True, slots=True)
class Features:
    """Condition indicators of one channel over one window; `t0_ns` belongs to `first_sample`."""

    t0_ns: int
    frame_id: str
    source: str
    channel: str
    first_sample: int
    sample_count: int
    sample_rate_hz: float
    band_low_hz: float
    band_high_hz: float
    speed_hz: float
    speed_source: str
    values: tuple[FeatureValue, ...]


@dataclass(frozen=True, slots=True)
class SpectrumMarker:
    """A line or family of lines with a meaning; positions in the spectrum's axis unit."""

    label: str
    component: str
    position: float
    harmonics: int = 1
    sideband_spacing: float = 0.0
    snr_db: float = float("nan")


@dataclass(frozen=True, slots=True, eq=False)
class Spectrum:
    """A spectrum over one window; `values` is float32 of shape (lines,), line k at start + k step."""

    t0_ns: int
    frame_id: str
    source: str
    channel: str
    kind: str
    first_sample: int
    sample_count: int
    sample_rate_hz: float
    band_low_hz: float
    band_high_hz: float
    speed_hz: float
    axis_unit: str
    axis_start: float
    axis_step: float
    value_unit: str
    values: NDArray[np.float32]
    markers: tuple[SpectrumMarker, ...] = ()


@dataclass(frozen=True, slots=True)
class Alarm:
    """One change of one alarm; `t_ns` and `sample` are of the last sample that led to it.

    `present` is false where the level is only kept (latched), or OK; `acknowledged` belongs to the level.
    """

    t_ns: int
    frame_id: str
    alarm_id: str
    source: str
    component: str
    fault: str
    channel: str
    level: Level
    previous_level: Level
    expected_order: float
    found_order: float
    found_frequency_hz: float
    value: float
    threshold: float
    unit: str
    confidence: float
    sample: int
    reason: str
    present: bool = True
    acknowledged: bool = False
    acknowledged_by: str = ""


@dataclass(frozen=True, slots=True)
class AlarmState:
    """All alarms of one source that are not OK, as of the last sample judged (`t_ns`, `sample`)."""

    t_ns: int
    frame_id: str
    source: str
    level: Level
    stale: bool
    note: str
    sample: int
    active: tuple[Alarm, ...] = ()


@dataclass(frozen=True, slots=True)
class TrendValue:
    """Where one indicator stands and where it goes; see `gearsim_msgs/TrendValue` for the meaning of NaN."""

    source: str
    channel: str
    component: str
    name: str
    unit: str
    value: float
    expected: float
    limit: float
    deviation: float
    slope: float
    slope_low: float
    slope_high: float
    direction: str
    hours_to_limit: float
    span_s: float


@dataclass(frozen=True, slots=True)
class Trends:
    """All indicators that a node follows, as of the last sample that counts (`t_ns`, `sample`)."""

    t_ns: int
    frame_id: str
    source: str
    sample: int
    baseline: str
    values: tuple[TrendValue, ...] = ()
