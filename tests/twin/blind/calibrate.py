"""Finds the sizes at which effects stand out by so many dB, and writes `sizes.json`.

    python -m blind.calibrate [rig ...]      (from tests/twin, with the packages of ros2_ws on the path)

Its seed is no other's.
"""

from __future__ import annotations

import json
import sys

import numpy as np

from blind.effects import EFFECTS, SIZES
from blind.making import Hidden, make
from blind.rigs import RIGS
from blind.severity import stands_out_db
from gearsim_io.errors import InputError

TARGETS_DB = (6.0, 12.0, 24.0)
_SEED = 990_001
_STEPS = 5
_SLACK_DB = 2.0  # by which the smallest size that is tried may stand out more than asked for
_SECONDS = {"parallel": 0.8, "bearing": 1.2, "planetary": 1.2}


def sizes_for(rig: str, name: str) -> tuple[list[float | None], list[float]]:
    """Three sizes (None where none of the tried does), and the dB at all that were tried."""
    effect = EFFECTS[name]
    grid = np.geomspace(effect.low, effect.high, _STEPS)
    found = np.array(_grid_db(rig, name, grid.tolist()))
    grid, found = grid[: found.size], np.maximum.accumulate(found)
    rising = found + 1e-9 * np.arange(found.size)
    sizes = np.exp(np.interp(TARGETS_DB, rising, np.log(grid)))
    told = [
        float(f"{s:.3g}") if found[0] - _SLACK_DB <= t <= found[-1] else None
        for s, t in zip(sizes, TARGETS_DB, strict=True)
    ]
    return told, [round(float(f), 1) for f in found]


def _grid_db(rig: str, name: str, grid: list[float]) -> list[float]:
    """What was found at ascending sizes, up to the first that the machine cannot have."""
    noise = EFFECTS[name].noise.get(rig, 1.0)
    plain, found = _data(rig, (), noise), list[float]()
    for size in grid:
        try:
            found.append(stands_out_db(plain, _data(rig, ((name, size),), noise), RIGS[rig].rate_hz))
        except InputError:
            break
    return found


def _data(rig: str, effects: tuple[tuple[str, float], ...], noise: float) -> np.ndarray:
    made = make(Hidden(rig, effects, noise), (_SEED,), records=1, seconds=_SECONDS[rig])
    return made.records[0].data


def main() -> None:
    """Of all rigs, or of those that are named."""
    content = (
        json.loads(SIZES.read_text(encoding="utf-8")) if SIZES.is_file() else {"sizes": {}, "grid_db": {}}
    )
    content["targets_db"] = TARGETS_DB
    for rig in sys.argv[1:] or RIGS:
        for name, effect in EFFECTS.items():
            if rig not in effect.rigs or effect.given or name in content["sizes"].get(rig, {}):
                continue
            sizes, found = sizes_for(rig, name)
            content["sizes"].setdefault(rig, {})[name] = sizes
            content["grid_db"].setdefault(rig, {})[name] = found
            SIZES.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
            print(rig, name, sizes, found, flush=True)


if __name__ == "__main__":
    main()
