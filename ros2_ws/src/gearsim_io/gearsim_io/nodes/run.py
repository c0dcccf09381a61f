"""Runs one node until it is told to stop: clean on Ctrl-C and SIGTERM, one line on bad input."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import time
from collections.abc import Callable, Sequence
from types import FrameType

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from gearsim_io.errors import EnvironmentLackError, InputError

WAKE_S = 0.1
PATIENCE_S = 1.0


def run_node(
    make_node: Callable[[], Node], name: str, args: Sequence[str] | None = None, *, told_status: int = 0
) -> int:
    """Spin the node that `make_node` makes, in a single-threaded executor.

    SIGINT and SIGTERM end it with `told_status`, and a node ends by itself when it sets its attribute
    `exit_status` to a number; before the end its method `finish()`, if it has one, is called while the
    node can still publish. A signal more than a second after the first ends the process at once (not
    earlier: Ctrl-C often reaches a process twice, from the terminal and from its parent).
    `InputError` and parameters that the node refuses give one line on stderr and status 2,
    `EnvironmentLackError` status 3.

    Parameters
    ----------
    make_node : callable
        Makes the node; called after rclpy is ready.
    name : str
        Who speaks in error messages.
    args : sequence of str, optional
        Command line, the process's own by default.
    told_status : int
        What is returned after a signal; 0, as a node that is told to stop has done its job.
    """
    stopping = False
    told_s = 0.0

    def stop(_signum: int, _frame: FrameType | None) -> None:
        nonlocal stopping, told_s
        if stopping and time.monotonic() - told_s > PATIENCE_S:
            os._exit(130)
        if not stopping:
            stopping, told_s = True, time.monotonic()

    previous = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    node: Node | None = None
    try:
        # rclpy's own handlers would end the context before the node could say goodbye.
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        node = make_node()
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        while not stopping and getattr(node, "exit_status", None) is None:
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
    return getattr(node, "exit_status", None) or (told_status if stopping else 0)
