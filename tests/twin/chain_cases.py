"""Records of three rigs with an effect of measuring chain, operation or structure, beside the models.

The records come from other seeds, speeds and parameters (some per cent) than the models beside them.
"""

from __future__ import annotations

import copy
from functools import cache
from pathlib import Path
from typing import Any

from gearsim_io.machines import load_machine, machine_file
from gearsim_io.record import Record
from gearsim_sim.scenario import parse_scenario
from gearsim_sim.simulation import to_record
from gearsim_twin.baseline import scenario_content
from gearsim_twin.case import Case
from gearsim_twin.causes import Context
from gearsim_twin.modelled import describe
from gearsim_twin.simulated import Simulator
from gearsim_twin.view import View, view_of

RATE_HZ = 25600.0
SECONDS = 4.0
_IDEAL = {"accelerometers": {"chain": "ideal"}}
BASES: dict[str, dict[str, Any]] = {
    "parallel": {
        "machine": "unsw_parallel",
        "model": "lpm34",
        "operating_point": {"speed": "10.137 Hz", "load": "50 N*m"},
        "parameters": {"mesh.mean_stiffness": "3.3e8 N/m"},
        "sensors": {"accelerometers": {"chain": "ideal", "channels": ["b1_y", "b3_y", "b3_x"]}},
    },
    "planetary": {
        "machine": "unsw_planetary",
        "model": "planetary18",
        "operating_point": {"speed": "2.2137 Hz", "load": "46.875 N*m"},
        "parameters": {"mesh.mean_stiffness": "3.1e8 N/m"},
        "sensors": _IDEAL,
    },
    "bearing": {
        "machine": "mfpt",
        "model": "bearing5",
        "operating_point": {"speed": "24.8 Hz", "load": "0 N*m"},
        "sensors": {**_IDEAL, "tachos": {"shafts": ["shaft"]}},
    },
}


def merged(base: Any, more: Any) -> Any:
    """A mapping with another laid over it, level by level."""
    if not (isinstance(base, dict) and isinstance(more, dict)):
        return copy.deepcopy(more)
    return {
        key: merged(base[key], more[key])
        if key in more and key in base
        else copy.deepcopy(more.get(key, base.get(key)))
        for key in {**base, **more}
    }


def record(rig: str, seed: int = 1, seconds: float = SECONDS, **more: Any) -> Record:
    """A record of a rig; `more` is laid over its scenario."""
    content = merged({**BASES[rig], "seed": seed, "sample_rate": f"{RATE_HZ} Hz"}, more)
    return to_record(parse_scenario(content, Path("rig.yaml")), seconds)


def accelerometers(**effects: Any) -> dict[str, Any]:
    """Effects on all accelerometers, as part of a scenario."""
    return {"sensors": {"accelerometers": {"all": effects}}}


@cache
def _nominal(rig: str, speed_hz: float, rate_hz: float) -> tuple[dict[str, Any], View]:
    """The nominal model beside a healthy record of that speed."""
    measured = record(rig, 11, operating_point={"speed": f"{speed_hz} Hz"}, sample_rate=f"{rate_hz} Hz")
    case = _case(rig, measured)
    views = (view_of(measured, case.machine),)
    content = scenario_content(case, views[0])
    with Simulator(case, 1, views) as simulator:
        (view,) = simulator.views({0: content})
    return content, view


def _case(rig: str, measured: Record) -> Case:
    machine = BASES[rig]["machine"]
    model = BASES[rig]["model"]
    known = describe(machine, model)
    return Case(load_machine(machine), machine_file(machine), model, (measured,), (), (), False, known)


def context(rig: str, measured: Record, follow: bool = False) -> Context:
    """A record beside the nominal model at the rig's usual speed; `follow`: at that of the record."""
    case = _case(rig, measured)
    views = (view_of(measured, case.machine),)
    stated = float(BASES[rig]["operating_point"]["speed"].split()[0])
    if follow:
        content = scenario_content(case, views[0])
        with Simulator(case, 1, views) as simulator:
            (model,) = simulator.views({0: content})
    else:
        content, model = _nominal(rig, stated, measured.sample_rate_hz)
    return Context(case, views, (), (), (), (content,), (model.only(measured.channels),))


@cache
def healthy(rig: str, seed: int) -> Context:
    """A record without any effect."""
    return context(rig, record(rig, seed))
