"""What a record shows of its bearings: which fault lines stand out, where, and how wide a spall is.

Measured and simulated records go the same way, with the code of the diagnosis, so that what a model already
shows can be told from what it lacks.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from gearsim_dsp.evidence import EvidencePool
from gearsim_dsp.families import FamilyEvidence, FamilySearch
from gearsim_dsp.features import is_signal
from gearsim_dsp.judges.bearing import ALARM_PROBABILITY, Verdict, find_faults, is_fault
from gearsim_dsp.judges.finding import Finding
from gearsim_dsp.kinematics import FaultFamily
from gearsim_dsp.sizing.spall_width import Sizing, size_defect
from gearsim_dsp.window import WindowInput, WindowResult, analyse_window
from gearsim_io.errors import InputError

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context
    from gearsim_twin.view import View

__all__ = ["Sign", "signs_of", "size_of", "unexplained_signs"]

_WINDOW_S, _LEAST_TURNS, _HOPS = 2.0, 20.0, 2
# A spall may modulate less than what the diagnosis calls a fault: a first guess is a question, no alarm.
_LEAST_MODULATION, _LEAST_DOMINANCE = 0.03, 1.1
_NEXT_TO_NOTHING = 0.01
_AS_STRONG = 0.5  # of the measured modulation: a model that shows so much has the fault already
_SAME_ORDER = 0.05  # families are further apart
_RIVAL_SHARE = 0.25
# Half-width of the search for bearings of other dimensions; neighbouring families are 6 % apart and more.
_WIDE = 0.05
_EDGE, _SAME_LINE = 0.85, 5e-4
_FEWEST = 4
_CLEAR_DB, _MOST_DB = 6.0, 30.0
_WANDER_LINES = 0.015
_RACES = ("outer_race", "inner_race")
_FAULTS = ("outer_race", "inner_race", "rolling_element", "cage")


@dataclass(frozen=True, slots=True)
class Sign:
    """A family of fault lines of one bearing that stands out of one record.

    Attributes
    ----------
    component, fault : str
        As the diagnosis names them.
    expected_order, found_order : float
        Fundamental in multiples of the reference shaft's speed: of the nameplate, and as found.
    std_order : float
        Standard deviation of the latter.
    modulation : float
        Mean square of the lines in the squared envelope over its squared mean.
    share : float
        Of this bearing among those with the same lines, 0 to 1.
    channel : str
        That shows it best.
    finding : Finding
        For the size.
    elements : int
        Rolling elements with which the lines make sense: the nameplate's, or another number.
    run : (int, int) or None
        Of lines in the spectrum itself, the first of the harmonics that stand out and their number.
    """

    component: str
    fault: str
    expected_order: float
    found_order: float
    std_order: float
    modulation: float
    share: float
    channel: str
    finding: Finding
    elements: int
    run: tuple[int, int] | None = None

    @property
    def weight(self) -> float:
        """By which signs are ranked: modulation by the bearing's share."""
        return self.modulation * self.share

    @property
    def is_fault(self) -> bool:
        """Whether the diagnosis would tell them as a fault."""
        return self.finding.confidence > 0.0


_FOUND: WeakKeyDictionary[View, tuple[Sign, ...]] = WeakKeyDictionary()
_SIZES: WeakKeyDictionary[View, dict[tuple[str, str], Sizing | None]] = WeakKeyDictionary()


def signs_of(view: View) -> tuple[Sign, ...]:
    """What stands out of a record, the strongest first; bearings alike in their lines have a sign each."""
    if view not in _FOUND:
        pool = EvidencePool(view.machine)
        for results in _windows(view):
            pool.add(results)
        found = _found_by(view, pool)
        found += [other for sign in found for other in _others(sign)]
        _FOUND[view] = tuple(sorted(found, key=lambda sign: -sign.weight))
    return _FOUND[view]


