"""`gearsim evaluate`: how often the diagnosis is right, on random simulated machines."""

from __future__ import annotations

from pathlib import Path

import click

from gearsim_bringup.first_use import tell_first_use
from gearsim_bringup.options import ANY_PATH, example, json_option
from gearsim_bringup.ui import Voice

EXAMPLE = """
./gearsim evaluate --set random --cases 60 --seed 1 --out out/evaluation
./gearsim evaluate --set random --cases 500 --seed 2 --out out/judged --page docs/evaluation.md
"""


@click.command("evaluate", epilog=example(EXAMPLE))
@click.option(
    "--set", "set_name", default="random", show_default=True, help="random, healthy, thesis or table77."
)
@click.option("--cases", default=60, show_default=True, type=click.IntRange(min=0), help="How many.")
@click.option(
    "--seed", default=1, show_default=True, type=click.IntRange(min=0), help="Of all that is drawn."
)
@click.option("--out", required=True, type=ANY_PATH, help="Folder of the results; a run there is continued.")
@click.option("--workers", default=1, show_default=True, type=click.IntRange(min=1), help="Processes.")
@click.option("--page", type=ANY_PATH, help="Write this page from all results in the folder.")
@click.option(
    "--fit", is_flag=True, help="Fit the confidence to all results in the folder; needs a checkout."
)
@json_option
def command(
    set_name: str,
    cases: int,
    seed: int,
    out: Path,
    workers: int,
    page: Path | None,
    fit: bool,
    json_mode: bool,
) -> None:
    """Simulate random machines with and without faults, diagnose them, and count what is right."""
    from gearsim_bringup.evaluation.fit import fit_all
    from gearsim_bringup.evaluation.page import evaluation_page, summary
    from gearsim_bringup.evaluation.rejudge import rejudged
    from gearsim_bringup.evaluation.run import evaluate, read_results

    voice = Voice(json_mode=json_mode)
    tell_first_use(voice)
    with voice.progress() as bar:
        task = bar.add_task("evaluating", total=max(cases, 1))
        results = evaluate(
            set_name, cases, seed, out, workers, lambda done, _total: bar.update(task, completed=done)
        )
    everything = read_results(out)
    if fit:
        for line in fit_all(everything, f"gearsim evaluate --fit, {len(everything)} results in {out.name}"):
            voice.say(line)
        voice.result({"fitted": len(everything)})
        return
    if page is not None:
        page.parent.mkdir(parents=True, exist_ok=True)
        page.write_text(evaluation_page([rejudged(one) for one in everything]))
    numbers = summary([rejudged(one) for one in results])
    for name, value in numbers.items():
        voice.say(f"{name.replace('_', ' ')}: {value:.4g}")
    voice.result(numbers)
