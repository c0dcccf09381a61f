"""`gearsim casing`: finite elements of the gearbox's casing, their checks and their reduction."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gearsim_bringup.commands.casing_update import update
from gearsim_bringup.options import ANY_PATH, POSITIVE, example, json_option
from gearsim_bringup.ui import Voice

if TYPE_CHECKING:
    from gearsim_sim.model.casing.reduced import ReducedCasing
    from gearsim_sim.model.casing.reduction import Tell

DEFAULT = "unsw_casing"
IN_MACHINE = "unsw_casing_updated"  # of the shipped gearbox
SENSOR_HELP = "NAME:X,Y,Z:DIRECTION in metres, or a node's number (--deck) for X,Y,Z; repeatable."
GROUP_EXAMPLE = """
./gearsim casing check
./gearsim casing reduce --out out/casing.npz
./gearsim casing show --out out/casing
./gearsim casing update --out out/updated
"""
BUILD_EXAMPLE = """
./gearsim casing build --out out/matrices
./gearsim casing build my_casing.yaml --free --deck out/my_casing.bdf
"""
REDUCE_EXAMPLE = """
./gearsim casing reduce --out out/casing.npz
./gearsim casing reduce my_casing.yaml --modes 300 --band 8000 --sensor lid:0,0.12,0.03:y --out out/mine.npz
./gearsim casing reduce my_matrices.yaml --out out/mine.npz    # your own K and M, see docs/casing.md
"""
RESPONSES_EXAMPLE = """
./gearsim casing responses --out out/responses.npz
./gearsim casing responses out/mine.npz --band 8000 --out out/responses.npz   # from a reduced casing
"""


@click.group("casing", epilog=example(GROUP_EXAMPLE))
def command() -> None:
    """Build, check, update, reduce and show finite-element models of a gearbox's casing.

    CASING is a shipped name or the path of a description (.yaml), see docs/casing.md.
    """


@command.command("build", epilog=example(BUILD_EXAMPLE))
@click.argument("casing", default=DEFAULT)
@click.option("--free", is_flag=True, help="Without its pads, as hung up in a modal test.")
@click.option(
    "--out", type=ANY_PATH, help="Folder for mass, stiffness and a description that `reduce` reads."
)
@click.option("--deck", type=ANY_PATH, help="Nastran deck (.bdf) to write, for other programs.")
@json_option
def build(casing: str, free: bool, out: Path | None, deck: Path | None, json_mode: bool) -> None:
    """Mesh CASING and assemble its mass and stiffness."""
    from gearsim_sim.model.casing.build import build_structure
    from gearsim_sim.model.casing.described import load_described
    from gearsim_sim.model.casing.export import write_deck_of, write_matrices

    voice = Voice(json_mode=json_mode)
    params = load_described(casing)
    structure = build_structure(params, free=free)
    mesh = structure.mesh
    voice.say(f"{params.name}: {len(mesh.quads)} shells, {len(mesh.hexes)} solid elements,")
    voice.say(f"  {len(mesh.nodes_m)} nodes, {structure.size} independent displacements")
    files = write_matrices(structure, params, out) if out else []
    if deck:
        files.append(write_deck_of(structure, params, deck))
    for file in files:
        voice.say(f"  {file}")
    counts = {"shells": len(mesh.quads), "solids": len(mesh.hexes), "nodes": len(mesh.nodes_m)}
    told = [str(file) for file in files]
    voice.result({"name": params.name, **counts, "displacements": structure.size, "files": told})


@command.command("check", epilog=example("./gearsim casing check --finer"))
@click.argument("casing", default=DEFAULT)
@click.option("--finer", is_flag=True, help="Also against a mesh of twice as many elements (minutes).")
@json_option
def check(casing: str, finer: bool, json_mode: bool) -> int:
    """Check the elements against closed forms, and CASING against what must hold of it."""
    from gearsim_sim.model.casing.checks import casing_checks, element_checks
    from gearsim_sim.model.casing.params import load_casing

    voice = Voice(json_mode=json_mode)
    params = load_casing(casing)
    found = []
    with voice.progress() as bar:
        task = bar.add_task("elements", total=None)
        of_casing = casing_checks(params, finer=finer, tell=lambda step: bar.update(task, description=step))
        for one in chain(element_checks(), of_casing):
            found.append(one)
            mark = "ok  " if one.met else "FAIL"
            figure = f"{one.value:.3g} {one.unit} (at most {one.limit:g})"
            voice.say(f"{mark} {one.name}: {figure}; {one.detail}".rstrip("; "))
    content = [
        {"name": one.name, "value": one.value, "limit": one.limit, "unit": one.unit, "met": one.met}
        for one in found
    ]
    voice.result({"name": params.name, "checks": content})
    return 0 if all(one.met for one in found) else 1


@command.command("reduce", epilog=example(REDUCE_EXAMPLE))
@click.argument("casing", default=DEFAULT)
@click.option("--out", required=True, type=ANY_PATH, help="File to write (.npz).")
@click.option(
    "--modes", default=100, show_default=True, type=click.IntRange(min=0), help="Kept beside masters."
)
@click.option("--band", "band_hz", type=POSITIVE, help="Refuse unless valid up to here [Hz].")
@click.option("--sensor", "sensors", multiple=True, help=SENSOR_HELP)
@json_option
def reduce(
    casing: str, out: Path, modes: int, band_hz: float | None, sensors: tuple[str, ...], json_mode: bool
) -> None:
    """Reduce CASING, or your own matrices, to its bearing seats and some modes (Craig-Bampton)."""
    from gearsim_sim.model.casing.reduce_file import check_target, reduce_description
    from gearsim_sim.model.casing.reduced import save_reduced

    voice = Voice(json_mode=json_mode)
    check_target(out)
    with _telling(voice) as tell:
        reduced = reduce_description(casing, modes, sensors, band_hz, tell)
    save_reduced(reduced, out)
    _tell_reduced(voice, reduced, out)


@contextmanager
def _telling(voice: Voice) -> Iterator[Tell]:
    """A bar that a reduction moves by telling its step and how much is done."""
    with voice.progress() as bar:
        task = bar.add_task("reading", total=1.0)
        yield lambda step, done: bar.update(task, description=step, completed=done)


def _tell_reduced(voice: Voice, reduced: ReducedCasing, out: Path) -> None:
    about = reduced.provenance
    voice.say(f"{reduced.name}: {about['displacements']} displacements reduced to {reduced.size}")
    voice.say(f"  {6 * len(reduced.masters)} of {', '.join(reduced.masters)}, and {reduced.modes} modes")
    accuracy = ", ".join(f"{100 * share:g} % below {high:g} Hz" for high, share in about["accuracy"])
    voice.say(f"  valid up to {reduced.valid_hz:.0f} Hz (own frequencies within {accuracy});")
    voice.say(f"  the first mode left out is at {about['cutoff_hz']:.0f} Hz")
    voice.say(f"  sensors: {', '.join(site.name for site in reduced.sites) or 'none'}")
    voice.say(f"  {out}")
    voice.result(
        {
            "name": reduced.name,
            "file": str(out),
            "size": reduced.size,
            "masters": reduced.masters,
            "modes": reduced.modes,
            "valid_hz": reduced.valid_hz,
            "cutoff_hz": about["cutoff_hz"],
            "sensors": [site.name for site in reduced.sites],
        }
    )


@command.command("responses", epilog=example(RESPONSES_EXAMPLE))
@click.argument("casing", default=IN_MACHINE)
@click.option("--out", required=True, type=ANY_PATH, help="File to write (.npz).")
@click.option(
    "--modes", default=1000, show_default=True, type=click.IntRange(min=0), help="Kept beside masters."
)
@click.option(
    "--band",
    "band_hz",
    type=POSITIVE,
    default=20000.0,
    show_default=True,
    help="Refuse unless valid so far [Hz].",
)
@click.option("--sensor", "sensors", multiple=True, help=SENSOR_HELP)
@json_option
def responses(
    casing: str, out: Path, modes: int, band_hz: float, sensors: tuple[str, ...], json_mode: bool
) -> None:
    """Frequency responses of CASING from its bearing seats to its sensors, for `path: frf` in scenarios.

    CASING may also be a file that `reduce` has made.
    """
    from gearsim_sim.frf.file import save_responses
    from gearsim_sim.frf.make import make_responses
    from gearsim_sim.model.casing.reduce_file import check_target

    voice = Voice(json_mode=json_mode)
    check_target(out)
    with _telling(voice) as tell:
        found = make_responses(casing, modes, sensors, band_hz, tell)
    save_responses(found, out)
    voice.say(f"{found.name}: responses to {len(found.inputs)} forces, {', '.join(found.inputs)}")
    voice.say(f"  {len(found.omega)} modes, valid up to {found.valid_hz:.0f} Hz")
    voice.say(f"  sensors: {', '.join(found.sites) or 'none'}")
    voice.say(f"  {out}")
    content = {"name": found.name, "file": str(out), "modes": len(found.omega), "valid_hz": found.valid_hz}
    voice.result({**content, "forces": found.inputs, "sensors": found.sites})


@command.command("show", epilog=example("./gearsim casing show --modes 12 --out out/casing"))
@click.argument("casing", default=DEFAULT)
@click.option("--out", required=True, type=ANY_PATH, help="Folder for the pictures.")
@click.option("--modes", default=12, show_default=True, type=click.IntRange(1, 60), help="Mode shapes drawn.")
@click.option("--mounted", is_flag=True, help="On its pads; otherwise hung up freely.")
@json_option
def show(casing: str, out: Path, modes: int, mounted: bool, json_mode: bool) -> None:
    """Draw the mesh of CASING and its first elastic modes."""
    from gearsim_bringup.casing_pictures.page import draw_casing
    from gearsim_sim.model.casing.described import load_described

    voice = Voice(json_mode=json_mode)
    params = load_described(casing)
    with voice.progress() as bar:
        task = bar.add_task("pictures", total=None)
        files, frequencies = draw_casing(
            params, out, modes, mounted=mounted, tell=lambda step: bar.update(task, description=step)
        )
    for file in files:
        voice.say(f"  {file}")
    voice.result({"files": [str(file) for file in files], "frequencies_hz": frequencies})


command.add_command(update)
