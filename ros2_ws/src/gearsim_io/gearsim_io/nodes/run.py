"""Runs one node until it is told to stop: clean on Ctrl-C and SIGTERM, one line on bad input."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from collections.abc import Callable, Sequence
from types import FrameType

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from gearsim_io.errors import EnvironmentLackError, InputError

WAKE_S = 0.1


def run_node(make_node: Callable[[], Node], name: str, args: Sequence[str] | None = None) -> int:
    """Spin the node that `make_node` makes, in a single-threaded executor.

    SIGINT and SIGTERM end it with status 0; before that its method `finish()`, if it has one, is called
    while the node can still publish. A second signal ends the process at once. `InputError` and parameters
    that the node refuses give one line on stderr and status 2, `EnvironmentLackError` status 3.

    Parameters
    ----------
    make_node : callable
        Makes the node; called after rclpy is ready.
    name : str
        Who speaks in error messages.
    args : sequence of str, optional
        Command line, the process's own by default.
    """
    stopping = False

    def stop(_signum: int, _frame: FrameType | None) -> None:
        nonlocal stopping
        if stopping:
            os._exit(130)
        stopping = True

    previous = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    node: Node | None = None
    try:
        # rclpy's own handlers would end the context before the node could say goodbye.
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        node = make_node()
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        while not stopping:
            executor.spin_once(timeout_sec=WAKE_S)
        executor.shutdown()
        finish = getattr(node, "finish", None)
        if finish is not None:
            finish()
    except (InputError, ParameterException) as error:
        print(f"{name}: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    except EnvironmentLackError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 3
    finally:
        if node is not None:
            node.destroy_node()
        with contextlib.suppress(Exception):  # already down, or never up
            rclpy.try_shutdown()
        for number, handler in previous.items():
            signal.signal(number, handler)
    return 0
