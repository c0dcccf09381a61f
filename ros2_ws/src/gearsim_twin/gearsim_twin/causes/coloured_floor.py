"""Noise of the measuring chain: a floor, rising towards low frequencies, that the machine does not make."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearsim_twin.causes.between_lines import between_lines
from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_sensor
from gearsim_twin.causes.prior import LogNormal
from gearsim_twin.causes.spectra_beside import Beside, CurveFit, fit_curve

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

__all__ = ["ColouredFloor"]

Array = NDArray[np.float64]

_LEAST_OCTAVES = 1.0  # in which the floor lies above the model
_OVER_DB = 3.0
# A white floor is any sensor's own, whatever its height; usual ones rise by 2 dB at most from there on down.
_RISE_HZ, _LEAST_RISE_DB = 40.0, 4.0
# Noise follows the law of 1/f; what machines and flow make has humps.
_USUALLY_OFF_DB, _HARDLY_OFF_DB = 1.5, 5.0
_VAGUE = 0.25  # decades of the corner
_HIGHEST_CORNER = 0.124  # of the sample rate


def floor_db(frequency_hz: Array, density: float, corner_hz: float) -> Array:
    """Power density in dB of white noise that rises as 1/f below a corner."""
    return np.asarray(20 * np.log10(density) + 10 * np.log10(1 + corner_hz / frequency_hz))


def _floor(data: Beside) -> CurveFit | None:
    """Density and corner of the floor, if the bands that it rules follow its law and rise."""
    f = data.frequency_hz

    def predicted(p: Array) -> Array:
        added = floor_db(f, 10 ** (p[0] / 20), 10 ** p[1])
        return np.asarray(10 * np.log10(10 ** (data.simulated_db / 10) + 10 ** (added / 10)))

    quiet = float(np.quantile(data.measured_db, 0.1))
    starts = [(quiet + up, corner) for up in (-6.0, 0.0) for corner in (0.0, 2.0, 3.5)]
    fit = fit_curve(data, predicted, starts, ((-300.0, -2.0), (200.0, 5.0)), gain=False)
    density, corner = 10 ** (fit.values[0] / 20), 10 ** fit.values[1]
    lifted = floor_db(f, density, corner) > data.simulated_db + _OVER_DB
    rise = 10 * np.log10(1 + corner / _RISE_HZ)
    if _octaves(f[lifted]) < _LEAST_OCTAVES or fit.std[1] > _VAGUE or rise < _LEAST_RISE_DB:
        return None
    off = np.abs(data.measured_db - predicted(fit.values))[lifted]
    if np.median(off) > _USUALLY_OFF_DB or np.quantile(off, 0.9) > _HARDLY_OFF_DB:
        return None
    std = np.array([0.1151 * fit.std[0] * density, 2.3026 * fit.std[1] * corner])
    return CurveFit(np.array([density, corner]), std, fit.gain_db, fit.drop, fit.share)


def _octaves(frequency_hz: Array) -> float:
    """What bands reach over; 0 of none."""
    return float(np.log2(frequency_hz.max() / frequency_hz.min())) if frequency_hz.size else 0.0


class ColouredFloor:
    """White noise with a rise of 1/f, one density for each channel; of a white floor nothing is strange."""

    name = "coloured_floor"
    of_chain = True
    proven = True  # read off between the lines; a chain with a floor of its own shows little else of it
    parameters: tuple[Parameter, ...] = (
        Parameter("density", "m/s^2/Hz^0.5", LogNormal(1e-3, 6.0, 1e-12, 1e3)),
        Parameter("corner_hz", "Hz", LogNormal(30.0, 8.0, 0.011, 1e5)),
    )
    confused_with: tuple[tuple[str, str], ...] = (
        ("tooth_wear", "a record of the machine at rest: noise of the chain stays, that of teeth does not"),
        ("unit_or_gain_error", "the levels of lines: noise leaves them as they are"),
    )

    def applies(self, context: Context) -> bool:
        """Wherever there are accelerometers."""
        return bool(context.views)

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """The channels whose floor is lifted, the densities as shares of the clearest one's."""
        pairs = list(zip(context.views, context.simulated_views, strict=True))
        beside = {channel: between_lines(pairs, channel) for channel in context.views[0].record.channels}
        fits = {channel: _floor(data) for channel, data in beside.items() if data is not None}
        found = {channel: fit for channel, fit in fits.items() if fit is not None}
        if not found:
            return []
        top = max(found.values(), key=lambda fit: fit.drop)
        start: dict[str, float | str] = {
            "density": float(top.values[0]),
            "std:density": float(top.std[0]),
            "corner_hz": float(np.clip(top.values[1], 0.011, _most_corner_hz(context))),
            "std:corner_hz": float(top.std[1]),
        }
        return [start | {f"share:{c}": float(fit.values[0] / top.values[0]) for c, fit in found.items()}]

    def extend(self, content: Content, values: Values, context: Context) -> Content:
        """The content with that noise on the channels that have it."""
        corner_hz = min(float(values["corner_hz"]), _most_corner_hz(context))
        for key, share in values.items():
            if key.startswith("share:"):
                channel = key.removeprefix("share:")
                density = float(values["density"]) * float(share)
                content = with_sensor(content, channel, "noise_density", f"{density:.9g} m/s^2/Hz^0.5")
                content = with_sensor(content, channel, "noise_corner", f"{corner_hz:.9g} Hz")
        return content

    def signature(self, values: Values) -> str:
        """In plain words."""
        corner = float(values["corner_hz"])
        rise = f", rising below {corner:.3g} Hz" if corner > 1 else ""
        return f"between the lines a floor of {float(values['density']):.2g} m/s^2/sqrt(Hz){rise}"


def _most_corner_hz(context: Context) -> float:
    """The highest corner that simulated sensors can have at the rate of the records."""
    return _HIGHEST_CORNER * min(view.record.sample_rate_hz for view in context.views)
