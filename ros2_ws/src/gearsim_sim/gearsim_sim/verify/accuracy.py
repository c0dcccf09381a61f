"""How far the compiled loop is from DOP853 on the readable right-hand side, model by model, fault by fault.

Both start from the same running machine, then a fault grows within 3 ms and stays; compared are the
accelerations of all sites at the rate of integration, before any filter, over 10 ms. The error is the rms
difference over the rms of the reference, of the site where that is worst. The 10 ms are those in which the
fault does most: a run over a turn of the reference shaft, with and without it, says where they are. How much
it does there, relative to the healthy machine, is its *effect*.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.events import FaultSpec
from gearsim_sim.model.bearing_faults import Term
from gearsim_sim.model.faults import REGISTRY, Fault
from gearsim_sim.model.plant import Plant
from gearsim_sim.verify.machines import SEED, load_for, model_names, plant_of
from gearsim_sim.verify.reference import reference
from gearsim_sim.verify.trajectory import Course, run, site_accelerations

Array = NDArray[np.float64]
STEP_RATE_HZ = 4 * 65536.0
SECONDS, GROWTH_S, FILM_SECONDS = 0.010, 0.003, 0.001
LIMIT = 1e-3
# Teeth that rattle in their play meet with a bend of the force at every mesh: there the scheme is of second
# order, and 1e-3 needs 8 steps per sample on the planetary stage.
RATTLING = {"gear_backlash": 4e-3}
HEALTHY = "healthy"
# In a flexible casing, where DOP853 takes long: spalls of bearings, whose forces the casing feels, and faults
# of teeth and planets.
_IN_CASING = (
    *("outer_race_spall", "inner_race_spall", "rolling_element_spall", "wide_spall"),
    *("gear_tooth_crack", "gear_tooth_spall"),
    *("planet_tooth_crack", "planet_tooth_spall", "planet_position_error", "unequal_load_sharing"),
)
_PEAK_S = 0.006  # where in the window the fault does most
_BINS_S = 0.002
_EVERY = 3  # step that is compared


@dataclass(frozen=True)
class Accuracy:
    """Of one fault (or none) on one model.

    Attributes
    ----------
    model, kind, component : str
        `kind` is HEALTHY without a fault.
    error : float
        rms difference over rms, of the worst site.
    effect : float
        rms of what the fault changes over the rms of the healthy machine, of the site with the largest.
    """

    model: str
    kind: str
    component: str
    error: float
    effect: float


def kinds_on(model: str) -> tuple[str, ...]:
    """HEALTHY, and the kinds of fault that a model can have; in a flexible casing those of `_IN_CASING`."""
    plant = plant_of(model)
    tried = REGISTRY if plant.carrier is None else _IN_CASING
    return (HEALTHY, *(name for name in tried if REGISTRY[name].components(plant)))


def limit(kind: str) -> float:
    """Greatest error that is allowed."""
    return RATTLING.get(kind, LIMIT)


def all_cases() -> Iterator[tuple[str, str]]:
    """Every model with every kind."""
    for model in model_names():
        for kind in kinds_on(model):
            yield model, kind


def measure(model: str, kind: str = HEALTHY) -> Accuracy:
    """The accuracy of a model with a fault of its default parameters."""
    plant, load_nm = plant_of(model), load_for(model, kind)
    if kind == HEALTHY:
        course = Course(SECONDS, plant.limits.speed_hz, load_nm)
        return Accuracy(model, kind, "", _error(plant, course, ()), 0.0)
    component, fault, turns = _where_it_acts(plant, kind, load_nm)
    course = Course(SECONDS, plant.limits.speed_hz, load_nm, turns, growth_s=GROWTH_S)
    course = _for_films(course, (fault,))
    error = _error(plant, course, (fault,))
    normal = site_accelerations(plant, course, STEP_RATE_HZ)
    change = site_accelerations(plant, course, STEP_RATE_HZ, (fault,)) - normal
    effect = float(np.max(_rms(change) / _scale(normal)))
    return Accuracy(model, kind, component, error, effect)


def _for_films(course: Course, faults: Sequence[Fault]) -> Course:
    """A shorter course if there is an oil film, which is full grown at its start.

    Under a load a film is a spring of microseconds against its damper: DOP853 has to take steps of tenths of
    a microsecond, and a film that begins with no thickness at all has no time constant.
    """
    if not any(getattr(one, "what", None) is Term.FILM for fault in faults for one in fault.contributions):
        return course
    begin = _PEAK_S - 0.5 * FILM_SECONDS
    turns = course.turns + course.speed_hz * begin
    return replace(course, seconds=FILM_SECONDS, turns=turns, begin_s=-GROWTH_S, lead_s=2 * GROWTH_S)


def _error(plant: Plant, course: Course, faults: Sequence[Fault]) -> float:
    trajectory = run(plant, course, STEP_RATE_HZ, faults)
    steps = np.arange(1, trajectory.count - 1, _EVERY)
    truth = reference(trajectory, steps.astype(np.float64))
    return float(np.max(_rms(trajectory.accel[:, steps - 1] - truth) / _scale(truth)))


def _rms(values: Array) -> Array:
    return np.asarray(np.sqrt(np.mean(values**2, axis=1)))


def _scale(values: Array) -> Array:
    """rms of each site; a site that hardly moves counts as a hundredth of the liveliest."""
    size = _rms(values)
    return np.asarray(np.maximum(size, 0.01 * size.max()))


def _where_it_acts(plant: Plant, kind: str, load_nm: float) -> tuple[str, Fault, float]:
    """The component on which the fault does most, and the angle at which a window has to begin."""
    speed = plant.limits.speed_hz
    turn = Course(1.1 / speed, speed, load_nm)
    normal = site_accelerations(plant, turn, STEP_RATE_HZ)
    found: list[tuple[float, int, str, Fault]] = []
    for component in REGISTRY[kind].components(plant):
        fault = REGISTRY[kind].build(FaultSpec(kind, component), plant, SEED)
        change = site_accelerations(plant, turn, STEP_RATE_HZ, (fault,)) - normal
        effect = np.max((change / _scale(normal)[:, None]) ** 2, axis=0)
        size = round(_BINS_S * STEP_RATE_HZ)
        bins = effect[: effect.size // size * size].reshape(-1, size).mean(axis=1)
        bins[: round(_PEAK_S / _BINS_S)] = 0.0
        at = int(np.argmax(bins))
        found.append((float(bins[at]), at, component, fault))
    _, at, component, fault = max(found, key=lambda one: one[0])
    begin_s = (at + 0.5) * _BINS_S - _PEAK_S
    return component, fault, turn.turns + speed * begin_s
