"""The sensor table: what a row of it holds, in SI units; None, zero or an empty part switches an effect off.

Scenarios write it as `settings` says, and `table` makes the rows of that.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from gearsim_sim.sensors.drift import Drift
from gearsim_sim.sensors.dropouts import Dropouts
from gearsim_sim.sensors.gain import Temperature
from gearsim_sim.sensors.highpass import HighPass
from gearsim_sim.sensors.interference import Inverter, Mains
from gearsim_sim.sensors.marks import Pickup
from gearsim_sim.sensors.mounting import Mounting
from gearsim_sim.sensors.overload import Overload
from gearsim_sim.sensors.sampling import Sampling

Mix = tuple[tuple[str, float], ...]


@dataclass(frozen=True, slots=True)
class Row:
    """One channel that is sampled: an accelerometer (m/s^2) or a torque transducer (N m).

    Attributes
    ----------
    channel : str
        Name in `SampleBatch.channels`.
    site : str or tuple of (str, float)
        Place and direction where the model tells what happens, or a weighted sum of several.
    axis : str
        Direction, for people.
    full_scale : float or None
        Largest magnitude in `unit`; beyond it the signal is clipped.
    bandwidth_hz : float or None
        Frequency at which the second-order roll-off has reached -3 dB.
    noise_density : float or None
        One-sided, `unit`/sqrt(Hz).
    adc_bits : int or None
        Word length over the whole range, both signs.
    delay_s : float
        By how much the channel comes later than the motion.
    noise_corner_hz : float or None
        Below it 1/f noise exceeds the white noise.
    gain_error : float
        Relative.
    offset : float
        Of the zero, in `unit`.
    zero_per_k : float
        Shift of the zero with temperature, `unit`/K.
    cross_axis : tuple of (str, float)
        Other sites that come through, with the parts of them that do.
    unit : str
    """

    channel: str
    site: str | Mix
    axis: str = ""
    full_scale: float | None = None
    bandwidth_hz: float | None = None
    noise_density: float | None = None
    adc_bits: int | None = None
    delay_s: float = 0.0
    noise_corner_hz: float | None = None
    gain_error: float = 0.0
    offset: float = 0.0
    zero_per_k: float = 0.0
    cross_axis: Mix = ()
    mounting: Mounting | None = None
    high_pass: HighPass | None = None
    temperature: Temperature | None = None
    drift: Drift[float] | None = None
    mains: Mains[float] | None = None
    inverter: Inverter[float] | None = None
    dropouts: Dropouts | None = None
    overload: Overload | None = None
    unit: str = "m/s^2"

    @property
    def looks_at(self) -> Mix:
        """Sites and weights whose sum the sensor sees."""
        own: Mix = ((self.site, 1.0),) if isinstance(self.site, str) else self.site
        return own + self.cross_axis


@dataclass(frozen=True, slots=True)
class Tacho:
    """A tacho of `pulses` per turn on a shaft; pulse 0 comes at the angle `phase_turns`."""

    shaft: str
    pulses: int = 1
    phase_turns: float = 0.0
    pickup: Pickup = field(default_factory=Pickup)


@dataclass(frozen=True, slots=True)
class Encoder:
    """A rotary encoder of `lines` per turn on a shaft."""

    shaft: str
    lines: int = 900
    pickup: Pickup = field(default_factory=Pickup)


@dataclass(frozen=True, slots=True)
class SensorTable:
    """All sensors of a rig, and how the accelerometers are sampled."""

    accelerometers: tuple[Row, ...]
    tachos: tuple[Tacho, ...]
    encoders: tuple[Encoder, ...]
    torques: tuple[Row, ...] = ()
    sampling: Sampling = field(default_factory=Sampling)
