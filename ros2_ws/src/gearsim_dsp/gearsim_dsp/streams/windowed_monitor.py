"""What the monitors of samples share: batches become windows, each window one report."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Any

from gearsim_dsp.alarms import Indication
from gearsim_dsp.bands import Band
from gearsim_dsp.quality import QualityIssue
from gearsim_dsp.results import Features, FeatureValue, Spectrum
from gearsim_dsp.speed import ShaftSpeed
from gearsim_dsp.streams.assembler import Batch, Window, WindowAssembler, WindowSettings
from gearsim_dsp.streams.report import Report
from gearsim_io.nameplate import Machine

__all__ = ["WindowedMonitor", "fatal_words"]

_MOST_TOLD = 3


class WindowedMonitor(ABC):
    """Judges each window of a stream; what it makes of one is the affair of its children.

    Parameters
    ----------
    machine : Machine
    window : WindowSettings
    source : str
        Name in what is published.
    """

    def __init__(self, machine: Machine, window: WindowSettings, source: str) -> None:
        self.machine = machine
        self.source = source
        self.assembler = WindowAssembler(machine, window)
        self._run = 0

    @property
    def hop_s(self) -> float:
        """Distance of two windows, in seconds of signal."""
        return self.assembler.settings.hop_s

    def push(self, batch: Batch) -> list[Report]:
        """Take one batch, in any interleaving; return the reports of the windows that are complete now."""
        return [self.judge(window) for window in self.assembler.push(batch)]

    def finish(self) -> list[Report]:
        """The end of the input: reports of the windows that still waited for something."""
        return [self.judge(window) for window in self.assembler.finish()]

    def judge(self, window: Window) -> Report:
        """The report of one window, made by this monitor's assembler or by one that several share."""
        if window.run != self._run:
            self._run = window.run
            self._restart()
        return self._judge(window)

    def _restart(self) -> None:  # noqa: B027 - not all monitors remember anything
        """The stream began anew: forget what earlier windows told."""

    @abstractmethod
    def _judge(self, window: Window) -> Report:
        """What the window tells."""

    def _report(
        self,
        window: Window,
        *,
        features: Iterable[Features],
        indications: tuple[Indication, ...],
        tests: int,
        judged: bool,
        note: str,
        quality: Iterable[QualityIssue],
        spectra: Iterable[Spectrum] = (),
        results: Iterable[Any] = (),
    ) -> Report:
        """A report of this window; see `Report`. The note counts where nothing was judged."""
        return Report(
            run=window.run,
            first_sample=window.first_sample,
            end_sample=window.end_sample,
            last_ns=window.last_ns,
            frame_id=self.machine.name,
            features=tuple(features),
            spectra=tuple(spectra),
            indications=indications,
            tests=tests,
            judged=judged,
            note="" if judged else note,
            quality=tuple(quality),
            results=tuple(results),
        )

    def _features(
        self,
        window: Window,
        channel: str,
        values: Iterable[FeatureValue],
        speed: ShaftSpeed,
        band: Band | None = None,
    ) -> Features:
        """Indicators of a channel over this window, of the whole spectrum where no band is given."""
        band = band or Band(0.0, 0.5 * window.sample_rate_hz, "whole")
        return Features(
            t0_ns=window.t0_ns,
            frame_id=self.machine.name,
            source=self.source,
            channel=channel,
            first_sample=window.first_sample,
            sample_count=window.sample_count,
            sample_rate_hz=window.sample_rate_hz,
            band_low_hz=band.low_hz,
            band_high_hz=band.high_hz,
            speed_hz=speed.value_hz,
            speed_source=speed.source,
            values=tuple(values),
        )


def fatal_words(quality: Iterable[QualityIssue]) -> str:
    """What kept channels from being judged, the first few of it; empty if nothing did."""
    told = sorted({f"{issue.channel}: {issue.detail}" for issue in quality if issue.fatal})
    return "; ".join(told[:_MOST_TOLD])
