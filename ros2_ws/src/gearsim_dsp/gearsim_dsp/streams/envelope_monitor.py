"""Envelope analysis of a stream: every window judged, on all channels, for all bearing faults."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from gearsim_dsp.alarms import Indication
from gearsim_dsp.bands import Band
from gearsim_dsp.evidence import EvidencePool
from gearsim_dsp.families import FamilyEvidence
from gearsim_dsp.judges.bearing import MODULATION_LIMIT, Verdict, find_faults
from gearsim_dsp.judges.finding import Finding
from gearsim_dsp.kinematics import fault_families
from gearsim_dsp.quality import QualityIssue
from gearsim_dsp.results import Features, FeatureValue, Spectrum, SpectrumMarker
from gearsim_dsp.speed import ShaftSpeed
from gearsim_dsp.streams.assembler import Window, WindowSettings
from gearsim_dsp.streams.band_keeper import BandKeeper
from gearsim_dsp.streams.live_sizes import LiveSizes, width_words
from gearsim_dsp.streams.report import Report
from gearsim_dsp.streams.window_speeds import LiveSpeeds, WindowSpeeds
from gearsim_dsp.streams.windowed_monitor import WindowedMonitor, fatal_words
from gearsim_dsp.window import BandSpectrum, WindowInput, WindowResult, analyse_window
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine

__all__ = ["EnvelopeMonitor", "EnvelopeSettings", "group_of", "indications", "significance"]

_LEAST_P = 1e-300
_KEEPS = 0.5
_MARKED_HARMONICS = 5
_CLEAR_DB = 6.0
_MEMORY_WITHOUT_ANGLE = 4


@dataclass(frozen=True, slots=True)
class EnvelopeSettings:
    """Settings of the envelope monitor.

    Parameters
    ----------
    window : WindowSettings
    band_hz : tuple of float, optional
        Band to demodulate beside the bank that covers the spectrum; None: the kurtogram chooses one for each
        channel.
    memory_windows : int
        Windows that are averaged for a judgement; 1 judges every window by itself, 0 leaves it to the
        machine: 1 where an angle signal is listed, else 4, for the sake of the speed's estimate.
    kurtogram_every : int
        Windows from one choice of a band to the next (of another channel); 0: no kurtogram.
    size_every : int
        Windows from one measurement of a spall's width to the next, where there is a finding; 0: none.
    between : bool
        Demodulate the bands centred on the borders of the bank's, too: a resonance on a border shows better
        by a third and more, for nearly twice the time.
    """

    window: WindowSettings = field(default_factory=WindowSettings)
    band_hz: tuple[float, float] | None = None
    memory_windows: int = 0
    kurtogram_every: int = 16
    size_every: int = 64
    between: bool = False

    def __post_init__(self) -> None:
        if self.band_hz is not None and not 0 <= self.band_hz[0] < self.band_hz[1]:
            raise InputError(
                "envelope settings", "band_hz", self.band_hz, "low and high with 0 <= low < high"
            )
        for name in ("memory_windows", "kurtogram_every", "size_every"):
            if not 0 <= getattr(self, name) <= 1000:
                raise InputError("envelope settings", name, getattr(self, name), "0 to 1000")


@dataclass(frozen=True, slots=True)
class _Told:
    """What is made known of one window."""

    features: tuple[Features, ...] = ()
    spectra: tuple[Spectrum, ...] = ()
    indications: tuple[Indication, ...] = ()


class EnvelopeMonitor(WindowedMonitor):
    """Judges each window of a stream by the squared envelope spectra of all channels.

    Parameters
    ----------
    machine : Machine
        Nameplate; its bearings give the fault families looked for.
    settings : EnvelopeSettings
    source : str
        Name in what is published.
    speeds : WindowSpeeds, optional
        Where the windows' speeds come from, if not from their own angle signals and vibration.
    by_window : bool
        False for those who pool the windows' results and judge them together: no window is then judged by
        itself, and reports have results and quality alone.

    Raises
    ------
    InputError
        When the nameplate's geometry is impossible.
    """

    def __init__(
        self,
        machine: Machine,
        settings: EnvelopeSettings | None = None,
        source: str = "envelope",
        speeds: WindowSpeeds | None = None,
        *,
        by_window: bool = True,
    ) -> None:
        self.settings = settings or EnvelopeSettings()
        super().__init__(machine, self.settings.window, source)
        angle = bool(machine.tacho_shafts or machine.encoder_shafts)
        memory = self.settings.memory_windows or (1 if angle else _MEMORY_WITHOUT_ANGLE)
        self._pool = EvidencePool(machine, memory)
        every = self.settings.kurtogram_every if self.settings.band_hz is None else 0
        self._keeper = BandKeeper(machine, every, self.settings.window.hop_s)
        find_faults(machine, self._pool)  # an impossible nameplate is told now, not at the first window
        self._families = fault_families(machine)
        self._speeds = speeds or LiveSpeeds(machine)
        self._by_window = by_window
        self._sizes = LiveSizes(machine, self.settings.size_every)

    def _restart(self) -> None:
        self._pool.reset()
        self._keeper.reset()
        self._speeds.reset()
        self._sizes.reset()

    def _judge(self, window: Window) -> Report:
        speed = self._speeds.of(window)
        self._keeper.renew(window, speed.value_hz)
        results = [self._analyse(window, row, speed) for row in range(len(window.channels))]
        quality = tuple(issue for result in results for issue in result.quality) + self._speeds.issues
        if self._speeds.lost:
            results = []  # on no known axis
        fit = [result for result in results if result.spectra]
        told = self._told(window, results, fit, speed) if self._by_window else _Told()
        return self._report(
            window,
            features=told.features,
            spectra=told.spectra,
            indications=told.indications,
            tests=1,
            judged=bool(fit),
            note=self._why_not(quality, speed),
            quality=quality,
            results=results,
        )

    def _told(
        self, window: Window, results: list[WindowResult], fit: list[WindowResult], speed: ShaftSpeed
    ) -> _Told:
        self._pool.add(results)
        verdict = find_faults(self.machine, self._pool)
        return _Told(
            tuple(self._of_result(window, result, verdict) for result in fit),
            tuple(self._spectrum(window, result, verdict) for result in fit),
            indications(verdict, self._widths(window, verdict, speed)) if fit else (),
        )

    def _analyse(self, window: Window, row: int, speed: ShaftSpeed) -> WindowResult:
        given = self.settings.band_hz
        band = self._keeper.band(window.channels[row]) if given is None else Band(*given, "given")
        return analyse_window(
            WindowInput(
                samples=window.data[row],
                sample_rate_hz=window.sample_rate_hz,
                channel=window.channels[row],
                first_sample=window.first_sample,
                speed=speed,
                machine=self.machine,
                bands=() if band is None else (band,),
                between=self.settings.between,
                spectra=partial(window.spectra, row),
            )
        )

    def _widths(self, window: Window, verdict: Verdict, speed: ShaftSpeed) -> dict[str, str]:
        """Words on the width of each finding's spall, by group."""
        best = speed if speed.phase is not None else verdict.speed
        return {
            group_of(f.fault, f.expected_order): width_words(self._sizes.of(window, f, best))
            for f in verdict.findings
        }

    def _why_not(self, quality: tuple[QualityIssue, ...], speed: ShaftSpeed) -> str:
        if fatal := fatal_words(quality):
            return fatal
        if self._speeds.lost:
            return "the speed changes, and was not found in the vibration of this window"
        if not self.machine.bearings:
            return "the nameplate lists no bearings: no fault can be looked for"
        if not math.isfinite(speed.value_hz):
            return "the speed is not known: no tacho and no nominal speed on the nameplate"
        return "no envelope spectrum could be made"

    def _of_result(self, window: Window, result: WindowResult, verdict: Verdict) -> Features:
        band = self._shown(result, verdict)
        values = [
            FeatureValue("band_kurtosis", "", band.kurtosis, "1"),
            FeatureValue("band_rms", "", math.sqrt(max(band.level, 0.0)), window.unit),
        ]
        for evidence in _of_channel(verdict, result.channel):
            stem = evidence.family.label.lower()
            names = self._members(evidence)
            values.append(FeatureValue(f"{stem}_snr", names, evidence.snr_db, "dB"))
            values.append(FeatureValue(f"{stem}_modulation", names, evidence.modulation, "1"))
            values.append(FeatureValue(f"{stem}_significance", names, significance(evidence), "-log10 P"))
        return self._features(window, result.channel, values, verdict.speed, band.band)

    def _spectrum(self, window: Window, result: WindowResult, verdict: Verdict) -> Spectrum:
        band = self._shown(result, verdict)
        # Without tacho the axis counts turns at the nameplate's speed, not at the speed found since.
        scale = verdict.speed.value_hz / result.axis_speed_hz
        markers = [self._marker(e, scale) for e in _of_channel(verdict, result.channel)]
        return Spectrum(
            t0_ns=window.t0_ns,
            frame_id=self.machine.name,
            source=self.source,
            channel=result.channel,
            kind="squared_envelope",
            first_sample=window.first_sample,
            sample_count=window.sample_count,
            sample_rate_hz=window.sample_rate_hz,
            band_low_hz=band.band.low_hz,
            band_high_hz=band.band.high_hz,
            speed_hz=result.axis_speed_hz,
            axis_unit="order",
            axis_start=0.0,
            axis_step=band.order_step,
            value_unit="1",
            values=np.asarray(band.power, dtype=np.float32),
            markers=tuple(markers),
        )

    def _marker(self, evidence: FamilyEvidence, scale: float) -> SpectrumMarker:
        """At the order found where the family shows, else at the order expected, times `scale`."""
        shows = evidence.snr_db >= _CLEAR_DB and math.isfinite(evidence.found_order)
        return SpectrumMarker(
            label=evidence.family.label,
            component=self._members(evidence),
            position=scale * (evidence.found_order if shows else evidence.family.order),
            harmonics=_MARKED_HARMONICS,
            sideband_spacing=scale * evidence.family.sideband_order,
            snr_db=evidence.snr_db,
        )

    def _members(self, evidence: FamilyEvidence) -> str:
        """Names of the bearings that this family may come from on the channel: the nearest, else all."""
        wanted = group_of(evidence.family.fault, evidence.family.order)
        like = [f.component for f in self._families if group_of(f.fault, f.order) == wanted]
        near = [c for c in like if evidence.channel in self.machine.bearing(c).channels]
        return ", ".join(near or like)

    def _shown(self, result: WindowResult, verdict: Verdict) -> BandSpectrum:
        """The band worth a look: given, that of a finding on the channel, the kurtogram's, most impulsive."""
        last = result.spectra[-1]
        if self.settings.band_hz is not None:
            return last
        for finding in verdict.findings:
            if finding.channel == result.channel:
                wanted = finding.evidence.get("band_hz")
                for spectrum in result.spectra:
                    if [spectrum.band.low_hz, spectrum.band.high_hz] == wanted:
                        return spectrum
        return last if last.band.why == "kurtogram" else max(result.spectra, key=lambda s: s.kurtosis)


