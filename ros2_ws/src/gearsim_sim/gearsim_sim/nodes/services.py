"""The simulator's services: requests become calls of the simulation, mistakes one line in the answer."""

from __future__ import annotations

import json
import math
from typing import Any

from gearsim_msgs.srv import ClearFault, InjectFault, SetOperatingPoint
from rclpy.node import Node

from gearsim_io.errors import InputError
from gearsim_io.nodes.answers import answer
from gearsim_sim.events import FaultSpec
from gearsim_sim.simulation import Simulation


class RigServices:
    """`~/set_operating_point`, `~/inject_fault` and `~/clear_fault` of a node."""

    def __init__(self, node: Node, simulation: Simulation) -> None:
        self._simulation = simulation
        self._logger = node.get_logger()
        self._services = [
            node.create_service(SetOperatingPoint, "~/set_operating_point", self._set_operating_point),
            node.create_service(InjectFault, "~/inject_fault", self._inject_fault),
            node.create_service(ClearFault, "~/clear_fault", self._clear_fault),
        ]

    def _set_operating_point(self, request: Any, response: Any) -> Any:
        def act() -> str:
            speed_hz, load_nm = _given(request.speed), _given(request.load)
            if speed_hz is None and load_nm is None:
                raise InputError("set_operating_point", "speed, load", "nan, nan", "at least one of them")
            response.sample = self._simulation.set_operating_point(speed_hz, load_nm, _ramp(request))
            parts = [] if speed_hz is None else [f"speed {speed_hz:g} Hz"]
            parts += [] if load_nm is None else [f"load {load_nm:g} N m"]
            return f"{', '.join(parts)} from sample {response.sample}"

        return answer(response, self._logger, act)

    def _inject_fault(self, request: Any, response: Any) -> Any:
        def act() -> str:
            fault = _fault(request)
            response.sample = self._simulation.inject(fault, _ramp(request))
            response.fault_id = fault.name
            return f"fault {fault.name} from sample {response.sample}"

        return answer(response, self._logger, act)

    def _clear_fault(self, request: Any, response: Any) -> Any:
        def act() -> str:
            response.sample = self._simulation.clear(request.fault_id, _ramp(request))
            return f"{request.fault_id or 'all faults'} cleared from sample {response.sample}"

        return answer(response, self._logger, act)


def _fault(request: Any) -> FaultSpec:
    params: Any = {}
    if request.parameters.strip():
        try:
            params = json.loads(request.parameters)
        except json.JSONDecodeError as error:
            expected = f"a JSON object ({error})"
            raise InputError("inject_fault", "parameters", request.parameters, expected) from None
    if not isinstance(params, dict):
        raise InputError("inject_fault", "parameters", request.parameters, "a JSON object")
    severity = params.pop("severity", 1.0)
    if isinstance(severity, bool) or not isinstance(severity, (int, float)):
        raise InputError("inject_fault", "parameters.severity", severity, "a number from 0 to 2")
    return FaultSpec(request.kind, request.component, params, float(severity), request.fault_id)


def _given(value: float) -> float | None:
    return None if math.isnan(value) else float(value)


def _ramp(request: Any) -> float:
    if not (math.isfinite(request.ramp_seconds) and request.ramp_seconds >= 0):
        raise InputError("service request", "ramp_seconds", request.ramp_seconds, "a finite time >= 0 s")
    return float(request.ramp_seconds)
