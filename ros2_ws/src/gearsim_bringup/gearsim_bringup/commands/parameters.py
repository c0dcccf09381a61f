"""`gearsim parameters`: every parameter of scenarios, faults and machines, with unit, range and meaning."""

from __future__ import annotations

from pathlib import Path

import click

from gearsim_bringup.options import ANY_PATH, example, json_option
from gearsim_bringup.ui import Voice

EXAMPLE = """
./gearsim parameters outer_race_spall
./gearsim parameters --out docs/parameters.md
"""


@click.command("parameters", epilog=example(EXAMPLE))
@click.argument("section", required=False)
@click.option("--out", type=ANY_PATH, help="Markdown file to write, in place of printing.")
@json_option
def command(section: str | None, out: Path | None, json_mode: bool) -> None:
    """List all parameters, or those of one SECTION: a kind of fault, a kind of machine, or scenario."""
    from gearsim_bringup.reference_page import markdown, sections

    voice = Voice(json_mode=json_mode)
    chosen = sections(section)
    text = markdown(chosen, whole=section is None)
    if out is None:
        voice.say(text)
    else:
        out.write_text(text, encoding="utf-8")
        voice.say(f"  {out}")
    voice.result({"sections": [one.content() for one in chosen]})
