"""Entry point of the recorder node (`gearsim_io.nodes.recorder_node`)."""

import sys

from gearsim_io.nodes.entry import run_entry


def main(args: list[str] | None = None, *, told_status: int = 0) -> int:
    """Run the node until it is told to stop; the exit status (see `run_entry`)."""
    return run_entry("gearsim_io.nodes.recorder_node", "recorder", args, told_status=told_status)


if __name__ == "__main__":
    sys.exit(main())
