"""Where two records are compared: a line, a band, a figure of one channel, in one of seven domains."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from gearsim_io.errors import InputError

__all__ = ["DOMAINS", "Domain", "Place", "hz_text"]

Domain = Literal["orders", "psd", "envelope", "cyclic", "torsional", "statistics", "transient"]
DOMAINS: tuple[Domain, ...] = get_args(Domain)

_STATISTICS = {
    "rms": "level",
    "kurtosis": "kurtosis",
    "crest": "crest factor",
    "asymmetry": "upper against lower half wave",
    "drift": "change of level from beginning to end",
    "fluctuation": "scatter of the short-time level",
    "quiet": "quietest moment against the usual",
    "loud": "loudest moment against the usual",
    "ratio": "speed",
}
_TRANSIENT = {
    "peak": "peak of the average over a turn of {label}",
    "decay": "decay time after an impact of {label}",
    "centre": "centre frequency after an impact of {label}",
    "spacing": "time from first to second impact of {label}",
    "teeth": "lines of single teeth, averaged over a turn of {label}",
    "knock": "kurtosis of what single teeth do, averaged over a turn of {label}",
    "planet": "lines of a planet's turn, averaged over a turn of {label}",
}


@dataclass(frozen=True, slots=True)
class Place:
    """One place of comparison; its level is in dB.

    Attributes
    ----------
    domain : str
        One of `DOMAINS`.
    channel : str
        Accelerometer channel; in the domain torsional the shaft of an encoder, or two as "input/output".
    kind : str
        What is at the place, see the module of the domain. Where it is "ratio", the level is not in dB but
        the found frequency's distance from the expected one in per cent.
    at : float
        Position, in `unit`.
    unit : str
        "order" (turns of the reference shaft), "Hz", or "1" where there is no position.
    width : float
        In `unit`; of a ratio, the width in per cent at which lines no longer coincide.
    label : str
        What it belongs to, such as "2 x gears" or "BPFO of bearing_3".
    band_hz : tuple of float, optional
        Carrier band behind an envelope, a coherence or a figure; None: all frequencies.
    """

    domain: Domain
    channel: str
    kind: str
    at: float
    unit: str
    width: float
    label: str = ""
    band_hz: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if self.domain not in DOMAINS:
            raise InputError("Place", "domain", self.domain, f"one of {', '.join(DOMAINS)}")

    def hz(self, speed_hz: float) -> float:
        """Position in Hz at a speed of the reference shaft; NaN where there is no position."""
        return {"Hz": self.at, "order": self.at * speed_hz}.get(self.unit, float("nan"))

    def words(self, speed_hz: float = float("nan")) -> str:
        """The place in plain words, with frequencies in Hz where the speed is told."""
        return f"{self.what(speed_hz)} {self.where()}"

    def what(self, speed_hz: float = float("nan")) -> str:
        """What is compared, without channel and band."""
        name = self.label or self.kind
        if self.domain == "statistics":
            return _STATISTICS.get(self.kind, self.kind)
        if self.domain == "transient":
            position = f" ({self._position(speed_hz)})" if self.unit == "order" else ""
            return _TRANSIENT[self.kind].format(label=self.label) + position
        if self.kind == "ratio":
            return f"frequency of {name} ({self._position(speed_hz)})"
        if self.domain == "psd":
            return f"noise at {hz_text(self.at)}"
        if self.kind == "floor":
            return "floor"
        if self.kind == "passage":
            return f"lines from {name} on ({self._position(speed_hz)})"
        plain = name.startswith(("tone", "modulation", "sidebands"))
        head = "coherence at " if self.domain == "cyclic" else "" if plain else "line "
        return f"{head}{name} ({self._position(speed_hz)})"

    def where(self) -> str:
        """Channel and band in words."""
        band = "" if self.band_hz is None else f"{band_text(self.band_hz)} "
        if self.domain == "torsional":
            return f"of the encoder of {self.channel}" if "/" not in self.channel else f"of {self.channel}"
        if self.domain == "envelope":
            return f"in the {band}envelope of {self.channel}"
        return f"in {band}of {self.channel}" if band else f"of {self.channel}"

    def _position(self, speed_hz: float) -> str:
        if self.unit == "order" and speed_hz == speed_hz:
            return f"{hz_text(self.at * speed_hz)}, order {self.at:.4g}"
        return f"order {self.at:.4g}" if self.unit == "order" else hz_text(self.at)


def hz_text(value_hz: float) -> str:
    """A frequency as people write it."""
    return f"{value_hz / 1e3:.4g} kHz" if value_hz >= 1e4 else f"{value_hz:.4g} Hz"


def band_text(band_hz: tuple[float, float]) -> str:
    """A band as people write it: "6-12 kHz" or "40-180 Hz"."""
    low, high = band_hz
    if high >= 1e3:
        return f"{low / 1e3:.2g}-{high / 1e3:.3g} kHz"
    return f"{low:.3g}-{high:.3g} Hz"
