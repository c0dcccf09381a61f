"""Records of shipped machines, simulated once for all tests that look at them."""

from __future__ import annotations

import copy
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from gearsim_io.machines import load_machine, machine_file
from gearsim_io.record import PulseTrain, Record
from gearsim_sim.scenario import parse_scenario
from gearsim_sim.simulation import to_record
from gearsim_twin.case import Case, make_case

RATE_HZ = 8192.0
PARALLEL: dict[str, Any] = {
    "machine": "unsw_parallel",
    "model": "lpm34",
    "sample_rate": "8192 Hz",
    "operating_point": {"speed": "9.9 Hz", "load": "40 N*m"},
    "sensors": {
        "accelerometers": {"channels": ["b1_y", "b3_y"]},
        "encoders": {"shafts": []},
        "torques": {"shafts": ["input"]},
    },
}
RIG: dict[str, Any] = {
    "machine": "mfpt",
    "model": "bearing5",
    "sample_rate": "12000 Hz",
    "operating_point": {"speed": "24.8 Hz", "load": "0 N*m"},
    "sensors": {"tachos": {"shafts": []}, "encoders": {"shafts": []}},
    "faults": [{"kind": "outer_race_spall", "component": "test_bearing", "params": {"width_m": "0.5 mm"}}],
}


@cache
def _parallel(seconds: float, seed: int) -> Record:
    return to_record(parse_scenario({**PARALLEL, "seed": seed}, Path("rig.yaml")), seconds)


@cache
def _rig(seconds: float) -> Record:
    return to_record(parse_scenario(copy.deepcopy(RIG), Path("rig.yaml")), seconds)


def parallel_record(seconds: float = 3.0, seed: int = 1) -> Record:
    """Of the parallel rig at 9.9 Hz and 40 N m: two channels, tachos, torque of the input."""
    return _parallel(seconds, seed)


def rig_record(seconds: float = 3.0) -> Record:
    """Of the MFPT rig at 24.8 Hz with a spall on the outer race: one channel and no angle signal."""
    return _rig(seconds)


def case_of(machine: str, model: str, *measured: Record, **more: tuple[Record, ...]) -> Case:
    """The case of records of a shipped machine."""
    return make_case(load_machine(machine), machine_file(machine), model, measured, **more)


def turning(speed_hz: np.ndarray, rate_hz: float, channels: tuple[str, ...] = ("b1_y",)) -> Record:
    """Noise on some channels, and a tacho of one pulse per turn of the input at a given course of speed."""
    turns = np.concatenate(([0.0], np.cumsum(0.5 * (speed_hz[1:] + speed_hz[:-1])) / rate_hz))
    pulses = np.interp(np.arange(1, int(turns[-1]) + 1), turns, np.arange(turns.size))
    rng = np.random.default_rng(5)
    data = rng.standard_normal((len(channels), speed_hz.size)).astype(np.float32)
    return Record(rate_hz, channels, "m/s^2", data, (PulseTrain("input", 1.0, pulses),), source="turning")
