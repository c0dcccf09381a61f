"""What a page shows beside the verdict: records and models side by side, and the way from one to the next.

Everything here is of the held-out records, which nothing was fitted to.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from gearsim_io.nameplate import Machine
from gearsim_twin.calibrate import SMOOTH_DB
from gearsim_twin.compare.chains import Nuisance
from gearsim_twin.compare.discrepancy import Comparison, compare, pooled
from gearsim_twin.compare.places import Place
from gearsim_twin.model import Model
from gearsim_twin.score import DomainScore, Scores, score_models
from gearsim_twin.tuning import tuning_of
from gearsim_twin.view import View

if TYPE_CHECKING:
    from gearsim_twin.compare.features import Features
    from gearsim_twin.judge import Bench
    from gearsim_twin.select import Selection
    from gearsim_twin.workbench import Trial, Workbench

__all__ = ["BASELINE", "TUNED", "BandScore", "Exhibit", "Given", "Step", "exhibit_of", "through_chain"]

BASELINE, TUNED = "baseline", "tuned_only"
"""Names of the first two steps; those after them have the name of the cause that they add."""


@dataclass(frozen=True, slots=True)
class Given:
    """A record of the case: what it is for, and what was found of its speed and load."""

    role: str
    source: str
    seconds: float
    rate_hz: float
    channels: tuple[str, ...]
    speed_hz: float
    relative_error: float
    speed_source: str
    load_nm: float | None


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """A model on the way to the extended one.

    Attributes
    ----------
    name : str
        `BASELINE`, `TUNED`, or the cause that it adds to the step before it.
    component : str
        That the cause sits in; "" where that is no question.
    comparison : Comparison
        All held-out records beside it.
    """

    name: str
    component: str
    comparison: Comparison


@dataclass(frozen=True, slots=True)
class BandScore:
    """Scores of what lies in one band of frequencies: noise, lines, and all that has it as carrier."""

    band_hz: tuple[float, float]
    score: DomainScore


@dataclass(frozen=True, slots=True, eq=False)
class Exhibit:
    """What a page shows.

    Attributes
    ----------
    machine : Machine
    model : str
    split : bool
        True where the held-out records are parts of those for training.
    given : tuple of Given
    steps : tuple of Step
        Baseline, tuned, and one per cause.
    scores : Scores
        Held-out scores of all steps, under the keys of `keys`.
    bands : tuple of BandScore
        The same by bands.
    measured : View
        The first held-out record.
    sides : mapping of str to View
        What baseline and extended model give in its place, each behind its measuring chain; of the
        same model under both names where no cause was found.
    """

    machine: Machine
    model: str
    split: bool
    given: tuple[Given, ...]
    steps: tuple[Step, ...]
    scores: Scores
    bands: tuple[BandScore, ...]
    measured: View
    sides: Mapping[str, View]

    @property
    def keys(self) -> tuple[str, ...]:
        """Names of the steps' scores."""
        return tuple(_key(number, step.name) for number, step in enumerate(self.steps))


def exhibit_of(bench: Bench, work: Workbench, selection: Selection, seed: int) -> Exhibit:
    """Everything shown of a case that was judged.

    Parameters
    ----------
    bench : Bench
    work : Workbench
        Of the records for training and those held out.
    selection : Selection
    seed : int
        Of intervals and of the sensors' noise.
    """
    final = selection.final.trial.model
    described = tuning_of(bench.case.machine_path, bench.case.model)
    records = (*work.training, *work.holdout)
    models = [Model(described, described.nominal), selection.tuned.trial.model]
    models += [replace(final, extensions=final.extensions[: k + 1]) for k in range(len(final.extensions))]
    trials = work.by_models_alone().trials(models[:1], records) + work.trials(models[1:], records)
    names = [
        (BASELINE, ""),
        (TUNED, ""),
        *((each.cause.name, each.words.get("component", "")) for each in final.extensions),
    ]
    measured = [work.measured[k] for k in work.holdout]
    yard = selection.yard
    tau_db = {
        name: float(np.hypot(SMOOTH_DB, median))
        for name, median in zip(yard.stack.domains, yard.tau_median_db, strict=True)
    }
    steps = tuple(
        Step(*name, pooled([compare(work.measured[k], trial.features[k], tau_db) for k in work.holdout]))
        for name, trial in zip(names, trials, strict=True)
    )
    sides = {
        _key(k, name): [trial.features[h] for h in work.holdout]
        for k, ((name, _), trial) in enumerate(zip(names, trials, strict=True))
    }
    return Exhibit(
        machine=bench.case.machine,
        model=bench.case.model,
        split=bench.case.split,
        given=_given(bench),
        steps=steps,
        scores=score_models(measured, sides, seed),
        bands=_bands(bench, measured, sides, seed),
        measured=bench.views[work.holdout[0]],
        sides=_sides(bench, work, models, trials, seed),
    )


