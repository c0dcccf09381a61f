"""Runs the product's command line and writes down every file that it opens, also in its worker processes.

    GEARSIM_WATCH=log python watched.py twin ...

Only the standard library is used before the hook stands, so nothing of the program escapes it.
"""

from __future__ import annotations

import os
import sys

_LOG = os.environ.get("GEARSIM_WATCH", "")
_EVENTS = ("open", "os.listdir", "os.scandir", "os.chdir")
_seen: set[str] = set()


def _watch(event: str, arguments: tuple[object, ...]) -> None:
    if event not in _EVENTS or not arguments:
        return
    path = arguments[0]
    if isinstance(path, bytes):
        path = os.fsdecode(path)
    if not isinstance(path, str) or path in _seen or path == _LOG:
        return
    _seen.add(path)
    with open(_LOG, "a", encoding="utf-8") as log:
        log.write(os.path.abspath(path) + "\n")


if _LOG:
    sys.addaudithook(_watch)

if __name__ == "__main__":
    # The folder of this file, with all that makes cases, is not for the program to import from.
    sys.path[:] = [entry for entry in sys.path if os.path.abspath(entry or ".") != os.path.dirname(__file__)]
    from gearsim_bringup.cli import main

    sys.exit(main())
