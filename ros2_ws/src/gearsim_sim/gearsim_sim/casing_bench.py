"""How fast casings are reduced, and how fast many modes run: in the loop, or as frequency responses."""

from __future__ import annotations

import resource
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from gearsim_sim.bench import SAMPLE_RATE_HZ, best_factor, casing_params
from gearsim_sim.frf.bank import ResonatorBank
from gearsim_sim.frf.file import find_responses
from gearsim_sim.frf.responses import responses_of
from gearsim_sim.model.casing.reduced import load_reduced
from gearsim_sim.params.casing_gearbox import CasingGearboxParams

_REDUCE = (
    "import resource, sys; from pathlib import Path; "
    "from gearsim_sim.model.casing.reduce_file import reduce_description; "
    "from gearsim_sim.model.casing.reduced import save_reduced; "
    "save_reduced(reduce_description(sys.argv[1], int(sys.argv[2]), (), None, lambda *_: None), "
    "Path(sys.argv[3])); print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
)


def reduce_seconds_and_mb(name: str, modes: int, file: Path) -> tuple[float, float]:
    """Processor time and greatest memory of a process that reduces a casing into a file."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, "-c", _REDUCE, name, str(modes), str(file)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return used, int(done.stdout.split()[-1]) * 1024 / 1e6


def with_modes(modes: int, folder: Path) -> tuple[CasingGearboxParams, float | None]:
    """The 146-DOF gearbox in the same casing with more modes, kept in a folder.

    Returns
    -------
    params : CasingGearboxParams
    seconds : float or None
        Processor time of the reduction; None where the folder had it.
    """
    params = casing_params(finite=False)
    name = params.casing.name
    file, seconds = folder / f"{name}-{modes}.npz", None
    kept = load_reduced(file) if file.is_file() else None
    if kept is None or not responses_of(kept, str(file)).belongs_to(params.casing):
        folder.mkdir(parents=True, exist_ok=True)
        seconds, _ = reduce_seconds_and_mb(name, modes, file)
        kept = load_reduced(file)
    return replace(params, casing=kept), seconds


def bank_real_time_factor(
    name: str,
    seconds: float = 0.25,
    repeats: int = 20,
    clock: Callable[[], float] = time.process_time,
) -> float:
    """Seconds of eight forces through shipped responses to one site, per second of processor time."""
    responses = find_responses(name)
    bank = ResonatorBank(responses.of_sites(responses.sites[:1]), SAMPLE_RATE_HZ)
    samples = round(seconds * SAMPLE_RATE_HZ)
    forces = np.random.default_rng(1).normal(size=(len(responses.inputs), samples))
    bank.push(forces[:, :64])  # compiles
    return best_factor(lambda _: bank.push(forces), seconds, repeats, clock)
