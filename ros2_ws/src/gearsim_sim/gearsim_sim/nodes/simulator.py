"""Entry point of the simulator node (`gearsim_sim.nodes.rig`)."""

import signal
import sys


def main(args: list[str] | None = None) -> int:
    """Run the simulator until it is told to stop, or until the end it was given.

    Returns the exit status: 0 after Ctrl-C, SIGTERM or the given end, 2 for bad parameters or a bad
    scenario (one line on stderr). Ctrl-C while the libraries are still being loaded ends the process at
    once and silently (130 in a shell).
    """
    previous = signal.signal(signal.SIGINT, signal.SIG_DFL)
    from gearsim_io.nodes.run import run_node
    from gearsim_sim.nodes.rig import Simulator

    signal.signal(signal.SIGINT, previous)
    return run_node(Simulator, "simulator", args)


if __name__ == "__main__":
    sys.exit(main())
