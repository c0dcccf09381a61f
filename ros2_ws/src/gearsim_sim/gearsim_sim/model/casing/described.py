"""Descriptions of casings by name or path: boxes for parallel shafts, round housings for planetary stages."""

from __future__ import annotations

from pathlib import Path

from gearsim_io.quantities import load_yaml, read_yaml
from gearsim_sim.model.casing.params import FOLDER, CasingParams, load_casing
from gearsim_sim.model.casing.ring_housing import RING_HOUSING, RingHousing

Described = CasingParams | RingHousing


def load_described(name_or_path: str) -> Described:
    """The casing or housing shipped under a name, or described by a YAML file of one's own.

    Raises
    ------
    InputError
        If there is none of that name, or its parts do not fit each other.
    """
    path = Path(name_or_path)
    if path.suffix not in (".yaml", ".yml"):
        path = FOLDER / f"{name_or_path}.yaml"
    content = read_yaml(path) if path.is_file() else {}
    if not isinstance(content, dict) or content.get("kind") != RING_HOUSING:
        return load_casing(name_or_path)
    params = load_yaml(RingHousing, path, require_source=True)
    params.check(str(path))
    return params
