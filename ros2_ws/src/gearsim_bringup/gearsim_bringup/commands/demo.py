"""`gearsim demo`: the whole chain once, on simulated and on real input."""

from __future__ import annotations

import time
from pathlib import Path

import click

from gearsim_bringup.options import ANY_PATH, FiniteRange, example, json_option
from gearsim_bringup.ui import Voice


@click.command("demo", epilog=example("./gearsim demo\n./gearsim demo --out out/my_demo"))
@click.option("--seconds", default=30.0, type=FiniteRange(min=15), help="Simulated seconds of the rig.")
@click.option("--out", type=ANY_PATH, help="New folder for all files (default: out/demo-<date>-<time>).")
@click.option("--real/--no-real", default=True, help="Also a measured record, where the data are present.")
@json_option
def command(seconds: float, out: Path | None, real: bool, json_mode: bool) -> int:
    """Run the rig live: healthy first, a spall after 8 s, alarms, bag, rerun recording and picture."""
    from gearsim_bringup.demo import Demo

    voice = Voice(json_mode=json_mode)
    target = out or Path("out") / time.strftime("demo-%Y%m%d-%H%M%S")
    summary = Demo(voice, target).run(seconds, real=real)
    voice.result(summary)
    return 0 if summary["alarm_seconds"] is not None else 1