def unexplained_signs(context: Context, fault: str, *, absent: bool = False) -> list[tuple[int, Sign]]:
    """Signs of one kind of fault that measured records show and the present model does not, strongest first.

    One per component, with the number of the record that shows it most. Usually the model is looked at with
    the noise of its sensors, which hides what a sound bearing does; `absent` asks for what it has not at all.
    """
    best: dict[str, tuple[int, Sign]] = {}
    model = context.simulated_views if absent else context.noisy_views or context.simulated_views
    for record, (measured, simulated) in enumerate(zip(context.views, model, strict=True)):
        before = context.healthy_views[record : record + 1]
        present = [sign for view in before for sign in signs_of(view) if sign.fault == fault]
        shown = [sign for sign in signs_of(simulated) if sign.fault == fault]
        for sign in signs_of(measured):
            quiet = absent and _is_quiet(simulated, measured, sign, context.gains_db)
            if sign.fault != fault or any(
                _explains(one, sign) for one in (*present, *(() if quiet else shown))
            ):
                continue
            known = best.get(sign.component)
            if known is None or known[1].weight < sign.weight:
                best[sign.component] = (record, sign)
    return sorted(best.values(), key=lambda each: -each[1].weight)


def size_of(view: View, sign: Sign) -> Sizing | None:
    """Width of a spall of a race, or why there is none; None where the record does not allow the question."""
    kept = _SIZES.setdefault(view, {})
    key = (sign.component, sign.fault)
    if key not in kept:
        kept[key] = _sized(view, sign)
    return kept[key]


def _sized(view: View, sign: Sign) -> Sizing | None:
    near = [name for name in view.machine.bearing(sign.component).channels if name in view.record.channels]
    channel = sign.channel if sign.channel in near or not near else near[0]
    finding = replace(sign.finding, component=sign.component, channel=channel)
    try:
        return size_defect(
            view.signal(channel), view.record.sample_rate_hz, finding, view.machine, view.speed
        )
    except InputError:  # not finite, too short, or sampled too slowly
        return None


def _is_quiet(model: View, measured: View, sign: Sign, gains_db: Mapping[str, float]) -> bool:
    """Whether the model gives next to nothing in the band in which a record has these lines.

    A sound bearing gives lines of its passages too, a hundred decibels down: without noise they modulate what
    little there is as deeply as a spall.
    """
    band = sign.finding.evidence.get("band_hz")
    if not isinstance(band, list) or sign.channel not in model.record.channels:
        return False
    own, other = (_band_power(view, sign.channel, band[0], band[1]) for view in (model, measured))
    return bool(own * 10.0 ** (0.1 * gains_db.get(sign.channel, 0.0)) < _NEXT_TO_NOTHING * other)


def _band_power(view: View, channel: str, low_hz: float, high_hz: float) -> float:
    """Mean square of a channel in a band."""
    signal = view.signal(channel)
    lines = np.fft.rfft(signal)
    hz = np.fft.rfftfreq(signal.size, 1.0 / view.record.sample_rate_hz)
    inside = lines[(hz >= low_hz) & (hz < high_hz)]
    return float(2.0 * np.sum(inside.real**2 + inside.imag**2)) / signal.size**2


def _explains(model: Sign, measured: Sign) -> bool:
    """Whether the model shows these lines as strongly; bearings alike in their lines are one here."""
    near = abs(model.found_order / measured.found_order - 1.0) < _SAME_ORDER
    return near and model.modulation > _AS_STRONG * measured.modulation


def _stands(evidence: FamilyEvidence) -> bool:
    return is_fault(evidence) or (
        evidence.false_alarm_probability < ALARM_PROBABILITY
        and evidence.modulation >= _LEAST_MODULATION
        and evidence.dominance >= _LEAST_DOMINANCE
    )


def _found_by(view: View, pool: EvidencePool) -> list[Sign]:
    """Findings of the diagnosis, weaker evidence, and lines further off than slip takes them."""
    verdict = find_faults(view.machine, pool)
    searches = _Searches(view, pool, verdict)
    found, moved = [], False
    for finding in verdict.findings:
        if finding.fault in _FAULTS:
            evidence = searches.beyond_edge(finding)
            moved |= evidence is not None
            shares = {} if evidence is None else searches.shares(evidence)
            found.append(_from_evidence(evidence, shares, view) if evidence else _from_finding(finding, view))
    searches.explain(found)
    groups = {_key(e.family.fault, e.family.order): e for e in verdict.evidence if e.family.fault in _FAULTS}
    done = {_key(sign.fault, sign.expected_order) for sign in found}
    for key in [key for key in groups if key not in done]:
        evidence = searches.again(groups[key]) if moved else groups[key]
        if _stands(evidence):
            found.append(_from_evidence(evidence, searches.shares(evidence), view))
    # Of a bearing whose races show where they are expected nothing is to be found elsewhere: sidebands.
    heard = {name for sign in found if sign.fault in _RACES for name in searches.alike(sign.finding)}
    for key, judged in groups.items():
        family = judged.family
        if family.fault in _RACES and key not in done and family.component not in heard:
            found += searches.elsewhere(family)
    return found


