"""Numbers as people read them: decibels, quantities with their intervals, names of causes."""

from __future__ import annotations

import math

from gearsim_twin.exhibit import BASELINE, TUNED
from gearsim_twin.verdict import Found, Number

__all__ = ["cause_name", "decibels", "domain_name", "parameter_name", "quantity", "span", "step_name"]

_PREFIXES = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
_SCALED = ("m", "kg*m", "kg m", "Pa*s", "s", "rad")
_UNITS = ("m", "rad", "hz", "s", "db", "n", "nm", "kg")
_SAME_SIDES = 0.2
_READABLE = 0.1
_DOMAINS = {"orders": "lines", "psd": "noise", "cyclic": "coherence", "transient": "impacts"}


def decibels(value: float | None, sign: bool = False) -> str:
    """Such as "9.1 dB"; a dash where there is none."""
    if value is None or not math.isfinite(value):
        return "–"
    return f"{value:+.1f} dB" if sign else f"{value:.1f} dB"


def quantity(number: Number) -> str:
    """Value and 95 % interval with a prefix that keeps them short: "0.800 ± 0.008 mm"."""
    scale, prefix = _prefix(number)
    value, low, high = (each / scale for each in (number.value, *number.ci95))
    unit = "" if number.unit in ("1", "") else f" {prefix}{number.unit.replace('*', ' ')}"
    half = 0.5 * (high - low)
    if not (math.isfinite(half) and half > 0):
        return f"{value:.4g}{unit}"
    lead = half / 10 ** math.floor(math.log10(half))
    # Two figures of the uncertainty where the first is 1 or 2, else one.
    places = max(0, (1 if lead < 2.95 else 0) - math.floor(math.log10(half)))
    if places > 6:
        return f"{value:.6g}{unit}"
    if abs((high - value) - (value - low)) <= _SAME_SIDES * half:
        return f"{value:.{places}f} ± {half:.{places}f}{unit}"
    return f"{value:.{places}f} ({low:.{places}f} to {high:.{places}f}){unit}"


def _prefix(number: Number) -> tuple[float, str]:
    size = max(abs(number.value), abs(number.ci95[1]) if math.isfinite(number.ci95[1]) else 0.0)
    if number.unit not in _SCALED or size <= 0:
        return 1.0, ""
    return next(((scale, prefix) for scale, prefix in _PREFIXES if size >= _READABLE * scale), _PREFIXES[-1])


def span(ci95: tuple[float, float]) -> str:
    """An interval in decibels."""
    low, high = ci95
    return "" if not (math.isfinite(low) and math.isfinite(high)) else f"{low:.1f} to {high:.1f}"


def domain_name(domain: str) -> str:
    """A domain of comparison for people."""
    return _DOMAINS.get(domain, domain)


def parameter_name(name: str) -> str:
    """The name of a parameter without its unit: "width_m" is "width"."""
    head, _, tail = name.rpartition("_")
    return (head if head and tail in _UNITS else name).replace("_", " ")


def cause_name(found: Found) -> str:
    """Such as "bearing spall outer, bearing_3"."""
    plain = found.name.replace("_", " ")
    return f"{plain}, {found.component}" if found.component else plain


def step_name(name: str, component: str) -> str:
    """A model on the way to the extended one."""
    known = {BASELINE: "as described", TUNED: "tuned"}
    plain = known.get(name, f"+ {name.replace('_', ' ')}")
    return f"{plain}, {component}" if component else plain
