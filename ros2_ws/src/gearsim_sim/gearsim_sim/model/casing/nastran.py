"""A mesh as a Nastran deck, so that another program can solve the same structure with its own elements."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from gearsim_sim.model.casing.material import Array, Material
from gearsim_sim.model.casing.mesh import Average, Mesh

_SOLID = 1_000_000  # property number of the hexahedra


def write_deck(mesh: Mesh, thickness_m: Array, material: Material, modes: int, path: Path) -> None:
    """Write a deck for SOL 103: `modes` free modes with lumped mass, in SI.

    Quads become CQUAD4, hexahedra CHEXA, ties RBE2 and RBE3, pads CELAS2. Node n of the mesh is grid n + 1.
    """
    lines = [*_case(modes), *_nodes(mesh), *_elements(mesh), *_properties(mesh, thickness_m, material)]
    lines += [*_ties(mesh), *_pads(mesh), "ENDDATA"]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def read_frequencies_hz(path: Path) -> Array:
    """Frequencies of the table of real eigenvalues in a MYSTRAN or Nastran output (.F06)."""
    found, inside = [], False
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        inside = inside or "R E A L   E I G E N V A L U E S" in line
        words = line.split()
        if inside and len(words) >= 5 and words[0].isdigit() and words[1].isdigit():
            found.append(float(words[4]))
        elif inside and found:
            break
    return np.array(found)


def _case(modes: int) -> list[str]:
    return [
        "SOL 103",
        "CEND",
        "TITLE = casing, free modes",
        "METHOD = 1",
        "BEGIN BULK",
        _card("EIGRL", 1, None, None, modes),
    ]


def _nodes(mesh: Mesh) -> Iterable[str]:
    solid = set(np.unique(mesh.hexes).tolist())
    for number, (x, y, z) in enumerate(mesh.nodes_m.tolist()):
        # Nodes of hexahedra have no rotations.
        yield _card("GRID", number + 1, None, x, y, z, None, 456 if number in solid else None)


def _elements(mesh: Mesh) -> Iterable[str]:
    for number, (quad, region) in enumerate(
        zip(mesh.quads.tolist(), mesh.quad_regions.tolist(), strict=True), 1
    ):
        yield _card("CQUAD4", number, region + 1, *(node + 1 for node in quad))
    for number, nodes in enumerate(mesh.hexes.tolist(), len(mesh.quads) + 1):
        yield _card("CHEXA", number, _SOLID, *(node + 1 for node in nodes))


def _properties(mesh: Mesh, thickness_m: Array, material: Material) -> Iterable[str]:
    yield _card(
        "MAT1", 1, material.youngs_modulus_pa, None, material.poisson_ratio, material.density_kg_per_m3
    )
    for number, thickness in enumerate(thickness_m.tolist(), 1):
        yield _card("PSHELL", number, 1, thickness, 1, None, 1)
    if len(mesh.hexes):
        # Two points in each direction, shear reduced: what stands in place of incompatible modes.
        yield _card("PSOLID", _SOLID, 1, None, "TWO", None, "REDUCED")


def _ties(mesh: Mesh) -> Iterable[str]:
    number = len(mesh.quads) + len(mesh.hexes) + 1
    for rigid in mesh.rigids:
        yield _card("RBE2", number, rigid.centre + 1, 123, *(int(node) + 1 for node in rigid.nodes))
        number += 1
    for average in mesh.averages:
        yield _average(number, average)
        number += 1


def _average(number: int, average: Average) -> str:
    fields: list[object] = [number, None, average.node + 1, 123456]
    for weight in np.unique(average.weights).tolist():
        nodes = average.sources[average.weights == weight]
        fields += [weight, 123, *(int(node) + 1 for node in nodes)]
    return _card("RBE3", *fields)


def _pads(mesh: Mesh) -> Iterable[str]:
    number = len(mesh.quads) + len(mesh.hexes) + len(mesh.rigids) + len(mesh.averages) + 1
    for pad in mesh.pads:
        for node in pad.nodes.tolist():
            for direction, stiffness in enumerate(pad.stiffness_n_per_m, 1):
                yield _card("CELAS2", number, stiffness / len(pad.nodes), node + 1, direction)
                number += 1


def _card(name: str, *fields: object) -> str:
    """A card of large fields (16 columns), four a line."""
    texts = [_field(value) for value in fields]
    rows = [texts[k : k + 4] for k in range(0, len(texts), 4)]
    heads = [f"{name + '*':<8}"] + ["*       "] * (len(rows) - 1)
    # Large fields come in pairs of lines.
    if len(rows) % 2:
        rows.append([])
        heads.append("*       ")
    lines = [head + "".join(f"{text:>16}" for text in row) for head, row in zip(heads, rows, strict=True)]
    return "\n".join(lines)


def _field(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, float):
        text = f"{value:.9E}"
        return text if len(text) <= 16 else f"{value:.8E}"
    return str(value)
