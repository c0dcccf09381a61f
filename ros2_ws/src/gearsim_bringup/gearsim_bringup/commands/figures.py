"""`gearsim figures`: pictures of the methods at work on measured records."""

from __future__ import annotations

from pathlib import Path

import click

from gearsim_bringup.options import ANY_PATH, example, json_option
from gearsim_bringup.ui import Voice

EXAMPLE = """
./gearsim figures --out docs/images/methods
./gearsim figures --only squared_envelope_spectrum --out out/pictures
./gearsim figures --stories --out docs/images/stories
"""


@click.command("figures", epilog=example(EXAMPLE))
@click.option("--out", required=True, type=ANY_PATH, help="Folder for the pictures.")
@click.option("--only", multiple=True, help="Name of a picture; may be given more than once. Default: all.")
@click.option("--stories", is_flag=True, help="The pictures of docs/stories.md in place of docs/methods.")
@json_option
def command(out: Path, only: tuple[str, ...], stories: bool, json_mode: bool) -> None:
    """Draw the pictures of docs/methods, or of docs/stories.md, from the measured records in GEARSIM_DATA."""
    from gearsim_bringup.method_figures.draw import make_figures

    voice = Voice(json_mode=json_mode)
    with voice.progress() as bar:
        task = bar.add_task("figures", total=1.0)
        files = make_figures(
            out,
            only,
            lambda done, total, name: bar.update(task, completed=done / total, description=name),
            "stories" if stories else "methods",
        )
    for file in files:
        voice.say(f"  {file}")
    voice.result({"files": [str(file) for file in files]})
