"""`gearsim scenarios`: what can be run and simulated by name."""

from __future__ import annotations

import click

from gearsim_bringup.options import example, json_option
from gearsim_bringup.ui import Voice

EXAMPLE = """
./gearsim scenarios
./gearsim scenarios crack
"""


@click.command("scenarios", epilog=example(EXAMPLE))
@click.argument("word", default="")
@json_option
def command(word: str, json_mode: bool) -> None:
    """List the shipped scenarios with a line on each; with a WORD those that have it in name or line."""
    from gearsim_io.errors import InputError
    from gearsim_sim.scenario import scenario_names, scenario_summary

    voice = Voice(json_mode=json_mode)
    every = {name: scenario_summary(name) for name in scenario_names()}
    found = {name: text for name, text in every.items() if word.lower() in f"{name} {text}".lower()}
    if not found:
        raise InputError("scenarios", "", word, "a word of a scenario's name or line")
    width = max(map(len, found))
    for name, text in found.items():
        voice.say(f"{name:<{width}}  {text}")
    voice.result({"scenarios": [{"name": name, "description": text} for name, text in found.items()]})
