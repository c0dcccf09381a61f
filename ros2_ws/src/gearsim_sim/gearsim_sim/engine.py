"""The engine: parameters and a seed in, accelerations and shaft angles out, in any portions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_sim.carrying import needed_sites
from gearsim_sim.events import Clear, Event, FaultSpec, Inject, SetOperatingPoint
from gearsim_sim.integrate.decimate import HALF_LENGTH_SAMPLES, decimate, padded_taps
from gearsim_sim.model.assembly import Vector
from gearsim_sim.model.plant import Plant, RotatingSite
from gearsim_sim.model.plants import make_plant
from gearsim_sim.model.rotating_force import RotatingForce
from gearsim_sim.operation import Operation
from gearsim_sim.profile.profile import Profile
from gearsim_sim.schedule import REBASE_STEPS, ActiveFault, Schedule, Severity
from gearsim_sim.stepper import Motion, Stepper
from gearsim_sim.timeline import Timeline

MIN_OVERSAMPLING, MAX_OVERSAMPLING = 2, 256
# Below this rate of integration the scheme loses accuracy; slow sample rates get more steps per sample.
MIN_STEP_RATE_HZ = 131072.0
MIN_RATE_HZ, MAX_RATE_HZ = 100.0, 1e6
SETTLING_S = 0.5
_START_TURNS = 0.5  # so that whole turns of both shafts start from 0
_BLOCK_SAMPLES = 2048

Sites = Mapping[str, Vector | RotatingSite]
PROBED = ("displacement_m", "force_n")


def probe_names(plant: Plant) -> tuple[str, ...]:
    """Further outputs that an engine can give: of each interface `PROBED`."""
    return tuple(f"{name}.{what}" for name in plant.system.interface_names for what in PROBED)


@dataclass(frozen=True, slots=True, eq=False)
class EngineOutput:
    """`n` output samples; sample `first_sample + i` is at time (first_sample + i) / sample_rate_hz.

    Accelerations are filtered (linear phase, delay removed), angles and speeds are the state itself
    at that time: all on one time axis.
    """

    first_sample: int
    site_names: tuple[str, ...]
    accel: NDArray[np.float64]  # (sites, n) [m/s^2]
    shaft_names: tuple[str, ...]
    turns: NDArray[np.int64]  # (shafts, n) whole turns of each shaft's encoder, from 0 on
    fraction: NDArray[np.float64]  # (shafts, n) rest of the angle in turns, [0, 1)
    speed_hz: NDArray[np.float64]  # (shafts, n) d(angle)/dt in turns per second
    signals: Mapping[str, NDArray[np.float64]] = field(
        default_factory=dict
    )  # name -> (n,) of `Plant.signals`
    probes: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)  # name -> (n,)
    forces: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)  # on a casing, filtered

    @property
    def sample_count(self) -> int:
        """Samples per site."""
        return int(self.accel.shape[1])


class Engine:
    """Integrates a machine; owns all dynamic state.

    A run starts from static equilibrium at speed and settles for 0.5 s before sample 0. The output is
    bitwise the same however it is split into calls, and depends on `seed` and the events only.

    Parameters
    ----------
    params : parameters of a machine
        Such as those of `gearsim_sim.params.load_parallel_params`; any key of `model.plants.MAKERS`.
    seed : int
        Of the gears' pitch and surface errors, >= 0.
    sample_rate_hz : float
        Rate of the output samples, 100 Hz to 1 MHz.
    oversampling : int
        Integration steps per output sample, 2 to 256. Low sample rates get more steps by themselves.
    faults : sequence of FaultSpec
        Present at full severity from the start.
    speed_hz, load_nm : float, optional
        Operating point at the start (default: that of the parameters).
    sites : mapping, optional
        Name of each site and its linear combination of degrees of freedom
        (`{"b3_y": {"y_p3": 1.0}}`); default: those of the machine (pedestals b1_x, b1_y ... b4_y).
    probes : sequence of str
        Further outputs out of `probe_names`: displacement of a bearing or of a mesh (without
        transmission error), contact force of the shaft on the pedestal, force of the mesh.
    forces : bool
        Whether the bearings' forces on a flexible casing are put out, those of dampers included.
    operation : Operation, optional
        Operating profile, ripple and added structure; without it speed and load change by events only.
    looked_at : sequence of str, optional
        Sites that matter; in a flexible casing, where each takes time, no others are put out (if none, one).
    settling : bool
        Whether samples begin at rest, before sample 0; see `next_sample`.

    Raises
    ------
    InputError
        For anything out of its range, naming it.
    """

    def __init__(
        self,
        params: Any,
        seed: int,
        sample_rate_hz: float,
        oversampling: int = 4,
        faults: Sequence[FaultSpec] = (),
        *,
        speed_hz: float | None = None,
        load_nm: float | None = None,
        sites: Sites | None = None,
        probes: Sequence[str] = (),
        forces: bool = False,
        operation: Operation | None = None,
        looked_at: Sequence[str] | None = None,
        settling: bool = False,
    ) -> None:
        check_numbers(seed, sample_rate_hz, oversampling)
        self.params = params
        self.sample_rate_hz = float(sample_rate_hz)
        self._steps = max(oversampling, math.ceil(MIN_STEP_RATE_HZ / sample_rate_hz))
        self._operation = Operation() if operation is None else operation
        self.plant = self._operation.machine(make_plant(params, seed))
        self._timeline = Timeline(self.plant, seed, self.sample_rate_hz, self._steps)
        limits = self.plant.limits
        if speed_hz is None and self._operation.profile.trace is None:
            speed_hz = limits.speed_hz
        if speed_hz is not None:
            speed_hz = self._timeline.checked_speed(speed_hz)
        load_nm = self._timeline.checked_load(limits.load_nm if load_nm is None else load_nm)
        wanted = needed_sites(self.plant, looked_at) if sites is None else sites
        self._sites = checked_sites(wanted, self.plant.system.dof_names)
        self._probes = tuple(probes)
        self._probe_names = probe_names(self.plant)
        for name in self._probes:
            if name not in self._probe_names:
                raise InputError("engine", "probes", name, "one of " + ", ".join(self._probe_names))
        self._forces = forces
        self._prepare(seed, speed_hz, load_nm, faults)
        self._settle(1 - int(SETTLING_S * sample_rate_hz) if settling else 0)
        self.warm_up()

    def _prepare(
        self, seed: int, speed_hz: float | None, load_nm: float, faults: Sequence[FaultSpec]
    ) -> None:
        """Static equilibrium at the step where settling begins."""
        step_rate_hz = self.sample_rate_hz * self._steps
        course = self._operation.course(self.plant, 1.0 / step_rate_hz, speed_hz, load_nm, seed)
        forces = self._operation.forces(self.plant)
        self._schedule = first_schedule(self.plant, self._timeline, self._steps, course, faults, forces)
        outputs = {"probed": bool(self._probes), "forces": self._forces}
        self._stepper = Stepper(self.plant, self._schedule, self._sites, self._steps, **outputs)
        self._taps = padded_taps(self._steps)
        columns = (2 * HALF_LENGTH_SAMPLES + _BLOCK_SAMPLES) * self._steps + self._taps.size
        self._accel = np.zeros((self._stepper.row_count, columns))

    def _settle(self, first: int) -> None:
        """Run up to the step before the one where the filter of sample `first` begins."""
        self._motions: list[Motion] = []
        self._next = first
        last = (first - HALF_LENGTH_SAMPLES) * self._steps - 1
        while True:
            self._base_step = self._stepper.step + 1  # step of column 0
            if self._stepper.step >= last:
                break
            self._integrate(min(last, self._stepper.step + _BLOCK_SAMPLES * self._steps))
        self._motions.clear()
        self._motion_sample = first - HALF_LENGTH_SAMPLES

    @property
    def site_names(self) -> tuple[str, ...]:
        """Names of the acceleration outputs, in order."""
        return tuple(self._sites)

    @property
    def shaft_names(self) -> tuple[str, ...]:
        """Names of the shafts whose encoders are put out."""
        return tuple(self.plant.encoders)

    @property
    def next_sample(self) -> int:
        """Index of the first sample that the next `advance` returns."""
        return self._next

    @property
    def lookahead_samples(self) -> int:
        """How far the state runs ahead of the returned samples: half of the filter's length."""
        return HALF_LENGTH_SAMPLES

    @property
    def earliest_event_sample(self) -> int:
        """Earliest `at_sample` that an event may have now.

        The linear-phase filter looks `lookahead_samples` ahead of what it returns, so the state at the
        samples before this one is history.
        """
        return max(0, -(-self._stepper.step // self._steps))

    @property
    def operating_point(self) -> tuple[float, float]:
        """Speed [Hz] and load [N m] that the present profile leads to."""
        profile = self._schedule.profile
        return profile.speed_hz.final_value(), profile.load_nm.final_value()

    @property
    def steady(self) -> bool:
        """Whether speed and load change by events only."""
        return self._schedule.profiles[0][1].constant

    def operating_point_at(self, sample: int) -> tuple[float, float]:
        """Speed of the reference shaft [Hz] and load [N m] at a sample that has been handed out."""
        return self._schedule.operating_point(sample * self._steps)

    def warm_up(self, *, events: bool = False) -> None:
        """Compile what `advance` uses; the constructor has done so already.

        With `events` also what only events bring (a stream should call this before it starts).
        """
        if events:
            self._stepper.compile_all()
        decimate(self._accel, 0, self._taps, self._steps, np.empty((self._accel.shape[0], 1)), 0, 1)

    def advance(self, n: int, events: Sequence[Event] = ()) -> EngineOutput:
        """The next `n` samples; `events` are scheduled first. The split into calls changes no bit.

        Raises
        ------
        InputError
            If an event is not acceptable.
        FloatingPointError
            If the motion is no longer finite, which no accepted input should bring about.
        """
        if n < 1:
            raise InputError("engine", "n", n, "at least one sample")
        for event in events:
            self.schedule(event)
        accel = np.empty((self._accel.shape[0], n))
        done = 0
        while done < n:
            count = min(n - done, _BLOCK_SAMPLES)
            sample = self._next + done
            self._integrate((sample + count - 1 + HALF_LENGTH_SAMPLES) * self._steps)
            column = (sample - HALF_LENGTH_SAMPLES) * self._steps - self._base_step
            decimate(self._accel, column, self._taps, self._steps, accel, done, count)
            done += count
        if not np.all(np.isfinite(accel)):
            raise FloatingPointError(f"the motion became infinite before sample {self._next + n}")
        pushes = accel[self._stepper.row_count - len(self._stepper.force_names) :]
        if self._stepper.row_count != len(self._sites):
            accel = accel[self._stepper.site_rows]
        return self._output(accel, pushes, self._take_motions(n))

    def _output(self, accel: NDArray[np.float64], pushes: Any, motion: Motion) -> EngineOutput:
        first = self._next
        self._next += accel.shape[1]
        values = {
            name: (motion.displacements if i % 2 == 0 else motion.forces)[i // 2]
            for i, name in enumerate(self._probe_names)
            if name in self._probes
        }
        return EngineOutput(
            first_sample=first,
            site_names=self.site_names,
            accel=accel,
            shaft_names=self.shaft_names,
            turns=motion.turns,
            fraction=motion.fraction,
            speed_hz=motion.speed_hz,
            signals=dict(zip(self.plant.signals, motion.signals, strict=True)),
            probes=values,
            forces=dict(zip(self._stepper.force_names, pushes, strict=True)),
        )

    def _integrate(self, to_step: int) -> None:
        """Advance to a step, stopping where something changes."""
        self._make_room(to_step)
        stepper = self._stepper
        while stepper.step < to_step:
            step = stepper.step
            self._schedule.go_on(step)
            self._timeline.apply(self._schedule, step)
            if step % REBASE_STEPS == 0:
                self._schedule.rebase(step)
            stop = min(to_step, (step // REBASE_STEPS + 1) * REBASE_STEPS)
            for change in (self._timeline.next_step, self._schedule.change_step):
                stop = stop if change is None else min(stop, change)
            self._motions.append(stepper.advance(stop - step, self._accel, step + 1 - self._base_step))

    def _make_room(self, to_step: int) -> None:
        """Move what the filter still needs to the front of the buffer when the end would be passed."""
        width = self._accel.shape[1] - self._taps.size
        if to_step - self._base_step < width:
            return
        keep_from = (self._next_kept()) * self._steps - HALF_LENGTH_SAMPLES * self._steps
        shift = keep_from - self._base_step
        used = self._stepper.step + 1 - self._base_step
        self._accel[:, : used - shift] = self._accel[:, shift:used].copy()
        self._base_step = keep_from

    def _next_kept(self) -> int:
        """First sample whose filter window is still needed: the one after the last that was complete."""
        return max(self._stepper.step // self._steps - HALF_LENGTH_SAMPLES + 1, self._next)

    def _take_motions(self, count: int) -> Motion:
        """The states of the next `count` samples out of those gathered."""
        parts = [[getattr(motion, name) for motion in self._motions] for name in Motion.__slots__]
        joined = [np.concatenate(part, axis=1) for part in parts]
        skip = self._next - self._motion_sample
        self._motions = [Motion(*(array[:, skip + count :] for array in joined))]
        self._motion_sample = self._next + count
        return Motion(*(np.ascontiguousarray(array[:, skip : skip + count]) for array in joined))

    def set_operating_point(
        self,
        speed_hz: float | None = None,
        load_nm: float | None = None,
        ramp_s: float = 1.0,
        at_sample: int | None = None,
    ) -> int:
        """Schedule a change; returns the sample at which the ramp starts (None: the earliest possible).

        The ramp has no jump of acceleration. It is lengthened to 10 ms, and where the drive's torque
        would not do. None keeps the speed or load that the latest begun ramp leads to.
        """
        return self.schedule(SetOperatingPoint(speed_hz, load_nm, ramp_s, at_sample))

    def inject(self, fault: FaultSpec, ramp_s: float = 0.1, at_sample: int | None = None) -> int:
        """Schedule a fault; returns the sample at which it starts to grow (over 10 ms at least).

        A fault that runs under the same name may be injected again with another severity only.
        """
        return self.schedule(Inject(fault, ramp_s, at_sample))

    def clear(self, fault_id: str = "", ramp_s: float = 0.1, at_sample: int | None = None) -> int:
        """Schedule the end of a fault (all if empty); returns the sample at which it starts to shrink."""
        return self.schedule(Clear(fault_id, ramp_s, at_sample))

    def schedule(self, event: Event) -> int:
        """Schedule any event; returns its sample.

        Raises
        ------
        InputError
            If its sample is history, or a value is out of range.
        """
        return self._timeline.add(event, self.earliest_event_sample)


def first_schedule(
    plant: Plant,
    timeline: Timeline,
    steps_per_sample: int,
    course: Profile,
    faults: Sequence[FaultSpec],
    forces: Sequence[RotatingForce] = (),
) -> Schedule:
    """Operating profile and faults from the step on where settling begins."""
    first = -HALF_LENGTH_SAMPLES * steps_per_sample - math.ceil(SETTLING_S / course.step_s)
    schedule = Schedule(plant, course, first, _START_TURNS - course.turns_between(first, 0), forces)
    for spec in faults:
        fault = timeline.initial_fault(spec, first)
        severity = Severity(fault.severity, fault.severity, first, 0.0)
        schedule.faults[spec.name] = ActiveFault(fault, severity, schedule.new_serial())
    return schedule


def check_numbers(seed: int, sample_rate_hz: float, oversampling: int) -> None:
    """InputError unless an engine can have these."""
    if seed < 0:
        raise InputError("engine", "seed", seed, ">= 0")
    if not MIN_RATE_HZ <= sample_rate_hz <= MAX_RATE_HZ:
        expected = f"{MIN_RATE_HZ:g} to {MAX_RATE_HZ:g} Hz"
        raise InputError("engine", "sample_rate_hz", sample_rate_hz, expected)
    if not MIN_OVERSAMPLING <= oversampling <= MAX_OVERSAMPLING or oversampling != int(oversampling):
        expected = f"a whole number from {MIN_OVERSAMPLING} to {MAX_OVERSAMPLING}"
        raise InputError("engine", "oversampling", oversampling, expected)


def checked_sites(sites: Sites, dofs: tuple[str, ...]) -> dict[str, Vector | RotatingSite]:
    """The sites, if these degrees of freedom make them up."""
    if not sites:
        raise InputError("engine", "sites", "none", "at least one site")
    for name, site in sites.items():
        for vector in (site.x, site.y) if isinstance(site, RotatingSite) else (site,):
            unknown = [dof for dof in vector if dof not in dofs]
            if unknown or not any(vector.values()):
                expected = "a combination of degrees of freedom out of " + ", ".join(dofs)
                raise InputError("engine", f"sites.{name}", unknown or vector, expected)
    return dict(sites)
