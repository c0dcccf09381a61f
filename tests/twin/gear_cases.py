"""Contexts of causes at gears, shafts and planets: records with a hidden effect beside the nominal model."""

from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gearsim_io.machines import load_machine, machine_file
from gearsim_io.record import PulseTrain
from gearsim_sim.scenario import parse_scenario
from gearsim_sim.simulation import to_record
from gearsim_twin.baseline import scenario_content
from gearsim_twin.case import make_case
from gearsim_twin.causes.context import Context
from gearsim_twin.simulated import Simulator

# White noise as of a laboratory's sensors, and a mesh that the record has stiffer than the model by 3 %: the
# judge tunes that first, a guess must stand what is left of it.
NOISE = {"noise_density": {"value": 5e-4, "unit": "m/s^2/Hz^0.5"}}
BASES: dict[str, dict[str, Any]] = {
    "lpm34": {
        "machine": "unsw_parallel",
        "model": "lpm34",
        "sample_rate": "16384 Hz",
        "operating_point": {"speed": "10 Hz", "load": "50 N*m"},
        "parameters": {"mesh.mean_stiffness": "3.27e8 N/m"},
        "sensors": {
            "accelerometers": {"all": NOISE},
            "encoders": {"shafts": []},
            "torques": {"shafts": ["input"]},
        },
    },
    "planetary18": {
        "machine": "unsw_planetary",
        "model": "planetary18",
        "sample_rate": "16384 Hz",
        "operating_point": {"speed": "2.1333 Hz", "load": "46.9 N*m"},
        "parameters": {"mesh.mean_stiffness": "3.09e8 N/m"},
        "sensors": {
            "accelerometers": {"all": NOISE},
            "encoders": {"shafts": []},
        },
    },
}
SECONDS = {"lpm34": 3.0, "planetary18": 6.0}


def fault(kind: str, component: str, **params: Any) -> dict[str, Any]:
    """An entry of a scenario's faults."""
    return {"kind": kind, "component": component, "params": params}


def gear_context(
    model: str,
    *faults: dict[str, Any],
    seed: int = 7,
    machine: Path | None = None,
    mark_turns: float = 0.0,
    **more: Any,
) -> Context:
    """The nominal model beside a record with other random errors, noise, another stiffness, and faults.

    `mark_turns` is by how much the tacho's marks are late against the teeth.
    """
    content = {**copy.deepcopy(BASES[model]), "seed": seed, "faults": list(faults), **more}
    if machine is not None:
        content["machine"] = str(machine)
    seconds = SECONDS[model] if machine is None else 5.1
    record = to_record(parse_scenario(content, Path("x.yaml")), seconds)
    record = replace(record, tachos=tuple(_late(train, mark_turns) for train in record.tachos))
    plate = load_machine(content["machine"])
    case = make_case(plate, machine_file(content["machine"]), model, [record])
    views = case.views()[:1]
    contents = tuple(scenario_content(case, view) for view in views)
    with Simulator(case, measured=views) as simulator:
        simulated = tuple(simulator.views(dict(enumerate(contents))))
    return Context(case, views, (), (), (), contents, simulated)


def _late(train: PulseTrain, turns: float) -> PulseTrain:
    """The same marks, further on in the turn; where a tacho begins to count is nobody's choice."""
    step = np.median(np.diff(train.samples)) * train.pulses_per_revolution
    return replace(train, samples=train.samples[:-8] + turns * step)


def unlike_wheels(folder: Path) -> Path:
    """The parallel rig with 24 and 40 teeth, whose wheels turn at speeds of their own."""
    text = machine_file("unsw_parallel").read_text(encoding="utf-8")
    changes = {
        "ratio: {value: 1,": "ratio: {value: 0.6,",
        "driving_teeth: {value: 32,": "driving_teeth: {value: 24,",
        "driven_teeth: {value: 32,": "driven_teeth: {value: 40,",
    }
    for old, new in changes.items():
        assert text.count(old) == 1
        text = text.replace(old, new)
    pinion, gear = text.split("  gear:\n    inertia", 1)
    radius = "base_radius: {value: 0.0463,"
    assert pinion.count(radius) == 1
    assert gear.count(radius) == 1
    # Module times teeth times cos 20 deg / 2.
    pinion = pinion.replace(radius, "base_radius: {value: 0.034725,")
    gear = gear.replace(radius, "base_radius: {value: 0.057875,")
    path = folder / "unlike.yaml"
    path.write_text(pinion + "  gear:\n    inertia" + gear, encoding="utf-8")
    return path
