"""Other programs to be measured beside this one, in an environment of their own below `.gearsim`.

They are no part of the program: nothing of it imports them, and without them the bench leaves their
figures out.
"""

from __future__ import annotations

import json
import os
import subprocess
import venv
from pathlib import Path

from gearsim_bringup.ui import JobFailedError, Voice
from gearsim_io.errors import EnvironmentLackError

HERE = Path(__file__).parent
REQUIREMENTS = HERE / "requirements.txt"


def folder() -> Path:
    """Where the peers' environment is, or would be."""
    return Path(os.environ.get("GEARSIM_STATE", ".gearsim")) / "peers"


def _python() -> Path:
    return folder() / "bin" / "python"


def _stamp() -> Path:
    return folder() / "complete"


def install(voice: Voice) -> None:
    """Make the environment, unless it is there; needs the package index and some minutes.

    Raises
    ------
    EnvironmentLackError
        If the packages cannot be had.
    """
    wanted = REQUIREMENTS.read_text()
    if _stamp().is_file() and _stamp().read_text() == wanted:
        return
    voice.say(f"  installing the peers into {folder()} ...")
    venv.create(folder(), clear=True, with_pip=True)
    command = [str(_python()), "-m", "pip", "install", "-q", "-r", str(REQUIREMENTS)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        last = (done.stderr.strip().splitlines() or ["pip failed"])[-1]
        raise EnvironmentLackError(f"the peers cannot be installed: {last}", "gearsim bench, without --peers")
    _stamp().write_text(wanted)


def ross_seconds_per_second() -> dict[str, float] | None:
    """Processor time of ROSS for a simulated second, see `ross_gearbox.py`; None without ROSS."""
    if not _stamp().is_file():
        return None
    environment = {
        key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "VIRTUAL_ENV")
    }
    environment |= {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [str(_python()), "-W", "ignore", str(HERE / "ross_gearbox.py")],
        capture_output=True,
        text=True,
        check=False,
        env=environment,
    )
    if done.returncode:
        last = (done.stderr.strip().splitlines() or ["it failed"])[-1]
        raise JobFailedError(f"ROSS: {last}")
    found = json.loads(done.stdout.strip().splitlines()[-1])
    return {key: float(value) for key, value in found.items()}
