"""Entry point of the exporter node (`gearsim_bringup.monitoring.nodes.exporter_node`)."""

import sys

from gearsim_io.nodes.entry import run_entry


def main(args: list[str] | None = None) -> int:
    """Run the node until it is told to stop; the exit status (see `run_entry`)."""
    return run_entry("gearsim_bringup.monitoring.nodes.exporter_node", "exporter", args)


if __name__ == "__main__":
    sys.exit(main())
