"""How scenarios write the sensor table, and the chains that are shipped.

The folder `catalogue` has a file per measuring chain (`lab`, `ideal`, ...) with value, unit and source of
each number. A scenario picks one and may change parts of it, for all channels or for one; `off` switches an
effect off. An effect with several numbers (`mounting`, `mains`, ...) is replaced as a whole.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from gearsim_io.quantities import Si, Strict, load_yaml
from gearsim_sim.sensors.drift import Drift
from gearsim_sim.sensors.dropouts import Dropouts
from gearsim_sim.sensors.gain import Temperature
from gearsim_sim.sensors.highpass import HighPass
from gearsim_sim.sensors.interference import Inverter, Mains
from gearsim_sim.sensors.marks import Pickup
from gearsim_sim.sensors.mounting import Mounting, mountings
from gearsim_sim.sensors.options import OrOff, SiOrOff, is_off
from gearsim_sim.sensors.overload import Overload
from gearsim_sim.sensors.rows import Mix
from gearsim_sim.sensors.sampling import Sampling

CATALOGUE = Path(__file__).parent / "catalogue"

MaybeFloat = float | None
Accel = Annotated[float, Si("m/s^2", ge=0)]
Torque = Annotated[float, Si("N*m", ge=0)]
AdcBits = Annotated[MaybeFloat, SiOrOff("", ge=2, le=32)]


def _named_mounting(raw: Any) -> Any:
    if is_off(raw):
        return None
    if isinstance(raw, str):
        if raw not in mountings():
            raise ValueError("one of " + ", ".join(mountings()) + ", off, or {resonance, q}")
        return mountings()[raw]
    return raw


def _mix(raw: Any) -> Any:
    """A site's name, or a mapping of sites and weights, as a weighted sum."""
    if raw is None or isinstance(raw, tuple):
        return raw
    if isinstance(raw, str):
        return ((raw, 1.0),)
    weights = list(raw.values()) if isinstance(raw, dict) else []
    if not weights or any(isinstance(w, bool) or not isinstance(w, (int, float)) for w in weights):
        raise ValueError("a site, or sites with their weights, such as {b1_x: 0.7071, b1_y: 0.7071}")
    return tuple((str(name), float(weight)) for name, weight in raw.items())


Sites = Annotated[Mix | None, BeforeValidator(_mix)]
SignalPath = Literal["modes", "frf"]


class Effects(Strict):
    """The numbers of a chain that do not depend on what it measures; what is left out stays as it is."""

    bandwidth: Annotated[MaybeFloat, SiOrOff("Hz", gt=0)] = None
    """Frequency at which the second-order roll-off is 3 dB down; left out above 0.49 of the sensors' rate."""
    noise_corner: Annotated[MaybeFloat, SiOrOff("Hz", gt=0.01, le=1e5)] = None
    """Frequency below which noise rises as 1/f above the white noise."""
    adc_bits: AdcBits = None
    """Word length of the converter over the whole range, both signs."""
    delay: Annotated[float, Si("s", ge=0, le=1)] = 0.0
    """By how much the channel comes later than the motion."""
    gain_error: Annotated[float, Si("", gt=-1, le=1)] = 0.0
    """Relative error of the sensitivity."""
    temperature: Annotated[Temperature | None, OrOff()] = None
    """What temperature does to the sensitivity."""
    dropouts: Annotated[Dropouts | None, OrOff()] = None
    """Bursts in which the signal is lost."""

    @model_validator(mode="after")
    def _whole_bits(self) -> Effects:
        if self.adc_bits is not None and self.adc_bits != round(self.adc_bits):
            raise ValueError("a whole number of adc_bits")
        return self

    def given(self) -> dict[str, Any]:
        """What was written, under the names of `Row`."""
        names = {"range": "full_scale", "bandwidth": "bandwidth_hz", "delay": "delay_s"}
        names["noise_corner"] = "noise_corner_hz"
        own = self.model_fields_set - {"site", "axis", "path", "description"}
        found = {names.get(key, key): getattr(self, key) for key in own}
        if found.get("adc_bits") is not None:
            found["adc_bits"] = round(found["adc_bits"])
        if "cross_axis" in found:
            found["cross_axis"] = found["cross_axis"] or ()
        return found


class AccelerometerEffects(Effects):
    """The numbers of an accelerometer's chain."""

    range: Annotated[MaybeFloat, SiOrOff("m/s^2", gt=0)] = None
    """Largest magnitude; beyond it the signal is clipped."""
    noise_density: Annotated[MaybeFloat, SiOrOff("m/s^2/Hz^0.5", ge=0)] = None
    """One-sided density of the white noise."""
    offset: Annotated[float, Si("m/s^2")] = 0.0
    """Error of the zero."""
    mounting: Annotated[Mounting | None, BeforeValidator(_named_mounting)] = None
    """How the sensor is fixed: a shipped name, or resonance and q."""
    high_pass: Annotated[HighPass | None, OrOff()] = None
    """AC coupling."""
    drift: Annotated[Drift[Accel] | None, OrOff()] = None
    """Wandering zero."""
    mains: Annotated[Mains[Accel] | None, OrOff()] = None
    """Hum."""
    inverter: Annotated[Inverter[Accel] | None, OrOff()] = None
    """Lines of a frequency converter."""
    overload: Annotated[Overload | None, OrOff()] = None
    """Slow recovery from clipping, as of a charge amplifier."""


