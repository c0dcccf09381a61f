"""Which diagnostic nodes a live graph has, and who passes their results on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from gearsim_bringup.processes import NodeSpec
from gearsim_io.errors import InputError

__all__ = ["ALL_MONITORS", "MONITORS", "TWIN", "Choice", "choose"]

MONITORS = ("envelope", "kurtosis")
"""Nodes that run unless others are asked for: they judge by themselves, without a learnt baseline."""

ALL_MONITORS = (*MONITORS, "gear", "trend")
TWIN = "twin"
"""Node that runs where a model is given to run beside the stream."""
_OF_RESULTS = ("trend",)
_LEARNING = ("gear", "trend", TWIN)
_MODULES = {TWIN: "gearsim_twin.nodes.twin"}
EXPORTER_PORT, MQTT_PORT = 9812, 1883


@dataclass(frozen=True)
class Choice:
    """Diagnostic nodes of `ALL_MONITORS` and `TWIN`, which levels latch, and addresses of the stacks.

    `prometheus` is where the exporter listens, `mqtt` where the broker is: (host, port). `baselines` is the
    folder of learnt baselines and `learn_s` how long to learn; empty and 0: as the nodes have it. `model` is
    what the twin runs: the name of a model, or a scenario.
    """

    monitors: tuple[str, ...] = MONITORS
    latch: str = "none"
    prometheus: tuple[str, int] | None = None
    mqtt: tuple[str, int] | None = None
    baselines: str = ""
    learn_s: float = 0.0
    model: str = ""

    @property
    def listeners(self) -> int:
        """Nodes that subscribe to the samples."""
        return sum(name not in _OF_RESULTS for name in self.monitors)

    @property
    def alarm_listeners(self) -> int:
        """Nodes that subscribe to the alarms."""
        stacks = sum(address is not None for address in (self.prometheus, self.mqtt))
        return stacks + sum(name in _LEARNING for name in self.monitors)

    def specs(self, alarm_listeners: int = 0) -> list[NodeSpec]:
        """The nodes, those that listen to results before those that have them.

        `alarm_listeners` others, beside these nodes, must be there to hear alarms before samples are taken.
        """
        everyone = alarm_listeners + self.alarm_listeners if alarm_listeners else 0
        found = []
        for name, address in (("exporter", self.prometheus), ("mqtt", self.mqtt)):
            if address is not None:
                values: dict[str, str | int] = {"host": address[0], "port": address[1]}
                found.append(NodeSpec(name, f"gearsim_bringup.monitoring.nodes.{name}", values))
        order = sorted(self.monitors, key=lambda name: name not in _OF_RESULTS)
        return found + [
            NodeSpec(n, _MODULES.get(n, f"gearsim_dsp.nodes.{n}"), self._parameters(n, everyone))
            for n in order
        ]

    def _parameters(self, name: str, alarm_listeners: int) -> dict[str, str | float]:
        parameters: dict[str, str | float] = {"latch": self.latch}
        if alarm_listeners and name not in _OF_RESULTS:
            parameters["alarm_listeners"] = alarm_listeners
        if name in _LEARNING and self.baselines:
            parameters["baseline_dir"] = self.baselines
        if name in _LEARNING and self.learn_s:
            parameters["learn_s"] = float(self.learn_s)
        if name == TWIN:
            parameters["model"] = self.model
        return parameters


def choose(
    monitors: str,
    latch: str,
    prometheus: str | None,
    mqtt: str | None,
    baselines: Path | None = None,
    learn_s: float | None = None,
    twin: str | None = None,
) -> Choice:
    """What was asked for on the command line.

    Raises
    ------
    InputError
        For a node or a model that there is not, or an address that is none.
    """
    names = ALL_MONITORS if monitors == "all" else tuple(dict.fromkeys(monitors.replace(" ", "").split(",")))
    for name in names:
        if name not in ALL_MONITORS:
            raise InputError("--monitors", "", name, f"all, or some of {', '.join(ALL_MONITORS)}")
    model = "" if twin is None else _model(twin)
    return Choice(
        (*names, TWIN) if model else names,
        latch,
        None if prometheus is None else _address(prometheus, "--prometheus", EXPORTER_PORT),
        None if mqtt is None else _address(mqtt, "--mqtt", MQTT_PORT),
        "" if baselines is None else str(baselines.absolute()),
        learn_s or 0.0,
        model,
    )


def _model(text: str) -> str:
    """The name of a model, or the file of a scenario wherever the node runs."""
    from gearsim_sim.models import MODELS
    from gearsim_sim.scenario import scenario_file

    return text if text in MODELS else str(scenario_file(text).absolute())


def _address(text: str, where: str, usual: int) -> tuple[str, int]:
    """`9812`, `host` or `host:9812`; without a host this computer alone."""
    host, _, port = (
        text.rpartition(":") if ":" in text else ("", "", text) if text.isdigit() else (text, "", "")
    )
    if (port or ":" in text) and not (port.isdigit() and int(port) < 65536):
        raise InputError(where, "", text, "a port, a host, or host:port")
    return host or "127.0.0.1", int(port) if port else usual