def _key(fault: str, order: float) -> tuple[str, float]:
    return fault, round(order, 4)


class _Searches:
    """Searches beyond what a bearing as on the nameplate can show."""

    def __init__(self, view: View, pool: EvidencePool, verdict: Verdict) -> None:
        spectra = pool.spectra()
        self._view = view
        self._families = [evidence.family for evidence in verdict.evidence]
        looks = max(1, len(self._families) * len(spectra))
        loudest = max((one.whole for one in spectra), default=0.0)
        self._searches = [FamilySearch(view.machine, one, verdict.speed, looks, loudest) for one in spectra]

    def alike(self, one: FaultFamily | Finding) -> list[str]:
        """Bearings with the same lines as the component told."""
        own = next(f for f in self._families if f.component == one.component and f.fault == one.fault)
        key = _key(own.fault, own.order)
        return [f.component for f in self._families if _key(f.fault, f.order) == key]

    def shares(self, evidence: FamilyEvidence) -> dict[str, float]:
        """Of bearings with the same lines, by how loud these are next to each; bands count in decibels.

        High bands tell the most: what comes through shaft and casing from another bearing is weak there.
        """
        here = replace(evidence.family, order=evidence.found_order, tolerance=_SAME_LINE)
        judged = [search.judge(here) for search in self._searches]
        clear = {band.band for one in judged for band in one.by_band if band.clear}
        levels = {one.channel: {b.band: b.amplitude for b in one.by_band} for one in judged}
        bands = clear or {band.band for band in judged[0].by_band}
        near: dict[str, float] = {}
        for name in self.alike(evidence.family):
            own = [levels[c] for c in self._view.machine.bearing(name).channels if c in levels]
            logs = []
            for band in bands:
                loudest = max(max(level.get(band, 0.0) for level in levels.values()), 1e-300)
                logs.append(
                    math.log(max([level.get(band, 0.0) / loudest for level in own], default=0.0) + 1e-3)
                )
            near[name] = math.exp(sum(logs) / len(logs)) if logs else 1.0
        total = sum(near.values())
        return {name: value / total for name, value in near.items()}

    def explain(self, signs: list[Sign]) -> None:
        """Lines of these no longer count."""
        for sign in signs:
            family = self._family(sign.finding)
            for search in self._searches:
                search.explain(family, sign.found_order)

    def beyond_edge(self, finding: Finding) -> FamilyEvidence | None:
        """Where a finding at the edge of the usual search belongs to lines beyond it, these."""
        family = self._family(finding)
        if abs(finding.found_order / family.order - 1.0) < _EDGE * family.tolerance:
            return None
        wide = self._best(replace(family, tolerance=_WIDE))
        beyond = wide is not None and abs(wide.found_order / finding.found_order - 1.0) > _SAME_LINE
        return wide if beyond and wide and wide.modulation > finding_modulation(finding) else None

    def again(self, evidence: FamilyEvidence) -> FamilyEvidence:
        """The evidence without the lines of what was found beyond the usual search."""
        judged = [search.judge(evidence.family) for search in self._searches]
        return min(judged, key=lambda one: one.false_alarm_probability)

    def elsewhere(self, family: FaultFamily) -> list[Sign]:
        """Lines of a race of other dimensions or with another number of elements."""
        count = self._view.machine.bearing(family.component).rolling_elements
        found = []
        wide = self._best(replace(family, tolerance=_WIDE))
        if wide is not None:
            found.append(_from_evidence(wide, self.shares(wide), self._view))
        for other in (count - 2, count - 1, count + 1, count + 2):
            changed = replace(family, order=family.order * other / count)
            best = self._best(changed) if other > _FEWEST else None
            if best is not None:
                sign = _from_evidence(best, self.shares(best), self._view)
                found.append(replace(sign, expected_order=changed.order, elements=other))
        return sorted(found, key=lambda sign: -sign.modulation)[:1]

    def _best(self, family: FaultFamily) -> FamilyEvidence | None:
        judged = [search.judge(family) for search in self._searches]
        clear = [one for one in judged if is_fault(one)]
        return max(clear, key=lambda one: one.modulation) if clear else None

    def _family(self, finding: Finding) -> FaultFamily:
        key = _key(finding.fault, finding.expected_order)
        return next(f for f in self._families if _key(f.fault, f.order) == key)


