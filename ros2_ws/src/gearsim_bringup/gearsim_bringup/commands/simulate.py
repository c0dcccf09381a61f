"""`gearsim simulate`: the signals of a scenario offline, as fast as they can be made."""

from __future__ import annotations

import dataclasses
import time
from pathlib import Path

import click

from gearsim_bringup.first_use import tell_first_use
from gearsim_bringup.options import ANY_PATH, FORMATS, POSITIVE, example, json_option
from gearsim_bringup.ui import Voice

EXAMPLE = """
./gearsim simulate demo --seconds 30 --out out/demo_bag
./gearsim simulate my_scenario.yaml --seconds 10 --out out/run --format mcap,npz,wav
"""


def _formats(_context: click.Context, _option: click.Parameter, text: str) -> tuple[str, ...]:
    names = tuple(dict.fromkeys(name.strip() for name in text.split(",")))
    unknown = [name for name in names if name not in FORMATS]
    if unknown:
        raise click.BadParameter(f"got {unknown[0]!r}, expected some of {', '.join(FORMATS)}")
    return names


@click.command("simulate", epilog=example(EXAMPLE))
@click.argument("scenario")
@click.option("--seconds", required=True, type=POSITIVE, help="Simulated seconds.")
@click.option("--out", required=True, type=ANY_PATH, help="New folder for the bag and the other formats.")
@click.option("--format", "formats", default="mcap", callback=_formats, help="Some of mcap, npz, wav.")
@click.option("--seed", type=click.IntRange(min=0), help="Seed in place of the scenario's.")
@json_option
def command(
    scenario: str, seconds: float, out: Path, formats: tuple[str, ...], seed: int | None, json_mode: bool
) -> None:
    """Run a SCENARIO (a shipped name, or a YAML file) offline: bit for bit what the live rig sends."""
    from gearsim_io.new_paths import refuse_existing
    from gearsim_sim.scenario import load_scenario

    voice = Voice(json_mode=json_mode)
    refuse_existing(out, "the name of a new folder")
    loaded = load_scenario(scenario)
    from gearsim_bringup.offline import simulate_to  # after what can be refused at once
    from gearsim_sim.rehearsal import rehearse

    rehearse(loaded)
    if seed is not None:
        loaded = dataclasses.replace(loaded, seed=seed)
    tell_first_use(voice)
    began = time.monotonic()
    with voice.progress() as bar:
        task = bar.add_task(f"simulating {loaded.name}", total=seconds)
        made = simulate_to(loaded, seconds, out, formats, lambda done: bar.update(task, completed=done))
    factor = made.seconds / (time.monotonic() - began)
    voice.say(
        f"{made.samples} samples of {len(made.channels)} channels at {made.sample_rate_hz:g} Hz "
        f"({factor:.1f}x real time with set-up and writing)"
    )
    for file in made.files:
        voice.say(f"  {file}")
    voice.result(
        {
            "scenario": loaded.name,
            "seed": loaded.seed,
            "samples": made.samples,
            "seconds": made.seconds,
            "sample_rate_hz": made.sample_rate_hz,
            "channels": list(made.channels),
            "files": [str(file) for file in made.files],
            "real_time_factor": factor,
        }
    )
