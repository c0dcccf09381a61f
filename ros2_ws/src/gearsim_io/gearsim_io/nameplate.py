"""The nameplate of a machine: what an owner knows and a diagnosis may use. Never what is wrong with it.

Mirrors `gearsim_msgs/MachineInfo`. Loaded from the `nameplate` section of a machine YAML by
`gearsim_io.machines`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TypeVar

_T = TypeVar("_T", "Shaft", "Bearing")
PLANETARY_MEMBERS = ("carrier", "sun", "ring")


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
class PlanetaryStage(_Described):
    """A planetary gear stage; the member that stands still has no shaft (an empty name).

    `planet_shaft` is the shaft under which the spin of the planets against the carrier is listed, so
    that planet bearings have a shaft. `input_member` is "carrier", "sun" or "ring".
    """

    name: str
    carrier_shaft: str
    sun_shaft: str
    ring_shaft: str
    planet_shaft: str
    input_member: str
    sun_teeth: int
    ring_teeth: int
    planet_teeth: int
    planet_angles_rad: tuple[float, ...]

    @property
    def fixed_member(self) -> str:
        """The member that stands still: "carrier", "sun" or "ring"."""
        return next(one for one in PLANETARY_MEMBERS if not getattr(self, f"{one}_shaft"))

    def member_ratios(self) -> dict[str, float]:
        """Signed speeds of carrier, sun and ring, and of the planets' spin against the carrier ("planet").

        Relative to the input member; by Willis, (w_s - w_c) Z_s = -(w_r - w_c) Z_r.
        """
        sun, ring = float(self.sun_teeth), float(self.ring_teeth)
        weight = {"sun": sun, "ring": ring, "carrier": -(sun + ring)}
        last = next(one for one in weight if one not in (self.fixed_member, self.input_member))
        speed = {self.fixed_member: 0.0, self.input_member: 1.0}
        speed[last] = -weight[self.input_member] / weight[last]
        speed["planet"] = (speed["ring"] - speed["carrier"]) * ring / self.planet_teeth
        return speed


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
    planetary_stages: tuple[PlanetaryStage, ...] = ()
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
