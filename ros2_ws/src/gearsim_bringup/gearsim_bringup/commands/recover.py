"""`gearsim recover`: a sound bag from a damaged one."""

from __future__ import annotations

from pathlib import Path

import click

from gearsim_bringup.options import ANY_PATH, example, json_option
from gearsim_bringup.ui import Voice


@click.command("recover", epilog=example("./gearsim recover broken_bag --out saved_bag"))
@click.argument("bag", type=ANY_PATH)
@click.option("--out", type=ANY_PATH, help="Folder of the new bag (default: BAG with _recovered appended).")
@json_option
def command(bag: Path, out: Path | None, json_mode: bool) -> None:
    """Copy every sound message of a damaged BAG into a new one and say what was lost."""
    from gearsim_io import bags

    voice = Voice(json_mode=json_mode)
    target = out or bag.with_name(f"{bag.stem if bag.is_file() else bag.name}_recovered")
    report = bags.recover(bag, target)
    voice.say(report.summary())
    voice.result(
        {
            "out": str(report.out),
            "messages": report.messages,
            "seconds": report.seconds,
            "unverified": report.unverified,
            "lost_messages": report.lost_messages,
            "skipped_bytes": report.skipped_bytes,
            "losses": report.losses,
        }
    )
