"""Parameters of the simulator node."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gearsim_io.errors import InputError
from gearsim_io.nodes.parameters import parameter
from gearsim_sim.scenario import Scenario, load_scenario

OF_SCENARIO = -1


@dataclass(frozen=True)
class SimulatorParameters:
    """What a user may set."""

    scenario: str = parameter("healthy", "shipped scenario, or path of a YAML file")
    seed: int = parameter(OF_SCENARIO, "seed of all random numbers; -1: that of the scenario", -1, 2**62)
    batch_samples: int = parameter(OF_SCENARIO, "samples per message; -1: that of the scenario", -1, 65536)
    rate_factor: float = parameter(
        float(OF_SCENARIO),
        "times real time; 0: as fast as it goes; -1: that of the scenario",
        -1.0,
        1000.0,
        live=True,
    )
    paused: bool = parameter(False, "simulated time stands still", live=True)
    end_after: float = parameter(0.0, "simulated seconds after which the node ends; 0: never", 0.0, 1e9)
    wait_for_subscribers: int = parameter(0, "subscribers of accel to wait for before sample 0", 0, 100)
    publish_clock: bool = parameter(False, "publish the simulated time on /clock")
    t0_ns: int = parameter(-1, "time of sample 0 in ns since 1970; -1: the clock's time then", -1, 2**62)

    def load(self) -> Scenario:
        """The scenario with the changes that the parameters ask for; InputError if it is not right."""
        changes: dict[str, Any] = {}
        if self.seed != OF_SCENARIO:
            changes["seed"] = self.seed
        if self.batch_samples != OF_SCENARIO:
            changes["batch_samples"] = self.batch_samples
        if self.rate_factor != OF_SCENARIO:
            if self.rate_factor < 0:
                expected = "0 to 1000, or -1 for that of the scenario"
                raise InputError("parameter of node simulator", "rate_factor", self.rate_factor, expected)
            changes["rate_factor"] = self.rate_factor
        return load_scenario(self.scenario, changes)
