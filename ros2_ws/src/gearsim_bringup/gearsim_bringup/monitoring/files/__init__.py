"""Settings for monitoring stacks, shipped as they are and written out for use."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from gearsim_io.errors import InputError

__all__ = ["FILES", "read_file", "write_files"]

FILES = {
    "prometheus.yml": "Prometheus: scrapes the exporter node",
    "alerts.yml": "Prometheus: alert rules",
    "grafana_dashboard.json": "Grafana: a dashboard to import",
    "diagnostic_aggregator.yaml": "ROS 2: analyzers for diagnostic_aggregator",
}


def read_file(name: str) -> str:
    """The text of a shipped file."""
    return files(__name__).joinpath(name).read_text(encoding="utf-8")


def write_files(folder: Path, *, overwrite: bool = False) -> list[Path]:
    """Write all shipped files into a folder, which is made if need be.

    Raises
    ------
    InputError
        When one of them is there already, unless `overwrite`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / name for name in FILES]
    for path in paths:
        if path.exists() and not overwrite:
            raise InputError(str(path), "", "it exists already", "another folder, or --overwrite")
    for path in paths:
        path.write_text(read_file(path.name), encoding="utf-8")
    return paths
