"""Many variants of one machine at once, over one compiled kernel.

Variants are laid side by side in vector registers: each number of the time loop is an array over the
variants, so that the processor integrates as many of them as a register holds for little more than the
price of one. A variant gives what `Engine` gives for it, to rounding: the sums of the two loops have another
order. It does not depend on which other variants run beside it, nor on how the run is split into calls, to
the last bit. Variants in a flexible casing have an engine each (`ensemble_engines`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_sim.engine import MIN_STEP_RATE_HZ, Sites, check_numbers, checked_sites, first_schedule
from gearsim_sim.ensemble_engines import EngineRuns
from gearsim_sim.ensemble_parts import EnsembleOutput, Variant
from gearsim_sim.events import Clear, Event, FaultSpec, Inject, SetOperatingPoint
from gearsim_sim.integrate.vectors import LANES
from gearsim_sim.lane_group import Lane, LaneGroup
from gearsim_sim.lane_tables import TABLES, check_alike
from gearsim_sim.model.faults import fault_kind
from gearsim_sim.model.loop_data import NEED_RATES
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.plants import make_plant
from gearsim_sim.profile.profile import constant_profile
from gearsim_sim.stepper import Stepper
from gearsim_sim.timeline import Timeline

__all__ = ["Ensemble", "EnsembleOutput", "Variant"]

Array = NDArray[np.float64]
_Result = TypeVar("_Result")


class Ensemble:
    """Integrates variants of one machine.

    Variants may differ in every physical number, in the seed of their gears' errors, in faults and in
    operating point; they must have the same structure: degrees of freedom, tracks, bearings of as many
    rolling elements. Variants whose linear systems are equal (those that differ in seed, faults, clearance
    or operating point) run faster, because they share their modes.

    Parameters
    ----------
    variants : sequence of Variant
        Or of tuples (params, seed, faults, speed_hz, load_nm).
    sample_rate_hz, oversampling, sites
        As of `Engine`; the same for all variants.
    workers : int
        Threads; each integrates groups of `LANES` variants.

    Raises
    ------
    InputError
        For anything out of its range, naming it, and for faults that only the single engine can do.
    """

    def __init__(
        self,
        variants: Sequence[Variant | tuple[Any, int, Sequence[FaultSpec], float | None, float | None]],
        sample_rate_hz: float = 65536.0,
        oversampling: int = 4,
        *,
        sites: Sites | None = None,
        workers: int = 1,
    ) -> None:
        check_numbers(0, sample_rate_hz, oversampling)
        if not variants:
            raise InputError("ensemble", "variants", "none", "at least one variant")
        if workers < 1:
            raise InputError("ensemble", "workers", workers, "at least one thread")
        self.variants = tuple(Variant(*one) for one in variants)
        self.sample_rate_hz = float(sample_rate_hz)
        self._steps = max(oversampling, math.ceil(MIN_STEP_RATE_HZ / sample_rate_hz))
        self._sites = sites
        self._workers = workers
        self._next = 0
        self._tables: set[str] = set()
        self._lanes: tuple[Lane, ...] = ()
        self._engines: EngineRuns | None = None
        for variant in self.variants:
            check_numbers(variant.seed, sample_rate_hz, oversampling)
        first = self.variants[0]
        if make_plant(first.params, first.seed).carrier is not None:
            self._engines = EngineRuns(self.variants, self.sample_rate_hz, oversampling, sites, workers)
            self.site_names = self._engines.site_names
            return
        lanes = []
        for number, variant in enumerate(self.variants):
            lanes.append(self._lane(number, variant))
            check_alike(number, lanes[number].stepper.data, lanes[0].stepper.data)
        self._lanes = tuple(lanes)
        order = _by_system([lane.plant for lane in lanes])
        self._members = [order[i : i + LANES] for i in range(0, len(order), LANES)]
        self._rates = bool(self._tables & set(NEED_RATES))
        self._groups = [
            LaneGroup([lanes[i] for i in own], self._steps, rates=self._rates) for own in self._members
        ]
        self._each_group(LaneGroup.settle)

    def _lane(self, number: int, variant: Variant) -> Lane:
        plant = make_plant(variant.params, variant.seed)
        if plant.carrier is not None:
            expected = "a machine on the ground, as the first one is"
            raise InputError("ensemble", f"variants.{number}", plant.name, expected)
        timeline = Timeline(plant, variant.seed, self.sample_rate_hz, self._steps)
        limits = plant.limits
        speed_hz = timeline.checked_speed(limits.speed_hz if variant.speed_hz is None else variant.speed_hz)
        load_nm = timeline.checked_load(limits.load_nm if variant.load_nm is None else variant.load_nm)
        for spec in variant.faults:
            self._tables |= _check_fault(number, spec, plant, variant.seed)
        course = constant_profile(plant, 1.0 / (self.sample_rate_hz * self._steps), speed_hz, load_nm)
        schedule = first_schedule(plant, timeline, self._steps, course, variant.faults)
        sites = checked_sites(plant.sites if self._sites is None else self._sites, plant.system.dof_names)
        self.site_names = tuple(sites)
        return Lane(plant, timeline, schedule, Stepper(plant, schedule, sites, self._steps))

    def _each_group(self, work: Callable[[LaneGroup], _Result]) -> list[_Result]:
        """`work` for all groups, by the threads."""
        if self._workers == 1 or len(self._groups) == 1:
            return [work(group) for group in self._groups]
        with ThreadPoolExecutor(self._workers) as pool:
            return list(pool.map(work, self._groups))

    @property
    def shaft_names(self) -> tuple[str, ...]:
        """Names of the shafts whose encoders are put out."""
        if self._engines is not None:
            return self._engines.shaft_names
        return tuple(self._lanes[0].plant.encoders)

    @property
    def next_sample(self) -> int:
        """Index of the first sample that the next `advance` returns."""
        return self._next if self._engines is None else self._engines.next_sample

    @property
    def earliest_event_sample(self) -> int:
        """Earliest `at_sample` that an event may have now, see `Engine.earliest_event_sample`."""
        if self._engines is not None:
            return self._engines.earliest_event_sample
        return max(0, -(-self._groups[0].step // self._steps))

    def advance(self, n: int) -> EnsembleOutput:
        """The next `n` samples; the split into calls changes no bit.

        Raises
        ------
        FloatingPointError
            If a motion is no longer finite, which no accepted input should bring about.
        """
        if n < 1:
            raise InputError("ensemble", "n", n, "at least one sample")
        if self._engines is not None:
            return self._engines.advance(n)
        rows = self._lanes[0].stepper.row_count
        accel = np.empty((len(self._lanes), rows, n))
        places, start = {}, 0
        for group, own in zip(self._groups, self._members, strict=True):
            places[group] = accel[start : start + len(own)]
            start += len(own)
        motions = self._each_group(lambda group: group.advance(places[group]))
        order = np.argsort([i for own in self._members for i in own])
        if not np.all(np.isfinite(accel)):
            raise FloatingPointError(f"a motion became infinite before sample {self._next + n}")
        first = self._next
        self._next += n
        turns = np.concatenate([motion.turns for motion in motions])[order]
        values = np.concatenate([motion.values for motion in motions])[order]
        shafts = turns.shape[1]
        return EnsembleOutput(
            first_sample=first,
            site_names=self.site_names,
            accel=accel[order][:, self._lanes[0].stepper.site_rows],
            shaft_names=self.shaft_names,
            turns=turns,
            fraction=values[:, :shafts],
            speed_hz=values[:, shafts : 2 * shafts],
            signal_names=tuple(self._lanes[0].plant.signals),
            signals=values[:, 2 * shafts :],
        )

    def set_operating_point(
        self,
        variant: int,
        speed_hz: float | None = None,
        load_nm: float | None = None,
        ramp_s: float = 1.0,
        at_sample: int | None = None,
    ) -> int:
        """Schedule a change for one variant, see `Engine.set_operating_point`."""
        return self.schedule(variant, SetOperatingPoint(speed_hz, load_nm, ramp_s, at_sample))

    def inject(
        self, variant: int, fault: FaultSpec, ramp_s: float = 0.1, at_sample: int | None = None
    ) -> int:
        """Schedule a fault of one variant, see `Engine.inject`."""
        return self.schedule(variant, Inject(fault, ramp_s, at_sample))

    def clear(
        self, variant: int, fault_id: str = "", ramp_s: float = 0.1, at_sample: int | None = None
    ) -> int:
        """Schedule the end of a fault of one variant (all if empty), see `Engine.clear`."""
        return self.schedule(variant, Clear(fault_id, ramp_s, at_sample))

    def schedule(self, variant: int, event: Event) -> int:
        """Schedule any event of one variant; returns its sample.

        Raises
        ------
        InputError
            If its sample is history, or a value is out of range.
        """
        if not 0 <= variant < len(self.variants):
            raise InputError("ensemble", "variant", variant, f"0 to {len(self.variants) - 1}")
        if self._engines is not None:
            return self._engines.schedule(variant, event)
        lane = self._lanes[variant]
        if isinstance(event, Inject):
            tables = _check_fault(variant, event.fault, lane.plant, self.variants[variant].seed)
            if not self._rates and tables & set(NEED_RATES):
                expected = "another kind: this one must be in a variant from the start, if only at severity 0"
                raise InputError("ensemble", "fault.kind", event.fault.kind, expected)
        sample = lane.timeline.add(event, self.earliest_event_sample)
        for group in self._groups:
            group.look_again()
        return sample


def _check_fault(number: int, spec: FaultSpec, plant: Plant, seed: int) -> set[str]:
    """Tables of a fault; InputError for one that works by what the ensemble's loop does not have."""
    tables = {one.table for one in fault_kind(spec.kind).build(spec, plant, seed).contributions}
    if not tables <= set(TABLES):
        expected = "a fault of bearings or teeth; others need the single engine"
        raise InputError("ensemble", f"variants.{number}.faults", spec.kind, expected)
    return tables


def _by_system(plants: Sequence[Plant]) -> list[int]:
    """Variants with equal linear systems next to each other, else in order."""
    first: dict[bytes, int] = {}
    ranks = []
    for number, plant in enumerate(plants):
        system = plant.system
        arrays = (system.mass, system.damping, system.stiffness, system.interfaces, system.inputs)
        key = b"".join(array.tobytes() for array in arrays)
        ranks.append(first.setdefault(key, number))
    return sorted(range(len(plants)), key=lambda number: (ranks[number], number))
