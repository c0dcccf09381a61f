"""A modal test as a universal file, for other programs and for the way back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gearsim_io.errors import InputError
from gearsim_sim.model.casing.material import Array
from gearsim_sim.model.casing.mesh import Mesh
from gearsim_sim.model.casing.modal_test import ModalTest, TestPlan
from gearsim_sim.model.casing.universal_file import FORCE, KINDS, RESPONSE

FREQUENCY = 18


def check_export(path: Path) -> None:
    """InputError unless a universal file of that name can be written: told before the work."""
    if path.suffix.lower() not in (".uff", ".unv"):
        raise InputError("--export", "", str(path), "a file name that ends in .uff or .unv")
    if not path.parent.is_dir():
        raise InputError("--export", "", str(path), "a file in a folder that exists")


def write_modal_test(plan: TestPlan, test: ModalTest, mesh: Mesh, title: str, path: Path) -> None:
    """Write responses with coordinates and units (SI); points bear the numbers of their nodes, from 1.

    Directions must lie along axes.
    """
    import pyuff

    used = np.unique(np.concatenate([plan.nodes, plan.reference_nodes]))
    sets = [_units(), _coordinates(used, mesh)]
    struck = [_end(*place) for place in zip(plan.nodes, plan.directions, strict=True)]
    moved = [_end(*place) for place in zip(plan.reference_nodes, plan.reference_directions, strict=True)]
    for response, row in zip(moved, test.accelerance, strict=True):
        for force, values in zip(struck, row, strict=True):
            sets.append(_function(response, force, values, test.frequencies_hz, title))
    part = path.with_name(path.name + ".part")
    part.unlink(missing_ok=True)
    try:
        pyuff.UFF(str(part)).write_sets(sets, mode="add")
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise InputError(
            "--export", "", str(path), f"a file that can be written ({error.strerror})"
        ) from None


def _units() -> dict[str, Any]:
    names = {"units_code": 1, "units_description": "SI", "temp_mode": 1}
    return {"type": 164, **names, "length": 1.0, "force": 1.0, "temp": 1.0, "temp_offset": 0.0}


def _coordinates(nodes: np.ndarray[Any, Any], mesh: Mesh) -> dict[str, Any]:
    none = np.zeros(len(nodes), dtype=int)
    x, y, z = mesh.nodes_m[nodes].T
    numbers = {"node_nums": nodes + 1, "def_cs": none, "disp_cs": none, "color": none}
    return {"type": 2411, **numbers, "x": x, "y": y, "z": z}


def _end(node: int, way: Array) -> tuple[int, int]:
    """Number of a point, and its direction as universal files count them."""
    axis = int(np.argmax(np.abs(way)))
    return int(node) + 1, (axis + 1) * (1 if way[axis] > 0 else -1)


def _function(
    moved: tuple[int, int], struck: tuple[int, int], values: np.ndarray[Any, Any], lines_hz: Array, title: str
) -> dict[str, Any]:
    return {
        "type": 58,
        "binary": 1,
        "func_type": RESPONSE,
        "id1": title,
        "rsp_node": moved[0],
        "rsp_dir": moved[1],
        "ref_node": struck[0],
        "ref_dir": struck[1],
        "x": lines_hz,
        "data": values,
        "abscissa_spacing": 1,
        "abscissa_spec_data_type": FREQUENCY,
        "abscissa_axis_units_lab": "Hz",
        "ordinate_spec_data_type": KINDS["acceleration"][0],
        "ordinate_axis_units_lab": "m/s^2",
        "orddenom_spec_data_type": FORCE,
        "orddenom_axis_units_lab": "N",
    }
