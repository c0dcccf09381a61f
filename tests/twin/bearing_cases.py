"""Contexts of causes: simulated records with a hidden effect beside the nominal model."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from gearsim_io.machines import load_machine, machine_file
from gearsim_io.record import Record
from gearsim_sim.scenario import parse_scenario
from gearsim_sim.simulation import to_record
from gearsim_twin.baseline import scenario_content
from gearsim_twin.case import make_case
from gearsim_twin.causes.context import Context
from gearsim_twin.simulated import Simulator

PARALLEL: dict[str, Any] = {
    "machine": "unsw_parallel",
    "model": "lpm34",
    "sample_rate": "32768 Hz",
    "operating_point": {"speed": "10 Hz", "load": "50 N*m"},
    "sensors": {
        "accelerometers": {"channels": ["b1_y", "b2_y", "b3_y", "b4_y"]},
        "tachos": {"shafts": ["input"], "pulses": 1},
        "encoders": {"shafts": []},
    },
}


def _rig(machine: str, rate: str, speed: str) -> dict[str, Any]:
    return {
        "machine": machine,
        "model": "bearing5",
        "sample_rate": rate,
        "operating_point": {"speed": speed, "load": "0 N*m"},
        "sensors": {"tachos": {"shafts": ["shaft"], "pulses": 1}, "encoders": {"shafts": []}},
    }


BASES = {
    "lpm34": PARALLEL,
    "mfpt": _rig("mfpt", "48828 Hz", "25 Hz"),
    "hit_sq": _rig("hit_sq", "51200 Hz", "20 Hz"),
}
COMPONENT = {"lpm34": "bearing_3", "mfpt": "test_bearing", "hit_sq": "test_bearing"}
NOISE_M_S2 = {"lpm34": 0.3, "mfpt": 0.2, "hit_sq": 0.05}
"""White measuring noise over the whole band, so that the records are not cleaner than any real one."""


def fault(rig: str, kind: str, **params: Any) -> dict[str, Any]:
    return {"kind": kind, "component": COMPONENT[rig], "params": params}


def record_of(
    rig: str,
    *faults: dict[str, Any],
    seed: int = 1,
    seconds: float = 3.0,
    load: str = "",
    **more: Any,
) -> Record:
    """A record of a rig with faults, and measuring noise; `load` is what its file would state."""
    content = {**BASES[rig], "seed": seed, "faults": list(faults), **more}
    record = to_record(parse_scenario(content, Path("rig.yaml")), seconds)
    noise = np.random.default_rng(seed).standard_normal(record.data.shape).astype(np.float32)
    return Record(
        record.sample_rate_hz,
        record.channels,
        record.unit,
        record.data + np.float32(NOISE_M_S2[rig]) * noise,
        record.tachos,
        notes={"load": load} if load else {},
        source=f"{rig} {seed}",
    )


def context_of(rig: str, *records: Record, changed: dict[str, Any] | None = None) -> Context:
    """The records beside the nominal model of the rig, or a changed one."""
    base = BASES[rig]
    case = make_case(load_machine(base["machine"]), machine_file(base["machine"]), base["model"], records)
    views = case.views()
    training = views[: len(case.training)]
    contents = tuple({**scenario_content(case, view), **(changed or {})} for view in training)
    with Simulator(case, 1, views) as simulator:
        simulated = tuple(simulator.views(dict(enumerate(contents))))
    return Context(case, training, (), (), (), contents, simulated)


@cache
def hidden(rig: str, kind: str, seed: int, **params: Any) -> Context:
    """One record with one fault, beside the nominal model."""
    return context_of(rig, record_of(rig, fault(rig, kind, **params), seed=seed))
