"""`gearsim import`: measured files as bags."""

from __future__ import annotations

from pathlib import Path

import click

from gearsim_bringup.options import ANY_PATH, POSITIVE, SPEED, SPEED_HELP, example, json_option
from gearsim_bringup.ui import Voice

EXAMPLE = """
./gearsim import OuterRaceFault_1.mat --machine mfpt --out out/outer
./gearsim import run.csv --machine my_rig.yaml --rate 25600 --unit g --column a1 --out out/run
"""


@click.command("import", epilog=example(EXAMPLE))
@click.argument("files", nargs=-1, required=True, type=ANY_PATH, metavar="FILE...")
@click.option("--machine", required=True, help="Shipped machine description, or the path of a YAML file.")
@click.option("--out", required=True, type=ANY_PATH, help="Folder of the new bag (of several: their parent).")
@click.option("--rate", type=POSITIVE, help="Sampling rate in Hz; must agree with what the file says.")
@click.option("--unit", help="Unit of the samples, such as g or m/s^2.")
@click.option(
    "--column", "--variable", "columns", multiple=True, help="Variable or column to take; repeatable."
)
@click.option("--channel", "channels", multiple=True, help="Name of the channel; one per --column.")
@click.option("--speed", type=SPEED, help=SPEED_HELP)
@json_option
def command(
    files: tuple[Path, ...],
    machine: str,
    out: Path,
    rate: float | None,
    unit: str | None,
    columns: tuple[str, ...],
    channels: tuple[str, ...],
    speed: float | None,
    json_mode: bool,
) -> None:
    """Turn measured FILEs (.mat .csv .wav .npz .npy .h5 .uff) into bags that play like a live stream."""
    from gearsim_io.importers import Overrides, import_to_bag

    voice = Voice(json_mode=json_mode)
    overrides = Overrides(rate, unit, columns, channels, speed)
    made = import_to_bag(files, machine, out, overrides)
    for place, record in made:
        names = ", ".join(record.channels)
        voice.say(
            f"{place}: {record.seconds:.3f} s at {record.sample_rate_hz:g} Hz, {names} in {record.unit}"
        )
        for key, note in sorted(record.notes.items()):
            voice.say(f"  {key}: {note}")
    voice.result(
        {
            "bags": [
                {
                    "path": str(place),
                    "sample_rate_hz": record.sample_rate_hz,
                    "seconds": record.seconds,
                    "channels": list(record.channels),
                    "unit": record.unit,
                    "notes": record.notes,
                }
                for place, record in made
            ]
        }
    )
