"""Makes the records of a case: machine, effects, operation, sensors; and the truth about them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blind import motion
from blind.build import Build
from blind.chain import measured, pulses
from blind.draws import low_noise
from blind.effects import EFFECTS
from blind.rigs import RIGS, Rig
from gearsim_io.bags.stream import StreamWriter
from gearsim_io.bags.writer import BagWriter
from gearsim_io.machines import load_machine, read_machine_file
from gearsim_io.record import PulseTrain, Record, Torques
from gearsim_sim.events import FaultSpec
from gearsim_sim.model.faults import REGISTRY
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.plants import make_plant
from gearsim_sim.models import parameters
from gearsim_sim.scenario import Scenario, parse_scenario

Array = NDArray[np.float64]
_PULSE_JITTER = 0.02  # samples
_T0_NS = 1_700_000_000_000_000_000
_DRIVE = 5e-5  # rms of what a good drive lets its speed wander within a record
_LIGHT = 0.06  # of the nominal load, at which teeth with play rattle
_MISUSE = {"backlash_contact_loss"}
_LEARNT = 2  # records of a case that are not held out
_HEALTHY = 100  # number of the first record without effects: noise and course of its own
# The last motion: to look at many effects of the measuring chain, a machine need run only once.
_motions: dict[str, Array] = {}


@dataclass(frozen=True)
class Hidden:
    """What is hidden in a case, and how much of it: pairs of an effect's name and its size.

    `noise` is the sensors' over the rig's ordinary one.
    """

    rig: str
    effects: tuple[tuple[str, float], ...]
    noise: float = 1.0


@dataclass(frozen=True, eq=False)
class _Streams:
    """Random numbers of a record, so that an effect does not change the noise that it is measured with."""

    course: np.random.Generator
    effects: np.random.Generator
    noise: np.random.Generator


@dataclass(frozen=True, eq=False)
class Made:
    """Records of a case: two to train on and one held out, the truth, and records without the effects."""

    records: tuple[Record, ...]
    truth: dict[str, Any]
    healthy: tuple[Record, ...] = ()


@dataclass(frozen=True, eq=False)
class _Machine:
    """One machine on its rig: how it was made, under what load it runs, and the gains of its sensors."""

    build: Build
    plant: Plant
    extras_of: Any
    load: float
    light: bool
    gains: Array

    def run(self, number: int, seed: tuple[int, ...], seconds: float) -> Record:
        """One of its records."""
        streams = _Streams(*(np.random.default_rng([*seed, 1 + number, k]) for k in range(3)))
        extras = self.extras_of(streams.effects)
        return _record(self.build, self.plant, extras, self.load, self.light, self.gains, streams, seconds)


def make(
    case: Hidden, seed: tuple[int, ...], records: int = 3, seconds: float | None = None, healthy: int = 0
) -> Made:
    """All records of one machine with its effects, and some of it without them.

    Parameters
    ----------
    case : Hidden
    seed : tuple of int
        Of everything: the same gives the same records.
    records : int
    seconds : float, optional
        In place of the rig's.
    healthy : int
        Records of the same machine and sensors in other runs, before it had the effects.
    """
    rig = RIGS[case.rig]
    long = seconds or rig.seconds
    machine = _machine(case, seed)
    made = [machine.run(number, seed, long) for number in range(records)]
    before = _machine(replace(case, effects=()), seed) if healthy else machine
    sound = [before.run(_HEALTHY + number, seed, long) for number in range(healthy)]
    build = machine.build
    ran_hz = float(np.mean([build.ran_hz[k] for k in range(min(_LEARNT, records))]))
    for truth in build.truths:
        stated = truth.pop("stated_hz", None)
        if stated:  # a run is the speed that it had, and no mean of all runs
            told = truth["parameters"]
            told |= {key: ran_hz / stated if key == "speed_ratio" else ran_hz for key in told}
        limits = truth.pop("limits", None)
        if limits:
            truth["parameters"]["range_m_s2"] = float(min(limits.values()))
    truth = {
        "rig": rig.name,
        "machine": build.machine or rig.machine,
        "effects": [dict(one, size=size) for one, (_, size) in zip(build.truths, case.effects, strict=True)],
        "parameters": dict(build.parameters.items()),
        "speed_hz": build.speed_hz,
    }
    return Made(tuple(made), truth, tuple(sound))


def _machine(case: Hidden, seed: tuple[int, ...]) -> _Machine:
    """The machine of a seed: the same with any effects, but for these."""
    rig = RIGS[case.rig]
    rng = np.random.default_rng([*seed, 0])
    made_by = int(rng.integers(1, 1 << 31))
    gains = np.exp(0.01 * rng.standard_normal(len(rig.channels)))
    load = rig.load_nm * math.exp(0.01 * rng.standard_normal())
    build = build_of(case, rng)
    plant, extras_of = place_in(build, made_by)
    light = any(name in _MISUSE for name, _ in case.effects)
    return _Machine(build, plant, extras_of, load * (_LIGHT if light else 1.0), light, gains)


def build_of(case: Hidden, rng: np.random.Generator) -> Build:
    """A machine as it was made, some per cent off its description, with the effects entered."""
    rig = RIGS[case.rig]
    build = Build(rig, rng)
    build.parameters |= _perturbed(rig, rng)
    build.noise = case.noise
    base = int(rng.integers(1 << 31))
    for name, size in case.effects:
        # Random numbers of its own, so that an effect is the same alone and beside another.
        build.rng = np.random.default_rng([base, *name.encode()])
        EFFECTS[name].enter(build, size)
    return build


def write(made: Made, folder: Path) -> list[Path]:
    """Each record as a bag; names and notes tell nothing. Those without effects are `before_1` and so on."""
    machine = load_machine(RIGS[made.truth["rig"]].machine)
    for name, records in (("run", made.records), ("before", made.healthy)):
        for number, record in enumerate(records):
            with BagWriter(folder / f"{name}_{number + 1}", {}, sync_period_s=None) as writer:
                stream = StreamWriter(writer)
                stream.write(machine, record.t0_ns)
                for batch in record.batches():
                    stream.write(batch)
    return [folder / f"run_{number + 1}" for number in range(len(made.records))]


def _perturbed(rig: Rig, rng: np.random.Generator) -> dict[str, Any]:
    """The machine as it was built: numbers some per cent off."""
    content = read_machine_file(rig.machine)[1]["model"]
    found: dict[str, Any] = {}
    for name, spread in rig.spread.items():
        number: Any = content
        for part in name.split("."):
            number = number[part]
        value = float(number["value"]) * math.exp(spread * rng.standard_normal())
        found[name] = {"value": value, "unit": number["unit"]}
    return found


def _scenario(rig: Rig, machine: str, changes: dict[str, Any]) -> Scenario:
    content = {
        "machine": machine,
        "model": rig.model,
        "operating_point": {"speed": f"{rig.speed_hz} Hz", "load": f"{rig.load_nm} N*m"},
        **changes,
    }
    return parse_scenario(content, Path("blind.yaml"))


def place_in(build: Build, seed: int) -> tuple[Plant, Any]:
    """The plant with its structure, and for each record what effects add."""
    rig, machine = build.rig, build.machine or build.rig.machine
    unit = {"mass": "kg", "frequency": "Hz"}

    def listed(entries: list[dict[str, Any]]) -> list[dict[str, Any]]:
        return [
            {key: f"{value:.12g} {unit[key]}" if key in unit else value for key, value in one.items()}
            for one in entries
        ]

    structure = {"resonances": listed(build.resonances), "paths": listed(build.paths)}
    scenario = _scenario(rig, machine, {"parameters": build.parameters, "structure": structure})
    plant = scenario.operation.machine(make_plant(parameters(scenario), seed))
    contributions: list[Any] = []
    for kind, component, params in build.faults:
        fault = REGISTRY[kind].build(FaultSpec(kind, component, params), plant, seed)
        contributions += fault.contributions

    def extras_of(rng: np.random.Generator) -> motion.Extras:
        lags = {}
        for name, lagging in build.lags.items():
            index = next(i for i, seat in enumerate(plant.bearings) if seat.name == name)
            lags[index] = lagging(rng)
        forces = []
        for names, force in build.forces:
            column = int(names[""]) if "" in names else -1
            direction = plant.system.inputs[:, column] if column >= 0 else plant.system.direction(names)

            def at(seconds: Array, turns: Array, force: Any = force) -> Array:
                return np.asarray(force(seconds, turns, rng))

            forces.append((np.asarray(direction, dtype=np.float64), at))
        return motion.Extras(tuple(contributions), lags, tuple(forces))

    return plant, extras_of


def _record(
    build: Build,
    plant: Plant,
    extras: motion.Extras,
    load: float,
    light: bool,
    gains: Array,
    rng: _Streams,
    seconds: float,
) -> Record:
    rig = build.rig
    rate = rig.rate_hz * rig.steps
    lead = motion.lead_steps(1 / rate)
    halves = 2 * (lead + round(seconds * rig.rate_hz) * rig.steps) + 1
    # The drive holds its speed within some parts in a thousand from run to run, and within a run even closer.
    mean = build.speed_hz * (1 + 0.003 * rng.course.uniform(-1, 1))
    speed = mean * (1 + _DRIVE * low_noise(halves, 2 * rate, 2.0, rng.course))
    if build.swing:
        speed += mean * build.swing * low_noise(halves, 2 * rate, build.swing_hz, rng.effects)
    turns = rng.course.uniform(0, 40) + (np.cumsum(speed) - speed) / (2 * rate)
    load_nm = np.full(halves, load * (1 + 0.003 * rng.course.uniform(-1, 1)))
    if build.load_rms_nm:
        load_nm += build.load_rms_nm * low_noise(halves, 2 * rate, build.load_hz, rng.effects)
    course = motion.Course(1 / rate, turns, speed, load_nm)
    key = _same_motion(build, load, seconds, mean, turns)
    if key not in _motions:
        _motions.clear()
        _motions[key] = motion.run(plant, course, extras, rig.channels)
    accel = _motions[key]
    data = measured(build, accel, rng.effects, rng.noise, gains)
    at_samples = turns[2 * lead : -1 : 2 * rig.steps][: data.shape[1]]
    build.ran_hz.append(float(at_samples[-1] - at_samples[0]) / (at_samples.size - 1) * rig.rate_hz)
    tachos: tuple[PulseTrain, ...] = ()
    if build.tacho_factor:
        shaft = next(track for track in plant.tracks if track.name == rig.tacho)
        place = pulses(shaft.rate * at_samples, rig.pulses * build.tacho_factor, _PULSE_JITTER, rng.noise)
        tachos = (PulseTrain(rig.tacho, float(rig.pulses), place),)
    torques = _torque(load_nm[2 * lead : -1 : 2 * rig.steps][: data.shape[1]], rng.noise) if light else None
    return Record(
        sample_rate_hz=rig.rate_hz,
        channels=rig.channels,
        unit="m/s^2",
        data=data,
        tachos=tachos,
        t0_ns=_T0_NS,
        machine=rig.machine,
        torques=torques,
    )


def _same_motion(build: Build, load: float, seconds: float, mean: float, turns: Array) -> str:
    """What the motion hangs on; effects of the measuring chain leave it as it is."""
    machine = (build.rig.name, build.machine, build.parameters, build.resonances, build.paths, build.faults)
    operation = (load, seconds, mean, float(turns[0]), build.swing, build.load_rms_nm)
    alive = (id(build), len(build.lags), len(build.forces)) if build.lags or build.forces else ()
    return repr((machine, operation, alive))


def _torque(load_nm: Array, rng: np.random.Generator) -> Torques:
    """A transducer in the output shaft."""
    noisy = load_nm + 0.02 * rng.standard_normal(load_nm.size)
    return Torques(("output_torque",), noisy.astype(np.float32)[None, :])
