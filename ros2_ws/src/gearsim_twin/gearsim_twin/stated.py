"""Models with causes stated by hand, scored on held-out records: what an extension gains, nothing chosen.

The judge looks for causes; this takes them as given, so that a finding of one's own, or one that another
record taught, can be put to the test on a record that it was not taken from.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from gearsim_io.errors import InputError
from gearsim_twin.baseline import scenario_content
from gearsim_twin.case import Case
from gearsim_twin.causes.cause import Cause, Content, Values
from gearsim_twin.causes.context import Context
from gearsim_twin.compare.features import Features, features, make_plan
from gearsim_twin.measuring_chain import measuring_chain
from gearsim_twin.score import Scores, score_models
from gearsim_twin.simulated import Simulator
from gearsim_twin.view import View

__all__ = ["Stated", "score_stated"]

Stated = Sequence[tuple[Cause, Values]]
"""Causes with their values, in the order in which they extend the nominal model; empty for that itself."""


def score_stated(
    case: Case, models: Mapping[str, Stated], seconds: float | None = None, seed: int = 1
) -> Scores:
    """Scores of stated models on the held-out records of a case.

    Parameters
    ----------
    case : Case
    models : mapping of str to sequence of (Cause, values)
        By a name each; nothing is fitted but gains, floors and bandwidths of the measuring chain, and those
        on the training records alone.
    seconds : float, optional
        Length of the simulations; by default as long as each record.
    seed : int
        Of the simulations and of the intervals.

    Returns
    -------
    Scores
        Weighted rms errors in dB under the names of the models, over all places and domain by domain.

    Raises
    ------
    InputError
        If there is no model, or the simulator refuses one.
    """
    if not models:
        raise InputError("score_stated", "models", "none", "one or more")
    train, held = len(case.training), len(case.holdout)
    numbers = range(train + held)
    with Simulator(case) as simulator:
        views = simulator.measured
        nominal = {k: scenario_content(case, views[k]) for k in numbers}
        context = _context(case, views[:train], [nominal[k] for k in range(train)])
        made = {
            name: simulator.views(_extended(nominal, stated, context), seconds, seed)
            for name, stated in models.items()
        }
        plan = make_plan(case, [*views[:train], *(view for each in made.values() for view in each[:train])])
        measured = [features(views[k], plan) for k in numbers]
        chain = measuring_chain(plan, case.levels_known)
        shown: dict[str, list[Features]] = {}
        for name, simulated in made.items():
            found = [features(view, plan) for view in simulated]
            nuisance = chain.fit(list(zip(measured[:train], found[:train], strict=True)))
            shown[name] = [chain.apply(nuisance, each) for each in found[train:]]
    return score_models(measured[train:], shown, seed)


def _context(case: Case, views: Sequence[View], contents: Sequence[Content]) -> Context:
    """What an extension may look at: records and nominal model, nothing that was compared."""
    return Context(case, tuple(views), (), (), (), tuple(contents), ())


def _extended(nominal: Mapping[int, Content], stated: Stated, context: Context) -> dict[int, Content]:
    contents = dict(nominal)
    for cause, values in stated:
        contents = {k: cause.extend(content, values, context) for k, content in contents.items()}
    return contents
