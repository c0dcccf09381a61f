"""Entry point of the envelope node (`gearsim_dsp.nodes.envelope_node`)."""

import signal
import sys


def main(args: list[str] | None = None) -> int:
    """Run the node until it is told to stop.

    Returns the exit status: 0 after Ctrl-C or SIGTERM, 2 for bad parameters (one line on stderr). Ctrl-C
    while
    the libraries are still being loaded ends the process at once and silently.
    """
    previous = signal.signal(signal.SIGINT, signal.SIG_DFL)
    from gearsim_dsp.nodes.envelope_node import make_node
    from gearsim_io.nodes.run import run_node

    signal.signal(signal.SIGINT, previous)
    return run_node(make_node, "envelope", args)


if __name__ == "__main__":
    sys.exit(main())
