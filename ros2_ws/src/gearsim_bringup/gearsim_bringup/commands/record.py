"""`gearsim record`: whatever the rig publishes, into a bag."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from gearsim_bringup.options import ANY_PATH, example

EXAMPLE = """
./gearsim record --out out/my_bag
./gearsim record --out out/my_bag --topic /gearsim/accel --topic /gearsim/tacho
"""


@click.command("record", epilog=example(EXAMPLE))
@click.option("--out", required=True, type=ANY_PATH, help="Folder of the new bag.")
@click.option(
    "--topic", "topics", multiple=True, help="Full name of a topic, repeatable (default: all of gearsim's)."
)
@click.option("--all", "everything", is_flag=True, help="Every topic there is.")
def command(out: Path, topics: tuple[str, ...], everything: bool) -> int:
    """Record the rig's topics into a bag until Ctrl-C."""
    from gearsim_bringup.processes import NodeSpec, ParameterValue, run_here
    from gearsim_io.nodes.recorder import main

    values: dict[str, ParameterValue] = {
        "bag": str(out),
        "topics": list(topics) or [""],
        "all_topics": everything,
    }
    click.echo(f"recording to {out}; Ctrl-C ends it", file=sys.stderr)
    return run_here(main, NodeSpec("recorder", "", values))
