"""Finds sizes at which effects stand out by so many dB, and writes `sizes.json`.

    python -m blind.calibrate [rig ...]      (from tests/twin, with the packages of ros2_ws on the path)

Each severity is looked for on some machines; the size on the first that shows it is kept, as where `sizing`
begins on the machines of cases. What none of them shows has no size, and is not hidden. What is in the file
already stays. The seeds are no others'.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blind.effects import EFFECTS, SIZES, TARGETS_DB, noise_of
from blind.rigs import RIGS
from blind.sizing import OutOfReachError, plain_data, search

_MACHINES = (990_001, 990_002, 990_003)


@cache
def _plain(rig: str, noise: float, seed: int) -> NDArray[np.float32]:
    return plain_data(rig, noise, (seed,))


def sizes_for(rig: str, name: str) -> tuple[list[float | None], list[str]]:
    """Three sizes, None where no machine shows it so, and why not."""
    effect, noise = EFFECTS[name], noise_of([name], rig)
    first = float(np.sqrt(effect.low * effect.high))
    sizes: list[float | None] = []
    why: list[str] = []
    for target in TARGETS_DB:
        size = None
        for seed in _MACHINES:
            try:
                size = search(rig, name, target, first, noise, (seed,), _plain(rig, noise, seed))
            except OutOfReachError as error:
                why.append(str(error))
                continue
            first = size
            break
        sizes.append(size)
    return sizes, why


def main(words: Sequence[str]) -> None:
    """Of all rigs, or of those that are named."""
    content: dict[str, Any] = {"targets_db": TARGETS_DB, "sizes": {}}
    if SIZES.is_file():
        content |= json.loads(SIZES.read_text(encoding="utf-8"))
    for rig in words or RIGS:
        for name, effect in EFFECTS.items():
            if rig not in effect.rigs or effect.given or name in content["sizes"].get(rig, {}):
                continue
            sizes, why = sizes_for(rig, name)
            content["sizes"].setdefault(rig, {})[name] = sizes
            SIZES.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
            print(rig, name, sizes, why, flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
