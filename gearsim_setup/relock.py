"""Make the lock files anew: `python3 gearsim_setup/relock.py` in the repository, needs the network.

Resolves `requirements.in` and `requirements-ros.in` with uv (fetched into a folder that is thrown
away) against the public package index alone, for CPython 3.11 to 3.13 on x86-64 Linux, one version
of each distribution for all of them. What the lock files pin already stays unless `--upgrade` is
given, or `--upgrade NAME ...` for some.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import venv
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
INDEX = "https://pypi.org/simple"
HEADER = "# Made by gearsim_setup/relock.py; do not edit. CPython 3.11 to 3.13 on x86-64 Linux.\n"
_ENVIRONMENT = (
    "sys_platform == 'linux' and platform_machine == 'x86_64' and "
    "implementation_name == 'cpython' and python_version < '3.14'"
)
# Every line's condition says no more than the environment above, and what some Pythons of it need does
# no harm to the others: without conditions the files are plain lists that set-up can compare.
_MARKER = re.compile(r" ; [^\\]*(?= \\$)", re.MULTILINE)


def main(argv: Sequence[str]) -> int:
    """Write both lock files."""
    upgrade: list[str] = []
    if argv[:1] == ["--upgrade"]:
        upgrade = [f"--upgrade-package={name}" for name in argv[1:]] or ["--upgrade"]
    elif argv:
        print("usage: python3 gearsim_setup/relock.py [--upgrade [NAME ...]]", file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory() as folder:
        venv.create(folder, with_pip=True)
        uv = Path(folder, "bin", "uv")
        subprocess.run([Path(folder, "bin", "pip"), "install", "--quiet", "uv"], check=True)
        Path(folder, "pyproject.toml").write_text(f'[tool.uv]\nenvironments = ["{_ENVIRONMENT}"]\n')
        for name, constraints in (("requirements", []), ("requirements-ros", ["requirements"])):
            _lock(uv, Path(folder), name, constraints, upgrade)
    return 0


def _lock(uv: Path, folder: Path, name: str, constraints: list[str], upgrade: list[str]) -> None:
    lock = ROOT / f"{name}.lock"
    draft = folder / lock.name
    (folder / f"{name}.in").write_text((ROOT / f"{name}.in").read_text())
    if lock.is_file():
        draft.write_text(lock.read_text())
    command: list[str] = [str(uv), "pip", "compile", "--quiet", "--universal", "--generate-hashes"]
    command += ["--python-version=3.11", "--fork-strategy=fewest", "--no-header", f"--default-index={INDEX}"]
    command += [f"--constraints={other}.lock" for other in constraints]
    command += [*upgrade, f"--output-file={lock.name}", f"{name}.in"]
    stray = ("UV_", "PIP_")
    env = {key: value for key, value in os.environ.items() if not key.startswith(stray)}
    subprocess.run(command, cwd=folder, env=env, stdout=subprocess.DEVNULL, check=True)
    draft.write_text(HEADER + _MARKER.sub("", draft.read_text()).replace(HEADER, ""))
    lock.write_text(draft.read_text())
    print(f"{lock.name}: {len(re.findall(r'^[A-Za-z0-9][^ ]*==', lock.read_text(), re.MULTILINE))} pinned")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
