"""A mean speed other than the one stated, or the one at which the model runs."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import percentile_filter

from gearsim_dsp.spectra import welch_psd
from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_section
from gearsim_twin.causes.prior import LogNormal

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context
    from gearsim_twin.view import View

__all__ = ["CLEAR", "LARGEST", "ShaftSpeedOffset", "Stretch", "model_speed_hz", "stretch_between"]

Array = NDArray[np.float64]

_RANGE = 0.08  # of the speed
_GRID = 2e-4
_TOP_HZ = 2500.0
_LEAST_HZ = 60.0  # below, lines are too wide on a logarithmic axis
_HEIGHT_DB = (6.0, 30.0)  # of a line that counts, and the most that it counts
CLEAR = 1.6  # best match over that of other stretches
_SIGMAS = 3.0
_LEAST_OFFSET = 1e-3
_FLOOR_LINES = 61
LARGEST = 0.1  # what is further off is another label, not an offset


@dataclass(frozen=True, slots=True)
class Stretch:
    """Ratio of measured to simulated frequencies, its standard deviation, and how clear the match is."""

    ratio: float
    std: float
    clear: float


def stretch_between(measured: View, model: View, reach: float = _RANGE) -> Stretch | None:
    """By what factor the model's lines must be moved to lie on the measured ones; None if nothing fits.

    `reach` is the natural logarithm of the largest factor that is tried.

    Notes
    -----
    Heights of lines over their floor (6 to 30 dB), of the spectrum and of the squared envelope's, on a
    logarithmic axis: a factor is a shift there. The shift with the largest sum of products must stand clear
    of all shifts that are no neighbours.
    """
    total: Array | None = None
    for channel in measured.record.channels:
        if channel not in model.record.channels:
            continue
        for envelope in (False, True):
            one, other = (_heights(view, channel, envelope) for view in (measured, model))
            if one is None or other is None:
                continue
            match = _match(one, other, reach)
            scale = float(np.sqrt(np.sum(one**2) * np.sum(other**2)))
            if scale > 0:
                total = match / scale if total is None else total + match / scale
    if total is None:
        return None
    top = int(np.argmax(total))
    half = total.size // 2
    beside = max(8, round(2.0 / (measured.record.seconds * 10.0) / _GRID))
    others = np.concatenate([total[: max(0, top - beside)], total[top + beside + 1 :]])
    clear = float(total[top] / max(float(others.max(initial=0.0)), 1e-300))
    above = np.flatnonzero(total >= 0.5 * total[top])
    near = above[np.abs(above - top) <= beside]
    width = _GRID * max(float(near.max() - near.min()), 1.0)
    place = float(np.sum(total[near] * near) / np.sum(total[near])) - half
    # Many lines share the peak: its middle is known ten times as well as it is wide (checked by simulation).
    return Stretch(math.exp(place * _GRID), 0.1 * width, clear)


def _heights(view: View, channel: str, envelope: bool) -> Array | None:
    """Heights of lines over their floor on a logarithmic axis of frequency."""
    x, rate = view.signal(channel), view.record.sample_rate_hz
    if not np.all(np.isfinite(x)) or np.ptp(x) == 0:
        return None
    if envelope:
        x = (x - x.mean()) ** 2
    psd = welch_psd(x, rate, 2.0 / view.record.seconds)
    inside = psd.frequency_hz <= _TOP_HZ * 1.1
    level = 10 * np.log10(np.maximum(psd.density[inside], 1e-300))
    over = level - percentile_filter(level, 50, _FLOOR_LINES)
    height = np.clip(over - _HEIGHT_DB[0], 0.0, _HEIGHT_DB[1] - _HEIGHT_DB[0])
    axis = np.exp(np.arange(math.log(_LEAST_HZ), math.log(min(_TOP_HZ, 0.45 * rate)), _GRID))
    return np.asarray(np.interp(axis, psd.frequency_hz[inside], height))


def _match(one: Array, other: Array, reach: float) -> Array:
    """Sum of products for every shift within the range."""
    half = round(reach / _GRID)
    size = 1 << int(np.ceil(np.log2(one.size + other.size)))
    cross = np.fft.irfft(np.fft.rfft(one, size) * np.conj(np.fft.rfft(other, size)), size)
    return np.concatenate([cross[-half:], cross[: half + 1]])


class ShaftSpeedOffset:
    """The machine runs faster or slower than stated."""

    name = "shaft_speed_offset"
    parameters: tuple[Parameter, ...] = (Parameter("speed_hz", "Hz", LogNormal(15.0, 4.0, 1e-3, 500.0)),)
    confused_with: tuple[tuple[str, str], ...] = (
        ("bearing_geometry", "a tacho, or a second bearing: a speed moves all families by one factor"),
        ("cage_slip", "a tacho: slip leaves the shaft's own lines where they are"),
        ("mislabelled_record", "the tacho's number of pulses in a turn"),
    )

    def applies(self, context: Context) -> bool:
        """Wherever there are records."""
        return bool(context.views)

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """The speed measured, where it is not the one stated; else the factor that the spectra tell."""
        starts: list[dict[str, float | str]] = []
        for view, model in zip(context.views, context.simulated_views, strict=True):
            nominal = view.machine.nominal_speed_hz
            counted = view.source in ("tacho", "encoder")
            found = None if counted else stretch_between(view, model)
            if found is not None and found.clear >= CLEAR:
                speed = model_speed_hz(context, view) * found.ratio
                stated = nominal if math.isfinite(nominal) else view.speed_hz
                off = max(abs(found.ratio - 1), abs(speed / stated - 1))
                if max(_LEAST_OFFSET, _SIGMAS * found.std) < off < LARGEST:
                    std = found.std * speed
                    starts.append({"speed_hz": speed, "std:speed_hz": std, "stated_hz": stated})
            elif (told := _told(view, nominal)) is not None:
                starts.append(told)
        return sorted(starts, key=lambda s: float(s["std:speed_hz"]))[:1]

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """The content at that speed; a course of the speed is moved with its mean."""
        speed = float(values["speed_hz"])
        trace = content.get("profile", {}).get("trace", {})
        if "columns" in trace:
            changed = copy.deepcopy(content)
            columns = changed["profile"]["trace"]["columns"]
            factor = speed / float(np.mean(columns["speed_hz"]))
            columns["speed_hz"] = [float(f"{factor * v:.9g}") for v in columns["speed_hz"]]
            return changed
        return with_section(content, "operating_point.speed", {"value": float(f"{speed:.12g}"), "unit": "Hz"})

    def signature(self, values: Values) -> str:
        """In plain words."""
        speed, stated = float(values["speed_hz"]), float(values["stated_hz"])
        return (
            f"all lines of the machine lie {100 * (speed / stated - 1):+.2f} % from where they should: the "
            f"shaft turns at {speed:.4g} Hz and not at the {stated:.4g} Hz stated"
        )


def _told(view: View, nominal_hz: float) -> dict[str, float | str] | None:
    """A measured speed that the nameplate's is too far from."""
    speed = view.speed
    if speed.source == "nameplate" or not (math.isfinite(nominal_hz) and math.isfinite(speed.value_hz)):
        return None
    std = 0.25 * (speed.ci95_hz[1] - speed.ci95_hz[0])
    off = abs(speed.value_hz / nominal_hz - 1)
    if not max(_LEAST_OFFSET, _SIGMAS * std / nominal_hz) < off < LARGEST:
        return None
    return {"speed_hz": float(speed.value_hz), "std:speed_hz": float(std), "stated_hz": nominal_hz}


def model_speed_hz(context: Context, view: View) -> float:
    """The speed at which the model ran beside a view."""
    content = context.contents[context.views.index(view)] if context.contents else {}
    told = content.get("operating_point", {}).get("speed")
    return float(told["value"]) if isinstance(told, dict) else view.speed_hz
