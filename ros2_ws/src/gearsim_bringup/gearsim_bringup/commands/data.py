"""`gearsim data`: measured records from the package index."""

from __future__ import annotations

import sys

import click

from gearsim_bringup.options import example
from gearsim_bringup.ui import Voice


@click.group("data", epilog=example("./gearsim data get mfpt"))
def command() -> None:
    """Get measured records to try the diagnosis on."""


@command.command("get", epilog=example("./gearsim data get mfpt --accept-licence"))
@click.argument("name", type=click.Choice(["mfpt"]))
@click.option("--accept-licence", is_flag=True, help="Accept the records' licence without being asked.")
def get(name: str, accept_licence: bool) -> None:  # noqa: ARG001 - mfpt is the only set there is
    """Fetch the records NAME into the cache, after showing their licence."""
    from gearsim_bringup.data import get_mfpt

    voice = Voice(json_mode=False)
    asked = (lambda question: click.confirm(question, err=True)) if sys.stdin.isatty() else None
    get_mfpt(accept_licence=accept_licence, confirm=asked, say=voice.say)
