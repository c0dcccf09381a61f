"""Hum of the supply: lines at multiples of 50 or 60 Hz that stay where they are when the speed changes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gearsim_dsp.noise_floor import comb_false_alarm
from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_sensor
from gearsim_twin.causes.expected_lines import odds_of_lines
from gearsim_twin.causes.hum_in_all import HumLines, hum_in_all
from gearsim_twin.causes.lines import (
    BESIDE,
    SKIRT,
    LineSpectrum,
    MachineLines,
    SlowPart,
    line_spectrum,
    machine_lines,
    slow_part,
)
from gearsim_twin.causes.prior import LogNormal, Normal

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context
    from gearsim_twin.view import View

__all__ = ["Hum", "MainsInterference", "find_hum"]

_SUPPLIES_HZ = (50.0, 60.0)
_DRIFT = 0.001  # EN 50160 allows 1 % for 99.5 % of a year; grids keep within 0.1 % nearly always
_ORDERS = tuple(range(1, 13))
_WANDERING = (-4e-4, -2e-4, 0.0, 2e-4, 4e-4)  # from one record to another
_CAP = 25.0  # of one line's evidence, so that no single line makes a comb
_FALSE_ALARM = 1e-6
_LINE = 12.0  # evidence of a line that counts by itself: 1e-5 of noise
_HINT = 3.0  # evidence of a line that may be one
_LOW = 3  # hum shows in one of its first orders, unless these are the machine's
_ALONE = 25.0  # evidence of a fundamental that needs no harmonics
_TOP_HZ = 800.0
_LEAST_SHARE = 1e-6  # of hum in the signal's power: rounding and leakage are not hum
_OWN = 0.25
_AMPLITUDE_ERROR = 0.05  # of a line whose power is ten times the floor or more, beside an order
_LEAST_S = 0.8  # forty periods
# Of what the shafts' orders leave about a line, so much in one sine at the supply's frequency: what orders
# leave of themselves lies on both sides of them alike.
_ONE_SINE = 0.7
_SMALLEST_PART = 0.02
_LARGEST_PART = 100.0


@dataclass(frozen=True, slots=True)
class Hum:
    """Supply lines of one channel: frequency with its standard deviation, amplitude (peak) by order.

    `amplitude_std` is that of the first: beside an order it may be half of it.
    """

    frequency_hz: float
    frequency_std_hz: float
    amplitude: Mapping[int, float]
    amplitude_std: float = 0.0


def find_hum(slow: SlowPart, known: MachineLines, supply_hz: float = 0.0) -> Hum | None:
    """Look for hum.

    Parameters
    ----------
    slow : SlowPart
        Of a channel, 0.8 s at least.
    known : MachineLines
        Orders of hum that fall on these do not count, unless the angle shows that they are none of these: a
        line of the supply stays where it is while the orders beside it turn away from it.
    supply_hz : float
        Of the nameplate; 0: 50 and 60 Hz are tried.

    Returns
    -------
    Hum or None
        None where the comb would come of noise in one of a million records.
    """
    sample_rate_hz = slow.sample_rate_hz
    if slow.signal.size < _LEAST_S * sample_rate_hz:
        return None
    samples = slow.without_orders(_TOP_HZ)
    spectrum = line_spectrum(samples, sample_rate_hz)
    if spectrum is None:
        return None
    best: tuple[float, float, dict[int, float]] = (0.0, 0.0, {})
    for supply in (supply_hz,) if supply_hz > 0 else _SUPPLIES_HZ:
        reach = _DRIFT * supply
        trials = np.arange(-reach, reach + 1e-9, 0.25 * spectrum.step_hz / _ORDERS[-1]) + supply
        orders = [k for k in _ORDERS if k * supply < 0.45 * sample_rate_hz]
        lines = np.stack([spectrum.at(k * trials) for k in orders])
        free = np.array(
            [
                [_is_free(slow, known, k * f, spectrum.step_hz, z) for f, z in zip(trials, row, strict=True)]
                for k, row in zip(orders, lines.tolist(), strict=True)
            ]
        )
        lines *= free
        total = np.minimum(lines, _CAP).sum(axis=0)
        top = int(np.argmax(total))
        found = {
            k: float(z)
            for k, z in zip(orders, lines[:, top], strict=True)
            if z >= _LINE and _alone(spectrum, k * float(trials[top]), float(z))
        }
        # The evidence at a line is the largest of three: the chance is three times as great.
        chance = float(comb_false_alarm(max(total[top] - len(orders) * np.log(3.0), 0.0), len(orders)))
        low = [k for k in found if k <= _LOW] or not np.any(free[:_LOW, top])
        enough = (low and len(found) >= 2) or found.get(1, 0.0) >= _ALONE
        if enough and chance * trials.size < _FALSE_ALARM and total[top] > best[0]:
            best = (float(total[top]), float(trials[top]), found)
    if not best[2]:
        return None
    frequency, std = slow.refine(best[1], best[2])
    free_lines = [k for k, z in best[2].items() if _is_free(slow, known, k * frequency, spectrum.step_hz, z)]
    if not free_lines or min(abs(frequency / supply - 1) for supply in _SUPPLIES_HZ) > 1.1 * _DRIFT:
        return None
    orders = sorted({1, *best[2]})
    amplitude = {k: slow.amplitude(k * frequency) for k in orders}
    # The other orders are told in parts of the first, which must not vanish for that.
    amplitude[1] = max(amplitude[1], max(amplitude.values()) / _LARGEST_PART)
    return Hum(frequency, std, amplitude, slow.amplitude_std(frequency, samples))


def _is_free(
    slow: SlowPart, known: MachineLines, frequency_hz: float, step_hz: float, evidence: float
) -> bool:
    """Whether a line is none of the machine's: far from them, or beside one that the angle tells from it.

    The latter is looked at where there is a line at all: it costs a hundred times as much.
    """
    if not known.explain(frequency_hz, step_hz):
        return True
    return known.counted and evidence > _HINT and slow.share_beyond_orders(frequency_hz) > _ONE_SINE


def _alone(spectrum: LineSpectrum, frequency_hz: float, evidence: float) -> bool:
    """Whether a line is twice as high as all within some lines of it: not one of many."""
    line = round(frequency_hz / spectrum.step_hz)
    beside = np.r_[line - BESIDE : line - SKIRT, line + SKIRT + 1 : line + BESIDE + 1]
    beside = beside[(beside > 0) & (beside < spectrum.evidence.size)]
    return evidence > 4 * float(spectrum.evidence[beside].max(initial=0.0))


def _hum_of(view: View, channel: str) -> Hum | None:
    """Hum in a channel, if it is loud enough to be more than rounding and leakage."""
    signal = view.signal(channel)
    if not np.all(np.isfinite(signal)):
        return None
    hum = find_hum(slow_part(view, channel, _TOP_HZ), machine_lines(view), view.machine.line_frequency_hz)
    if hum is None or 0.5 * sum(a**2 for a in hum.amplitude.values()) < _LEAST_SHARE * np.var(signal):
        return None
    return hum


def _power(hum: Hum) -> float:
    return sum(a**2 for a in hum.amplitude.values())


class MainsInterference:
    """Hum of the supply in the measuring chain."""

    name = "mains_interference"
    superposes = True
    proven = True  # its finder has a false alarm rate of its own
    parameters: tuple[Parameter, ...] = (
        Parameter("amplitude_m_s2", "m/s^2", LogNormal(0.1, 6.0, 1e-6, 1e4)),
        Parameter("frequency_hz", "Hz", Normal(50.0, 5.0, 45.0, 65.0)),
    )
    confused_with: tuple[tuple[str, str], ...] = (
        ("unbalance", "a record at another speed: orders move, lines of the supply do not"),
        ("inverter_lines", "a record with the inverter off: hum stays"),
    )

    def applies(self, context: Context) -> bool:
        """Wherever there are accelerometers."""
        return bool(context.views)

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """The hum of the clearest channel; the other channels by their shares of it."""
        best: tuple[float, Hum] | None = None
        shares: dict[str, float] = {}
        for view, model in zip(context.views, context.simulated_views, strict=True):
            found = {}
            for name in view.record.channels:
                hum = _hum_of(view, name)
                own = _hum_of(model, name) if hum is not None and name in model.record.channels else None
                # What the model shows just as well is no hum, or is hum that it has already.
                if hum is not None and (own is None or _power(own) < _OWN * _power(hum)):
                    found[name] = hum
            if not found:
                continue
            top = max(found, key=lambda name: found[name].amplitude[1])
            if best is None or found[top].frequency_std_hz < best[0]:
                best = (found[top].frequency_std_hz, found[top])
                shares = {name: hum.amplitude[1] / found[top].amplitude[1] for name, hum in found.items()}
        if best is None:
            names = context.views[0].record.channels
            hidden = {name: hum_in_all(context, name, _SUPPLIES_HZ) for name in names}
            hums = {name: Hum(*one) for name, one in hidden.items() if one is not None}
            if not hums:
                return []
            top = max(hums, key=lambda name: hums[name].amplitude[1])
            best = (hums[top].frequency_std_hz, hums[top])
            shares = {name: hum.amplitude[1] / best[1].amplitude[1] for name, hum in hums.items()}
        hum = best[1]
        parts = {k: a / hum.amplitude[1] for k, a in hum.amplitude.items() if k > 1}
        start: dict[str, float | str] = {
            "amplitude_m_s2": hum.amplitude[1],
            "std:amplitude_m_s2": math.hypot(_AMPLITUDE_ERROR * hum.amplitude[1], hum.amplitude_std),
            "frequency_hz": hum.frequency_hz,
            "std:frequency_hz": hum.frequency_std_hz,
        }
        start |= {f"part:{k}": part for k, part in parts.items() if part >= _SMALLEST_PART}
        start |= {f"share:{name}": share for name, share in shares.items()}
        return [start]

    def seen_again(self, values: Values, heldout: Context) -> float:
        """Log odds of that hum in other records, wherever the supply may have wandered meanwhile."""
        parts = {1: 1.0} | {int(k[5:]): float(v) for k, v in values.items() if k.startswith("part:")}
        amplitude, supply = float(values["amplitude_m_s2"]), float(values["frequency_hz"])
        total = 0.0
        for view in heldout.views:
            shares = {n: float(values.get(f"share:{n}", 0.0)) for n in view.record.channels}
            looks = {n: HumLines.of(view, n, supply, tuple(parts)) for n, share in shares.items() if share}
            odds = [
                odds_of_lines(
                    [
                        (amplitude * shares[n] * part, *look.sine(k, supply * (1 + drift)))
                        for n, look in looks.items()
                        for k, part in parts.items()
                    ]
                )
                for drift in _WANDERING
            ]
            total += float(np.logaddexp.reduce(odds)) - math.log(len(odds))
        return total

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """The content with hum on the channels that show it."""
        parts = {
            int(key.removeprefix("part:")): float(v) for key, v in values.items() if key.startswith("part:")
        }
        for key, share in values.items():
            if key.startswith("share:"):
                mains = {
                    "amplitude": f"{float(values['amplitude_m_s2']) * float(share):.9g} m/s^2",
                    "frequency": f"{float(values['frequency_hz']):.9g} Hz",
                    "harmonics": parts,
                }
                content = with_sensor(content, key.removeprefix("share:"), "mains", mains)
        return content

    def signature(self, values: Values) -> str:
        """In plain words."""
        orders = sorted(int(key.removeprefix("part:")) for key in values if key.startswith("part:"))
        more = f" and its multiples {', '.join(map(str, orders))}" if orders else ""
        return (
            f"lines at {float(values['frequency_hz']):.2f} Hz{more} that do not move with the speed: hum of "
            f"the supply, {float(values['amplitude_m_s2']):.3g} m/s^2"
        )
