"""How a node's process begins: nothing heavy is imported before Ctrl-C has a meaning."""

from __future__ import annotations

import signal
from collections.abc import Sequence
from importlib import import_module


def run_entry(module: str, name: str, args: Sequence[str] | None = None, *, told_status: int = 0) -> int:
    """Import `module`, make the node by its `make_node()`, and run it until it is told to stop.

    Returns the exit status: `told_status` after Ctrl-C or SIGTERM, 0 after the node's own end, 2 for bad
    parameters or input (one line on stderr). Ctrl-C while the libraries are still being loaded, which takes
    a second or two, ends the process at once and silently (130 in a shell).
    """
    previous = signal.signal(signal.SIGINT, signal.SIG_DFL)
    make_node = import_module(module).make_node
    run_node = import_module("gearsim_io.nodes.run").run_node
    signal.signal(signal.SIGINT, previous)
    status: int = run_node(make_node, name, args, told_status=told_status)
    return status
