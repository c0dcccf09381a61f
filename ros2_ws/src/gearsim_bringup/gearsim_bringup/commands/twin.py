"""`gearsim twin`: what a simulation gets wrong, why, the extended model, and the gain."""

from __future__ import annotations

from pathlib import Path

import click

from gearsim_bringup.options import ANY_PATH, POSITIVE, SPEED, SPEED_HELP, SeveralValues, example, json_option
from gearsim_bringup.ui import Voice

EXAMPLE = """
./gearsim twin rec --machine unsw_parallel --model lpm34
./gearsim twin OuterRaceFault_vload_1.mat OuterRaceFault_vload_5.mat --machine mfpt --model bearing5 \\
    --healthy baseline_1.mat --holdout OuterRaceFault_vload_3.mat --report out/mfpt
./gearsim simulate out/mfpt/extended.yaml --seconds 10 --out out/again
"""


class _Twin(SeveralValues):
    several = ("--healthy", "--holdout")


@click.command("twin", cls=_Twin, epilog=example(EXAMPLE))
@click.argument("measured", type=ANY_PATH, nargs=-1, required=True, metavar="MEASURED...")
@click.option("--machine", required=True, help="Machine description: a shipped name, or a YAML file.")
@click.option("--model", required=True, help="Model that is to be judged, such as lpm34.")
@click.option(
    "--healthy",
    type=ANY_PATH,
    multiple=True,
    metavar="FILE...",
    help="Records of the same machine without the effect; the model is calibrated on them first.",
)
@click.option(
    "--holdout",
    type=ANY_PATH,
    multiple=True,
    metavar="FILE...",
    help="Records that nothing is fitted to, for the score; by default the last third of each.",
)
@click.option("--rate", type=POSITIVE, help="Sampling rate in Hz of files; must agree with what they say.")
@click.option("--unit", help="Unit of the files' samples, such as g or m/s^2.")
@click.option("--column", "--variable", "columns", multiple=True, help="Variable to take; repeatable.")
@click.option("--speed", type=SPEED, help=SPEED_HELP)
@click.option(
    "--workers", type=click.IntRange(1, 256), help="Processes; default: as many as cores, two at most."
)
@click.option("--seed", type=click.IntRange(0), default=1, show_default=True, help="Of all random numbers.")
@click.option("--report", type=ANY_PATH, metavar="DIR", help="New folder for page, verdict, extended model.")
@json_option
def command(
    measured: tuple[Path, ...],
    machine: str,
    model: str,
    healthy: tuple[Path, ...],
    holdout: tuple[Path, ...],
    rate: float | None,
    unit: str | None,
    columns: tuple[str, ...],
    speed: float | None,
    workers: int | None,
    seed: int,
    report: Path | None,
    json_mode: bool,
) -> None:
    """Judge a simulation by measured records: what it gets wrong, why, and what mends it.

    Without --report page, verdict and extended model go to a new folder out/twin_N.
    """
    from gearsim_bringup.pages.folder import check_folder
    from gearsim_bringup.twin_run import lines, new_folder, run_judge
    from gearsim_io.importers import Overrides
    from gearsim_twin.given import HEALTHY, HELD_OUT, MEASURED, check_given

    voice = Voice(json_mode=json_mode)
    folder = report or new_folder()
    check_folder(folder)
    check_given({MEASURED: measured, HELD_OUT: holdout, HEALTHY: healthy}, machine, model)
    from gearsim_twin.case import load_case  # after what can be refused at once

    overrides = Overrides(rate, unit, columns, (), speed)
    case = load_case(measured, machine, model, healthy, holdout, overrides)
    for remark in case.remarks:
        voice.say(f"note: {remark}")
    verdict = run_judge(case, folder, workers, seed)
    for remark in verdict.remarks[len(case.remarks) :]:
        voice.say(f"note: {remark}")
    voice.result(verdict.to_json())
    for line in lines(verdict):
        voice.say(line)
