"""From the `profile` section of a scenario to a `Profile`, checked against what the drive can do."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gearsim_io.errors import InputError
from gearsim_sim.profile.curve import Constant, Curve, Laid, Stretch, ramp_stretch, stretches_between
from gearsim_sim.profile.dynamics import LawLoad, Rotor, TorqueSpeed, settles_at
from gearsim_sim.profile.laws import CREEP, ConstantMotor, ControlledMotor, CurveMotor, LoadShape, Motor
from gearsim_sim.profile.noise import WIDEST_BAND, RandomLoad
from gearsim_sim.profile.profile import Profile
from gearsim_sim.profile.settings import LoadLawModel, LoadNoiseModel, ProfileModel, TorquesModel, TraceModel
from gearsim_sim.profile.trace import Trace, chosen_columns, read_columns, trace_curve

# The torques must bring the machine this near to the speed that is asked for.
_REACHED = 0.98
# Speeds that follow from torques are checked against the limit for so long ahead.
_CHECKED_S = 60.0
_RPM = 1 / 60


@dataclass(frozen=True, slots=True)
class DriveLimits:
    """What the machine's drive can do, and what it has to turn."""

    step_s: float
    ratio: float  # turns of the loaded shaft per turn of the reference shaft
    inertia_kg_m2: float  # of everything, at the reference shaft
    speed_hz: float
    load_nm: float
    acceleration_torque_nm: float


@dataclass(frozen=True, slots=True)
class Wanted:
    """Where a profile comes from: the operating point, the section, and the file that holds them."""

    speed_hz: float | None
    load_nm: float
    section: ProfileModel
    where: str
    folder: Path
    seed: int


def build_profile(wanted: Wanted, drive: DriveLimits) -> Profile:
    """The profile.

    Raises
    ------
    InputError
        For what the drive cannot do, a trace that cannot be followed, or torques that do not bring the
        machine to the speed that is asked for.
    """
    section = wanted.section
    if section.torques is not None:
        profile = _of_torques(wanted, section.torques, drive)
    else:
        speed, load = _prescribed(wanted, drive)
        if section.load_law is not None:
            load = LawLoad(speed, _shape(section.load_law, _rated_speed(wanted, speed)), load)
        profile = Profile(speed, load, drive.step_s, drive.ratio, drive.inertia_kg_m2)
    if section.load_noise is None:
        return profile
    noise = _noise(section.load_noise, wanted, drive)
    return Profile(profile.speed_hz, profile.load_nm, drive.step_s, drive.ratio, drive.inertia_kg_m2, noise)


def _prescribed(wanted: Wanted, drive: DriveLimits) -> tuple[Curve, Curve]:
    """Speed and load without a law: constant, or from a trace."""
    if wanted.load_nm > drive.load_nm:
        _refuse(wanted, "operating_point.load", wanted.load_nm, f"0 to {drive.load_nm:g} N m")
    if wanted.section.trace is not None:
        if wanted.speed_hz is not None:
            _refuse(wanted, "operating_point.speed", wanted.speed_hz, "no speed beside profile.trace")
        return _of_trace(wanted, wanted.section.trace, drive)
    if wanted.speed_hz is None:
        _refuse(wanted, "operating_point.speed", "nothing", "a speed, or a profile.trace")
    assert wanted.speed_hz is not None
    if not 0 <= wanted.speed_hz <= drive.speed_hz:
        _refuse(wanted, "operating_point.speed", wanted.speed_hz, f"0 to {drive.speed_hz:g} Hz")
    return Constant(wanted.speed_hz), Constant(wanted.load_nm)


def _of_trace(wanted: Wanted, given: TraceModel, drive: DriveLimits) -> tuple[Curve, Curve]:
    trace, loads = read_trace(given, wanted.folder, wanted.where)
    speed = trace_curve(trace, drive.step_s, given.tolerance, given.speed)
    _check_trace(trace.where, given.speed, speed, drive)
    if given.load is None or loads is None:
        return speed, Constant(wanted.load_nm)
    load = trace_curve(loads, drive.step_s, given.load_tolerance, given.load)
    greatest = max((one.extremes()[1] for one in load.stretches), default=load.final_value())
    if greatest > drive.load_nm:
        raise InputError(trace.where, given.load, f"up to {greatest:.4g} N m", f"0 to {drive.load_nm:g} N m")
    return speed, load


