"""The judge: what a model gets wrong of measured records, why, the model extended, and the gain.

Case -> features of all records at the same places -> the model tuned (on records of the healthy machine
first, if there are any) -> causes chosen one by one -> scores on held-out records -> verdict.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, cast

from gearsim_twin.baseline import scenario_content
from gearsim_twin.calibrate import Prior, calibrated, plain_prior, settled_on, taught_by
from gearsim_twin.case import LEAST_PERIODS, Case, least_seconds
from gearsim_twin.causes import CAUSES
from gearsim_twin.causes.bearing_signs import signs_of
from gearsim_twin.causes.cause import Cause, Content
from gearsim_twin.causes.context import Context
from gearsim_twin.channels import telling_channels
from gearsim_twin.compare.chains import Nuisance, apply, behind
from gearsim_twin.compare.discrepancy import compare
from gearsim_twin.compare.features import Features, Plan, features, make_plan
from gearsim_twin.compare.merged import discrepancies
from gearsim_twin.conclude import Evidence, concluded
from gearsim_twin.exhibit import exhibit_of
from gearsim_twin.extended import write_extended
from gearsim_twin.fit import fit_tuning, judged
from gearsim_twin.had_before import had_before
from gearsim_twin.heard import heard
from gearsim_twin.labels import speed_label
from gearsim_twin.measuring_chain import measuring_chain
from gearsim_twin.model import Model
from gearsim_twin.patterns import patterns_of
from gearsim_twin.realisations import Realisations, realisations_of
from gearsim_twin.score import score_models
from gearsim_twin.select import select
from gearsim_twin.settings import Settings
from gearsim_twin.simulated import Simulator
from gearsim_twin.stated_floor import without_floor
from gearsim_twin.taught import NEAR, Conditions, Taught, apart
from gearsim_twin.tuning import Tuning, tuning_of
from gearsim_twin.verdict import Verdict
from gearsim_twin.view import View
from gearsim_twin.words import material
from gearsim_twin.workbench import Job, Trial, Workbench

__all__ = ["Bench", "judge"]

Tell = Callable[[str], None]
# Periods of the slowest part that a simulation holds at least.
_LEAST_PERIODS = 8.0


@dataclass(frozen=True, slots=True, eq=False)
class Bench:
    """A case made ready: views and nominal contents of all its records, and what is compared.

    Attributes
    ----------
    plan : Plan
        Of all channels.
    search : Plan
        Of the channels that the search for causes looks at.
    """

    case: Case
    simulator: Simulator
    views: tuple[View, ...]
    nominal: tuple[Content, ...]
    plan: Plan
    search: Plan
    settings: Settings

    @classmethod
    def of(cls, case: Case, simulator: Simulator, settings: Settings) -> Bench:
        """Simulates the nominal model once, so that lines which only it has are compared as well."""
        views = simulator.measured
        nominal = tuple(scenario_content(case, view) for view in views)
        training = range(len(case.training))
        simulated = [_simulated(simulator, k, nominal[k], settings) for k in training]
        both = [*(views[k] for k in training), *simulated]
        shifted = [
            (sign.fault, sign.expected_order, sign.found_order / sign.expected_order - 1.0)
            for k in training
            for sign in signs_of(views[k])
        ]
        plan = search = make_plan(case, both, shifted)
        if len(plan.frame.channels) > settings.most_channels:
            pairs = [
                (features(views[k], plan), features(made, plan))
                for k, made in zip(training, simulated, strict=True)
            ]
            limits = measuring_chain(plan, case.levels_known).limits
            chosen = telling_channels(pairs, plan.frame.channels, settings.most_channels, limits)
            search = make_plan(case, [view.only(chosen) for view in both], shifted)
        return cls(case, simulator, views, nominal, plan, search, settings)

    @property
    def seconds(self) -> float:
        """Length of all simulations."""
        return _seconds(self.case, self.settings)

    def workbench(
        self, records: Sequence[int], training: int, plan: Plan, taught: Taught | None = None
    ) -> Workbench:
        """Some records of the case, the first so many of them for training."""
        numbers = tuple(records)
        then = partial(features, plan=plan)

        def run(jobs: Sequence[Job]) -> Sequence[Features | None]:
            bare = [without_floor(content) for _, content in jobs]
            named = [(numbers[k], content) for (k, _), (content, _) in zip(jobs, bare, strict=True)]
            made = self.simulator.tried(named, then, self.seconds, self.settings.seed)
            pairs = zip(bare, made, strict=True)
            return [None if each is None else apply(floor, each) for (_, floor), each in pairs]

        return Workbench(
            measured=tuple(features(self.views[k], plan) for k in numbers),
            nominal=tuple(self.nominal[k] for k in numbers),
            training=tuple(range(training)),
            run=run,
            nuisances=measuring_chain(plan, self.case.levels_known, taught is not None),
            chance=self.chance(numbers, training, plan),
            numbers=numbers,
            taught=taught,
            conditions=tuple(self._conditions(k) for k in numbers),
        )

    @property
    def healthy(self) -> range:
        """Records of the healthy machine that are looked at."""
        first = len(self.case.training) + len(self.case.holdout)
        return range(first, first + len(self.case.healthy))[: self.settings.most_records]

    def taught(self, prior: Prior, plan: Plan) -> Taught | None:
        """What they show at the places of a plan; None where there are none."""
        if not self.healthy:
            return None
        bench = self.workbench(self.healthy, len(self.healthy), plan)
        return taught_by(bench, prior, bench.conditions)

    def chance(self, numbers: Sequence[int], training: int, plan: Plan) -> dict[int, Realisations]:
        """What chance does to each record: learnt once under each condition, on records for training."""
        geared = self.case.machine.gear_meshes or self.case.machine.planetary_stages
        number = self.settings.gear_seeds if geared else self.settings.seeds
        seeds = range(self.settings.seed, self.settings.seed + number)
        learnt: list[int] = []
        for own in numbers[:training]:
            if all(self._apart(own, other) >= NEAR for other in learnt):
                learnt.append(own)
        jobs = [(own, self.nominal[own], seed) for own in learnt for seed in seeds]
        found = self.simulator.seeded(jobs, partial(features, plan=plan), self.seconds)
        rows = [found[k * len(seeds) : (k + 1) * len(seeds)] for k in range(len(learnt))]
        known = [realisations_of(row) for row in rows]
        nearest = [min(range(len(learnt)), key=lambda k: self._apart(own, learnt[k])) for own in numbers]
        return {record: known[k] for record, k in enumerate(nearest)}

    def told(self) -> tuple[int, ...]:
        """Records for training that the search looks at: the first, and those under other conditions."""
        training = range(len(self.case.training))
        kept = [0]
        while len(kept) < min(self.settings.most_records, len(training)):
            far = {k: min(self._apart(k, other) for other in kept) for k in training if k not in kept}
            furthest = max(far, key=lambda k: far[k])
            if far[furthest] < NEAR:
                break
            kept.append(furthest)
        return tuple(sorted(kept))

    def _conditions(self, record: int) -> Conditions:
        """Speed, load, and radial force of a record."""
        return (self.views[record].speed_hz, *_load_and_force(self.nominal[record]))

    def _apart(self, one: int, other: int) -> float:
        return apart(self._conditions(one), self._conditions(other))

    def heldout(self, bench: Workbench, prior: Prior, trial: Trial) -> Context:
        """What the finders of causes may look at when they are asked a second time."""
        (shown,) = bench.trials([trial.model], bench.holdout)
        return self.context(bench, prior, shown, bench.holdout)

    def _before(self, bench: Workbench, trial: Trial, records: Sequence[int]) -> tuple[View, ...]:
        """For each record the healthy one of the most similar conditions; none once the model has causes."""
        if trial.model.extensions or not all(bench.familiar(k) for k in records):
            return ()
        assert bench.taught is not None  # as they are familiar
        nearest = [bench.taught.near(bench.conditions[k])[0] for k in records]
        return tuple(self.views[self.healthy[k]] for k in nearest)

    @staticmethod
    def chain(bench: Workbench, trial: Trial) -> Nuisance:
        """The whole measuring chain behind a trial's simulations."""
        if bench.taught is None:
            return cast(Nuisance, trial.nuisance[0])
        return behind(bench.taught.chain[0], trial.nuisance[0])

    def context(
        self, bench: Workbench, prior: Prior, trial: Trial, records: Sequence[int] | None = None
    ) -> Context:
        """What causes may look at: records for training, unless others are told."""
        records = bench.training if records is None else records
        contents = {bench.numbers[k]: trial.model.content(bench.nominal[k]) for k in records}
        shown = [trial.features[k] for k in records]
        tau = prior.tau_of(bench.stack.domains)
        # Of records for training that the search does not look at positions of lines are read all the same.
        training = range(len(self.case.training)) if records == bench.training else ()
        more = [k for k in training if k not in contents]
        chain = self.chain(bench, trial)
        plain = tuple(
            _simulated(self.simulator, k, content, self.settings) for k, content in contents.items()
        )
        return Context(
            case=self.case,
            views=tuple(self.views[k] for k in contents),
            measured=tuple(bench.measured[k] for k in records),
            simulated=tuple(shown),
            comparison=tuple(compare(bench.measured[k], trial.features[k], tau) for k in records),
            contents=tuple(contents.values()),
            simulated_views=plain,
            more_views=tuple(self.views[k] for k in more),
            more_contents=tuple(trial.model.content(self.nominal[k]) for k in more),
            noisy_views=tuple(heard(view, chain, self.settings.seed + k) for k, view in enumerate(plain)),
            gains_db=chain.gains_db,
            healthy_views=self._before(bench, trial, records),
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
        simulator.prepare()
        tell("simulating the nominal model")
        bench = Bench.of(case, simulator, chosen)
        return _judged(bench, chosen, known, out, tell, show)


def _judged(
    bench: Bench, settings: Settings, causes: tuple[Cause, ...], out: Path | None, tell: Tell, show: bool
) -> Verdict:
    case = bench.case
    train, held = len(case.training), len(case.holdout)
    tuning = tuning_of(case.machine_path, case.model)
    prior = _prior(bench, tuning, tell)
    held_out = range(train, train + held)
    told = bench.told()
    work = bench.workbench((*told, *held_out), len(told), bench.search, bench.taught(prior, bench.search))
    work, of_healthy = settled_on(work, prior)
    yard = prior.yard(work)
    tell("tuning the model")
    tuned = fit_tuning(work, yard, Model(prior.tuning, prior.tuning.nominal))
    yard = yard.by_independence(tuned.posterior.residual_db, tuned.trial.levels, tuned.posterior.noise)
    tuned = judged(yard, tuned.trial, tuned.slopes)
    label = speed_label(
        bench.views[:train], bench.views[train : train + held], causes, bench.plan.frame.window_turns
    )
    others = tuple(cause for cause in causes if label is None or cause.name != label.found.name)
    others = () if label is not None and label.contradicted else others
    context_of, again = (partial(look, work, prior) for look in (bench.context, bench.heldout))
    selection = select(work, yard, tuned, others, context_of, settings, tell, _nothing_left, again)
    tell("scoring on held-out records")
    whole = work
    if bench.search is not bench.plan or len(told) != train:
        taught = bench.taught(prior, bench.plan) if work.taught is not None else None
        whole = bench.workbench(range(train + held), train, bench.plan, taught)
    records = (*whole.training, *whole.holdout)
    trials = whole.by_models_alone().trials([Model(tuning, tuning.nominal)], records)
    trials += whole.trials([selection.tuned.trial.model, selection.final.trial.model], records)
    names = ("baseline", "tuned_only", "extended")
    scores = score_models(
        [whole.measured[k] for k in whole.holdout],
        {name: [trial.features[k] for k in whole.holdout] for name, trial in zip(names, trials, strict=True)},
        settings.seed,
    )
    remarks = _remarks(bench, of_healthy)
    shared = partial(patterns_of, lambda: context_of(selection.final.trial), bench.search.frame)
    evidence = Evidence(whole, selection, trials[1], trials[2], prior, scores, remarks, label, shared)
    verdict = concluded(evidence)
    if show:
        tell("gathering what is shown")
        verdict = replace(verdict, exhibit=exhibit_of(bench, whole, selection, settings.seed))
    if out is None:
        return verdict
    content = selection.final.trial.model.content(whole.nominal[0])
    return verdict.written(write_extended(out, content, verdict.comments()))


def _remarks(bench: Bench, of_healthy: tuple[str, ...]) -> tuple[str, ...]:
    """What is to be said of the records, each once."""
    said = [*bench.case.remarks, *(each for view in bench.views for each in view.remarks), *of_healthy]
    said += had_before([bench.views[k] for k in bench.healthy])
    return tuple(dict.fromkeys(said))


def _nothing_left(context: Context) -> bool:
    """Whether no difference is too large and too sure for a good model's own errors."""
    return not material(discrepancies(context.comparison))


def _prior(bench: Bench, tuning: Tuning, tell: Tell) -> Prior:
    """What is known of machine and model beforehand: assumed, or taught by records of the healthy machine."""
    prior = plain_prior(tuning)
    if not bench.healthy:
        return prior
    tell("calibrating on the healthy machine")
    return calibrated(bench.workbench(bench.healthy, len(bench.healthy), bench.search), prior)


def _load_and_force(content: Content) -> tuple[float, float]:
    """Load and radial force under which a model runs."""
    point = content.get("operating_point", {})
    force = content.get("parameters", {}).get("radial_load", {})
    return _number(point.get("load", {})), _number(force)


def _number(entry: Any) -> float:
    return float(entry["value"]) if isinstance(entry, dict) and "value" in entry else 0.0


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
