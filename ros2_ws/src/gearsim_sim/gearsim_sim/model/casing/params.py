"""Parameters of a welded casing: a box of plates, rings with eccentric discs, rubber pads. Read from YAML."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field

from gearsim_io.errors import InputError
from gearsim_io.quantities import Si, load_yaml, read_yaml
from gearsim_sim.model.casing.material import Material
from gearsim_sim.params.fields import Count, Strict

FOLDER = Path(__file__).with_name("descriptions")
Length = Annotated[float, Si("m", gt=0)]


class Steel(Strict):
    """What plates, rings and discs are made of."""

    youngs_modulus_pa: Annotated[float, Si("Pa", gt=0), Field(alias="youngs_modulus")]
    """Of all parts."""
    poisson_ratio: Annotated[float, Si("", gt=0, lt=0.5)]
    """Of all parts."""
    density_kg_per_m3: Annotated[float, Si("kg/m^3", gt=0), Field(alias="density")]
    """Of all parts."""


class Box(Strict):
    """The plates, by their middle planes: a floor, two end walls with the rings, two side walls; no lid."""

    length_m: Annotated[Length, Field(alias="length")]
    """Along x, between the side walls."""
    height_m: Annotated[Length, Field(alias="height")]
    """From the floor to the upper edge."""
    width_m: Annotated[Length, Field(alias="width")]
    """Along the shafts, between the end walls."""
    shaft_height_m: Annotated[Length, Field(alias="shaft_height")]
    """Of the shafts above the floor."""
    wall_thickness_m: Annotated[Length, Field(alias="wall_thickness")]
    """Of end and side walls."""
    floor_thickness_m: Annotated[Length, Field(alias="floor_thickness")]
    """Of the floor."""


class Rim(Strict):
    """A flange round the upper edge, outward; width 0 means none."""

    width_m: Annotated[float, Si("m", ge=0), Field(alias="width")]
    """Beyond the walls."""
    thickness_m: Annotated[Length, Field(alias="thickness")]
    """Of the flange."""


class Rings(Strict):
    """Two rings welded into each end wall, each holding an eccentric disc with a bearing's bore."""

    spacing_m: Annotated[Length, Field(alias="spacing")]
    """Between the centres of the two rings of a wall."""
    outer_radius_m: Annotated[Length, Field(alias="outer_radius")]
    """Of the ring, and of the hole in the wall."""
    disc_radius_m: Annotated[Length, Field(alias="disc_radius")]
    """Of the eccentric disc in the ring."""
    thickness_m: Annotated[Length, Field(alias="thickness")]
    """Of ring and disc, along the shafts; the wall is at the middle."""
    bore_radius_m: Annotated[Length, Field(alias="bore_radius")]
    """Of the bearings' outer rings."""
    bore_spacing_m: Annotated[Length, Field(alias="bore_spacing")]
    """Between the shafts; the discs' eccentricity is half of what it differs from the rings' spacing."""


class Pads(Strict):
    """Rubber pads under the corners of the floor, springs to the ground; stiffness 0 means hung up freely."""

    size_m: Annotated[Length, Field(alias="size")]
    """Side of a square pad."""
    inset_m: Annotated[float, Si("m", ge=0), Field(alias="inset")]
    """From the floor's edges to a pad."""
    vertical_n_per_m: Annotated[float, Si("N/m", ge=0), Field(alias="vertical_stiffness")]
    """Of one pad, along y."""
    lateral_n_per_m: Annotated[float, Si("N/m", ge=0), Field(alias="lateral_stiffness")]
    """Of one pad, along x and z."""


class Meshing(Strict):
    """How fine the mesh is."""

    plate_size_m: Annotated[Length, Field(alias="plate_size")]
    """Side of the quads, about."""
    ring_size_m: Annotated[Length, Field(alias="ring_size")]
    """Of the rings' hexahedra in radial direction, about."""
    ring_layers: Count
    """Hexahedra through a ring's thickness."""
    weld_width_m: Annotated[Length, Field(alias="weld_width")]
    """Of the strips along welds that are regions of their own."""


class CasingParams(Strict):
    """A whole casing."""

    name: str
    description: str = ""
    steel: Steel
    box: Box
    rim: Rim
    rings: Rings
    pads: Pads
    mesh: Meshing
    damping_ratio: Annotated[float, Si("", ge=0, lt=1)]
    """Of every mode, of critical."""
    thickness_m: Annotated[dict[str, Length], Field(alias="thickness", default_factory=dict)]
    """Of single regions, in place of their plate's."""

    @property
    def material(self) -> Material:
        """The steel as the elements need it."""
        steel = self.steel
        return Material(steel.youngs_modulus_pa, steel.poisson_ratio, steel.density_kg_per_m3)


def load_casing(name_or_path: str) -> CasingParams:
    """The casing shipped under a name, or described by a YAML file of one's own."""
    path = Path(name_or_path)
    if path.suffix not in (".yaml", ".yml"):
        known = sorted(file.stem for file in FOLDER.glob("*.yaml"))
        if name_or_path not in known:
            expected = f"one of {', '.join(known)}, or the path of a .yaml file"
            raise InputError("casing", "", name_or_path, expected)
        path = FOLDER / f"{name_or_path}.yaml"
    content = read_yaml(path)
    if isinstance(content, dict) and "kind" in content:
        expected = "a box of plates, which has no kind (others are built, reduced and shown alone)"
        raise InputError(str(path), "kind", str(content["kind"]), expected)
    params = load_yaml(CasingParams, path, require_source=True)
    _check_fit(params, str(path))
    return params


def _check_fit(params: CasingParams, where: str) -> None:
    """Bore in disc in ring in wall, rings beside each other, pads on the floor."""
    box, rings, pads = params.box, params.rings, params.pads
    half, eccentricity = rings.spacing_m / 2, abs(rings.spacing_m - rings.bore_spacing_m) / 2
    limits = (
        ("rings.disc_radius", rings.disc_radius_m, rings.bore_radius_m + eccentricity, rings.outer_radius_m),
        ("rings.outer_radius", rings.outer_radius_m, rings.disc_radius_m, half),
        ("box.length", box.length_m, 4 * half, float("inf")),
        ("box.shaft_height", box.shaft_height_m, half, box.height_m - half),
        ("pads.size", pads.size_m, 0.0, min(box.length_m, box.width_m) / 2 - pads.inset_m),
    )
    for field, value, low, high in limits:
        if not low < value < high:
            raise InputError(where, field, f"{value:g} m", f"between {low:g} m and {high:g} m")
