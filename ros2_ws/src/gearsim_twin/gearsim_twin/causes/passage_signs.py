"""Signs of bearings in the spectrum itself, for spalls whose events no envelope shows; all records together.

The search is that of `compare.passages`, over all records for training at once: fundamentals are counted in
turns of the shaft, so runs of harmonics lie alike in all of them. What a model shows there is measured where
its own lines lie, with the gains of the measuring chain.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from gearsim_dsp.bands import TOP_SHARE
from gearsim_dsp.judges.finding import Finding
from gearsim_dsp.kinematics import FaultFamily, fault_families
from gearsim_twin.causes.bearing_signs import Sign, signs_of
from gearsim_twin.causes.cause import REPEATED_NATS
from gearsim_twin.compare.passages import (
    ANGLE_MARKS,
    Found,
    LongLines,
    Shown,
    best_comb,
    found_all,
    long_lines,
    shown,
)

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context
    from gearsim_twin.view import View

__all__ = ["passage_signs", "shown_again"]

# A model that has so much of the measured power has these lines already; one that has so little lacks them.
_AS_STRONG, _LACKING = 0.5, 0.1
_SAME_ORDER = 1e-3
_NEAR = 2e-3  # where a fundamental is known, in parts of it
_RIVAL_SHARE = 0.25
_ELEMENT = "rolling_element"


@dataclass(frozen=True, slots=True)
class _Run:
    """A run of harmonics that stands out: what it belongs to, where, and the channel that shows it best."""

    family: FaultFamily
    order: float
    first: int
    count: int
    channel: str
    nats: float


_LINES: WeakKeyDictionary[View, dict[str, LongLines | None]] = WeakKeyDictionary()
_RUNS: WeakKeyDictionary[View, dict[int, tuple[_Run, ...]]] = WeakKeyDictionary()


def passage_signs(context: Context, fault: str, *, absent: bool = False) -> list[tuple[int, Sign]]:
    """Signs of one kind of fault in the spectrum itself that the present model does not show, the clearest
    first.

    One for each bearing that may have such lines, with the number of the record that shows them most;
    `absent` asks for what the model has not at all, without the noise that hides it.
    """
    found: list[tuple[int, Sign]] = []
    # An element that strikes both races, at all angles to the load, has lines wherever a race has.
    struck = _with_damaged_elements(context) if fault != _ELEMENT else set()
    for run in _runs(context):
        if run.family.fault != fault:
            continue
        each = [_shown(view, run, run.order) for view in context.views]
        most = int(np.argmax([one.power for one in each]))
        if each[most].power > 0 and _lacks(context, run, each, absent=absent):
            signs = _signs(context.views[most], run)
            found += [(most, sign) for sign in signs if sign.component not in struck]
    return sorted(found, key=lambda each: -each[1].weight)


def _with_damaged_elements(context: Context) -> set[str]:
    """Bearings whose envelopes show a damaged element."""
    signs = [sign for view in context.views for sign in signs_of(view)]
    return {sign.component for sign in signs if sign.fault == _ELEMENT and sign.is_fault}


def shown_again(sign: Sign, heldout: Context) -> bool:
    """Whether lines of such a sign stand out of held-out records as well, in their place, beside the model.

    Noise would do so once in e to the number of nats that it counts.
    """
    assert sign.run is not None
    family = next(f for f in fault_families(heldout.case.machine) if _is(f, sign))
    run = _Run(family, sign.found_order, *sign.run, sign.channel, 0.0)
    lines = [_lines(view, sign.channel) for view in heldout.views]
    known = [one for one in lines if one is not None]
    if not known:
        return False
    here = FaultFamily(*_named(family, sign.found_order))
    found = best_comb(known, here, 1, near=_NEAR, runs=[sign.run])
    if found is None or found.nats < REPEATED_NATS:
        return False
    return _lacks(heldout, run, [_shown(view, run, found.order) for view in heldout.views], absent=True)


def _is(family: FaultFamily, sign: Sign) -> bool:
    return family.component == sign.component and family.fault == sign.fault


def _named(family: FaultFamily, order: float) -> tuple[str, str, float, float, str, float]:
    return family.component, family.fault, order, family.sideband_order, family.label, family.tolerance


def _runs(context: Context) -> tuple[_Run, ...]:
    """What stands out of the records for training, those not simulated among them."""
    views = (*context.views, *context.more_views)
    kept = _RUNS.setdefault(context.views[0], {})
    if len(views) not in kept:
        families = _different(fault_families(context.case.machine))
        channels = [c for c in context.views[0].record.channels if all(c in v.record.channels for v in views)]
        turns = sorted({shaft.ratio for shaft in context.case.machine.shafts})
        best: dict[tuple[str, float], _Run] = {}
        for channel in channels:
            known = [one for one in (_lines(view, channel) for view in views) if one is not None]
            for family, comb in found_all(known, families, turns, len(channels)):
                key = (family.fault, family.order)
                if key not in best or best[key].nats < comb.nats:
                    best[key] = _Run(family, comb.order, comb.first, comb.count, channel, comb.nats)
        kept[len(views)] = tuple(sorted(best.values(), key=lambda run: -run.nats))
    return kept[len(views)]


def _different(families: Sequence[FaultFamily]) -> list[FaultFamily]:
    """One family of each order."""
    kept: list[FaultFamily] = []
    for family in families:
        if all(f.fault != family.fault or abs(f.order / family.order - 1) > _SAME_ORDER for f in kept):
            kept.append(family)
    return kept


def _lacks(context: Context, run: _Run, measured: Sequence[Shown], *, absent: bool) -> bool:
    """Whether the model has much less in these lines than all records together, and less than their noise.

    Where a sound bearing's lines are seen they hang on its clearance too much to ask for more of them.
    """
    views = context.simulated_views if absent else context.noisy_views or context.simulated_views
    gain = 10.0 ** (0.1 * context.gains_db.get(run.channel, 0.0))
    noise = sum(one.noise for one in measured)
    most = (_LACKING if absent else _AS_STRONG) * sum(one.power for one in measured)
    plain = gain * sum(_of_model(view, run) for view in context.simulated_views)
    model = gain * sum(_of_model(view, run) for view in views)
    # What the healthy machine showed is no cause's.
    before = sum(_of_model(view, run) for view in context.healthy_views)
    power = sum(one.power for one in measured)
    return bool(model < most and plain < noise and before <= _AS_STRONG * power)


def _of_model(view: View, run: _Run) -> float:
    """Power of such lines in a simulation, where the record has them or where its own lie."""
    lines = _lines(view, run.channel)
    if lines is None:
        return 0.0
    own = best_comb([lines], run.family, 1, runs=[(run.first, run.count)])
    places = {run.order} if own is None or own.nats < 0 else {run.order, own.order}
    return max(_shown(view, run, order).power for order in places)


def _shown(view: View, run: _Run, order: float) -> Shown:
    lines = _lines(view, run.channel)
    return Shown() if lines is None else shown(lines, run.family, Found(order, run.first, run.count, 0.0))


def _signs(view: View, run: _Run) -> list[Sign]:
    """A sign for each bearing that may have these lines, by how loud they are next to it."""
    machine = view.machine
    alike = [f for f in fault_families(machine) if f.fault == run.family.fault]
    alike = [f for f in alike if abs(f.order / run.family.order - 1) <= _SAME_ORDER]
    loud = {c: _shown(view, _at(run, c), run.order).power for c in view.record.channels}
    near = {
        f.component: max((loud.get(c, 0.0) for c in machine.bearing(f.component).channels), default=0.0)
        for f in alike
    }
    total = sum(near.values())
    shares = {name: power / total if total > 0 else 1.0 / len(near) for name, power in near.items()}
    most = max(shares.values())
    modulation = _shown(view, run, run.order).share
    std = 0.3 / (view.turns * (run.first + run.count))
    return [
        Sign(
            f.component,
            f.fault,
            f.order,
            run.order,
            std,
            modulation,
            shares[f.component],
            run.channel,
            _finding(f, run, view, modulation),
            machine.bearing(f.component).rolling_elements,
            (run.first, run.count),
        )
        for f in alike
        if shares[f.component] > _RIVAL_SHARE * most
    ]


def _at(run: _Run, channel: str) -> _Run:
    return _Run(run.family, run.order, run.first, run.count, channel, run.nats)


def _finding(family: FaultFamily, run: _Run, view: View, modulation: float) -> Finding:
    evidence = {"modulation": modulation, "component_shares": {}, "harmonic_snr_db": []}
    hz = run.order * view.speed_hz
    return Finding(
        family.component,
        family.fault,
        family.order,
        run.order,
        hz,
        0.0,
        0.0,
        "slight",
        run.channel,
        evidence,
    )


def _lines(view: View, channel: str) -> LongLines | None:
    kept = _LINES.setdefault(view, {})
    if channel not in kept:
        kept[channel] = _made(view, channel)
    return kept[channel]


def _made(view: View, channel: str) -> LongLines | None:
    rate = view.record.sample_rate_hz
    signal = view.signal(channel)
    phase = view.phase
    if phase is None or view.source not in ANGLE_MARKS:
        return None
    if not (np.all(np.isfinite(signal)) and np.ptp(signal) > 0):
        return None
    return long_lines(signal, phase, rate, TOP_SHARE * rate, view.machine)
