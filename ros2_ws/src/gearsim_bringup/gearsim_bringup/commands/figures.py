"""`gearsim figures`: pictures of the methods at work on measured records, and the casing's results."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import click

from gearsim_bringup.options import ANY_PATH, example, json_option
from gearsim_bringup.ui import Voice

EXAMPLE = """
./gearsim figures --out docs/images/methods
./gearsim figures --only squared_envelope_spectrum --out out/pictures
./gearsim figures --stories --out docs/images/stories
./gearsim figures --casing --out docs/images/casing --into docs/casing_results.md --records out/casing
"""


@click.command("figures", epilog=example(EXAMPLE))
@click.option("--out", required=True, type=ANY_PATH, help="Folder for the pictures.")
@click.option("--only", multiple=True, help="Name of a picture; may be given more than once. Default: all.")
@click.option("--stories", is_flag=True, help="The pictures of docs/stories.md in place of docs/methods.")
@click.option(
    "--casing", is_flag=True, help="Those of docs/casing_results.md, from simulations; some minutes."
)
@click.option("--into", type=ANY_PATH, help="With --casing: the page whose tables are replaced.")
@click.option("--records", type=ANY_PATH, help="With --casing: a folder that keeps what was simulated.")
@click.option(
    "--full-casing",
    type=ANY_PATH,
    help="With --casing: a reduction with 1000 modes; made if it is not given.",
)
@json_option
def command(
    out: Path,
    only: tuple[str, ...],
    stories: bool,
    casing: bool,
    into: Path | None,
    records: Path | None,
    full_casing: Path | None,
    json_mode: bool,
) -> None:
    """Draw the pictures of docs/methods, or of docs/stories.md, from the measured records in GEARSIM_DATA."""
    if not casing and (into or records or full_casing):
        raise click.UsageError("--into, --records and --full-casing belong to --casing.")
    if casing and stories:
        raise click.UsageError("--casing and --stories exclude each other.")
    voice = Voice(json_mode=json_mode)
    with voice.progress() as bar:
        task = bar.add_task("figures", total=1.0)

        def tell(done: float, total: float, name: str) -> None:
            bar.update(task, completed=done / total, description=name)

        if casing:
            files = _of_casing(out, only, into, records, full_casing, tell)
        else:
            from gearsim_bringup.method_figures.draw import make_figures

            files = make_figures(out, only, tell, "stories" if stories else "methods")
    for file in files:
        voice.say(f"  {file}")
    voice.result({"files": [str(file) for file in files]})


def _of_casing(
    out: Path,
    only: tuple[str, ...],
    into: Path | None,
    records: Path | None,
    full_casing: Path | None,
    tell: Callable[[float, float, str], None],
) -> list[Path]:
    from gearsim_bringup.casing_results.page import make_results
    from gearsim_bringup.casing_results.records import Records

    return make_results(Records(records, full_casing, tell), out, into, only, tell)