def _key(number: int, name: str) -> str:
    return f"{number} {name}"


def _given(bench: Bench) -> tuple[Given, ...]:
    case = bench.case
    roles = ["training"] * len(case.training) + ["held out"] * len(case.holdout)
    roles += ["healthy"] * len(case.healthy)
    return tuple(
        Given(
            role,
            view.record.source,
            view.record.seconds,
            view.record.sample_rate_hz,
            view.record.channels,
            view.speed_hz,
            view.speed.relative_error,
            view.source,
            view.load_nm,
        )
        for role, view in zip(roles, bench.views, strict=True)
    )


def _bands(
    bench: Bench, measured: Sequence[Features], sides: Mapping[str, Sequence[Features]], seed: int
) -> tuple[BandScore, ...]:
    """Scores of what lies below the carrier bands, and of each of them."""
    frame = bench.plan.frame
    carriers = frame.bands_hz
    ends = [(0.0, carriers[0][0]), *carriers]
    found = []
    for band in ends:
        inside = np.array([_inside(place, band, frame.speed_hz) for place in bench.plan.places])
        if inside.any():
            cut = {name: [each.where(inside) for each in side] for name, side in sides.items()}
            scores = score_models([each.where(inside) for each in measured], cut, seed)
            if scores.overall.places:
                found.append(BandScore(band, scores.overall))
    return tuple(found)


def _inside(place: Place, band_hz: tuple[float, float], speed_hz: float) -> bool:
    if place.domain == "torsional":
        return False
    if place.band_hz is not None:
        return place.band_hz == band_hz
    hz = place.hz(speed_hz) if place.domain in ("psd", "orders") else float("nan")
    return band_hz[0] <= hz < band_hz[1]


def _sides(
    bench: Bench, work: Workbench, models: Sequence[Model], trials: Sequence[Trial], seed: int
) -> dict[str, View]:
    """Baseline and extended model in place of the first held-out record."""
    record = work.holdout[0]
    benches = (work.by_models_alone(), work)
    ends = {BASELINE: 0, "extended": len(models) - 1}
    jobs = [(record, models[k].content(bench.nominal[record])) for k in ends.values()]
    views = bench.simulator.derived(jobs, _itself, bench.seconds, bench.settings.seed)
    return {
        name: through_chain(view, bench.chain(each, trials[k]), seed)
        for (name, k), view, each in zip(ends.items(), views, benches, strict=True)
    }


def _itself(view: View) -> View:
    return view


def through_chain(view: View, chain: Nuisance, seed: int) -> View:
    """A simulated view as the measuring chain would show it: gain, bandwidth and coloured noise.

    Parameters
    ----------
    view : View
    chain : Nuisance
    seed : int
        Of the noise.
    """
    rng = np.random.default_rng(seed)
    record = view.record
    hz = np.asarray(np.fft.rfftfreq(record.sample_count, 1.0 / record.sample_rate_hz), dtype=np.float64)
    rows = []
    for name, samples in zip(record.channels, record.data, strict=True):
        own = chain.of(name)
        lines = np.fft.rfft(np.asarray(samples, dtype=np.float64)) * np.sqrt(own.gain(hz))
        # White noise of variance 1 has the one-sided density 2 / rate.
        white = np.fft.rfft(rng.standard_normal(record.sample_count))
        lines += white * np.sqrt(0.5 * record.sample_rate_hz * own.floor(hz))
        rows.append(np.fft.irfft(lines, record.sample_count))
    data = np.asarray(rows, dtype=record.data.dtype)
    return replace(view, record=replace(record, data=data), _kept={})
