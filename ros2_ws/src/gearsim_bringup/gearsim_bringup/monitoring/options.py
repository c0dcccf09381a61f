"""Options of the commands that start diagnostic nodes."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import click

from gearsim_bringup.monitoring.choice import ALL_MONITORS, MONITORS, choose
from gearsim_bringup.options import ANY_PATH, POSITIVE

__all__ = ["monitor_options"]

_NAMES = ("monitors", "latch", "prometheus", "mqtt", "baselines", "learn_s", "twin")

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
    click.option("--baselines", type=ANY_PATH, help="Folder of learnt baselines (gear, trend, twin)."),
    click.option("--learn", "learn_s", type=POSITIVE, help="Seconds of signal to learn a baseline from."),
    click.option(
        "--twin",
        metavar="MODEL",
        help="Run this model beside the samples: a name such as lpm34, or a scenario such as extended.yaml.",
    ),
)


def monitor_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the options that `choose` takes; they come as one argument `choice` of type Choice."""

    @functools.wraps(command)
    def chosen(*args: Any, **values: Any) -> Any:
        taken = {name: values.pop(name) for name in _NAMES}
        return command(*args, choice=choose(**taken), **values)

    found: Callable[..., Any] = chosen
    for option in reversed(_OPTIONS):
        found = option(found)
    return found
