"""Programs from Debian packages for tests, without root: fetched by apt-get, unpacked into a cache folder."""

from __future__ import annotations

import fcntl
import os
import shutil
import subprocess
import time
import urllib.error
import urllib.request
from collections.abc import Sequence
from pathlib import Path

import pytest

CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "gearsim" / "test-debian"


def program(name: str, packages: Sequence[str]) -> tuple[Path, dict[str, str]]:
    """A program, installed or from Debian packages, and the environment it needs; skips without it."""
    installed = shutil.which(name) or shutil.which(name, path="/usr/sbin")
    if installed:
        return Path(installed), dict(os.environ)
    root = _unpacked(packages)
    found = next((root / d / name for d in ("usr/bin", "usr/sbin") if (root / d / name).is_file()), None)
    if found is None:
        pytest.skip(f"{name} is not in {', '.join(packages)}")
    libraries = [str(path) for path in root.glob("usr/lib/*-linux-gnu")] + [
        str(p) for p in root.glob("lib/*-linux-gnu")
    ]
    return found, {**os.environ, "LD_LIBRARY_PATH": os.pathsep.join(libraries)}


def _unpacked(packages: Sequence[str]) -> Path:
    root = CACHE / packages[0]
    CACHE.mkdir(parents=True, exist_ok=True)
    with open(CACHE / f"{packages[0]}.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # tests run in several processes
        if (root / ".done").exists():
            return root
        for tool in ("apt-get", "dpkg-deb"):
            if not shutil.which(tool):
                pytest.skip(f"{packages[0]} is not installed, and there is no {tool} to fetch it with")
        shutil.rmtree(root, ignore_errors=True)
        debs = root / ".debs"
        debs.mkdir(parents=True)
        command = ["apt-get", "download", "-q", *packages]
        fetched = subprocess.run(command, cwd=debs, capture_output=True, text=True, timeout=240, check=False)
        if fetched.returncode:
            last = (fetched.stderr.strip().splitlines() or ["no reason given"])[-1]
            shutil.rmtree(root, ignore_errors=True)
            pytest.skip(f"{packages[0]} cannot be fetched from Debian: {last}")
        for deb in debs.glob("*.deb"):
            subprocess.run(["dpkg-deb", "-x", str(deb), str(root)], check=True, timeout=120)
        shutil.rmtree(debs)
        (root / ".done").touch()
    return root


def wait_for_http(url: str, timeout_s: float = 30.0) -> str:
    """The body of a URL as soon as it answers with 200."""
    deadline = time.monotonic() + timeout_s
    while True:
        try:
            with urllib.request.urlopen(url, timeout=5) as answer:
                return str(answer.read().decode())
        except (urllib.error.URLError, OSError):
            if time.monotonic() > deadline:
                raise
            time.sleep(0.1)
