"""`gearsim view`: a bag as a rerun recording and as a picture."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import click
from rich.progress import Progress, TaskID

from gearsim_bringup.options import ANY_PATH, example, json_option
from gearsim_bringup.ui import Voice

EXAMPLE = """
./gearsim view out/demo/bag --out demo.rrd --png demo.png
.venv/bin/rerun --bind 127.0.0.1 demo.rrd
"""


@click.command("view", epilog=example(EXAMPLE))
@click.argument("bag", type=ANY_PATH)
@click.option("--out", type=ANY_PATH, help="The rerun recording (.rrd) to write.")
@click.option(
    "--png", "picture", type=ANY_PATH, help="The picture to write; needs a Vulkan driver, no screen."
)
@click.option("--full", is_flag=True, help="Keep every sample of every waveform in the recording.")
@click.option("--overwrite", is_flag=True, help="Replace files that exist.")
@json_option
def command(
    bag: Path, out: Path | None, picture: Path | None, full: bool, overwrite: bool, json_mode: bool
) -> None:
    """Show a BAG: waveforms, envelope spectra with fault lines, indicators, alarms, operating point."""
    from gearsim_io import rerun_export

    if out is None and picture is None:
        raise click.UsageError("say what to write: --out X.rrd, --png X.png, or both")
    voice = Voice(json_mode=json_mode)
    if out is not None:
        with voice.progress() as bar:
            task = bar.add_task(f"writing {out.name}", total=1.0)
            told = partial(_tell, bar, task)
            rerun_export.export(bag, out, full=full, overwrite=overwrite, progress=told)
        voice.say(f"written: {out}; open it with: .venv/bin/rerun --bind 127.0.0.1 {out}")
    if picture is not None:
        with voice.progress() as bar:
            task = bar.add_task(f"drawing {picture.name}", total=1.0)
            rerun_export.png(bag, picture, overwrite=overwrite, progress=partial(_tell, bar, task))
        voice.say(f"written: {picture}")
    voice.result({"rrd": None if out is None else str(out), "png": None if picture is None else str(picture)})


def _tell(bar: Progress, task: TaskID, share: float) -> None:
    bar.update(task, completed=share)
