"""A rig that is not quite as described, for tests of the live twin: streams of it, sound and with a spall."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from gearsim_io.machines import load_machine
from gearsim_io.nameplate import Machine
from gearsim_io.record import Record
from gearsim_sim.scenario import parse_scenario
from gearsim_sim.simulation import to_record

RATE_HZ = 8192.0
SPEED_HZ = 25.0


def machine() -> Machine:
    """The rig with a tacho on its shaft."""
    return dataclasses.replace(load_machine("mfpt"), tacho_shafts=("shaft",))


def stream(seconds: float, seed: int, fault_at_s: float | None = None, **content) -> Record:
    """Samples and tacho; the seat is a tenth softer than the model has it, and the sensor is noisy."""
    spall = {"kind": "outer_race_spall", "component": "test_bearing", "params": {"width_m": "0.6 mm"}}
    events = [] if fault_at_s is None else [{"at": f"{fault_at_s} s", "inject": {**spall, "ramp": "0.1 s"}}]
    scenario = {
        "machine": "mfpt",
        "model": "bearing2",
        "sample_rate": f"{RATE_HZ} Hz",
        "seed": seed,
        "operating_point": {"speed": f"{SPEED_HZ} Hz", "load": "0 N*m"},
        "parameters": {"radial_load": "1100 N"},
        "sensors": {
            "accelerometers": {"channels": ["accel"], "all": {"noise_density": "0.02 m/s^2/Hz^0.5"}},
            "tachos": {"shafts": ["shaft"]},
        },
        "timeline": events,
        **content,
    }
    return dataclasses.replace(to_record(parse_scenario(scenario, Path("rig.yaml")), seconds), machine="mfpt")
