"""One example of each thing that diagnostic nodes publish; tests name what they want to be different."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gearsim_dsp.results import (
    Alarm,
    Features,
    FeatureValue,
    Level,
    Spectrum,
    SpectrumMarker,
    Trends,
    TrendValue,
)

_WINDOW = {
    "t0_ns": 7,
    "frame_id": "rig",
    "channel": "b3_y",
    "first_sample": 1,
    "sample_count": 2,
    "sample_rate_hz": 65536.0,
    "band_low_hz": 0.0,
    "band_high_hz": 32768.0,
    "speed_hz": 10.0,
}
_ALARM = Alarm(
    t_ns=5,
    frame_id="rig",
    alarm_id="envelope/bearing_3/outer_race",
    source="envelope",
    component="bearing_3",
    fault="outer_race",
    channel="b3_y",
    level=Level.ERROR,
    previous_level=Level.OK,
    expected_order=4.89,
    found_order=4.88,
    found_frequency_hz=48.8,
    value=30.0,
    threshold=12.0,
    unit="-log10 P",
    confidence=0.99,
    sample=131071,
    reason="outer race of bearing_3: 48.8 Hz",
)
_TREND_VALUE = TrendValue(
    source="kurtosis",
    channel="b3_y",
    component="",
    name="rms",
    unit="m/s^2",
    value=3.5,
    expected=2.0,
    limit=4.0,
    deviation=6.0,
    slope=0.5,
    slope_low=0.25,
    slope_high=0.75,
    direction="rising",
    hours_to_limit=1.0,
    span_s=3600.0,
)


def alarm(**other) -> Alarm:
    """An outer race's alarm, just raised."""
    return replace(_ALARM, **other)


def features(**other) -> Features:
    """One indicator of one channel, as the kurtosis node tells it."""
    values = (FeatureValue("rms", "", 3.5, "m/s^2"),)
    return Features(**{**_WINDOW, "source": "kurtosis", "speed_source": "tacho", "values": values, **other})


def spectrum(**other) -> Spectrum:
    """A squared envelope spectrum of five lines, one marked."""
    fields = {
        "source": "envelope",
        "kind": "squared_envelope",
        "axis_unit": "order",
        "axis_start": 0.0,
        "axis_step": 0.5,
        "value_unit": "1",
        "values": np.arange(5, dtype=np.float32),
        "markers": (SpectrumMarker("BPFO", "bearing_3", 4.89, 5, 0.0, 30.0),),
    }
    return Spectrum(**{**_WINDOW, **fields, **other})


def trend_value(**other) -> TrendValue:
    """An indicator that rises towards its limit."""
    return replace(_TREND_VALUE, **other)


def trends(*values: TrendValue) -> Trends:
    """What the trend node tells of `values`; of one where none are given."""
    return Trends(9, "rig", "trend", 131071, "learnt from 60 s", values or (trend_value(),))
