"""The exporter node: what the rig publishes, for Prometheus to scrape over HTTP."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

from prometheus_client import CollectorRegistry, GCCollector, ProcessCollector, start_http_server
from rclpy.node import Node

from gearsim_bringup.monitoring.metrics import RigMetrics
from gearsim_bringup.monitoring.nodes.listener import ALL_SOURCES, listen
from gearsim_io import qos
from gearsim_io.errors import InputError
from gearsim_io.nodes.health import HealthPublisher, Level
from gearsim_io.nodes.parameters import declare_parameters, parameter


@dataclass(frozen=True)
class ExporterParameters:
    """Parameters of the exporter node."""

    host: str = parameter("127.0.0.1", "address to listen on; 0.0.0.0 opens it to the network")
    port: int = parameter(9812, "port to listen on; 0: any free one, told in the log", 0, 65535)
    forget_s: float = parameter(60.0, "age at which indicators are dropped [s]", 1.0, 86400.0)
    sources: str = parameter(ALL_SOURCES, "judging nodes whose alarm states are exported")


class ExporterNode(Node):
    """Subscribes to the results of the rig and serves them at `http://host:port/metrics`."""

    def __init__(self) -> None:
        super().__init__("exporter", namespace=qos.NAMESPACE)
        given = declare_parameters(self, ExporterParameters)
        self._metrics = RigMetrics(time.monotonic, given.forget_s)
        self._registry = CollectorRegistry()
        self._registry.register(self._metrics)
        ProcessCollector(registry=self._registry)
        GCCollector(registry=self._registry)
        try:
            self._server, self._thread = start_http_server(given.port, given.host, self._registry)
        except OSError as error:
            where = f"{given.host}:{given.port}"
            expected = f"an address that can be listened on ({error.strerror or error})"
            raise InputError("parameter of node exporter", "host, port", where, expected) from None
        listen(self, self._metrics, given.sources, self.get_logger().warning)
        qos.create_subscription(self, qos.DIAGNOSTICS, self._on_diagnostics)
        self._health = HealthPublisher(self)
        self._url = f"http://{given.host}:{self._server.server_port}/metrics"
        self._health.report("serving", Level.OK, self._url)
        self.get_logger().info(f"metrics at {self._url}")

    def finish(self) -> None:
        """Stop serving."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join(2.0)

    def _on_diagnostics(self, msg: Any) -> None:
        self._metrics.diagnostics({(s.name, s.hardware_id): s.level[0] for s in msg.status})


def make_node() -> ExporterNode:
    """The node, once rclpy is ready."""
    return ExporterNode()
