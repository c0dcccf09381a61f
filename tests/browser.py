"""Chromium without a window for tests of pages, driven by the DevTools protocol over a pipe."""

from __future__ import annotations

import base64
import contextlib
import fcntl
import itertools
import json
import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from debian import CACHE

NAMES = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
PACKAGE = "chromium-headless-shell"
_ANSWER_S = 90.0


@dataclass
class Page:
    """A page in the browser; what it logs, throws or asks of the network is collected."""

    write: Any
    read: Any
    session: str = ""
    console: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)
    _numbers: Iterator[int] = field(default_factory=lambda: itertools.count(1))
    _rest: bytes = b""

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """Send a command and wait for its answer."""
        number = next(self._numbers)
        message: dict[str, Any] = {"id": number, "method": method, "params": params}
        if self.session:
            message["sessionId"] = self.session
        self.write.write(json.dumps(message).encode() + b"\0")
        self.write.flush()
        deadline = time.monotonic() + _ANSWER_S
        while True:
            answer = self._next()
            if answer.get("id") == number:
                assert "error" not in answer, answer
                return dict(answer["result"])
            self._take(answer)
            assert time.monotonic() < deadline, f"no answer to {method}"

    def evaluate(self, script: str) -> Any:
        """The value of an expression in the page; promises are awaited."""
        told = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in told, told
        return told["result"].get("value")

    def open(self, file: Path, width: int, height: int = 900) -> None:
        """Show a file in a window of that size and wait until it has drawn its plots."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=width < 600,
        )
        self.console.clear()
        self.requests.clear()
        self.call("Page.navigate", url=file.absolute().as_uri())
        deadline = time.monotonic() + _ANSWER_S
        while self.evaluate("document.body && document.body.dataset.ready") != "yes":
            assert time.monotonic() < deadline, f"the page did not get ready: {self.console}"
            time.sleep(0.1)

    def picture(self, file: Path) -> None:
        """A picture of the whole page."""
        shot = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=True)
        file.write_bytes(base64.b64decode(shot["data"]))

    def pdf(self) -> bytes:
        """The page as it is printed."""
        told = self.call("Page.printToPDF", printBackground=True, preferCSSPageSize=True)
        return base64.b64decode(told["data"])

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self._rest:
            piece = self.read.read1(1 << 20)
            assert piece, "the browser ended"
            self._rest += piece
        line, _, self._rest = self._rest.partition(b"\0")
        return dict(json.loads(line))

    def _take(self, event: dict[str, Any]) -> None:
        method, params = event.get("method"), event.get("params", {})
        if method == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
            self.console.append(str(params["args"]))
        elif method == "Runtime.exceptionThrown":
            self.console.append(str(params["exceptionDetails"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"):
            self.console.append(str(params["entry"]))
        elif method == "Network.requestWillBeSent":
            self.requests.append(str(params["request"]["url"]))


@contextlib.contextmanager
def chromium() -> Iterator[Page]:
    """A page in a fresh Chromium; skips where none can be had."""
    program, environment = _program()
    to_browser, from_browser = os.pipe(), os.pipe()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as home:
        # Chromium reads commands from descriptor 3 and answers on 4.
        shell = f'exec "$@" 3<&{to_browser[0]} 4>&{from_browser[1]}'
        options = [
            "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars",
            "--remote-debugging-pipe", f"--user-data-dir={home}",
        ]  # fmt: skip
        command = ["bash", "-c", shell, "chromium", str(program), *options, "about:blank"]
        with open(Path(home) / "stderr", "wb") as errors:
            process = subprocess.Popen(
                command,
                env=environment,
                pass_fds=(to_browser[0], from_browser[1]),
                stderr=errors,
                stdout=errors,
            )
        os.close(to_browser[0])
        os.close(from_browser[1])
        try:
            with os.fdopen(to_browser[1], "wb") as write, os.fdopen(from_browser[0], "rb") as read:
                page = Page(write, read)
                target = next(t for t in page.call("Target.getTargets")["targetInfos"] if t["type"] == "page")
                told = page.call("Target.attachToTarget", targetId=target["targetId"], flatten=True)
                page.session = str(told["sessionId"])
                for part in ("Page", "Runtime", "Log", "Network"):
                    page.call(f"{part}.enable")
                yield page
        finally:
            process.terminate()
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _program() -> tuple[Path, dict[str, str]]:
    for name in NAMES:
        installed = shutil.which(name)
        if installed:
            return Path(installed), dict(os.environ)
    root = _unpacked()
    libraries = {str(file.parent) for file in root.glob("usr/lib/**/*.so*")}
    return root / "usr/lib/chromium" / PACKAGE, {
        **os.environ,
        "LD_LIBRARY_PATH": os.pathsep.join(sorted(libraries)),
    }


def _unpacked() -> Path:
    """Debian's package and what it needs beyond what is installed here, unpacked without root."""
    root = CACHE / PACKAGE
    CACHE.mkdir(parents=True, exist_ok=True)
    with open(CACHE / f"{PACKAGE}.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # tests run in several processes
        if (root / ".done").exists():
            return root
        for tool in ("apt-get", "dpkg-deb", "bash"):
            if not shutil.which(tool):
                pytest.skip(f"there is no Chromium here, and no {tool} to fetch it with")
        shutil.rmtree(root, ignore_errors=True)
        (root / ".debs").mkdir(parents=True)
        plan = _apt(["install", "-s", "--no-install-recommends", PACKAGE], root)
        needed = [line.split()[1] for line in plan.splitlines() if line.startswith("Inst ")]
        _apt(["download", "-q", *needed], root)
        for deb in (root / ".debs").glob("*.deb"):
            subprocess.run(["dpkg-deb", "-x", str(deb), str(root)], check=True, timeout=120)
        shutil.rmtree(root / ".debs")
        (root / ".done").touch()
    return root


def _apt(arguments: list[str], root: Path) -> str:
    command = ["apt-get", *arguments]
    done = subprocess.run(
        command, cwd=root / ".debs", capture_output=True, text=True, timeout=240, check=False
    )
    if done.returncode:
        last = (done.stderr.strip().splitlines() or ["no reason given"])[-1]
        shutil.rmtree(root, ignore_errors=True)
        pytest.skip(f"Chromium cannot be fetched from Debian: {last}")
    return done.stdout
