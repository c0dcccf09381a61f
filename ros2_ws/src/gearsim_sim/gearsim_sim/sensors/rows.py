"""The sensor table: what a row holds, how scenarios write it, and the chains that are shipped.

`catalogue.yaml` names measuring chains (`lab`, `ideal`, ...) with value, unit and source of each number.
A scenario picks one and may change single numbers, for all channels or for one; `off` switches an effect off.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, RootModel, ValidationInfo, model_validator

from gearsim_io.errors import InputError
from gearsim_io.nameplate import Channel, Machine
from gearsim_io.quantities import Si, Strict, load_yaml

CATALOGUE = Path(__file__).parent / "catalogue.yaml"
_OFF = (None, False, "off")


class SiOrOff(Si):
    """A physical number, or `off`."""

    @property
    def expected(self) -> str:
        """The accepted values in words."""
        return super().expected + ", or off"

    def _validate(self, raw: Any, info: ValidationInfo) -> Any:
        return None if raw in _OFF else super()._validate(raw, info)


MaybeFloat = float | None
AdcBits = Annotated[MaybeFloat, SiOrOff("", ge=2, le=32)]


@dataclass(frozen=True, slots=True)
class Accelerometer:
    """One row of the table, in SI units; None switches an effect off.

    Attributes
    ----------
    channel : str
        Name in `SampleBatch.channels`.
    site : str
        Place and direction where the model gives the acceleration.
    axis : str
        Direction, for people.
    range_m_s2 : float or None
        Largest magnitude; beyond it the signal is clipped.
    bandwidth_hz : float or None
        Frequency at which the second-order roll-off has reached -3 dB.
    noise_density : float or None
        One-sided, (m/s^2)/sqrt(Hz).
    adc_bits : int or None
        Word length over the whole range, both signs.
    delay_s : float
        By how much the channel comes later than the motion.
    """

    channel: str
    site: str
    axis: str = ""
    range_m_s2: float | None = None
    bandwidth_hz: float | None = None
    noise_density: float | None = None
    adc_bits: int | None = None
    delay_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Tacho:
    """A tacho of `pulses` per turn on a shaft; pulse 0 comes at the angle `phase_turns`."""

    shaft: str
    pulses: int = 1
    phase_turns: float = 0.0


@dataclass(frozen=True, slots=True)
class Encoder:
    """A rotary encoder of `lines` per turn on a shaft."""

    shaft: str
    lines: int = 900


@dataclass(frozen=True, slots=True)
class SensorTable:
    """All sensors of a rig."""

    accelerometers: tuple[Accelerometer, ...]
    tachos: tuple[Tacho, ...]
    encoders: tuple[Encoder, ...]


class Effects(Strict):
    """The numbers of a chain; one that is left out keeps what the chain has."""

    range: Annotated[MaybeFloat, SiOrOff("m/s^2", gt=0)] = None
    bandwidth: Annotated[MaybeFloat, SiOrOff("Hz", gt=0)] = None
    noise_density: Annotated[MaybeFloat, SiOrOff("m/s^2/Hz^0.5", ge=0)] = None
    adc_bits: AdcBits = None
    delay: Annotated[float, Si("s", ge=0, le=1)] = 0.0

    @model_validator(mode="after")
    def _whole_bits(self) -> Effects:
        if self.adc_bits is not None and self.adc_bits != round(self.adc_bits):
            raise ValueError("a whole number of adc_bits")
        return self

    def given(self) -> dict[str, Any]:
        """What was written, under the names of `Accelerometer`."""
        names = {"range": "range_m_s2", "bandwidth": "bandwidth_hz", "delay": "delay_s"}
        found = {names.get(key, key): getattr(self, key) for key in self.model_fields_set & set(_EFFECTS)}
        if found.get("adc_bits") is not None:
            found["adc_bits"] = round(found["adc_bits"])
        return found


_EFFECTS = tuple(Effects.model_fields)


class OneChannel(Effects):
    """Changes of one channel; `site` lets it look at another place of the model."""

    site: str | None = None
    axis: str | None = None


class Chain(Effects):
    """A chain of the catalogue."""

    description: str = ""


class Catalogue(RootModel[dict[str, Chain]]):
    """The shipped chains by name."""


class AccelerometersModel(Strict):
    """The accelerometers of a scenario.

    `chain` is a name of the catalogue, `channels` the channels that exist (default: all of the machine),
    `all` changes every channel, `each` single ones.
    """

    chain: str = "lab"
    channels: tuple[str, ...] | None = Field(default=None, min_length=1)
    all: Effects = Effects()
    each: dict[str, OneChannel] = Field(default_factory=dict)


class TachosModel(Strict):
    """Shafts with a tacho (default: those of the machine)."""

    shafts: tuple[str, ...] | None = None
    pulses: Annotated[int, Field(ge=1, le=10_000)] = 1


class EncodersModel(Strict):
    """Shafts with an encoder (default: those of the machine)."""

    shafts: tuple[str, ...] | None = None
    lines: Annotated[int, Field(ge=1, le=100_000)] = 900


class SensorsModel(Strict):
    """The `sensors` section of a scenario."""

    accelerometers: AccelerometersModel = AccelerometersModel()
    tachos: TachosModel = TachosModel()
    encoders: EncodersModel = EncodersModel()


@cache
def catalogue() -> Mapping[str, Chain]:
    """The shipped chains."""
    return load_yaml(Catalogue, CATALOGUE, require_source=True).root


def sensor_table(model: SensorsModel, machine: Machine, where: str) -> SensorTable:
    """The table that a scenario's `sensors` section means for a machine.

    Raises
    ------
    InputError
        An unknown chain, channel or shaft, or a word length without a range; named as in file `where`.
    """
    tacho_shafts = _shafts(model.tachos.shafts, machine.tacho_shafts, machine, f"{where}: sensors.tachos")
    encoder_shafts = _shafts(
        model.encoders.shafts, machine.encoder_shafts, machine, f"{where}: sensors.encoders"
    )
    return SensorTable(
        accelerometers=_accelerometers(model.accelerometers, machine, where),
        tachos=tuple(Tacho(shaft, model.tachos.pulses) for shaft in tacho_shafts),
        encoders=tuple(Encoder(shaft, model.encoders.lines) for shaft in encoder_shafts),
    )


def _accelerometers(model: AccelerometersModel, machine: Machine, where: str) -> tuple[Accelerometer, ...]:
    place = "sensors.accelerometers"
    chains = catalogue()
    if model.chain not in chains:
        raise InputError(where, f"{place}.chain", model.chain, "one of " + ", ".join(sorted(chains)))
    known = {channel.name: channel for channel in machine.channels}
    names = tuple(known) if model.channels is None else model.channels
    for name in (*names, *model.each):
        # A channel of one's own is allowed, if it says which site it looks at.
        own = name in model.each and model.each[name].site is not None
        if name not in known and not own:
            expected = "one of " + ", ".join(known) + ", or a site for it under each"
            raise InputError(where, f"{place}.channels", name, expected)
    if len(set(names)) != len(names):
        raise InputError(where, f"{place}.channels", list(names), "each channel once")
    extra = tuple(name for name in model.each if name not in names)
    if extra:
        raise InputError(where, f"{place}.each", extra[0], "a channel that is listed under channels")
    rows = tuple(_row(name, known.get(name), model, chains[model.chain]) for name in names)
    for row in rows:
        if row.adc_bits is not None and row.range_m_s2 is None:
            got = f"{row.adc_bits} bits without a range"
            raise InputError(where, f"{place}: adc_bits of {row.channel}", got, "a range, or adc_bits: off")
    return rows


def _row(name: str, channel: Channel | None, model: AccelerometersModel, chain: Chain) -> Accelerometer:
    row = Accelerometer(name, name, channel.axis if channel else "")
    row = dataclasses.replace(row, **chain.given())
    if channel is not None and math.isfinite(channel.full_scale) and row.range_m_s2 is not None:
        row = dataclasses.replace(row, range_m_s2=channel.full_scale)
    row = dataclasses.replace(row, **model.all.given())
    one = model.each.get(name)
    if one is None:
        return row
    return dataclasses.replace(
        row, **one.given(), site=one.site or row.site, axis=row.axis if one.axis is None else one.axis
    )


def _shafts(
    wanted: tuple[str, ...] | None, default: tuple[str, ...], machine: Machine, where: str
) -> tuple[str, ...]:
    if wanted is None:
        return default
    known = [shaft.name for shaft in machine.shafts]
    for shaft in wanted:
        if shaft not in known:
            raise InputError(where, "shafts", shaft, "one of " + ", ".join(known))
    if len(set(wanted)) != len(wanted):
        raise InputError(where, "shafts", list(wanted), "each shaft once")
    return wanted
