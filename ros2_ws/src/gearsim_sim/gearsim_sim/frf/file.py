"""The file that holds a casing's frequency responses (.npz); those of shipped casings lie beside this one."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gearsim_io.errors import InputError
from gearsim_sim.frf.responses import CasingResponses

FORMAT = 1
SHIPPED = Path(__file__).with_name("files")
_ARRAYS = ("omega", "ratios", "input_shapes", "site_shapes", "residual", "compliance")


def find_responses(name_or_path: str) -> CasingResponses:
    """The responses shipped under a name, or in a file of one's own (.npz)."""
    path = Path(name_or_path)
    if path.suffix == ".npz":
        return load_responses(path)
    known = sorted(file.stem for file in SHIPPED.glob("*.npz"))
    if name_or_path not in known:
        expected = f"one of {', '.join(known)}, or the path of a .npz file"
        raise InputError("responses", "", name_or_path, expected)
    return load_responses(SHIPPED / f"{name_or_path}.npz")


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
    arrays = {name: getattr(responses, name) for name in _ARRAYS}
    part = path.with_name(path.name + ".part")
    with part.open("wb") as file:
        np.savez_compressed(file, about=np.array(json.dumps(about)), **arrays)
    part.replace(path)


def load_responses(path: Path) -> CasingResponses:
    """Read what `save_responses` wrote; InputError if it is missing, damaged or of another kind."""
    where = str(path)
    try:
        with np.load(path, allow_pickle=False) as stored:
            about = json.loads(str(stored["about"]))
            if about.get("responses") != FORMAT:
                expected = f"responses of format {FORMAT}, as `gearsim casing responses` writes them"
                raise InputError(where, "", about.get("responses", "another kind of file"), expected)
            arrays = {name: np.array(stored[name], dtype=np.float64) for name in _ARRAYS}
        return _checked(about, arrays, where)
    except FileNotFoundError:
        raise InputError(where, "", "no such file", "responses of a casing (.npz)") from None
    except InputError:
        raise
    except (OSError, ValueError, KeyError, TypeError, AttributeError, EOFError, zipfile.BadZipFile) as error:
        expected = "responses of a casing, as `gearsim casing responses` writes them"
        raise InputError(where, "", f"{type(error).__name__}: {error}", expected) from None


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
