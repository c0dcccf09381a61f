"""A built casing as files: matrices with a description that the reduction reads, and a Nastran deck."""

from __future__ import annotations

from collections.abc import Mapping
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse
from ruamel.yaml import YAML

from gearsim_sim.model.casing.described import Described
from gearsim_sim.model.casing.nastran import write_deck
from gearsim_sim.model.casing.sites import default_sites, site_nodes
from gearsim_sim.model.casing.structure import MeshedStructure, thicknesses_m

DECK_MODES = 106  # six of the free body, and a hundred


def write_matrices(structure: MeshedStructure, params: Described, folder: Path) -> list[Path]:
    """Write `stiffness.npz`, `mass.npz` and `casing.yaml`, the description of a user's own matrices.

    Sensors are those default sites whose three displacements are independent.
    """
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / "stiffness.npz", folder / "mass.npz", folder / "casing.yaml"]
    scipy.sparse.save_npz(files[0], structure.stiffness)
    scipy.sparse.save_npz(files[1], structure.mass)
    text = StringIO()
    YAML(typ="safe", pure=True).dump(_description(structure, params), text)
    files[2].write_text(text.getvalue(), encoding="utf-8")
    return files


def write_deck_of(structure: MeshedStructure, params: Described, path: Path) -> Path:
    """Write the casing as a Nastran deck that asks for its first modes."""
    path.parent.mkdir(parents=True, exist_ok=True)
    thickness = thicknesses_m(params, structure.mesh.regions)
    write_deck(structure.mesh, thickness, params.material, DECK_MODES, path)
    return path


def _description(structure: MeshedStructure, params: Described) -> Mapping[str, Any]:
    places = default_sites(params)
    sensors = {}
    for place, node in zip(places, site_nodes(structure, places, params.mesh.plate_size_m), strict=True):
        rows = structure.ties[6 * node : 6 * node + 3]
        if rows.nnz == 3 and (rows.data == 1).all():
            sensors[place.name] = {
                "rows": rows.indices.tolist(),
                "direction": list(place.direction),
                "position": _metres(structure.mesh.nodes_m[node]),
            }
    return {
        "name": structure.name,
        "description": params.description,
        "stiffness": {"file": "stiffness.npz"},
        "mass": {"file": "mass.npz"},
        "damping_ratio": params.damping_ratio,
        "masters": {
            name: {"rows": rows.tolist(), "position": _metres(structure.positions_m[name])}
            for name, rows in structure.masters.items()
        },
        "sensors": sensors,
    }


def _metres(position: np.ndarray[Any, Any]) -> list[str]:
    return [f"{value:.9g} m" for value in position.tolist()]
