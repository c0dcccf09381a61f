"""`gearsim run`: the live graph."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import click

from gearsim_bringup.first_use import tell_first_use
from gearsim_bringup.monitoring.choice import Choice
from gearsim_bringup.monitoring.options import monitor_options
from gearsim_bringup.options import ANY_PATH, POSITIVE, FiniteRange, example
from gearsim_bringup.ui import Voice

EXAMPLE = """
./gearsim run healthy
./gearsim run demo --seconds 30 --record out/my_bag --view out/my_run.rrd
./gearsim run gear_wear --monitors all --latch error --prometheus 9812 --mqtt 127.0.0.1
./gearsim run demo --twin lpm34 --learn 60
"""


@click.command("run", epilog=example(EXAMPLE))
@click.argument("scenario")
@click.option(
    "--seconds", type=POSITIVE, help="End after so many simulated seconds (default: Ctrl-C ends it)."
)
@click.option("--rate", type=FiniteRange(0, 1000), help="Times real time; 0 is as fast as it goes.")
@click.option("--record", "bag", type=ANY_PATH, help="Record to this new bag.")
@click.option("--view", "rrd", type=ANY_PATH, help="Write a rerun recording of the run.")
@monitor_options
def command(
    scenario: str,
    seconds: float | None,
    rate: float | None,
    bag: Path | None,
    rrd: Path | None,
    choice: Choice,
) -> None:
    """Run simulator and diagnostic nodes live on a SCENARIO (a shipped name, or a YAML file).

    Topics are under /gearsim, in the ROS domain of the environment; watch with `ros2 topic echo
    /gearsim/alarm`. Ctrl-C ends it.
    """
    from gearsim_bringup.tell import Teller
    from gearsim_io.new_paths import refuse_existing
    from gearsim_sim.scenario import load_scenario

    for path, what in ((bag, "bag"), (rrd, "file")):
        if path is not None:
            refuse_existing(path, f"the name of a new {what}")
    loaded = load_scenario(scenario)
    from gearsim_bringup.live import LiveRun, simulator  # after what can be refused at once
    from gearsim_bringup.reach import reach_lines
    from gearsim_sim.rehearsal import rehearse

    rehearse(loaded)

    voice = Voice(json_mode=False)
    teller = Teller(voice, loaded.sample_rate_hz)
    listeners = choice.listeners + (bag is not None) + (rrd is not None)
    source = simulator(str(Path(loaded.source)), end_after=seconds or 0.0, rate=rate, listeners=listeners)
    custom: dict[str, Any] = {"scenario": loaded.name, "seed": str(loaded.seed)}
    with tempfile.TemporaryDirectory(prefix="gearsim_run_") as logs:
        voice.say(f"scenario {loaded.name}: {loaded.description}".rstrip(": "))
        for line in reach_lines(loaded, choice.monitors):
            voice.say(line)
        tell_first_use(voice)
        voice.say("topics under /gearsim; Ctrl-C ends the run")
        try:
            live = LiveRun(source, Path(logs), bag, custom, rrd, teller.alarm, teller.truth, choice)
            if warning := live.run().warning:
                voice.say(warning)
        finally:  # also after Ctrl-C, the usual end
            for path in (bag, rrd):
                if path is not None and path.exists():
                    voice.say(f"written: {path}")
