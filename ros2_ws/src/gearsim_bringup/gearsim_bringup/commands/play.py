"""`gearsim play`: a bag as a live stream."""

from __future__ import annotations

from pathlib import Path

import click

from gearsim_bringup.monitoring.choice import Choice
from gearsim_bringup.monitoring.options import monitor_options
from gearsim_bringup.options import ANY_PATH, FiniteRange, example
from gearsim_bringup.processes import NodeSpec, run_here

EXAMPLE = """
./gearsim play out/my_bag
./gearsim play out/my_bag --rate 4 --diagnose
./gearsim play out/my_bag --diagnose --monitors all --prometheus 9812
./gearsim play out/my_bag --twin out/twin_1/extended.yaml
"""


@click.command("play", epilog=example(EXAMPLE))
@click.argument("bag", type=ANY_PATH)
@click.option("--rate", default=1.0, type=FiniteRange(0.01, 100), help="Times the recorded pace.")
@click.option("--loop", is_flag=True, help="Begin again at the end, until Ctrl-C.")
@click.option("--diagnose", is_flag=True, help="Start the diagnostic nodes too and print their alarms.")
@monitor_options
def command(
    bag: Path,
    rate: float,
    loop: bool,
    diagnose: bool,
    choice: Choice,
) -> int:
    """Play a BAG on the topics it was recorded from, with /clock.

    With --diagnose or --twin the bag's own features, spectra and alarms are left out: nodes make new ones.
    """
    from gearsim_bringup.live import player

    if not (diagnose or choice.model):
        from gearsim_io.nodes.player import main

        return run_here(main, player(bag, rate=rate, loop=loop, listeners=0, signals_only=False))
    source = player(bag, rate=rate, loop=loop, listeners=choice.listeners, signals_only=True)
    _judge(bag, source, choice)
    return 0


def _judge(bag: Path, source: NodeSpec, choice: Choice) -> None:
    import tempfile

    from gearsim_bringup.first_use import tell_first_use
    from gearsim_bringup.live import LiveRun
    from gearsim_bringup.tell import Teller
    from gearsim_bringup.ui import Voice
    from gearsim_io import cdr, qos
    from gearsim_io.bags import read_bag
    from gearsim_io.errors import InputError

    first = next(iter(read_bag(bag, (qos.ACCEL.full_name,))), None)
    place = None if first is None else cdr.position(first.data, first.type)
    if place is None:
        raise InputError(str(bag), qos.ACCEL.full_name, "nothing", "samples to diagnose")
    voice = Voice(json_mode=False)
    if choice.model:
        tell_first_use(voice)
    teller = Teller(voice, place.sample_rate_hz)
    with tempfile.TemporaryDirectory(prefix="gearsim_play_") as logs:
        run = LiveRun(source, Path(logs), on_alarm=teller.alarm, on_truth=teller.truth, choice=choice)
        if warning := run.run().warning:
            voice.say(warning)