def read_trace(given: TraceModel, folder: Path, where: str) -> tuple[Trace, Trace | None]:
    """Speed [Hz] and, if there is one, load [N m] of a measured trace.

    Parameters
    ----------
    given : TraceModel
    folder : Path
        Where the path of its file starts.
    where : str
        The scenario, for mistakes in columns that it holds itself.

    Raises
    ------
    InputError
        If the file or the columns cannot be read or followed.
    """
    names = (given.time, given.speed) if given.load is None else (given.time, given.speed, given.load)
    if given.columns is not None:
        place = f"{where}: profile.trace.columns"
        columns = chosen_columns(place, given.columns, names)
    else:
        path = folder / (given.file or "")
        place = str(path)
        columns = read_columns(path, names)
    unit = _RPM if given.speed_unit == "rpm" else 1.0
    speed = Trace(place, columns[given.time], columns[given.speed] * unit)
    speed.checked(given.speed, given.max_gap)
    if given.load is None:
        return speed, None
    load = Trace(place, columns[given.time], columns[given.load])
    return speed, load.checked(given.load, given.max_gap)


def _check_trace(where: str, field: str, speed: Laid, drive: DriveLimits) -> None:
    """Speed and acceleration within what the drive can do."""
    greatest = max((one.extremes()[1] for one in speed.stretches), default=speed.final_value())
    if greatest > drive.speed_hz:
        raise InputError(where, field, f"up to {greatest:.4g} Hz", f"0 to {drive.speed_hz:g} Hz")
    possible = drive.acceleration_torque_nm / (2 * math.pi * drive.inertia_kg_m2)
    for one in speed.stretches:
        slope = tuple(k * c for k, c in enumerate(one.coefficients))[1:] or (0.0,)
        low, high = Stretch(0.0, 1.0, slope).extremes()
        found = max(abs(low), abs(high)) / (one.length * drive.step_s)
        if found > possible:
            at = f"{one.start * drive.step_s:.4g} to {one.end * drive.step_s:.4g} s"
            expected = f"at most {possible:.3g} Hz/s, which the drive's torque can give; noise in a trace is"
            expected += " smoothed by a tolerance"
            raise InputError(where, field, f"{found:.3g} Hz/s at {at}", expected)


def _shape(law: LoadLawModel | None, rated_speed_hz: float) -> LoadShape:
    if law is None:
        return LoadShape(1.0, 0.0, 0.0, rated_speed_hz)
    return LoadShape(law.constant, law.linear, law.quadratic, rated_speed_hz)


def _rated_speed(wanted: Wanted, speed: Curve) -> float:
    """The speed at which the load is the operating point's."""
    rated = wanted.speed_hz if wanted.speed_hz else _greatest(speed)
    if rated <= 0:
        _refuse(wanted, "profile.load_law", "a rated speed of 0 Hz", "an operating point that turns")
    return rated


def _greatest(speed: Curve) -> float:
    stretches: Iterable[Stretch] = speed.stretches if isinstance(speed, Laid) else ()
    return max((one.extremes()[1] for one in stretches), default=speed.final_value())


def _of_torques(wanted: Wanted, given: TorquesModel, drive: DriveLimits) -> Profile:
    asked = wanted.speed_hz
    if asked is None or not 0 < asked <= drive.speed_hz:
        _refuse(wanted, "operating_point.speed", asked, f"the speed to reach, up to {drive.speed_hz:g} Hz")
    assert asked is not None
    if not given.start_speed <= drive.speed_hz:
        _refuse(wanted, "profile.torques.start_speed", given.start_speed, f"0 to {drive.speed_hz:g} Hz")
    if wanted.load_nm > drive.load_nm:
        _refuse(wanted, "operating_point.load", wanted.load_nm, f"0 to {drive.load_nm:g} N m")
    steps = given.takeover / drive.step_s
    takeover = Laid([ramp_stretch(0.0, steps, 0.0, 1.0)], 0.0, 1.0)
    rated = Constant(wanted.load_nm)
    shape = _shape(wanted.section.load_law, asked)
    motor, inner = _motor(given, asked, wanted.load_nm * drive.ratio * shape(given.start_speed), drive)
    rotor = Rotor(motor, shape, rated, takeover, drive.inertia_kg_m2, drive.ratio, drive.step_s)
    _check_reach(wanted, rotor, given, asked, drive)
    speed = TorqueSpeed(rotor, 0, given.start_speed, inner, max(asked, given.start_speed))
    _check_solved(wanted, speed, drive)
    load = LawLoad(speed, shape, rated)
    return Profile(speed, load, drive.step_s, drive.ratio, drive.inertia_kg_m2)


