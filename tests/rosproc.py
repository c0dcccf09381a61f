"""Helpers of the tests that start ROS processes: a domain of their own, processes whose output is read."""

from __future__ import annotations

import contextlib
import fcntl
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

FIRST_DOMAIN, LAST_DOMAIN = 70, 101  # above 101 the ports of DDS run into those of ordinary clients
SHM = Path("/dev/shm")


@contextlib.contextmanager
def reserved_domain(folder: Path, start: int) -> Iterator[int]:
    """A ROS_DOMAIN_ID that no other test of this user has while the block runs (a locked file says so)."""
    folder.mkdir(parents=True, exist_ok=True)
    count = LAST_DOMAIN - FIRST_DOMAIN + 1
    for k in range(count):
        domain = FIRST_DOMAIN + (start + k) % count
        with open(folder / f"{domain}.lock", "w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                continue
            yield domain
            return
    raise RuntimeError(f"all ROS domains {FIRST_DOMAIN} to {LAST_DOMAIN} are taken by other tests")


class Process:
    """A child process of a test; its stdout and stderr are read as one stream of lines."""

    def __init__(self, command: Sequence[str], env: Mapping[str, str], name: str) -> None:
        self.name = name
        self.lines: list[str] = []
        self._new: queue.Queue[str | None] = queue.Queue()
        self._popen = subprocess.Popen(
            list(command),
            env=dict(env),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            start_new_session=True,  # a signal for one of them must not reach the others
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self.segments: set[str] = set()

    @property
    def pid(self) -> int:
        return self._popen.pid

    @property
    def returncode(self) -> int | None:
        return self._popen.poll()

    @property
    def output(self) -> str:
        return "\n".join(self.lines)

    def _read(self) -> None:
        assert self._popen.stdout is not None
        for line in self._popen.stdout:
            self.lines.append(line.rstrip("\n"))
            self._new.put(line)
        self._new.put(None)

    def wait_for(self, text: str, timeout_s: float = 20.0) -> str:
        """The first line that holds `text`; AssertionError with all output if none comes in time."""
        deadline = time.monotonic() + timeout_s
        seen = 0
        while True:
            while seen < len(self.lines):
                line = self.lines[seen]
                seen += 1
                if text in line:
                    return line
            left = deadline - time.monotonic()
            ended = self._popen.poll() is not None and not self._reader.is_alive()
            if left <= 0 or (ended and seen == len(self.lines)):
                state = f"ended with {self._popen.returncode}" if ended else f"silent for {timeout_s} s"
                raise AssertionError(f"{self.name}: no {text!r} ({state}); its output:\n{self.output}")
            with contextlib.suppress(queue.Empty):
                self._new.get(timeout=min(left, 0.2))

    def send_signal(self, number: int) -> None:
        """Send a signal to this process alone."""
        self.segments |= _segments_of(self.pid)
        if self._popen.poll() is None:
            self._popen.send_signal(number)

    def wait(self, timeout_s: float = 20.0) -> int:
        """Exit code; AssertionError with all output if it does not end in time."""
        try:
            code = self._popen.wait(timeout_s)
        except subprocess.TimeoutExpired:
            raise AssertionError(f"{self.name} did not end; its output:\n{self.output}") from None
        self._reader.join(timeout_s)
        return code

    def stop(self, number: int = signal.SIGINT, timeout_s: float = 20.0) -> int:
        """Ask it to end (Ctrl-C by default) and give its exit code."""
        self.send_signal(number)
        return self.wait(timeout_s)

    def kill(self) -> None:
        """End it without asking, if it still runs."""
        if self._popen.poll() is None:
            self.send_signal(signal.SIGKILL)
            self._popen.wait(10)
        self._reader.join(5)
        if self._popen.stdout is not None:
            self._popen.stdout.close()


class RosDomain:
    """What a test with ROS processes needs: `id`, the environment `env`, nodes inside and outside."""

    def __init__(self, domain: int, log_folder: Path) -> None:
        self.id = domain
        self.env = dict(os.environ)
        self.env.update(
            ROS_DOMAIN_ID=str(domain),
            ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST",
            ROS_LOG_DIR=str(log_folder),
            PYTHONUNBUFFERED="1",
        )
        self._processes: list[Process] = []
        self._contexts: list[tuple[Any, Any]] = []

    def start(self, *command: str, name: str = "") -> Process:
        """Start any command in this domain."""
        process = Process(command, self.env, name or Path(command[0]).name)
        self._processes.append(process)
        return process

    def start_node(
        self, module: str, parameters: Mapping[str, Any] | None = None, extra: Sequence[str] = ()
    ) -> Process:
        """Start `python -m module` with ROS parameters."""
        arguments: list[str] = []
        for key, value in (parameters or {}).items():
            arguments += ["-p", f"{key}:={_parameter(value)}"]
        arguments += extra
        command = [sys.executable, "-m", module]
        if arguments:
            command += ["--ros-args", *arguments]
        return self.start(*command, name=module.rsplit(".", 1)[-1])

    def node(self, name: str, namespace: str = "/gearsim") -> Any:
        """A node inside the test process, ended with the test."""
        import rclpy
        from rclpy.node import Node

        context = rclpy.Context()
        rclpy.init(context=context, domain_id=self.id)
        node = Node(name, namespace=namespace, context=context)
        self._contexts.append((context, node))
        return node

    def spin(self, node: Any, until: Any, timeout_s: float = 20.0) -> bool:
        """Spin a node of `node()` until `until()` is true; False if the time ran out."""
        from rclpy.executors import SingleThreadedExecutor

        executor = SingleThreadedExecutor(context=node.context)
        executor.add_node(node)
        deadline = time.monotonic() + timeout_s
        try:
            while not until():
                if time.monotonic() > deadline:
                    return False
                executor.spin_once(timeout_sec=0.1)
            return True
        finally:
            executor.remove_node(node)
            executor.shutdown()

    def close(self) -> None:
        """End what this test started, and only that."""
        for context, node in self._contexts:
            node.destroy_node()
            context.try_shutdown()
        leftover: set[str] = set()
        for process in self._processes:
            process.kill()
            leftover |= process.segments
        _remove_segments(leftover)


def _parameter(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_parameter(item) for item in value) + "]"
    return f"'{value}'" if isinstance(value, str) else repr(value)


def _segments_of(pid: int) -> set[str]:
    """Names of Fast DDS's shared-memory files that a process has open."""
    try:
        maps = Path(f"/proc/{pid}/maps").read_text()
    except OSError:
        return set()
    prefix = f"{SHM}/fastdds_"
    return {line.split(prefix, 1)[1].split()[0] for line in maps.splitlines() if prefix in line}


def _remove_segments(names: set[str]) -> None:
    """Remove files that killed processes left behind, unless another living process uses them."""
    if not names:
        return
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit() and int(entry.name) != os.getpid():
            names = names - _segments_of(int(entry.name))
    for name in names:
        for path in (SHM / f"fastdds_{name}", SHM / f"fastdds_{name}_el", SHM / f"sem.fastdds_{name}_mutex"):
            path.unlink(missing_ok=True)
