"""An ensemble run offline into files: one .npz for each variant, and a table of what was chosen for them."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_io.new_paths import refuse_existing
from gearsim_sim.ensemble import Ensemble
from gearsim_sim.ensemble_spec import EnsembleSpec, NamedVariant, table

# Angles of the shafts are smooth: every so many samples one is kept.
ANGLE_EVERY = 64
_PORTION = 64 * ANGLE_EVERY


def run_to(
    spec: EnsembleSpec,
    seconds: float,
    out: Path,
    workers: int,
    progress: Callable[[float], None] = lambda _seconds: None,
) -> tuple[Path, ...]:
    """Run all variants for that many simulated seconds; returns the files in the new folder `out`.

    `NAME.npz` holds the accelerations [m/s^2] of each site under its name as float32, `sample_rate_hz`,
    `unit`, `machine`, `angle_turns_SHAFT` at every `angle_every`-th sample. `variants.csv` lists what was
    chosen. What is interrupted leaves nothing.

    Raises
    ------
    InputError
        If `out` exists, or the run is too short for one sample.
    """
    total = round(seconds * spec.base.sample_rate_hz)
    if total < 1:
        raise InputError("ensemble", "seconds", seconds, f"at least {1 / spec.base.sample_rate_hz:g}")
    refuse_existing(out, "the name of a new folder")
    ensemble = spec.ensemble(workers)
    out.mkdir(parents=True)
    try:
        return _run(spec, ensemble, total, out, progress)
    except BaseException:
        shutil.rmtree(out, ignore_errors=True)
        raise


def _run(
    spec: EnsembleSpec, ensemble: Ensemble, total: int, out: Path, progress: Callable[[float], None]
) -> tuple[Path, ...]:
    """All in portions, so that the memory does not grow with the length of the run."""
    shape = (len(spec.variants), len(ensemble.site_names), total)
    raw = out / "raw.tmp"
    accel = np.memmap(raw, dtype=np.float32, mode="w+", shape=shape)
    angles = np.empty((shape[0], len(ensemble.shaft_names), -(-total // ANGLE_EVERY)))
    for start in range(0, total, _PORTION):
        portion = ensemble.advance(min(_PORTION, total - start))
        end = start + portion.accel.shape[2]
        accel[:, :, start:end] = portion.accel
        kept = slice(start // ANGLE_EVERY, -(-end // ANGLE_EVERY))
        angles[:, :, kept] = (portion.turns + portion.fraction)[:, :, ::ANGLE_EVERY]
        progress(end / spec.base.sample_rate_hz)
    files = [
        _save(spec, one, ensemble, accel[number], angles[number], out)
        for number, one in enumerate(spec.variants)
    ]
    del accel
    raw.unlink()
    listed = out / "variants.csv"
    listed.write_text(table([replace(one, chosen=chosen(one)) for one in spec.variants]))
    return (*files, listed)


def chosen(variant: NamedVariant) -> dict[str, float | str]:
    """What was chosen for a variant; seeds are whole numbers, which large ones would lose as floats."""
    return {**variant.chosen, "seed": variant.scenario.seed}


def _save(
    spec: EnsembleSpec,
    variant: NamedVariant,
    ensemble: Ensemble,
    accel: NDArray[np.float32],
    angles: NDArray[np.float64],
    out: Path,
) -> Path:
    arrays = dict(zip(ensemble.site_names, accel, strict=True))
    shafts = {f"angle_turns_{name}": angle for name, angle in zip(ensemble.shaft_names, angles, strict=True)}
    file = out / f"{variant.name}.npz"
    np.savez(
        file,
        unit=np.array("m/s^2"),
        sample_rate_hz=np.array(spec.base.sample_rate_hz),
        machine=np.array(spec.base.machine.name),
        angle_every=np.array(ANGLE_EVERY),
        allow_pickle=False,
        **arrays,
        **shafts,
    )
    return file
