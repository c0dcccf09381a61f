"""The judge: what a model gets wrong of measured records, why, the model extended, and the gain.

Case -> features of all records at the same places -> the model tuned (on records of the healthy machine
first, if there are any) -> causes chosen one by one -> scores on held-out records -> verdict.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from gearsim_io.errors import InputError
from gearsim_twin.baseline import scenario_content
from gearsim_twin.calibrate import Prior, calibrated, plain_prior
from gearsim_twin.case import LEAST_PERIODS, Case, least_seconds
from gearsim_twin.causes import CAUSES
from gearsim_twin.causes.cause import Cause, Content
from gearsim_twin.causes.context import Context
from gearsim_twin.compare.discrepancy import compare
from gearsim_twin.compare.features import Features, Plan, features, make_plan
from gearsim_twin.conclude import Evidence, concluded
from gearsim_twin.exhibit import exhibit_of
from gearsim_twin.extended import write_extended
from gearsim_twin.fit import fit_tuning
from gearsim_twin.measuring_chain import measuring_chain
from gearsim_twin.model import Model
from gearsim_twin.realisations import Realisations, realisations_of
from gearsim_twin.score import score_models
from gearsim_twin.select import select
from gearsim_twin.settings import Settings
from gearsim_twin.simulated import Simulator
from gearsim_twin.tuning import tuning_of
from gearsim_twin.verdict import Verdict
from gearsim_twin.view import View
from gearsim_twin.workbench import Job, Trial, Workbench

__all__ = ["Bench", "judge"]

Tell = Callable[[str], None]
# Periods of the slowest part that a simulation holds at least.
_LEAST_PERIODS = 8.0


@dataclass(frozen=True, slots=True, eq=False)
class Bench:
    """A case made ready: views and nominal contents of all its records, and the plan of comparison."""

    case: Case
    simulator: Simulator
    views: tuple[View, ...]
    nominal: tuple[Content, ...]
    plan: Plan
    settings: Settings

    @classmethod
    def of(cls, case: Case, simulator: Simulator, settings: Settings) -> Bench:
        """Simulates the nominal model once, so that lines which only it has are compared as well."""
        views = simulator.measured
        nominal = tuple(scenario_content(case, view) for view in views)
        training = range(len(case.training))
        simulated = [_simulated(simulator, k, nominal[k], settings) for k in training]
        plan = make_plan(case, [*(views[k] for k in training), *simulated])
        return cls(case, simulator, views, nominal, plan, settings)

    @property
    def seconds(self) -> float:
        """Length of all simulations."""
        return _seconds(self.case, self.settings)

    def workbench(self, records: Sequence[int], training: int) -> Workbench:
        """Some records of the case, the first so many of them for training."""
        numbers = tuple(records)

        def run(jobs: Sequence[Job]) -> Sequence[Features | None]:
            return self._made([(numbers[k], content) for k, content in jobs])

        return Workbench(
            measured=tuple(features(self.views[k], self.plan) for k in numbers),
            nominal=tuple(self.nominal[k] for k in numbers),
            training=tuple(range(training)),
            run=run,
            nuisances=measuring_chain(self.plan, self.case.levels_known),
            chance=self._chance(numbers, training),
        )

    def _made(self, jobs: Sequence[Job]) -> Sequence[Features | None]:
        """Features of simulations; None for those that the simulator refuses."""
        then = partial(features, plan=self.plan)
        try:
            return self.simulator.derived(jobs, then, self.seconds, self.settings.seed)
        except InputError:
            return [None] if len(jobs) == 1 else [one for job in jobs for one in self._made([job])]

    def _chance(self, numbers: Sequence[int], training: int) -> dict[int, Realisations]:
        """What chance does to each record: that of the record for training with the most similar speed."""
        then = partial(features, plan=self.plan)
        known = {}
        for k in range(training):
            job = (numbers[k], self.nominal[numbers[k]])
            seeds = range(self.settings.seed, self.settings.seed + self.settings.seeds)
            found = [self.simulator.derived([job], then, self.seconds, seed)[0] for seed in seeds]
            known[k] = realisations_of(found)
        speeds = [self.views[number].speed_hz for number in numbers]
        nearest = [min(known, key=lambda k: abs(speeds[k] - own)) for own in speeds]
        return {record: known[k] for record, k in enumerate(nearest)}

    def context(self, bench: Workbench, prior: Prior, trial: Trial) -> Context:
        """What causes may look at."""
        records = bench.training
        contents = {k: trial.model.content(bench.nominal[k]) for k in records}
        shown = [trial.features[k] for k in records]
        tau = prior.tau_of(bench.stack.domains)
        return Context(
            case=self.case,
            views=tuple(self.views[k] for k in records),
            measured=tuple(bench.measured[k] for k in records),
            simulated=tuple(shown),
            comparison=tuple(compare(bench.measured[k], trial.features[k], tau) for k in records),
            contents=tuple(contents.values()),
            simulated_views=tuple(
                _simulated(self.simulator, k, content, self.settings) for k, content in contents.items()
            ),
        )


def judge(
    case: Case,
    settings: Settings | None = None,
    out: Path | None = None,
    tell: Tell = lambda _: None,
    causes: Sequence[Cause] | None = None,
    show: bool = False,
) -> Verdict:
    """What is wrong, why, the extended model, and the gain.

    Parameters
    ----------
    case : Case
    settings : Settings, optional
    out : Path, optional
        File for the extended model; none is written without it.
    tell : callable
        Gets a line on what is being done; it may raise to stop.
    causes : sequence of Cause, optional
        In place of all that are known.
    show : bool
        Whether the verdict gets what a page shows beside it (`Verdict.exhibit`).

    Raises
    ------
    InputError
        If a record cannot be compared, or nothing tells its speed.
    """
    chosen = settings or Settings()
    known = tuple(CAUSES.values()) if causes is None else tuple(causes)
    tell("reading angles and speeds")
    with Simulator(case, chosen.workers) as simulator:
        tell("simulating the nominal model")
        bench = Bench.of(case, simulator, chosen)
        return _judged(bench, chosen, known, out, tell, show)


def _judged(
    bench: Bench, settings: Settings, causes: tuple[Cause, ...], out: Path | None, tell: Tell, show: bool
) -> Verdict:
    case = bench.case
    train, held, healthy = len(case.training), len(case.holdout), len(case.healthy)
    tuning = tuning_of(case.machine_path, case.model)
    prior = plain_prior(tuning)
    if healthy:
        tell("calibrating on the healthy machine")
        prior = calibrated(bench.workbench(range(train + held, train + held + healthy), healthy), prior)
    work = bench.workbench(range(train + held), train)
    yard = prior.yard(work)
    tell("tuning the model")
    tuned = fit_tuning(work, yard, Model(prior.tuning, prior.tuning.nominal))
    selection = select(work, yard, tuned, causes, partial(bench.context, work, prior), settings, tell)
    tell("scoring on held-out records")
    nominal = Model(tuning, tuning.nominal)
    models = [nominal, selection.tuned.trial.model, selection.final.trial.model]
    trials = work.trials(models, (*work.training, *work.holdout))
    names = ("baseline", "tuned_only", "extended")
    scores = score_models(
        [work.measured[k] for k in work.holdout],
        {name: [trial.features[k] for k in work.holdout] for name, trial in zip(names, trials, strict=True)},
        settings.seed,
    )
    remarks = dict.fromkeys([*case.remarks, *(each for view in bench.views for each in view.remarks)])
    evidence = Evidence(work, selection, prior, scores, tuple(remarks))
    verdict = concluded(evidence)
    if show:
        tell("gathering what is shown")
        verdict = replace(verdict, exhibit=exhibit_of(bench, work, selection, settings.seed))
    if out is None:
        return verdict
    content = selection.final.trial.model.content(work.nominal[0])
    return verdict.written(write_extended(out, content, verdict.comments()))


def _seconds(case: Case, settings: Settings) -> float:
    """As long as the shortest record for training, but as a slow machine's turns need."""
    shortest = min(record.seconds for record in case.training)
    return min(
        shortest, max(settings.most_seconds, _LEAST_PERIODS / LEAST_PERIODS * least_seconds(case.machine))
    )


def _simulated(simulator: Simulator, record: int, content: Content, settings: Settings) -> View:
    """What a model gives in place of a record."""
    (view,) = simulator.views({record: content}, _seconds(simulator.case, settings), settings.seed)
    return view
