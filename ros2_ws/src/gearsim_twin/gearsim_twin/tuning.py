"""The tuned model: a few global numbers of the machine, each known to some per cent, set as the data want.

A cause is what tuning cannot mend, so tuning comes first, and every comparison of causes lets it adapt.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gearsim_io.machines import read_machine_file
from gearsim_twin.causes.cause import Content
from gearsim_twin.causes.edit import with_parameter
from gearsim_twin.causes.prior import LogNormal
from gearsim_twin.knobs import ASSUMED_POWER, KNOBS, Knob

__all__ = ["Setting", "Tuning", "tuning_of"]


@dataclass(frozen=True, slots=True)
class Setting:
    """A knob of one machine.

    Attributes
    ----------
    name : str
        For people.
    prior : LogNormal
        Of the factor on the numbers, around 1.
    numbers : tuple of (str, float, str)
        Dotted name, value and unit of each.
    calibrated : bool
        Whether the values are no longer those of the description.
    """

    name: str
    prior: LogNormal
    numbers: tuple[tuple[str, float, str], ...]
    calibrated: bool = False


@dataclass(frozen=True, slots=True)
class Tuning:
    """What of a machine is tuned."""

    settings: tuple[Setting, ...]

    @property
    def nominal(self) -> tuple[float, ...]:
        """Coordinates at which the machine is as described."""
        return (0.0,) * len(self.settings)

    def apply(self, content: Content, coordinates: Sequence[float]) -> Content:
        """The scenario with the numbers scaled; those that are as described stay out of it."""
        for setting, u in zip(self.settings, coordinates, strict=True):
            if u == 0.0 and not setting.calibrated:
                continue
            factor = setting.prior.value(u)
            for name, value, unit in setting.numbers:
                content = with_parameter(content, name, value * factor, unit)
        return content

    def factors(self, coordinates: Sequence[float]) -> dict[str, float]:
        """Factor of each knob by name."""
        pairs = zip(self.settings, coordinates, strict=True)
        return {setting.name: setting.prior.value(float(u)) for setting, u in pairs}


def tuning_of(machine: str | Path, model: str) -> Tuning:
    """The knobs that a machine's description has numbers for.

    Parameters
    ----------
    machine : str or Path
        Name of a shipped machine description, or path of one.
    model : str
        Name of the simulator's model.

    Raises
    ------
    InputError
        If there is no such machine.
    """
    _, content = read_machine_file(machine)
    section = content.get("model", {})
    found = (_setting(knob, section) for knob in KNOBS.get(model, ()))
    return Tuning(tuple(setting for setting in found if setting is not None))


def _setting(knob: Knob, section: Mapping[str, Any]) -> Setting | None:
    if knob.needs and not _value(_number(section, knob.needs)):
        return None
    numbers, assumed = [], False
    for name in knob.parameters:
        number = _number(section, name)
        if _value(number):
            numbers.append((name, _value(number), str(number.get("unit", ""))))
            assumed = assumed or str(number.get("source", "")).startswith(("assumed", "fitted"))
    if not numbers:
        return None
    factor = knob.factor**ASSUMED_POWER if assumed else knob.factor
    return Setting(knob.name, LogNormal(1.0, factor, factor**-3.0, factor**3.0), tuple(numbers))


def _number(section: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    place: Any = section
    for part in name.split("."):
        place = place.get(part, {}) if isinstance(place, Mapping) else {}
    return place if isinstance(place, Mapping) else {}


def _value(number: Mapping[str, Any]) -> float:
    try:
        return float(number.get("value", 0.0))
    except (TypeError, ValueError):
        return 0.0
