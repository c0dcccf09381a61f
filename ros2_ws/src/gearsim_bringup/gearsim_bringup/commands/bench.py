"""`gearsim bench`: figures of speed and size, each beside its baseline."""

from __future__ import annotations

import os
import platform
from typing import Any

import click

from gearsim_bringup.options import example, json_option
from gearsim_bringup.ui import Voice

EXAMPLE = """
./gearsim bench
./gearsim bench --only sim --only dsp --json
./gearsim bench --only sim --peers
"""


@click.command("bench", epilog=example(EXAMPLE))
@click.option(
    "--only", "groups", multiple=True, help="Group of figures, repeatable (default: all but setup)."
)
@click.option(
    "--peers", is_flag=True, help="Install other programs (ROSS) beside this one first, to be measured too."
)
@json_option
def command(groups: tuple[str, ...], peers: bool, json_mode: bool) -> int:
    """Measure what the project promises: every figure as a ratio to a baseline of the same run.

    Groups: sim, dsp, bags, alarms, stream, and setup, which clones the project and sets it up anew.
    """
    from gearsim_bringup.bench.groups import DEFAULT, GROUPS
    from gearsim_bringup.bench.peers import install

    unknown = [name for name in groups if name not in GROUPS]
    if unknown:
        raise click.BadParameter(
            f"got {unknown[0]!r}, expected one of {', '.join(GROUPS)}", param_hint="--only"
        )
    voice = Voice(json_mode=json_mode)
    if peers:
        install(voice)
    figures = []
    for name in groups or DEFAULT:
        voice.say(f"{name} ...")
        for figure in GROUPS[name](voice):
            figures.append(figure)
            compared = ""
            if figure.baseline is not None:
                compared = f", {figure.ratio:.3g} of {figure.baseline[0]} ({figure.baseline[1]:.4g})"
            verdict = "met" if figure.met else "NOT MET"
            voice.say(
                f"  {figure.name:32} {figure.value:10.4g} {figure.unit}{compared}; goal {figure.goal}: "
                f"{verdict}"
            )
    voice.result({"machine": _machine(), "figures": [figure.as_json() for figure in figures]})
    return 0


def _machine() -> dict[str, Any]:
    model = ""
    try:
        with open("/proc/cpuinfo") as lines:
            model = next(
                (line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), ""
            )
    except OSError:
        pass
    return {
        "processor": model or platform.processor(),
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "python": platform.python_version(),
    }
