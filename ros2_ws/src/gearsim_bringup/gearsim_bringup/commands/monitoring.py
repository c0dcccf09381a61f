"""`gearsim monitoring`: the settings for monitoring stacks."""

from __future__ import annotations

from pathlib import Path

import click

from gearsim_bringup.options import ANY_PATH, example, json_option
from gearsim_bringup.ui import Voice

EXAMPLE = """
./gearsim monitoring --out out/monitoring
prometheus --config.file=out/monitoring/prometheus.yml    # beside ./gearsim run demo --prometheus 9812
"""


@click.command("monitoring", epilog=example(EXAMPLE))
@click.option("--out", type=ANY_PATH, required=True, help="Folder to write to.")
@click.option("--overwrite", is_flag=True, help="Replace files that are there already.")
@json_option
def command(out: Path, overwrite: bool, json_mode: bool) -> None:
    """Write out the settings for Prometheus, Grafana and ROS 2's diagnostic_aggregator."""
    from gearsim_bringup.monitoring.files import FILES, write_files
    from gearsim_io.new_paths import check_place

    check_place(out, "the name of a folder")
    voice = Voice(json_mode=json_mode)
    paths = write_files(out, overwrite=overwrite)
    for path in paths:
        voice.say(f"{path}  {FILES[path.name]}")
    voice.result({"files": [str(path) for path in paths]})
