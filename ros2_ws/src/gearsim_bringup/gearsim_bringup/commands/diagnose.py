"""`gearsim diagnose`: the verdict of the diagnostic nodes, offline."""

from __future__ import annotations

from pathlib import Path

import click

from gearsim_bringup.options import ANY_PATH, POSITIVE, SPEED, SPEED_HELP, example, json_option
from gearsim_bringup.ui import Voice

EXAMPLE = """
./gearsim diagnose out/demo/bag
./gearsim diagnose OuterRaceFault_1.mat --machine mfpt --json
./gearsim diagnose out/demo/bag --report out/report
"""


@click.command("diagnose", epilog=example(EXAMPLE))
@click.argument("source", type=ANY_PATH, metavar="BAG_OR_FILE")
@click.option("--machine", help="Machine description; a bag carries its own nameplate.")
@click.option("--rate", type=POSITIVE, help="Sampling rate in Hz of a file; must agree with what it says.")
@click.option("--unit", help="Unit of a file's samples, such as g or m/s^2.")
@click.option(
    "--column", "--variable", "columns", multiple=True, help="Variable or column to take; repeatable."
)
@click.option("--speed", type=SPEED, help=SPEED_HELP)
@click.option("--report", type=ANY_PATH, metavar="DIR", help="New folder for a page with verdict and plots.")
@json_option
def command(
    source: Path,
    machine: str | None,
    rate: float | None,
    unit: str | None,
    columns: tuple[str, ...],
    speed: float | None,
    report: Path | None,
    json_mode: bool,
) -> None:
    """Diagnose a bag or a measured file with the code of the diagnostic nodes."""
    from gearsim_bringup.pages.folder import check_folder
    from gearsim_bringup.sources import open_source
    from gearsim_io.importers import Overrides

    voice = Voice(json_mode=json_mode)
    if report is not None:
        check_folder(report)
    record, nameplate = open_source(source, machine, Overrides(rate, unit, columns, (), speed))
    from gearsim_dsp.diagnose import diagnose_record  # after what can be refused at once

    diagnosis = diagnose_record(record, nameplate)
    files: tuple[Path, ...] = ()
    if report is not None:
        from gearsim_bringup.diagnosis_report.write import write_report

        files = write_report(report, record, nameplate, diagnosis)
    voice.result(diagnosis.to_json())
    for line in diagnosis.lines():
        voice.say(line)
    for file in files:
        voice.say(f"  {file}")
