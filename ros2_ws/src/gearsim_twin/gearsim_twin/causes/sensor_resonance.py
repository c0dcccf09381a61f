"""Resonance of a sensor on its mounting: one curve on all that it shows, whatever excites the machine."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_sensor
from gearsim_twin.causes.prior import LogNormal
from gearsim_twin.causes.spectra_beside import (
    Beside,
    CurveFit,
    agreeing,
    channels_of,
    fit_change,
    peaks_hz,
    pooled,
)

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

__all__ = ["SensorResonance", "mounted_db"]

Array = NDArray[np.float64]

_LEAST_DROP = 20.0
_COVERED_DROP = 10.0  # where the sensors' noise covers half of the bands
_SURE = 0.02  # of resonance and Q: what is read off no better is fitted
_LEAST_SHARE = 0.15
_VAGUE = 0.08  # of the resonance: an upper end that is merely different
_AGREE = 0.06


def mounted_db(frequency_hz: Array, resonance_hz: float, q: float) -> Array:
    """What a sensor on its mounting reads over what moves under it (Serridge and Licht 1987), in dB."""
    ratio = frequency_hz / resonance_hz
    return np.asarray(-10 * np.log10((1 - ratio**2) ** 2 + (ratio / q) ** 2))


def _resonance(data: Beside, sample_rate_hz: float) -> CurveFit | None:
    """Frequency and Q, if the ratio has both the peak and the fall beyond it (or the rise towards it)."""
    f = data.frequency_hz

    def change(p: Array) -> Array:
        return mounted_db(f, 10 ** p[0], 10 ** p[1])

    top = float(np.log10(1.2 * sample_rate_hz))
    places = [*peaks_hz(data), 0.55 * sample_rate_hz]
    starts = [(float(np.log10(place)), q) for place in places for q in (0.7, 1.3)]
    low = float(np.log10(max(100.0, f[2])))
    fit = fit_change(data, change, starts, ((low, -0.1), (top, 2.2)))
    resonance, q = 10 ** fit.values[0], 10 ** fit.values[1]
    least = _LEAST_DROP if data.heard.mean() > 0.5 else _COVERED_DROP
    if fit.drop < least or fit.share < _LEAST_SHARE or q < 1.5:
        return None
    peak = (f > resonance / 1.12) & (f < resonance * 1.12)
    ratio = data.ratio_db - fit.gain_db
    # The peak itself must show where it lies in the band, and the fall behind it.
    if peak.sum() >= 3 and float(ratio[peak].max()) < 3.0:
        return None
    beyond = (f > 1.6 * resonance) & data.heard
    if beyond.sum() >= 4 and float(np.median(ratio[beyond])) > -1.0:
        return None
    std = np.array([2.3026 * fit.std[0] * resonance, 2.3026 * min(fit.std[1], 2.0) * q])
    if std[0] > _VAGUE * resonance:
        return None
    return CurveFit(np.array([resonance, q]), std, fit.gain_db, fit.drop, fit.share)


class SensorResonance:
    """A sensor on wax, a magnet or held by hand."""

    name = "sensor_resonance"
    scales = True
    of_chain = True
    parameters: tuple[Parameter, ...] = (
        Parameter("resonance_hz", "Hz", LogNormal(8000.0, 2.5, 100.0, 1e5)),
        Parameter("q", "1", LogNormal(12.0, 2.5, 0.5, 200.0)),
    )
    confused_with: tuple[tuple[str, str], ...] = (
        ("casing_resonance", "the sensor moved to another place, or screwed on: a casing's peak stays"),
        ("antialias_rolloff", "a record at a higher rate: a resonance is a peak before its fall"),
    )

    def applies(self, context: Context) -> bool:
        """Wherever there are accelerometers."""
        return bool(context.views)

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """The resonance that most channels share, and that of the clearest others."""
        starts: list[dict[str, float | str]] = []
        for component, fits in agreeing(context, _resonance, _AGREE)[:3]:
            (resonance, std), (q, q_std) = pooled(fits, 0), pooled(fits, 1)
            start: dict[str, float | str] = {"resonance_hz": resonance, "q": q, "component": component}
            if std < _SURE * resonance:
                start["std:resonance_hz"] = std
            if q_std < _SURE * q:
                start["std:q"] = q_std
            starts.append(start)
        return starts

    def extend(self, content: Content, values: Values, context: Context) -> Content:
        """The content with that mounting."""
        component = str(values["component"])
        names = channels_of(component, context)
        mounting = {"resonance": f"{float(values['resonance_hz']):.9g} Hz", "q": float(values["q"])}
        for channel in names:
            content = with_sensor(content, channel, "mounting", mounting)
        return content

    def signature(self, values: Values) -> str:
        """In plain words."""
        which = "all channels" if values["component"] == "all" else str(values["component"])
        return (
            f"{which} show too much towards {float(values['resonance_hz']):.0f} Hz "
            f"(Q {float(values['q']):.1f}) and too little above, in all lines and "
            "noise alike: the sensor on its mounting"
        )
