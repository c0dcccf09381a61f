"""A description of a casing with the thicknesses that an updating found."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from gearsim_io.errors import InputError
from gearsim_sim.model.casing.params import FOLDER
from gearsim_sim.model.casing.updating import Update

SUFFIX = "_updated"


def description_path(name_or_path: str) -> Path:
    """Where the description of a casing is, as `load_casing` finds it."""
    path = Path(name_or_path)
    return path if path.suffix in (".yaml", ".yml") else FOLDER / f"{name_or_path}.yaml"


def updated_description(source: Path, update: Update, basis: str) -> dict[str, Any]:
    """The description in `source` with the updated thickness of each region, in mm.

    Parameters
    ----------
    source : Path
        A description that `load_casing` has read.
    update : Update
    basis : str
        What it was updated against, for the `source` of each number.
    """
    yaml = YAML(typ="rt")
    content: dict[str, Any] = yaml.load(source.read_text(encoding="utf-8"))
    content["name"] = f"{content['name']}{SUFFIX}"
    content["thickness"] = dict(_entries(update, basis))
    return content


def _entries(update: Update, basis: str) -> Mapping[str, Any]:
    found = {}
    for k, region in enumerate(update.regions):
        change, std = 100 * update.change[k], 100 * update.std[k]
        source = f"updated against {basis}: {change:+.1f} %, standard deviation {std:.1f} %"
        value = round(1e3 * float(update.after.thickness_m[k]), 4)
        found[region] = {"value": value, "unit": "mm", "source": source}
    return found


def write_description(content: Mapping[str, Any], path: Path) -> None:
    """Write a description; InputError where that is not possible."""
    yaml = YAML(typ="rt")
    yaml.width = 200
    partial = path.with_suffix(".part")
    try:
        with partial.open("w", encoding="utf-8") as stream:
            yaml.dump(content, stream)
        partial.replace(path)
    except OSError as error:
        raise InputError("--out", "", str(path), f"a file that can be written ({error.strerror})") from None
