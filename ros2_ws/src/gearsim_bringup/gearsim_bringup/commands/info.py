"""`gearsim info`: what a bag holds and whether it is sound."""

from __future__ import annotations

from pathlib import Path

import click

from gearsim_bringup.cli import BAD_INPUT
from gearsim_bringup.options import ANY_PATH, example, json_option
from gearsim_bringup.ui import Voice


@click.command("info", epilog=example("./gearsim info out/demo/bag"))
@click.argument("bag", type=ANY_PATH)
@json_option
def command(bag: Path, json_mode: bool) -> int:
    """Show what the BAG (a folder, or one .mcap file) holds and whether it is sound."""
    from gearsim_io import bags

    voice = Voice(json_mode=json_mode)
    found = bags.info(bag)
    voice.result(found.to_json())
    voice.say(f"{found.path}: {found.size_bytes / 1e6:.1f} MB, recorded within {found.seconds:.3f} s")
    for name, topic in sorted(found.topics.items()):
        voice.say(f"  {found.totals.counts.get(name, 0):7d}  {name}  ({topic.type})")
    for key, value in sorted(found.custom_data.items()):
        voice.say(f"  {key}: {value}")
    if found.problem:
        voice.say(f"damaged: {found.problem}")
    return BAD_INPUT if found.problem else 0
