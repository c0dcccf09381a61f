"""Run a tool: output to a log file, nothing of it left running when we are stopped."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

GRACE_S = 5.0


def run_logged(
    argv: Sequence[str],
    *,
    log: Path,
    env: Mapping[str, str],
    cwd: Path | None = None,
    on_line: Callable[[str], None] | None = None,
    keep_open: Sequence[int] = (),
) -> int:
    """Run `argv` to its end and append what it says to `log`.

    Parameters
    ----------
    argv : sequence of str
        The command.
    log : Path
        File that takes stdout and stderr; its folder is made when missing.
    env : mapping
        The whole environment of the command.
    cwd : Path, optional
        Where it runs.
    on_line : callable, optional
        Called with each line of output.
    keep_open : sequence of int
        File descriptors that the command inherits. Set-up passes its lock, so that the lock
        outlives a killed set-up for as long as the tool it started is still writing.

    Returns
    -------
    int
        Exit status, negative for a signal; 127 when the command could not be started.

    Raises
    ------
    KeyboardInterrupt
        When we are interrupted; the command and all it started have been stopped by then.
    """
    log.parent.mkdir(parents=True, exist_ok=True)
    with log.open("a", encoding="utf-8", errors="replace") as sink:
        sink.write(f"$ {' '.join(argv)}\n")
        sink.flush()
        try:
            child = subprocess.Popen(
                list(argv),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                env=dict(env),
                cwd=cwd,
                text=True,
                errors="replace",
                process_group=0,
                pass_fds=tuple(keep_open),
            )
        except OSError as error:
            sink.write(f"{error}\n")
            return 127
        try:
            assert child.stdout is not None
            for line in child.stdout:
                sink.write(line)
                sink.flush()
                if on_line is not None:
                    on_line(line.rstrip("\n"))
            return child.wait()
        except BaseException:
            _stop(child)
            raise


def _stop(child: subprocess.Popen[str]) -> None:
    """End the command's whole process group, first politely."""
    for number, grace_s in ((signal.SIGTERM, GRACE_S), (signal.SIGKILL, GRACE_S)):
        try:
            os.killpg(child.pid, number)
        except ProcessLookupError:
            return
        try:
            child.wait(timeout=grace_s)
        except subprocess.TimeoutExpired:
            continue


def ask(argv: Sequence[str], env: Mapping[str, str] | None = None, timeout_s: float = 60.0) -> str | None:
    """Run a short command and return its stdout, or None when it failed in whatever way."""
    try:
        answer = subprocess.run(
            list(argv),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            env=None if env is None else dict(env),
            timeout=timeout_s,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return answer.stdout if answer.returncode == 0 else None


def last_lines(log: Path, count: int = 3) -> str:
    """The end of a log in one line, error lines preferred."""
    try:
        lines = [line.strip() for line in log.read_text(encoding="utf-8", errors="replace").splitlines()]
    except OSError:
        return "no output"
    # Only what the last command said.
    starts = [index for index, line in enumerate(lines) if line.startswith("$ ")]
    lines = [line for line in lines[starts[-1] + 1 if starts else 0 :] if line]
    errors = [line for line in lines if "error" in line.lower()]
    return " | ".join((errors or lines)[-count:])[:400] or "no output"
