"""The file that holds a casing's frequency responses (.npz); those of shipped casings lie beside this one."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gearsim_io.errors import InputError
from gearsim_sim.archive import find_archive, read_archive, write_archive
from gearsim_sim.frf.responses import CasingResponses

FORMAT = 1
SHIPPED = Path(__file__).with_name("files")
_ARRAYS = ("omega", "ratios", "input_shapes", "site_shapes", "residual", "compliance")


def find_responses(name_or_path: str) -> CasingResponses:
    """The responses shipped under a name, or in a file of one's own (.npz)."""
    return load_responses(find_archive(name_or_path, SHIPPED, "responses"))


def save_responses(responses: CasingResponses, path: Path) -> None:
    """Write them as one compressed .npz; a file that is there is replaced only by a whole one."""
    about = {
        "responses": FORMAT,
        "name": responses.name,
        "inputs": responses.inputs,
        "sites": responses.sites,
        "valid_hz": responses.valid_hz,
        "provenance": dict(responses.provenance),
    }
    write_archive(path, about, {name: getattr(responses, name) for name in _ARRAYS})


def load_responses(path: Path) -> CasingResponses:
    """Read what `save_responses` wrote; InputError if it is missing, damaged or of another kind."""
    expected = "responses of a casing, as `gearsim casing responses` writes them"
    with read_archive(path, "responses of a casing", expected) as (about, stored):
        if about.get("responses") != FORMAT:
            expected = f"responses of format {FORMAT}, as `gearsim casing responses` writes them"
            raise InputError(str(path), "", about.get("responses", "another kind of file"), expected)
        arrays = {name: np.array(stored[name], dtype=np.float64) for name in _ARRAYS}
        return _checked(about, arrays, str(path))


def _checked(about: Mapping[str, Any], arrays: Mapping[str, Any], where: str) -> CasingResponses:
    """The responses, if their arrays fit each other, hold finite numbers, and all modes are damped."""
    modes, inputs, sites = len(arrays["omega"]), len(about["inputs"]), len(about["sites"])
    shapes = {
        "omega": (modes,),
        "ratios": (modes,),
        "input_shapes": (inputs, modes),
        "site_shapes": (sites, modes),
        "residual": (sites, inputs),
        "compliance": (inputs, inputs),
    }
    for name, shape in shapes.items():
        if arrays[name].shape != shape:
            raise InputError(where, name, f"shape {arrays[name].shape}", f"shape {shape}")
        if not np.isfinite(arrays[name]).all():
            raise InputError(where, name, "numbers that are not finite", "finite numbers")
        arrays[name].setflags(write=False)
    if not (np.all(arrays["omega"] > 0) and np.all((arrays["ratios"] > 0) & (arrays["ratios"] < 1))):
        raise InputError(
            where, "omega, ratios", "modes without", "frequency above 0, damping between 0 and 1"
        )
    return CasingResponses(
        name=str(about["name"]),
        inputs=tuple(about["inputs"]),
        sites=tuple(about["sites"]),
        valid_hz=float(about["valid_hz"]),
        provenance=about["provenance"],
        **arrays,
    )