def _motor(given: TorquesModel, asked: float, balance_nm: float, drive: DriveLimits) -> tuple[Motor, float]:
    """The motor, and its inner state at the start: it carries the load where the machine turns already."""
    motor = given.motor
    if motor.constant is not None:
        return ConstantMotor(motor.constant), 0.0
    if motor.curve is not None:
        speeds = np.array([point.speed for point in motor.curve])
        return CurveMotor(speeds, np.array([point.torque for point in motor.curve])), 0.0
    controller = motor.controller
    assert controller is not None
    steps = controller.ramp / drive.step_s
    target = Laid([ramp_stretch(0.0, steps, given.start_speed, asked)], given.start_speed, asked)
    found = ControlledMotor(target, controller.gain, controller.integral_time, controller.limit, drive.step_s)
    return found, found.inner_for(balance_nm) if given.start_speed > 0 else 0.0


def _check_reach(wanted: Wanted, rotor: Rotor, given: TorquesModel, asked: float, drive: DriveLimits) -> None:
    """The motor must reach the speed that is asked for, and must not run away."""
    start = given.start_speed
    field = "profile.torques.motor"
    end = settles_at(rotor, start, wanted.load_nm, drive.speed_hz)
    crawl = 5 * CREEP * asked
    if end < crawl:
        needs = drive.ratio * wanted.load_nm * rotor.shape(crawl)
        found = f"{rotor.motor.strongest_nm(0.0):.4g} N m at rest"
        _refuse(wanted, field, found, f"more than the load there, {needs:.4g} N m: it does not start")
    if end < _REACHED * asked:
        expected = f"one that reaches the operating point's {asked:g} Hz under {wanted.load_nm:g} N m"
        _refuse(wanted, field, f"a motor that settles at {end:.4g} Hz", expected)
    if math.isinf(end) and not isinstance(rotor.motor, ControlledMotor):
        expected = f"one that comes to rest below the drive's {drive.speed_hz:g} Hz"
        _refuse(wanted, field, "a motor that runs away", expected)


def _check_solved(wanted: Wanted, speed: TorqueSpeed, drive: DriveLimits) -> None:
    steps = round(_CHECKED_S / drive.step_s)
    for one in stretches_between(speed, 0, steps):
        low, high = one.extremes()
        if high > drive.speed_hz or low < -1e-9 * drive.speed_hz:
            found = f"{high if high > drive.speed_hz else low:.4g} Hz at {one.start * drive.step_s:.3g} s"
            _refuse(wanted, "profile.torques", found, f"a speed from 0 to {drive.speed_hz:g} Hz")


def _noise(given: LoadNoiseModel, wanted: Wanted, drive: DriveLimits) -> RandomLoad:
    field = "profile.load_noise"
    if given.low >= given.high or (given.low > 0 and given.high > WIDEST_BAND * given.low):
        found = f"{given.low:g} to {given.high:g} Hz"
        _refuse(wanted, field, found, f"low below high, and high at most {WIDEST_BAND:g} times low")
    highest = 1 / (64 * drive.step_s)
    if given.high > highest:
        _refuse(wanted, f"{field}.high", given.high, f"at most {highest:g} Hz at this step of integration")
    if 3 * given.rms + wanted.load_nm > drive.load_nm:
        expected = f"at most {max(0.0, drive.load_nm - wanted.load_nm) / 3:.4g} N m: load and three times it"
        _refuse(wanted, f"{field}.rms", given.rms, f"{expected} within {drive.load_nm:g} N m")
    return RandomLoad(given.rms, given.low, given.high, drive.step_s, wanted.seed, "load_noise")


def _refuse(wanted: Wanted, field: str, found: object, expected: str) -> None:
    raise InputError(wanted.where, field, found, expected)
