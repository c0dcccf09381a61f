"""`gearsim ensemble`: many variants of one machine at once."""

from __future__ import annotations

import os
import time
from pathlib import Path

import click

from gearsim_bringup.first_use import tell_first_use
from gearsim_bringup.options import ANY_PATH, POSITIVE, example, json_option
from gearsim_bringup.ui import Voice

EXAMPLE = """
./gearsim ensemble examples/ensemble.yaml --seconds 10 --out out/ensemble
./gearsim ensemble my_variants.yaml --seconds 2 --out out/variants --workers 4 --json
"""


@click.command("ensemble", epilog=example(EXAMPLE))
@click.argument("spec", type=ANY_PATH)
@click.option("--seconds", required=True, type=POSITIVE, help="Simulated seconds of each variant.")
@click.option("--out", required=True, type=ANY_PATH, help="New folder for one .npz per variant.")
@click.option("--workers", type=click.IntRange(min=1), help="Threads (default: as many as cores).")
@json_option
def command(spec: Path, seconds: float, out: Path, workers: int | None, json_mode: bool) -> None:
    """Run the variants that the YAML file SPEC describes, all at once: a base scenario, and what differs.

    Written are clean accelerations at the machine's sites; sensors belong to simulate and run.
    """
    from gearsim_io.new_paths import refuse_existing
    from gearsim_io.quantities import read_yaml

    voice = Voice(json_mode=json_mode)
    refuse_existing(out, "the name of a new folder")
    read_yaml(spec)
    from gearsim_bringup.ensemble_files import chosen, run_to  # after what can be refused at once
    from gearsim_sim.ensemble_spec import load_ensemble_spec

    loaded = load_ensemble_spec(spec)
    threads = workers or os.cpu_count() or 1
    tell_first_use(voice)
    began, used = time.monotonic(), time.process_time()
    with voice.progress() as bar:
        task = bar.add_task(f"simulating {len(loaded.variants)} variants", total=seconds)
        files = run_to(loaded, seconds, out, threads, lambda done: bar.update(task, completed=done))
    simulated = seconds * len(loaded.variants)
    per_core = simulated / (time.process_time() - used)
    voice.say(
        f"{len(loaded.variants)} variants of {loaded.base.name}, {seconds:g} s each: "
        f"{simulated / (time.monotonic() - began):.1f}x real time in all with set-up and writing, "
        f"{per_core:.1f} machines in real time per core"
    )
    for file in files:
        voice.say(f"  {file}")
    voice.result(
        {
            "base": loaded.base.name,
            "sample_rate_hz": loaded.base.sample_rate_hz,
            "seconds": seconds,
            "variants": [
                {"name": one.name, "file": str(file), "chosen": chosen(one)}
                for one, file in zip(loaded.variants, files, strict=False)
            ],
            "table": str(files[-1]),
            "machines_per_core": per_core,
        }
    )
