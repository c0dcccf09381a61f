"""Finds the sizes at which effects stand out by so many dB, and writes `sizes.json`.

    python -m blind.calibrate [rig ...]      (from tests/twin, with the packages of ros2_ws on the path)

An effect is tried at a middle size, then where a line of 20 dB per decade would put the middle target, and
once more; the sizes of all targets lie on the line through what was found. What is in the file already stays.
Its seed is no other's.
"""

from __future__ import annotations

import json
import sys
from typing import Any

import numpy as np

from blind.effects import EFFECTS, SIZES
from blind.making import Hidden, make
from blind.rigs import RIGS
from blind.severity import stands_out_db
from gearsim_io.errors import InputError

TARGETS_DB = (6.0, 12.0, 24.0)
_SEED = 990_001
_SECONDS = {"parallel": 0.8, "bearing": 1.2, "planetary": 1.2}
_TRIES = 3
_SLOPES = (8.0, 40.0)  # dB per decade, of what grows at all
_NOTHING_DB = 2.0  # less may as well be chance


def sizes_for(rig: str, name: str) -> tuple[list[float | None], list[tuple[float, float]]]:
    """Three sizes (None where it takes one out of bounds), and what was found: pairs of size and dB."""
    effect = EFFECTS[name]
    low, high = np.log10(effect.low), np.log10(effect.high)
    noise = effect.noise.get(rig, 1.0)
    plain, found = _data(rig, (), noise), list[tuple[float, float]]()
    at = 0.5 * (low + high)
    for _ in range(_TRIES):
        try:
            data = _data(rig, ((name, float(10**at)),), noise)
        except InputError:  # more than the machine can have
            high = 0.5 * (at + low) if not found else max(place for place, _ in found)
            at = high
            continue
        db = stands_out_db(plain, data, RIGS[rig].rate_hz)
        found.append((at, db))
        if abs(db - TARGETS_DB[1]) < 1.0:
            break
        missing = TARGETS_DB[1] - db if db > _NOTHING_DB else 2 * TARGETS_DB[1]
        at = float(np.clip(at + missing / _slope(found), low, high))
        if any(abs(at - place) < 0.02 for place, _ in found):
            break
    sizes = [_size(found, target, low, high) for target in TARGETS_DB]
    return sizes, [(float(f"{10**place:.3g}"), round(db, 1)) for place, db in found]


def _slope(found: list[tuple[float, float]]) -> float:
    """dB per decade through the two points that are nearest to the middle target."""
    if len(found) < 2:
        return 20.0
    (x0, y0), (x1, y1) = sorted(found, key=lambda one: abs(one[1] - TARGETS_DB[1]))[:2]
    return float(np.clip((y1 - y0) / (x1 - x0), *_SLOPES)) if abs(x1 - x0) > 0.05 else 20.0


def _size(found: list[tuple[float, float]], target: float, low: float, high: float) -> float | None:
    place, db = min(found, key=lambda one: abs(one[1] - target))
    if db < _NOTHING_DB:
        return None
    at = place + (target - db) / _slope(found)
    return float(f"{10**at:.3g}") if low - 0.1 <= at <= high + 1e-6 else None


def _data(rig: str, effects: tuple[tuple[str, float], ...], noise: float) -> np.ndarray:
    made = make(Hidden(rig, effects, noise), (_SEED,), records=1, seconds=_SECONDS[rig])
    return made.records[0].data


def main() -> None:
    """Of all rigs, or of those that are named."""
    content: dict[str, Any] = {"targets_db": TARGETS_DB, "sizes": {}, "found": {}}
    if SIZES.is_file():
        content |= json.loads(SIZES.read_text(encoding="utf-8"))
    for rig in sys.argv[1:] or RIGS:
        for name, effect in EFFECTS.items():
            if rig not in effect.rigs or effect.given or name in content["sizes"].get(rig, {}):
                continue
            sizes, found = sizes_for(rig, name)
            content["sizes"].setdefault(rig, {})[name] = sizes
            content["found"].setdefault(rig, {})[name] = found
            SIZES.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
            print(rig, name, sizes, found, flush=True)


if __name__ == "__main__":
    main()
