"""Entry point of the twin node (`gearsim_twin.nodes.twin_node`)."""

import sys

from gearsim_io.nodes.entry import run_entry


def main(args: list[str] | None = None) -> int:
    """Run the node until it is told to stop; the exit status (see `run_entry`)."""
    return run_entry("gearsim_twin.nodes.twin_node", "twin", args)


if __name__ == "__main__":
    sys.exit(main())
