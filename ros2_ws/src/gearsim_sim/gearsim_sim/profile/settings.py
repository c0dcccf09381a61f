"""What a scenario says about its operating profile (section `profile`)."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from gearsim_io.quantities import Si, Strict

Seconds = Annotated[float, Si("s", gt=0, le=1e5)]
Torque = Annotated[float, Si("N*m", ge=0, le=1e6)]
SpeedHz = Annotated[float, Si("Hz", ge=0, le=500)]


class TraceModel(Strict):
    """A measured speed (and load) over time: columns of a CSV file, arrays of an npz file, or written out."""

    file: Annotated[str, Field(min_length=1)] | None = None
    """CSV file with a header, or npz file, beside the scenario."""
    columns: dict[str, tuple[float, ...]] | None = None
    """The columns themselves, in place of a file: `{time_s: [0, 1, 2, 3], speed_hz: [9, 10, 10, 9]}`."""
    time: str = "time_s"
    """Column of the time in seconds, from 0 on."""
    speed: str = "speed_hz"
    """Column of the speed of the reference shaft."""
    speed_unit: Literal["Hz", "rpm"] = "Hz"
    """Unit of that column."""
    load: str | None = None
    """Column of the load torque in N m; without it the load of the operating point."""
    tolerance: Annotated[float, Si("Hz", ge=0)] = 0.0
    """Rms distance from the points that a smoother curve of speed may have."""
    load_tolerance: Annotated[float, Si("N*m", ge=0)] = 0.0
    """The same for the load."""
    max_gap: Seconds | None = None
    """Longest time without a point; without it ten times the usual interval."""

    @model_validator(mode="after")
    def _one_place(self) -> TraceModel:
        if (self.file is None) == (self.columns is None):
            raise ValueError("either a file or columns")
        return self


class CurvePointModel(Strict):
    """A point of a motor's torque over speed."""

    speed: SpeedHz
    """Speed of the reference shaft."""
    torque: Annotated[float, Si("N*m", ge=-1e6, le=1e6)]
    """Torque of the motor there."""


class ControllerModel(Strict):
    """A PI speed controller that leads the motor to the speed of the operating point."""

    gain: Annotated[float, Si("N*m/Hz", gt=0)]
    """Torque per difference of speed."""
    integral_time: Seconds
    """Time in which a lasting difference adds as much torque again."""
    limit: Annotated[float, Si("N*m", gt=0, le=1e6)]
    """Greatest torque that the motor gives."""
    ramp: Seconds = 1.0
    """Time in which the wanted speed rises from that at the start to the operating point's."""


class MotorModel(Strict):
    """One of: a constant torque, a curve of torque over speed, a controlled motor."""

    constant: Annotated[float, Si("N*m", gt=0, le=1e6)] | None = None
    """Torque at any speed."""
    curve: Annotated[tuple[CurvePointModel, ...], Field(min_length=2)] | None = None
    controller: ControllerModel | None = None

    @model_validator(mode="after")
    def _just_one(self) -> MotorModel:
        if sum(part is not None for part in (self.constant, self.curve, self.controller)) != 1:
            raise ValueError("one of constant, curve, controller")
        if self.curve is not None:
            speeds = [point.speed for point in self.curve]
            if any(b <= a for a, b in pairwise(speeds)):
                raise ValueError("a curve with ascending speeds")
        return self


class LoadLawModel(Strict):
    """How the load depends on speed: shares of the load at the speed of the operating point."""

    constant: Annotated[float, Si("", ge=0, le=1)] = 0.0
    """Share of the load that any speed has."""
    linear: Annotated[float, Si("", ge=0, le=1)] = 0.0
    """Share that grows with the speed."""
    quadratic: Annotated[float, Si("", ge=0, le=1)] = 0.0
    """Share that grows with the square of the speed."""

    @model_validator(mode="after")
    def _whole(self) -> LoadLawModel:
        if abs(self.constant + self.linear + self.quadratic - 1) > 1e-9:
            raise ValueError("shares that add up to 1")
        return self


class TorquesModel(Strict):
    """The speed follows from what the motor gives and the load takes."""

    motor: MotorModel
    start_speed: SpeedHz = 0.0
    """Speed at the start; 0 is a run-up from rest."""
    takeover: Annotated[float, Si("s", ge=0.01, le=100)] = 0.1
    """Time in which the torques come on at the start."""


class RippleModel(Strict):
    """A torque that oscillates with the angle of a shaft (`order`) or in time (`frequency`)."""

    at: Literal["motor", "load"]
    """The torque that pulsates."""
    order: Annotated[float, Si("", gt=0, le=1000)] | None = None
    """Periods per turn of the shaft that it acts on."""
    frequency: Annotated[float, Si("Hz", ge=1)] | None = None
    """Fixed frequency, in place of an order."""
    amplitude: Torque
    """Amplitude of the torque."""
    phase: Annotated[float, Si("rad")] = 0.0
    """Phase of the cosine at the shaft's angle zero, or at time zero."""

    @model_validator(mode="after")
    def _just_one(self) -> RippleModel:
        if (self.order is None) == (self.frequency is None):
            raise ValueError("either order (of the shaft that it acts on) or frequency")
        return self


class LoadNoiseModel(Strict):
    """A band-limited random load on top."""

    rms: Annotated[float, Si("N*m", gt=0)]
    """Standard deviation of the random load."""
    low: Annotated[float, Si("Hz", ge=0)] = 0.0
    """Lower edge of its band."""
    high: Annotated[float, Si("Hz", gt=0, le=200)]
    """Upper edge of its band."""


class ProfileModel(Strict):
    """The section; without any key the operating point is constant and changes by events only."""

    trace: TraceModel | None = None
    torques: TorquesModel | None = None
    load_law: LoadLawModel | None = None
    load_noise: LoadNoiseModel | None = None
    ripple: tuple[RippleModel, ...] = ()

    @model_validator(mode="after")
    def _consistent(self) -> ProfileModel:
        if self.trace is not None and self.torques is not None:
            raise ValueError("either trace or torques")
        if self.trace is not None and self.trace.load is not None and self.load_law is not None:
            raise ValueError("either a load_law or the load of a trace")
        return self
