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
    """A measured speed (and load) over time: columns of a CSV file, or arrays of an npz file."""

    file: str = Field(min_length=1)
    time: str = "time_s"
    speed: str = "speed_hz"
    speed_unit: Literal["Hz", "rpm"] = "Hz"
    load: str | None = None  # column; without it the load of the operating point
    tolerance: Annotated[float, Si("Hz", ge=0)] = 0.0  # rms distance that a smoother curve may have
    load_tolerance: Annotated[float, Si("N*m", ge=0)] = 0.0
    max_gap: Seconds | None = None  # without it ten times the usual interval


class CurvePointModel(Strict):
    """A point of a motor's torque over speed."""

    speed: SpeedHz
    torque: Annotated[float, Si("N*m", ge=-1e6, le=1e6)]


class ControllerModel(Strict):
    """A PI speed controller that leads the motor to the speed of the operating point."""

    gain: Annotated[float, Si("N*m/Hz", gt=0)]
    integral_time: Seconds
    limit: Annotated[float, Si("N*m", gt=0, le=1e6)]
    ramp: Seconds = 1.0  # within which its target rises from the speed at the start


class MotorModel(Strict):
    """One of: a constant torque, a curve of torque over speed, a controlled motor."""

    constant: Annotated[float, Si("N*m", gt=0, le=1e6)] | None = None
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
    linear: Annotated[float, Si("", ge=0, le=1)] = 0.0
    quadratic: Annotated[float, Si("", ge=0, le=1)] = 0.0

    @model_validator(mode="after")
    def _whole(self) -> LoadLawModel:
        if abs(self.constant + self.linear + self.quadratic - 1) > 1e-9:
            raise ValueError("shares that add up to 1")
        return self


class TorquesModel(Strict):
    """The speed follows from what the motor gives and the load takes."""

    motor: MotorModel
    start_speed: SpeedHz = 0.0
    takeover: Annotated[float, Si("s", ge=0.01, le=100)] = 0.1  # the torques come on within this time


class RippleModel(Strict):
    """A torque that oscillates with the angle of a shaft (`order`) or in time (`frequency`)."""

    at: Literal["motor", "load"]
    order: Annotated[float, Si("", gt=0, le=1000)] | None = None
    frequency: Annotated[float, Si("Hz", ge=1)] | None = None
    amplitude: Torque
    phase: Annotated[float, Si("rad")] = 0.0

    @model_validator(mode="after")
    def _just_one(self) -> RippleModel:
        if (self.order is None) == (self.frequency is None):
            raise ValueError("either order (of the shaft that it acts on) or frequency")
        return self


class LoadNoiseModel(Strict):
    """A band-limited random load on top."""

    rms: Annotated[float, Si("N*m", gt=0)]
    low: Annotated[float, Si("Hz", ge=0)] = 0.0
    high: Annotated[float, Si("Hz", gt=0, le=200)]


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