def group_of(fault: str, order: float) -> str:
    """Name of the group of faults that have the same lines."""
    return f"{fault}@{order:.4f}"


def significance(evidence: FamilyEvidence) -> float:
    """-log10 of the probability that noise shows as much in this window, 300 at most."""
    return -math.log10(max(evidence.false_alarm_probability, _LEAST_P))


def _of_channel(verdict: Verdict, channel: str) -> Iterable[FamilyEvidence]:
    return (evidence for evidence in verdict.by_channel if evidence.channel == channel)


def indications(verdict: Verdict, widths: Mapping[str, str] | None = None) -> tuple[Indication, ...]:
    """Findings, and what is no finding (any more) but still half as large as one must be.

    `widths` are words on the width of the spall by group, to end the reason with.
    """
    groups = {group_of(f.fault, f.expected_order): f for f in verdict.findings}
    found = {group: _sign(finding, (widths or {}).get(group, "")) for group, finding in groups.items()}
    for evidence in verdict.evidence:
        group = group_of(evidence.family.fault, evidence.family.order)
        if group not in found and evidence.modulation >= _KEEPS * MODULATION_LIMIT:
            found[group] = _trace(group, evidence)
    return tuple(found[group] for group in sorted(found))


def _sign(finding: Finding, width: str) -> Indication:
    p = finding.evidence["false_alarm_probability"]
    assert isinstance(p, float)
    return Indication(
        component=finding.component,
        fault=finding.fault,
        group=group_of(finding.fault, finding.expected_order),
        channel=finding.channel,
        significance=-math.log10(max(p, _LEAST_P)),
        expected_order=finding.expected_order,
        found_order=float(finding.found_order),
        found_frequency_hz=float(finding.found_hz),
        confidence=float(finding.confidence),
        words=_words(finding),
        detail=width,
    )


def _trace(group: str, evidence: FamilyEvidence) -> Indication:
    return Indication(
        component="",
        fault=evidence.family.fault,
        group=group,
        channel=evidence.channel,
        significance=significance(evidence),
        expected_order=evidence.family.order,
        found_order=float(evidence.found_order),
        found_frequency_hz=float(evidence.found_hz),
        may_raise=False,
    )


def _words(finding: Finding) -> str:
    levels = finding.evidence["harmonic_snr_db"]
    assert isinstance(levels, list)
    more = sum(level >= _CLEAR_DB for level in levels[1:])
    harmonics = f" and {more} harmonic{'s' if more > 1 else ''}" if more else ""
    what = f"{finding.fault.replace('_', ' ')} of {finding.component}"
    return f"{what}: {finding.found_hz:.1f} Hz{harmonics}, {finding.snr_db:.0f} dB over the floor"
