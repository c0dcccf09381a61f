"""Options of the commands that start diagnostic nodes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from gearsim_bringup.monitoring.choice import ALL_MONITORS, MONITORS, choose

__all__ = ["choose", "monitor_options"]

_OPTIONS = (
    click.option(
        "--monitors",
        default=",".join(MONITORS),
        show_default=True,
        help=f"Diagnostic nodes, with commas: {', '.join(ALL_MONITORS)}; or all.",
    ),
    click.option(
        "--latch",
        type=click.Choice(["none", "error", "all"]),
        default="none",
        show_default=True,
        help="Levels that stay until they are acknowledged.",
    ),
    click.option("--prometheus", metavar="[HOST:]PORT", help="Serve metrics for Prometheus there."),
    click.option("--mqtt", metavar="HOST[:PORT]", help="Pass features and alarms on to this MQTT broker."),
)


def monitor_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command `--monitors`, `--latch`, `--prometheus` and `--mqtt`."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command
