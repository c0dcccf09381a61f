"""The upper end of the band: an early or steep roll-off of the measuring chain, or no filter at all."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_section, with_sensor
from gearsim_twin.causes.folded import folded_orders
from gearsim_twin.causes.prior import LogNormal
from gearsim_twin.causes.spectra_beside import Beside, CurveFit, agreeing, channels_of, fit_change, pooled

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

__all__ = ["AntialiasRolloff", "edge_of_band", "lowpass_db"]

Array = NDArray[np.float64]

_LEAST_DROP = 20.0  # of the robust sum of squares: three parameters more, and thousands of records
# Where noise covers the upper band and a tuned model has met it half way, less must do: the fit tells.
_COVERED_DROP = 7.0
_VAGUE = 0.05  # of the corner: beyond, it is fitted
_LEAST_SHARE = 0.15
_FREER = 6.0  # by which any order must fit better than the second, having one parameter more
_HIGHEST = 0.45  # of the rate: a corner above it is that of the usual filter
_LEAST_LOSS_DB = 3.0  # at the upper end
_STEEP = 3.5  # order between a sensor's second and a converter's filter
_AGREE = 0.15
_PER_OCTAVE = 12  # bands of `beside`
_EDGE_BANDS = 4
_EDGE_DB = 12.0  # over a third of an octave: steeper than what machines do by themselves
_EDGE_FROM = 0.36  # of the rate: where such filters begin


def lowpass_db(frequency_hz: Array, corner_hz: float, order: float, depth_db: float) -> Array:
    """A Butterworth magnitude of that order down to a floor `depth_db` below."""
    ratio = np.minimum((frequency_hz / corner_hz) ** (2 * order), 1e12)
    return np.asarray(10 * np.log10(1 / (1 + ratio) + 10 ** (-depth_db / 10)))


def _end_of_band(data: Beside, sample_rate_hz: float) -> CurveFit | None:
    """As `_rolloff`; where no curve fits, the edge that the measured spectrum itself shows."""
    return _rolloff(data, sample_rate_hz) or edge_of_band(data, sample_rate_hz)


def edge_of_band(data: Beside, sample_rate_hz: float) -> CurveFit | None:
    """The last steep fall, if levels stay down behind it and the model has no such fall there."""
    f, level = data.frequency_hz, data.measured_db
    for k in range(f.size - _EDGE_BANDS - 1, 4, -1):
        end = k + _EDGE_BANDS
        before = float(np.median(level[k - 4 : k + 1]))
        fall = before - level[end]
        expected = data.shaped(0.0)
        model = float(np.median(expected[k - 4 : k + 1]) - expected[end])
        down = before - level[end:].max()
        if fall > _EDGE_DB and down > _EDGE_DB and model < 0.5 * fall and f[k] > _EDGE_FROM * sample_rate_hz:
            over = np.flatnonzero(level[k : end + 1] < before - 3.0)
            corner = float(f[k + int(over[0])]) / 2 ** (0.5 / _PER_OCTAVE)
            order = fall / (6.02 * _EDGE_BANDS / _PER_OCTAVE)
            values = np.array([corner, max(order, _STEEP + 0.5), fall])
            return CurveFit(values, np.array([0.04 * corner, 0.3 * order, 3.0]), 0.0, fall, 1.0)
    return None


def _rolloff(data: Beside, sample_rate_hz: float) -> CurveFit | None:
    """Corner, order and depth, if the upper end falls as such a curve does and stays low."""
    f = data.frequency_hz
    warped = np.tan(np.pi * np.minimum(f / sample_rate_hz, 0.4999))

    def digital(corner: float, depth: float) -> Array:
        # A second-order filter in a digital chain: the bilinear transform takes half the rate to infinity.
        return lowpass_db(warped, float(np.tan(np.pi * corner / sample_rate_hz)), 2.0, depth)

    low, top = max(50.0, f[2]), 0.49 * sample_rate_hz
    corners = [share * sample_rate_hz for share in (0.06, 0.15, 0.3)]
    second = fit_change(
        data,
        lambda p: digital(p[0], p[1]),
        [(corner, 60.0) for corner in corners],
        ((low, 10.0), (top, 120.0)),
    )
    fit = fit_change(
        data,
        lambda p: lowpass_db(f, p[0], p[1], p[2]),
        [(corner, order, 60.0) for corner in corners for order in (2.0, 8.0)],
        ((low, 1.0, 10.0), (top, 40.0, 120.0)),
    )
    if second.drop > fit.drop - _FREER:
        corner, depth = second.values
        curve = digital(corner, depth)
        fit = CurveFit(
            np.array([corner, 2.0, depth]),
            np.array([second.std[0], 0.0, second.std[1]]),
            second.gain_db,
            second.drop,
            second.share,
        )
    else:
        curve = lowpass_db(f, *fit.values)
    corner, loss = fit.values[0], -float(curve[-1])
    covered = not bool(data.heard[-_EDGE_BANDS:].any())
    sure = fit.drop > (_COVERED_DROP if covered else _LEAST_DROP) and fit.share > _LEAST_SHARE
    # A dip amid the band is no roll-off: the curve must fit its own upper part.
    residual = np.abs(data.measured_db - data.shaped(fit.gain_db + curve))[f > corner]
    fits = residual.size >= 3 and float(np.median(residual)) < max(3.0, 0.25 * loss)
    return fit if sure and fits and loss > _LEAST_LOSS_DB and corner < _HIGHEST * sample_rate_hz else None


class AntialiasRolloff:
    """A chain that ends below the band, or that lets in what lies above it."""

    name = "antialias_rolloff"
    scales = True
    of_chain = True
    parameters: tuple[Parameter, ...] = (Parameter("corner_hz", "Hz", LogNormal(8000.0, 2.5, 50.0, 1e6)),)
    confused_with: tuple[tuple[str, str], ...] = (
        ("sensor_resonance", "a record at a higher rate: a resonance is a peak before its fall"),
        ("coloured_floor", "the record of a machine at rest: noise stays, a roll-off does not show"),
    )

    def applies(self, context: Context) -> bool:
        """Wherever there are accelerometers."""
        return bool(context.views)

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """The roll-off that most channels share; else orders that are folded, if any are."""
        starts: list[dict[str, float | str]] = []
        for component, fits in agreeing(context, _end_of_band, _AGREE)[:2]:
            (corner, std), (order, _) = pooled(fits, 0), pooled(fits, 1)
            start: dict[str, float | str] = {
                "corner_hz": corner,
                "kind": "converter" if order > _STEEP else "bandwidth",
                "order": order,
                "component": component,
            }
            starts.append(start if std > _VAGUE * corner else start | {"std:corner_hz": std})
        if folded := folded_orders(context.views):
            rate = context.views[0].record.sample_rate_hz
            words = ", ".join(f"{order:g}" for order in folded[:4])
            unfiltered: dict[str, float | str] = {"corner_hz": rate, "kind": "none", "component": "all"}
            starts.insert(0, unfiltered | {"orders": words, "image_hz": _image_hz(context, folded[0])})
        return starts

    def extend(self, content: Content, values: Values, context: Context) -> Content:
        """A second-order bandwidth, a converter's steep filter, or none at all."""
        rate = context.views[0].record.sample_rate_hz
        corner, kind = float(values["corner_hz"]), str(values["kind"])
        if kind == "none":
            sampling = {"oversampling": 4, "antialias": "none"}
            return with_section(content, "sensors.accelerometers.sampling", sampling)
        if kind == "converter" and values["component"] == "all":
            share = min(max(corner / rate, 0.1), 0.5)
            sampling = {
                "oversampling": 2,
                "antialias": "delta_sigma",
                "pass_band": min(max(2 * share - max(share + 0.05, 0.45), 0.1), 0.5),
                "stop_band": max(share + 0.05, 0.45),
            }
            return with_section(content, "sensors.accelerometers.sampling", sampling)
        component = str(values["component"])
        names = channels_of(component, context)
        for channel in names:
            content = with_sensor(content, channel, "bandwidth", f"{min(corner, 0.489 * rate):.9g} Hz")
        return content

    def signature(self, values: Values) -> str:
        """In plain words."""
        if values["kind"] == "none":
            return (
                f"orders {values['orders']} beyond half the sample rate show at their images (the first at "
                f"{float(values['image_hz']):.1f} Hz): nothing filters before the samples are taken"
            )
        corner = float(values["corner_hz"])
        order = float(values.get("order", 2.0))
        if values["kind"] == "converter":
            return f"nothing is left above {corner:.0f} Hz: an anti-alias filter of order {order:.0f} or more"
        return f"levels fall above {corner:.0f} Hz, 3 dB down there and {6 * order:.0f} dB per octave beyond"


def _image_hz(context: Context, order: float) -> float:
    """Where an order shows that lies beyond half the rate."""
    view = context.views[0]
    rate = view.record.sample_rate_hz
    at = order * view.speed_hz % rate
    return min(at, rate - at)
