"""Which lines are marked in spectra, and how they look: one rule for all plots."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Literal

from gearsim_bringup.diagnosis_report.material import BEARING_FAULTS, Material
from gearsim_bringup.diagnosis_report.words import fault_name, shaft_words
from gearsim_bringup.pages.plot import FOUND, GREEN, GREY, ORANGE, comb
from gearsim_dsp.judges.finding import Finding

__all__ = [
    "Marks",
    "all_marks",
    "drawn",
    "expected_marks",
    "finding_marks",
    "gear_marks",
    "shaft_marks",
]

_HARMONICS = 8
_SHAFT_HARMONICS = 4
_MESH_HARMONICS = 3
_SIDEBANDS = 3
_FAMILY_COLOURS = {"BPFO": "#a93226", "BPFI": "#7d3c98", "2xBSF": "#b9770e", "FTF": "#117a65"}


@dataclass(frozen=True, slots=True)
class Marks:
    """Lines of one entry of the legend; places are orders of the reference shaft."""

    name: str
    places: tuple[float, ...]
    colour: str
    dash: str
    visible: bool | Literal["legendonly"] = True


def drawn(
    marks: Iterable[Marks], end: float, rise: tuple[float, float], scale: float = 1.0, **style: Any
) -> list[dict[str, Any]]:
    """Vertical lines as high as `rise` at all places below `end` of an axis in orders times `scale`."""
    found = []
    for mark in marks:
        places = [place * scale for place in mark.places if place * scale < end]
        if places:
            look = {"dash": mark.dash, "visible": mark.visible, **style}
            found.append(comb(places, *rise, mark.name, mark.colour, **look))
    return found


def all_marks(material: Material) -> Iterator[Marks]:
    """Findings, then shafts, meshes, and the families that were not found (hidden until asked for)."""
    found = material.diagnosis.findings
    for number, finding in enumerate(found):
        if finding.found_order > 0:
            yield from finding_marks(material, number, finding, 2)
    yield from shaft_marks(material)
    yield from gear_marks(material)
    yield from expected_marks(material, 3)


def finding_marks(
    material: Material, number: int, finding: Finding, harmonics: int = _HARMONICS
) -> Iterator[Marks]:
    """Harmonics of a finding, and the sidebands of the first three."""
    colour = FOUND[number % len(FOUND)]
    order = finding.found_order
    name = fault_name(finding)
    yield Marks(name, tuple(k * order for k in range(1, harmonics + 1)), colour, "dash")
    spacing = material.sideband(finding)
    if spacing > 0:
        pairs = [
            k * order + side * spacing for k in range(1, min(3, harmonics) + 1) for side in (-2, -1, 1, 2)
        ]
        yield Marks("its sidebands", tuple(sorted(p for p in pairs if p > 0)), colour, "dot")


def shaft_marks(material: Material, harmonics: int = _SHAFT_HARMONICS) -> Iterator[Marks]:
    """First harmonics of every shaft."""
    for ratio, names in material.shafts().items():
        yield Marks(shaft_words(names), tuple(k * ratio for k in range(1, harmonics + 1)), GREY, "dot")


def gear_marks(material: Material) -> Iterator[Marks]:
    """Harmonics of every mesh; sidebands at the turns of its wheels are hidden until asked for."""
    for mesh in material.meshes():
        centres = [k * mesh.order for k in range(1, _MESH_HARMONICS + 1)]
        yield Marks(f"mesh {mesh.name}", tuple(centres), GREEN, "dash")
        for whose, spacing in mesh.spacings:
            reach = [k for k in range(-_SIDEBANDS, _SIDEBANDS + 1) if k]
            places = sorted(centre + k * spacing for centre in centres for k in reach)
            name = f"{mesh.name} ± {whose}"
            yield Marks(name, tuple(p for p in places if p > 0), ORANGE, "dot", "legendonly")


def _few(components: str) -> str:
    """Names as they are, or their number where they would fill the legend."""
    names = components.split(", ")
    return components if len(names) <= 2 else f"of {len(names)} bearings"


def expected_marks(
    material: Material, harmonics: int, visible: bool | Literal["legendonly"] = "legendonly"
) -> Iterator[Marks]:
    """Families of the bearings that are not among the findings."""
    found = {(one.component, one.fault) for one in material.diagnosis.findings}
    words = dict(zip(("BPFO", "BPFI", "2xBSF", "FTF"), BEARING_FAULTS, strict=True))
    for label, components, order in material.expected():
        if any((name, words.get(label, "")) in found for name in components.split(", ")):
            continue
        places = tuple(k * order for k in range(1, harmonics + 1))
        yield Marks(
            f"{label} {_few(components)}", places, _FAMILY_COLOURS.get(label, GREY), "dashdot", visible
        )
