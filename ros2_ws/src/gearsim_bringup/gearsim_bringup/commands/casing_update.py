"""`gearsim casing update`: plate thickness against a modal test."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gearsim_bringup.options import ANY_PATH, POSITIVE, example, json_option
from gearsim_bringup.ui import Voice

if TYPE_CHECKING:
    from gearsim_sim.model.casing.params import CasingParams
    from gearsim_sim.model.casing.updating import Tell, Update

EXAMPLE = """
./gearsim casing update --out out/updated
./gearsim casing update --test measured.uff --placement placement.yaml --out out/mine
./gearsim casing update --hammer 1 --out out/hammer     # a virtual test of a casing that differs
"""


@click.command("update", epilog=example(EXAMPLE))
@click.argument("casing", default="unsw_casing")
@click.option("--out", required=True, type=ANY_PATH, help="Folder for description, table and pictures.")
@click.option("--steps", default=9, show_default=True, type=click.IntRange(1, 50), help="At most so many.")
@click.option("--mirrored", is_flag=True, help="Mirror images of a strip change alike.")
@click.option("--test", type=ANY_PATH, help="Universal file (.uff) of a modal test in place of the thesis's.")
@click.option("--placement", type=ANY_PATH, help="YAML: where the test's points lie, see docs/casing.md.")
@click.option("--band", nargs=2, type=POSITIVE, help="Modes of the test between two frequencies [Hz].")
@click.option(
    "--hammer", type=click.IntRange(min=0), help="Seed of a virtual hammer test in place of the thesis's."
)
@click.option("--export", type=ANY_PATH, help="Universal file (.uff) for the virtual test's responses.")
@json_option
def update(
    casing: str,
    out: Path,
    steps: int,
    mirrored: bool,
    test: Path | None,
    placement: Path | None,
    band: tuple[float, float] | None,
    hammer: int | None,
    export: Path | None,
    json_mode: bool,
) -> None:
    """Update CASING's plate thickness by regions to the modal test of the thesis (Table 3.1).

    With --test to a test of your own: frequency responses, whose modes are identified, or mode shapes. With
    --hammer a casing whose welds differ is struck instead. Modes of both are paired by MAC, and mirror images
    change alike.
    """
    from gearsim_bringup.casing_pictures.update_page import folder_for, write_update
    from gearsim_sim.model.casing.against_thesis import BASIS, update_to_thesis
    from gearsim_sim.model.casing.params import load_casing

    _check_options(test, placement, band, hammer, export)
    voice = Voice(json_mode=json_mode)
    params = load_casing(casing)
    content: dict[str, Any] = {"name": params.name}
    with folder_for(out), voice.progress() as bar:
        task = bar.add_task("mesh", total=None)
        tell = lambda step: bar.update(task, description=step)  # noqa: E731
        if test is not None:
            found, files = _to_file(casing, params, (test, placement, band), steps, out, tell, content)
        elif hammer is not None:
            found, files = _to_virtual(casing, params, hammer, steps, (out, export), tell, content)
        else:
            found = update_to_thesis(params, steps, mirrored=mirrored, tell=tell)
            files = write_update(casing, found, BASIS, out, tell)
    _tell_updated(voice, found, files, content)


def _check_options(
    test: Path | None,
    placement: Path | None,
    band: tuple[float, float] | None,
    hammer: int | None,
    export: Path | None,
) -> None:
    """Options that need another one, or contradict one."""
    from gearsim_sim.model.casing.universal_export import check_export

    if test is not None and hammer is not None:
        raise click.UsageError("--test and --hammer: one of them at a time")
    for name, value in (("--placement", placement), ("--band", band)):
        if value is not None and test is None:
            raise click.UsageError(f"{name} goes with --test")
    if export is not None:
        if hammer is None:
            raise click.UsageError("--export goes with --hammer")
        check_export(export)


def _to_file(
    casing: str,
    params: CasingParams,
    source: tuple[Path, Path | None, tuple[float, float] | None],
    steps: int,
    out: Path,
    tell: Tell,
    content: dict[str, Any],
) -> tuple[Update, list[Path]]:
    from gearsim_bringup.casing_pictures.update_page import write_test, write_update
    from gearsim_sim.model.casing.measured_test import update_to_file

    measured = update_to_file(params, *source, steps, tell)
    found = measured.tested.update
    files = write_update(casing, found, f"modal test {source[0].name}", out, tell)
    files += write_test(measured.tested, measured.test, out)
    content["modes_of_test"] = measured.tested.identified.frequencies_hz.tolist()
    return found, files


def _to_virtual(
    casing: str,
    params: CasingParams,
    seed: int,
    steps: int,
    targets: tuple[Path, Path | None],
    tell: Tell,
    content: dict[str, Any],
) -> tuple[Update, list[Path]]:
    from gearsim_bringup.casing_pictures.update_page import write_test, write_update
    from gearsim_sim.model.casing.universal_export import write_modal_test
    from gearsim_sim.model.casing.virtual_test import run_virtual_test

    out, export = targets
    virtual = run_virtual_test(params, seed, steps, tell)
    found = virtual.tested.update
    basis = f"virtual hammer test {seed}"
    files = write_update(casing, found, basis, out, tell)
    files += write_test(virtual.tested, virtual.test, out)
    if export is not None:
        write_modal_test(virtual.tested.plan, virtual.test, virtual.mesh, f"{params.name}: {basis}", export)
        files.append(export)
    content["modes_of_test"] = virtual.tested.identified.frequencies_hz.tolist()
    content["true_change"] = dict(zip(found.regions, virtual.true_change.tolist(), strict=True))
    return found, files


def _tell_updated(voice: Voice, found: Update, files: list[Path], content: dict[str, Any]) -> None:
    if "modes_of_test" in content:
        voice.say(f"{len(content['modes_of_test'])} modes of the test")
    for name, after in (("before", False), ("after", True)):
        off = 100 * abs(found.deviations(after=after))
        content[name] = {
            "pairs": len(off),
            "mean_percent": float(off.mean()),
            "worst_percent": float(off.max()),
        }
        voice.say(
            f"{name + ':':8}{len(off)} frequencies off by {off.mean():.2f} %, {off.max():.2f} % at worst"
        )
    for file in files:
        voice.say(f"  {file}")
    changes = dict(zip(found.regions, found.change.tolist(), strict=True))
    told = [str(file) for file in files]
    voice.result({**content, "steps": found.steps, "change": changes, "files": told})
