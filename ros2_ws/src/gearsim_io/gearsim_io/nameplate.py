"""The nameplate of a machine: what an owner knows and a diagnosis may use. Never what is wrong with it.

Mirrors `gearsim_msgs/MachineInfo`. Loaded from the `nameplate` section of a machine YAML by
`gearsim_io.machines`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TypeVar

_T = TypeVar("_T", "Shaft", "Bearing")


class _Described:
    """Compared field by field, where one unknown number equals another (NaN by itself equals nothing)."""

    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Described) and type(other) is type(self) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def _key(self) -> tuple[object, ...]:
        values = (getattr(self, name) for name in self.__dataclass_fields__)  # type: ignore[attr-defined]
        return tuple(None if isinstance(value, float) and math.isnan(value) else value for value in values)


@dataclass(frozen=True, slots=True, eq=False)
class Shaft(_Described):
    """A shaft turning at `ratio` times the reference shaft; `nominal_speed_hz` is NaN if not known."""

    name: str
    ratio: float
    nominal_speed_hz: float


@dataclass(frozen=True, slots=True, eq=False)
class GearMesh(_Described):
    """A pair of meshing gears."""

    name: str
    driving_shaft: str
    driven_shaft: str
    driving_teeth: int
    driven_teeth: int


@dataclass(frozen=True, slots=True, eq=False)
class Bearing(_Described):
    """Geometry of a rolling-element bearing (metres, radians); `channels` are close to it, nearest first."""

    name: str
    shaft: str
    rolling_elements: int
    element_diameter_m: float
    pitch_diameter_m: float
    contact_angle_rad: float = 0.0
    outer_ring_rotates: bool = False
    channels: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Channel(_Described):
    """A measuring channel; `full_scale` in `unit`, NaN if not known."""

    name: str
    location: str = ""
    axis: str = ""
    unit: str = "m/s^2"
    full_scale: float = float("nan")


@dataclass(frozen=True, slots=True, eq=False)
class Machine(_Described):
    """The whole nameplate. Orders count turns of `reference_shaft`."""

    name: str
    description: str
    reference_shaft: str
    shafts: tuple[Shaft, ...]
    gear_meshes: tuple[GearMesh, ...] = ()
    bearings: tuple[Bearing, ...] = ()
    channels: tuple[Channel, ...] = ()
    tacho_shafts: tuple[str, ...] = ()
    encoder_shafts: tuple[str, ...] = ()
    line_frequency_hz: float = 0.0
    speed_tolerance: float = 0.02
    sources: dict[str, str] = field(default_factory=dict)

    def shaft(self, name: str) -> Shaft:
        """The shaft of that name; KeyError otherwise."""
        return _named(self.shafts, name)

    def bearing(self, name: str) -> Bearing:
        """The bearing of that name; KeyError otherwise."""
        return _named(self.bearings, name)

    @property
    def nominal_speed_hz(self) -> float:
        """Nameplate speed of the reference shaft, NaN if not known."""
        return self.shaft(self.reference_shaft).nominal_speed_hz


def _named(items: tuple[_T, ...], name: str) -> _T:
    for item in items:
        if item.name == name:
            return item
    raise KeyError(name)