class TorqueEffects(Effects):
    """The numbers of a torque transducer's chain."""

    range: Annotated[MaybeFloat, SiOrOff("N*m", gt=0)] = None
    """Largest magnitude; beyond it the signal is clipped."""
    noise_density: Annotated[MaybeFloat, SiOrOff("N*m/Hz^0.5", ge=0)] = None
    """One-sided density of the white noise."""
    offset: Annotated[float, Si("N*m")] = 0.0
    """Error of the zero."""
    zero_per_k: Annotated[float, Si("N*m/K")] = 0.0
    """Shift of the zero per kelvin of `temperature`."""
    drift: Annotated[Drift[Torque] | None, OrOff()] = None
    """Wandering zero."""
    mains: Annotated[Mains[Torque] | None, OrOff()] = None
    """Hum."""
    inverter: Annotated[Inverter[Torque] | None, OrOff()] = None
    """Lines of a frequency converter."""


class OneAccelerometer(AccelerometerEffects):
    """Changes of one channel; `site` lets it look elsewhere, `cross_axis` adds parts of other sites."""

    site: Sites = None
    """Place and direction of the model that the channel looks at, or several with weights; default: that
    of its name."""
    axis: str | None = None
    """Direction, for people."""
    path: SignalPath | None = None
    """How the motion comes to it; default: that of all accelerometers."""
    cross_axis: Annotated[Mix | None, OrOff(), BeforeValidator(_mix)] = None
    """Other sites that come through, with the parts of them that do."""


class AccelerometerChain(AccelerometerEffects):
    """A chain of the catalogue for accelerometers."""

    description: str = ""
    """One line for people."""


class TorqueChain(TorqueEffects):
    """A chain of the catalogue for torque transducers."""

    description: str = ""
    """One line for people."""


class AccelerometersModel(Strict):
    """The accelerometers of a scenario.

    `chain` is a name of the catalogue, `channels` the channels that exist (default: all of the machine),
    `all` changes every channel, `each` single ones; `sampling` is the converter's that takes them all.
    """

    chain: str = "lab"
    """Measuring chain out of the catalogue."""
    channels: tuple[str, ...] | None = Field(default=None, min_length=1)
    """Channels that exist; default: all of the machine."""
    sampling: Sampling = Sampling()
    """How the converter samples all of them."""
    path: SignalPath = "modes"
    """How the motion comes to them: from the model's own `modes`, or in a flexible casing from the bearings'
    forces through its frequency responses, `frf`, which reach much higher."""
    all: AccelerometerEffects = AccelerometerEffects()
    """Changes of every channel."""
    each: dict[str, OneAccelerometer] = Field(default_factory=dict)
    """Changes of single channels."""


class TorquesModel(Strict):
    """Shafts with a torque transducer (default: none), each a channel `<shaft>_torque`."""

    chain: str = "strain_gauge"
    """Measuring chain out of the catalogue."""
    shafts: tuple[str, ...] = ()
    """Shafts with a torque transducer; default: none."""
    all: TorqueEffects = TorqueEffects()
    """Changes of every transducer."""
    each: dict[str, TorqueEffects] = Field(default_factory=dict)
    """Changes of single ones, by shaft."""


class TachosModel(Pickup):
    """Shafts with a tacho (default: those of the machine); `each` changes single ones."""

    shafts: tuple[str, ...] | None = None
    """Shafts with a tacho; default: those of the machine."""
    pulses: Annotated[int, Field(ge=1, le=10_000)] = 1
    """Pulses per turn."""
    each: dict[str, Pickup] = Field(default_factory=dict)
    """Errors of single tachos, by shaft."""


class EncodersModel(Pickup):
    """Shafts with an encoder (default: those of the machine); `each` changes single ones."""

    shafts: tuple[str, ...] | None = None
    """Shafts with an encoder; default: those of the machine."""
    lines: Annotated[int, Field(ge=1, le=100_000)] = 900
    """Lines per turn."""
    each: dict[str, Pickup] = Field(default_factory=dict)
    """Errors of single encoders, by shaft."""


class SensorsModel(Strict):
    """The `sensors` section of a scenario."""

    accelerometers: AccelerometersModel = AccelerometersModel()
    """Accelerometers."""
    tachos: TachosModel = TachosModel()
    """Tachos."""
    encoders: EncodersModel = EncodersModel()
    """Encoders."""
    torques: TorquesModel = TorquesModel()
    """Torque transducers."""


_KINDS: Mapping[str, type[AccelerometerChain] | type[TorqueChain]] = {
    "accelerometers": AccelerometerChain,
    "torques": TorqueChain,
}


def chain_names(kind: str) -> tuple[str, ...]:
    """Names of the shipped chains of a kind of sensor, `accelerometers` or `torques`."""
    return tuple(sorted(path.stem for path in (CATALOGUE / kind).glob("*.yaml")))


@cache
def chain(kind: str, name: str) -> AccelerometerChain | TorqueChain:
    """A shipped chain; KeyError if there is none of that name."""
    if name not in chain_names(kind):
        raise KeyError(name)
    return load_yaml(_KINDS[kind], CATALOGUE / kind / f"{name}.yaml", require_source=True)
