"""Machine descriptions: one YAML file per machine, shipped under a name or given as a path.

A file has the keys `name`, `description`, `nameplate` (read here), and optionally `model` (read by
gearsim_sim) and `import` (how to read this rig's measured files, read by `gearsim_io.importers`).
Each number of the nameplate carries value, unit and source.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, Field

from gearsim_io.errors import InputError
from gearsim_io.nameplate import Bearing, Channel, GearMesh, Machine, PlanetaryStage, Shaft
from gearsim_io.places import entry
from gearsim_io.planetary import PlanetaryStageModel, Teeth, make_stage, stage_speeds
from gearsim_io.quantities import Si, Strict, read_yaml, validate

_FOLDER = Path(__file__).parent / "machines"
_RATIO_TOLERANCE = 1e-6


def _whole(value: float) -> int:
    if value != round(value):
        raise ValueError("a whole number")
    return round(value)


Length = Annotated[float, Si("m", gt=0)]


class ShaftModel(Strict):
    """A shaft; `ratio` may be left out where the gear meshes give it."""

    ratio: Annotated[float, Si("", gt=0)] | None = None
    nominal_speed: Annotated[float, Si("Hz", gt=0, nan=True)] = math.nan


class GearMeshModel(Strict):
    """Two meshing gears."""

    driving_shaft: str
    driven_shaft: str
    driving_teeth: Teeth
    driven_teeth: Teeth


class BearingModel(Strict):
    """A rolling-element bearing."""

    shaft: str
    rolling_elements: Annotated[float, Si("", ge=3), AfterValidator(_whole)]
    element_diameter: Length
    pitch_diameter: Length
    contact_angle: Annotated[float, Si("rad", ge=0, lt=math.pi / 2)] = 0.0
    outer_ring_rotates: bool = False
    channels: tuple[str, ...] = ()


class ChannelModel(Strict):
    """A measuring channel."""

    location: str = ""
    axis: str = ""
    unit: str = "m/s^2"
    full_scale: Annotated[float, Si("m/s^2", gt=0, nan=True)] = math.nan


class NameplateModel(Strict):
    """The `nameplate` section; shafts, meshes, stages, bearings and channels are keyed by their names."""

    reference_shaft: str
    shafts: dict[str, ShaftModel] = Field(min_length=1)
    gear_meshes: dict[str, GearMeshModel] = Field(default_factory=dict)
    planetary_stages: dict[str, PlanetaryStageModel] = Field(default_factory=dict)
    bearings: dict[str, BearingModel] = Field(default_factory=dict)
    channels: dict[str, ChannelModel] = Field(default_factory=dict)
    tacho_shafts: tuple[str, ...] = ()
    encoder_shafts: tuple[str, ...] = ()
    line_frequency: Annotated[float, Si("Hz", ge=0)] = 0.0
    speed_tolerance: Annotated[float, Si("", ge=0, lt=1)] = 0.02


class MachineFile(Strict):
    """The top level of a machine file; `model` and `import` are looked at by whoever needs them."""

    name: str = Field(min_length=1)
    description: str = ""
    nameplate: NameplateModel
    model: Any = None
    import_: Any = Field(default=None, alias="import")


def machine_names() -> tuple[str, ...]:
    """Names of the machine descriptions that are shipped."""
    return tuple(sorted(path.stem for path in _FOLDER.glob("*.yaml")))


def machine_file(name_or_path: str | Path) -> Path:
    """Where the description of a machine is: a shipped name, or the path of a YAML file.

    Raises
    ------
    InputError
        If it is neither.
    """
    text = str(name_or_path)
    shipped = _FOLDER / f"{text}.yaml"
    if "/" not in text and shipped.is_file():
        return shipped
    path = Path(name_or_path)
    if path.suffix in (".yaml", ".yml") and path.is_file():
        return path
    if path.suffix in (".yaml", ".yml"):
        raise InputError("machine", "", text, "a file that exists")
    known = ", ".join(machine_names())
    raise InputError("machine", "", text, f"one of {known}, or the path of a .yaml file")


def read_machine_file(name_or_path: str | Path) -> tuple[Path, dict[str, Any]]:
    """Path and plain content of a machine file, for the readers of its other sections.

    Raises
    ------
    InputError
        If there is no such machine or the file is not a YAML mapping.
    """
    path = machine_file(name_or_path)
    content = read_yaml(path)
    if not isinstance(content, dict):
        raise InputError(str(path), "", content, "a mapping with the keys name and nameplate")
    return path, content


def load_machine(name_or_path: str | Path) -> Machine:
    """The nameplate of a machine.

    Parameters
    ----------
    name_or_path : str or Path
        A shipped name (see `machine_names`) or the path of a YAML file.

    Raises
    ------
    InputError
        Naming file, key, value and what was expected, also where keys contradict each other.
    """
    path, content = read_machine_file(name_or_path)
    model = validate(MachineFile, content, str(path), require_source=True)
    plate = model.nameplate
    where = str(path)
    _check_references(where, plate)
    _check_bearings(where, plate)
    stages = tuple(make_stage(name, stage, where) for name, stage in plate.planetary_stages.items())
    ratios = _shaft_ratios(where, plate, stages)
    return Machine(
        name=model.name,
        description=model.description,
        reference_shaft=plate.reference_shaft,
        shafts=tuple(_shaft(name, shaft, ratios, plate) for name, shaft in plate.shafts.items()),
        gear_meshes=tuple(GearMesh(name, **mesh.model_dump()) for name, mesh in plate.gear_meshes.items()),
        planetary_stages=stages,
        bearings=tuple(make_bearing(name, bearing) for name, bearing in plate.bearings.items()),
        channels=tuple(Channel(name, **channel.model_dump()) for name, channel in plate.channels.items()),
        tacho_shafts=plate.tacho_shafts,
        encoder_shafts=plate.encoder_shafts,
        line_frequency_hz=plate.line_frequency,
        speed_tolerance=plate.speed_tolerance,
        sources=_sources(content["nameplate"]),
    )


def _shaft(name: str, shaft: ShaftModel, ratios: Mapping[str, float], plate: NameplateModel) -> Shaft:
    nominal = shaft.nominal_speed
    if math.isnan(nominal):  # the reference shaft's speed gives that of the others
        nominal = plate.shafts[plate.reference_shaft].nominal_speed * ratios[name]
    return Shaft(name, ratios[name], nominal)


def make_bearing(name: str, bearing: BearingModel) -> Bearing:
    """The bearing of that name, as its section describes it."""
    return Bearing(
        name=name,
        shaft=bearing.shaft,
        rolling_elements=int(bearing.rolling_elements),
        element_diameter_m=bearing.element_diameter,
        pitch_diameter_m=bearing.pitch_diameter,
        contact_angle_rad=bearing.contact_angle,
        outer_ring_rotates=bearing.outer_ring_rotates,
        channels=bearing.channels,
    )


def _check_references(where: str, plate: NameplateModel) -> None:
    """Names used must be defined."""
    shafts = ", ".join(plate.shafts)
    used = [("reference_shaft", plate.reference_shaft)]
    for name, mesh in plate.gear_meshes.items():
        used.append((f"gear_meshes.{name}.driving_shaft", mesh.driving_shaft))
        used.append((f"gear_meshes.{name}.driven_shaft", mesh.driven_shaft))
        if mesh.driving_shaft == mesh.driven_shaft:
            raise InputError(
                where, f"nameplate.gear_meshes.{name}.driven_shaft", mesh.driven_shaft, "another shaft"
            )
    for name, stage in plate.planetary_stages.items():
        members = ("carrier_shaft", "sun_shaft", "ring_shaft", "planet_shaft")
        named = ((member, getattr(stage, member)) for member in members)
        used += [(f"planetary_stages.{name}.{member}", shaft) for member, shaft in named if shaft]
    used += [(f"bearings.{name}.shaft", bearing.shaft) for name, bearing in plate.bearings.items()]
    for kind, named_shafts in (("tacho", plate.tacho_shafts), ("encoder", plate.encoder_shafts)):
        count = len(named_shafts)
        used += [(entry(f"{kind}_shafts", k, count), shaft) for k, shaft in enumerate(named_shafts)]
    for place, shaft in used:
        if shaft not in plate.shafts:
            raise InputError(where, f"nameplate.{place}", shaft, f"one of the shafts {shafts}")
    for name, bearing in plate.bearings.items():
        for k, channel in enumerate(bearing.channels):
            if channel not in plate.channels:
                known = ", ".join(plate.channels) or "(none)"
                place = entry(f"nameplate.bearings.{name}.channels", k, len(bearing.channels))
                raise InputError(where, place, channel, f"one of the channels {known}")


def _check_bearings(where: str, plate: NameplateModel) -> None:
    """The rolling elements must fit on their circle side by side."""
    for name, bearing in plate.bearings.items():
        place = f"nameplate.bearings.{name}"
        if bearing.element_diameter >= bearing.pitch_diameter:
            got = f"{bearing.element_diameter:g} m"
            raise InputError(
                where,
                f"{place}.element_diameter",
                got,
                f"less than the pitch diameter {bearing.pitch_diameter:g} m",
            )
        chord = bearing.pitch_diameter * math.sin(math.pi / bearing.rolling_elements)
        if bearing.element_diameter > chord:
            got = f"{int(bearing.rolling_elements)} elements of {bearing.element_diameter:g} m"
            raise InputError(
                where,
                f"{place}.rolling_elements",
                got,
                f"that they fit on a pitch circle of {bearing.pitch_diameter:g} m",
            )


def _shaft_ratios(where: str, plate: NameplateModel, stages: tuple[PlanetaryStage, ...]) -> dict[str, float]:
    """Speed of every shaft over that of the reference shaft; given, or from the teeth; never both at odds."""
    given = {name: shaft.ratio for name, shaft in plate.shafts.items() if shaft.ratio is not None}
    if given.get(plate.reference_shaft, 1.0) != 1.0:
        place = f"nameplate.shafts.{plate.reference_shaft}.ratio"
        raise InputError(where, place, given[plate.reference_shaft], "1, as it is the reference shaft")
    links = [
        (mesh.driving_shaft, mesh.driven_shaft, mesh.driving_teeth / mesh.driven_teeth, f"gear mesh {name}")
        for name, mesh in plate.gear_meshes.items()
    ]
    links += [(*link, "a planetary stage") for link in stage_speeds(stages)]
    ratios = {plate.reference_shaft: 1.0, **given}
    for _ in links:
        for driving, driven, step, _who in links:
            if driving in ratios:
                ratios.setdefault(driven, ratios[driving] * step)
            elif driven in ratios:
                ratios.setdefault(driving, ratios[driven] / step)
    for name in plate.shafts:
        if name not in ratios:
            expected = "a ratio, as no gear mesh joins this shaft to the reference shaft"
            raise InputError(where, f"nameplate.shafts.{name}.ratio", "nothing", expected)
    for driving, driven, step, who in links:
        expected_ratio = ratios[driving] * step
        if abs(ratios[driven] / expected_ratio - 1) > _RATIO_TOLERANCE:
            place = f"nameplate.shafts.{driven}.ratio"
            raise InputError(where, place, ratios[driven], f"{expected_ratio:g}, by the teeth of {who}")
    return ratios


def _sources(section: Any, place: str = "") -> dict[str, str]:
    """Where each number comes from, by its dotted path inside the section."""
    if not isinstance(section, Mapping):
        return {}
    if "value" in section and "source" in section:
        return {place: str(section["source"])}
    found: dict[str, str] = {}
    for key, inner in section.items():
        found.update(_sources(inner, f"{place}.{key}" if place else str(key)))
    return found
