"""Impulsiveness of a stream: RMS, kurtosis and crest factor of every channel, whole and in bands."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from gearsim_dsp.alarms import Indication
from gearsim_dsp.bands import TOP_SHARE, Band
from gearsim_dsp.envelope import squared_envelopes
from gearsim_dsp.features import crest_factor, kurtosis, rms
from gearsim_dsp.impulsiveness import FULL_MODULATION_KURTOSIS, impulsiveness
from gearsim_dsp.quality import QualityIssue, check_samples
from gearsim_dsp.results import Features, FeatureValue
from gearsim_dsp.speed import ShaftSpeed
from gearsim_dsp.streams.assembler import Window, WindowSettings
from gearsim_dsp.streams.report import Report
from gearsim_dsp.streams.window_speeds import LiveSpeeds
from gearsim_dsp.streams.windowed_monitor import WindowedMonitor, fatal_words
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine

__all__ = ["KurtosisMonitor", "KurtosisSettings"]

_FEWEST_BLOCKS, _MOST_BLOCKS = 10, 40
_BOTTOM_SHARE = 0.005


@dataclass(frozen=True, slots=True)
class KurtosisSettings:
    """Settings of the kurtosis monitor.

    Parameters
    ----------
    window : WindowSettings
    bands : int
        Number of bands of equal width that the spectrum is cut into, up to 0.46 of the sampling rate.
    band_hz : tuple of float, optional
        One band of one's own instead.
    """

    window: WindowSettings = field(default_factory=WindowSettings)
    bands: int = 8
    band_hz: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if not 1 <= self.bands <= 64:
            raise InputError("kurtosis settings", "bands", self.bands, "1 to 64")
        if self.band_hz is not None and not 0 <= self.band_hz[0] < self.band_hz[1]:
            raise InputError("kurtosis settings", "band_hz", self.band_hz, "low and high, 0 <= low < high")


@dataclass(frozen=True, slots=True)
class _Channel:
    """One channel over one window: whole-band numbers, and its most significant band."""

    name: str
    rms: float
    kurtosis: float
    crest: float
    band: Band
    band_kurtosis: float
    steady_kurtosis: float
    band_rms: float
    significance: float


class KurtosisMonitor(WindowedMonitor):
    """Tells impacts of whatever origin; it names no component.

    Parameters
    ----------
    machine : Machine
        Its tachos give the speed that goes with the features.
    settings : KurtosisSettings
    source : str
        Name in what is published.
    """

    def __init__(
        self, machine: Machine, settings: KurtosisSettings | None = None, source: str = "kurtosis"
    ) -> None:
        self.settings = settings or KurtosisSettings()
        super().__init__(machine, self.settings.window, source)
        self._speeds = LiveSpeeds(machine, follow=False)

    def _judge(self, window: Window) -> Report:
        speed = self._speeds.of(window)
        quality: list[QualityIssue] = []
        channels: list[_Channel] = []
        for row, name in enumerate(window.channels):
            issues = check_samples(window.data[row], name)
            quality += issues
            if not any(issue.fatal for issue in issues):
                channels.append(self._channel(window, row, speed))
        return self._report(
            window,
            features=(f for c in channels for f in self._both_features(window, c, speed)),
            indications=_indications(channels),
            tests=len(window.channels) * self._band_count,
            judged=bool(channels),
            note=fatal_words(quality),
            quality=quality,
        )

    @property
    def _band_count(self) -> int:
        return 1 if self.settings.band_hz else self.settings.bands

    def _bands(self, rate_hz: float) -> list[Band]:
        if self.settings.band_hz is not None:
            low, high = self.settings.band_hz
            return [Band(min(low, 0.25 * rate_hz), min(high, 0.49 * rate_hz), "given")]
        edges = np.linspace(_BOTTOM_SHARE * rate_hz, TOP_SHARE * rate_hz, self.settings.bands + 1)
        return [Band(float(a), float(b), "bank") for a, b in pairwise(edges)]

    def _channel(self, window: Window, row: int, speed: ShaftSpeed) -> _Channel:
        samples = window.data[row]
        bands = self._bands(window.sample_rate_hz)
        _, spectrum = window.spectra(row)
        lows = np.array([band.low_hz for band in bands])
        envelopes = squared_envelopes(spectrum, lows, bands[0].high_hz - bands[0].low_hz)
        found = impulsiveness(envelopes.values, self._blocks(window, speed, envelopes.values.shape[1]))
        best = int(np.argmin(found.p_value))
        return _Channel(
            name=window.channels[row],
            rms=rms(samples),
            kurtosis=kurtosis(samples),
            crest=crest_factor(samples),
            band=bands[best],
            band_kurtosis=float(found.kurtosis[best]),
            steady_kurtosis=float(found.steady_kurtosis[best]),
            band_rms=math.sqrt(float(envelopes.values[best].mean(dtype=np.float64))),
            significance=-math.log10(float(found.p_value[best])),
        )

    @staticmethod
    def _blocks(window: Window, speed: ShaftSpeed, samples: int) -> int:
        """One block per turn where the speed is known, within what the statistics need."""
        turns = window.sample_count / window.sample_rate_hz * speed.value_hz
        wanted = int(turns) if math.isfinite(turns) else _MOST_BLOCKS // 2
        return min(max(wanted, _FEWEST_BLOCKS), _MOST_BLOCKS, max(samples // 8, 5))

    def _both_features(self, window: Window, channel: _Channel, speed: ShaftSpeed) -> tuple[Features, ...]:
        """Of the whole channel, and of its most impulsive band."""
        whole = (
            FeatureValue("rms", "", channel.rms, window.unit),
            FeatureValue("kurtosis", "", channel.kurtosis, "1"),
            FeatureValue("crest_factor", "", channel.crest, "1"),
        )
        part = (
            FeatureValue("band_rms", "", channel.band_rms, window.unit),
            FeatureValue("band_kurtosis", "", channel.band_kurtosis, "1"),
            FeatureValue("band_kurtosis_steady", "", channel.steady_kurtosis, "1"),
            FeatureValue("impulsiveness_significance", "", channel.significance, "-log10 P"),
        )
        return (
            self._features(window, channel.name, whole, speed),
            self._features(window, channel.name, part, speed, channel.band),
        )


def _indications(channels: list[_Channel]) -> tuple[Indication, ...]:
    """One for the machine as a whole, from the channel that shows impacts most surely."""
    if not channels:
        return ()
    best = max(channels, key=lambda c: c.significance)
    low, high = best.band.low_hz / 1e3, best.band.high_hz / 1e3
    words = (
        f"impacts on {best.name}: excess kurtosis {best.steady_kurtosis:.1f} at {low:.1f} to {high:.1f} kHz, "
        f"where modulated noise reaches {FULL_MODULATION_KURTOSIS:.1f} at most"
    )
    sign = Indication(
        component="",
        fault="unknown",
        group="impacts",
        channel=best.name,
        significance=best.significance,
        confidence=1.0 - min(1.0, 10.0**-best.significance),
        words=words,
    )
    return (sign,)
