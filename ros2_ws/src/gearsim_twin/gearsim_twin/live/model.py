"""A model that gives what a machine should show at the speed at which it turns now.

Steady speeds are taken in steps: the same model at the same speed shows nothing new, so what was made of a
window of it can be kept. A speed that changes within a window is followed.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gearsim_dsp.speed import window_speed
from gearsim_io.errors import InputError
from gearsim_io.machines import load_machine, machine_file
from gearsim_io.nameplate import Machine
from gearsim_io.quantities import read_yaml
from gearsim_sim.scenario import parse_scenario, scenario_file
from gearsim_sim.simulation import to_record
from gearsim_twin.baseline import follows_speed, machine_word, speed_trace
from gearsim_twin.compare.features import Plan, make_plan
from gearsim_twin.given import check_given
from gearsim_twin.modelled import Modelled, describe
from gearsim_twin.view import View

__all__ = ["LiveModel"]

# Orders do not depend on it, and no resonance is so narrow that a thousandth matters.
_SPEED_STEP = 1e-3
# Of a sensor that is good and not ideal: without noise the level of a line that a model lacks would be any.
_NOISE = {"noise_density": "0.001 m/s^2/Hz^0.5"}
_SHORTEST_S = 0.05


@dataclass(frozen=True, slots=True)
class _Of:
    """The machine of a plan, as `make_plan` asks for it."""

    machine: Machine


class LiveModel:
    """A model ready to be run at any speed.

    Parameters
    ----------
    content : mapping
        Of a scenario: machine, model, load, faults, parameters ... Its profile and timeline do not count,
        as the speed is that of the stream and what is extended is there from the beginning.
    path : Path
        Names the content in errors; relative paths in it start there.

    Raises
    ------
    InputError
        If it is no scenario, or its model does not describe its machine.

    Notes
    -----
    Build one by `of_scenario` or `of_machine`.
    """

    def __init__(self, content: Mapping[str, Any], path: Path) -> None:
        self._path = path
        self._content = {k: v for k, v in copy.deepcopy(dict(content)).items() if k not in _LEFT_OUT}
        scenario = parse_scenario(self._content, path)
        self._modelled: Modelled = describe(scenario.machine_path, scenario.model)
        self.machine: Machine = load_machine(scenario.machine_path)
        self.name = f"{scenario.machine.name} by {scenario.model}"
        self.speed_hz = scenario.speed_hz or self._modelled.speed_hz

    @classmethod
    def of_scenario(cls, name_or_path: str | Path) -> LiveModel:
        """The model of a scenario: a shipped name, or a file such as the `extended.yaml` of `twin`."""
        path = scenario_file(name_or_path)
        content = read_yaml(path)
        if not isinstance(content, Mapping):
            raise InputError(str(path), "", content, "a mapping of scenario keys")
        return cls(content, path)

    @classmethod
    def of_machine(cls, machine: str | Path, model: str) -> LiveModel:
        """The nominal model of a machine, under the load of its description."""
        path = machine_file(machine)
        check_given({}, path, model)
        able = describe(path, model)
        point = {"speed": f"{able.speed_hz:.12g} Hz", "load": f"{able.load_nm:.12g} N*m"}
        return cls({"machine": machine_word(path), "model": model, "operating_point": point}, Path("model"))

    def channels(self, given: Sequence[str]) -> tuple[str, ...]:
        """Those of some channels that the model gives."""
        return tuple(name for name in given if name in self._modelled.sites)

    def warm_up(self) -> None:
        """Have the integrator compiled, which takes half a minute where it was never done."""
        names = tuple(channel.name for channel in self.machine.channels)
        self._simulated(self.channels(names)[:1], 8192.0, _SHORTEST_S, self._point(self.speed_hz))

    def plan(self, channels: tuple[str, ...], rate_hz: float, seconds: float) -> Plan:
        """What is compared; it depends on the model alone, so that it is the same in every run."""
        view = self._simulated(channels, rate_hz, seconds, self._point(self.speed_hz))
        return make_plan(_Of(self.machine), [view])

    def step_of(self, view: View) -> int | None:
        """The step of speed of a window; None where the speed changes within it.

        Windows of one step have the same window of the model beside them.

        Raises
        ------
        InputError
            If the speed is not known, or beyond the described drive.
        """
        if not (math.isfinite(view.speed_hz) and view.speed_hz > 0):
            raise InputError("twin", "speed", "not known", "one, at which the model can be run")
        if view.speed_hz > self._modelled.speed_limit_hz:
            limit = f"at most {self._modelled.speed_limit_hz:g} Hz, as the described drive can do"
            raise InputError("twin", "speed", f"{view.speed_hz:.4g} Hz", limit)
        return None if follows_speed(view) else round(math.log(view.speed_hz) / _SPEED_STEP)

    def beside(self, view: View) -> View:
        """What the model gives in place of a measured window; errors as for `step_of`."""
        record, step = view.record, self.step_of(view)
        if step is None:
            point = self._point(view.speed_hz)
            del point["operating_point"]["speed"]
            point["profile"] = {"trace": speed_trace(view)}
        else:
            point = self._point(math.exp(step * _SPEED_STEP))
        return self._simulated(record.channels, record.sample_rate_hz, record.seconds, point)

    def _point(self, speed_hz: float) -> dict[str, Any]:
        load = dict(self._content.get("operating_point", {}))
        return {"operating_point": {**load, "speed": {"value": speed_hz, "unit": "Hz"}}}

    def _simulated(
        self, channels: Sequence[str], rate_hz: float, seconds: float, point: Mapping[str, Any]
    ) -> View:
        """A window of the model with a clean pulse per turn, which tells its angle."""
        content = {**copy.deepcopy(self._content), **point}
        content["sample_rate"] = {"value": rate_hz, "unit": "Hz"}
        sensors = content.setdefault("sensors", {})
        accelerometers = sensors.setdefault("accelerometers", {})
        accelerometers["channels"] = list(channels)
        if accelerometers.get("chain") == "ideal":
            accelerometers["all"] = {**_NOISE, **accelerometers.get("all", {})}
        shafts = self._modelled.tacho_shafts
        shaft = self.machine.reference_shaft if self.machine.reference_shaft in shafts else shafts[0]
        sensors["tachos"] = {"shafts": [shaft], "pulses": 1}
        sensors["encoders"] = {"shafts": []}
        sensors["torques"] = {"shafts": []}
        record = to_record(parse_scenario(content, self._path), seconds)
        speed = window_speed(record.tachos, record.sample_count, record.sample_rate_hz, self.machine, "tacho")
        return View(replace(record, tachos=(), machine=self.machine.name), self.machine, speed)


_LEFT_OUT = ("profile", "timeline", "batch_samples", "rate_factor")
