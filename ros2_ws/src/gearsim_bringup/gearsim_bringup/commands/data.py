"""`gearsim data`: measured records from the package index."""

from __future__ import annotations

import click

from gearsim_bringup.options import example


@click.group("data", epilog=example("./gearsim data get mfpt"))
def command() -> None:
    """Get measured records to try the diagnosis on."""