def _windows(view: View) -> Iterator[list[WindowResult]]:
    record, machine = view.record, view.machine
    rate = record.sample_rate_hz
    if not machine.bearings or not math.isfinite(view.speed_hz):
        return
    slowest = min(machine.shaft(one.shaft).ratio for one in machine.bearings)
    seconds = max(_WINDOW_S, _LEAST_TURNS / (slowest * view.speed_hz))
    length = min(round(seconds * rate), record.sample_count)
    channels = [
        name
        for name, row in zip(record.channels, record.data, strict=True)
        if is_signal(row) and bool(np.all(np.isfinite(row)))
    ]
    for first in range(0, record.sample_count - length + 1, max(1, length // _HOPS)):
        part = view.part(first, first + length)
        yield [
            analyse_window(
                WindowInput(
                    part.record.data[record.channels.index(name)], rate, name, first, part.speed, machine
                )
            )
            for name in channels
        ]


def finding_modulation(finding: Finding) -> float:
    """Mean square of the lines in the squared envelope over its squared mean."""
    return float(str(finding.evidence["modulation"]))


def _from_finding(finding: Finding, view: View) -> Sign:
    finding = _at_speed_of(view, finding)
    shares = finding.evidence.get("component_shares")
    share = float(shares[finding.component]) if isinstance(shares, dict) else 1.0
    return Sign(
        finding.component,
        finding.fault,
        finding.expected_order,
        finding.found_order,
        _std_order(finding, view),
        finding_modulation(finding),
        share,
        finding.channel,
        finding,
        view.machine.bearing(finding.component).rolling_elements,
    )


def _at_speed_of(view: View, finding: Finding) -> Finding:
    """The order in turns of the view's shaft, where the windows told only a mean speed of their own."""
    if view.phase is not None or not finding.found_hz > 0:
        return finding
    return replace(finding, found_order=finding.found_hz / view.speed_hz)


def _from_evidence(evidence: FamilyEvidence, shares: dict[str, float], view: View) -> Sign:
    """A sign without finding, of the bearing next to which it is loudest."""
    family = evidence.family
    finding = Finding(
        max(shares, key=lambda name: shares[name]),
        family.fault,
        family.order,
        evidence.found_order,
        evidence.found_hz,
        evidence.snr_db,
        0.0,
        "slight",
        evidence.channel,
        {
            "modulation": evidence.modulation,
            "component_shares": shares,
            "harmonic_snr_db": list(evidence.harmonic_snr_db),
        },
    )
    return _from_finding(finding, view)


def _others(sign: Sign) -> list[Sign]:
    """The same lines as those of other bearings that may have them as well, less likely."""
    shares = sign.finding.evidence.get("component_shares")
    if not isinstance(shares, dict):
        return []
    return [
        replace(sign, component=name, share=float(share))
        for name, share in shares.items()
        if name != sign.component and share > _RIVAL_SHARE * sign.share
    ]


def _std_order(finding: Finding, view: View) -> float:
    """Of a fundamental told by its harmonics: Cramer and Rao's bound (Hann window), and what slip adds.

    Harmonic n at the height h_n over the floor tells the fundamental with the variance 12 / (pi T n)^2 / h_n
    over T turns. The rest, a share of a line, is how the cage's random running ahead and behind moves the
    mean of a record: found on simulated slip at two machines, see tests. What the speed is not known by is
    not in it.
    """
    turns = view.turns
    levels = finding.evidence.get("harmonic_snr_db")
    if not math.isfinite(turns) or turns <= 0:
        return math.inf
    heights = np.array(levels if isinstance(levels, list) and levels else [finding.snr_db])
    number = np.arange(1, heights.size + 1)
    clear = np.where(heights >= _CLEAR_DB, 10.0 ** (0.1 * np.minimum(heights, _MOST_DB)), 0.0)
    told = max(float(np.sum(number**2 * clear)), 1.0)
    return math.hypot(math.sqrt(12.0 / (math.pi**2 * told)), _WANDER_LINES) / turns
