"""`gearsim gallery`: pictures of every kind of fault, healthy beside faulty."""

from __future__ import annotations

from pathlib import Path

import click

from gearsim_bringup.first_use import tell_first_use
from gearsim_bringup.options import ANY_PATH, POSITIVE, example, json_option
from gearsim_bringup.ui import Voice

EXAMPLE = """
./gearsim gallery --out docs/gallery
./gearsim gallery --only cage_slip --only oil_film --out out/pictures
"""


@click.command("gallery", epilog=example(EXAMPLE))
@click.option("--out", required=True, type=ANY_PATH, help="Folder for the pictures and their page.")
@click.option(
    "--only", multiple=True, help="A kind of fault, or casing_inner, casing_outer; repeatable. Default: all."
)
@click.option("--seconds", default=4.0, show_default=True, type=POSITIVE, help="Simulated time of a record.")
@json_option
def command(out: Path, only: tuple[str, ...], seconds: float, json_mode: bool) -> None:
    """Draw waveform, spectrum and envelope spectrum of every kind of fault."""
    from gearsim_bringup.gallery.cases import check_names

    check_names(only)
    from gearsim_bringup.gallery.page import make_gallery  # after what can be refused at once

    voice = Voice(json_mode=json_mode)
    tell_first_use(voice)
    with voice.progress() as bar:
        task = bar.add_task("gallery", total=1.0)
        files = make_gallery(
            out,
            only,
            seconds,
            lambda done, total, kind: bar.update(task, completed=done / total, description=kind),
        )
    for file in files:
        voice.say(f"  {file}")
    voice.result({"files": [str(file) for file in files]})
