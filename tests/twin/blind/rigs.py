"""The machines that cases are made of, and how they are measured."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Rig:
    """A machine, its model, and the records that are taken of it.

    Attributes
    ----------
    name, machine, model : str
    rate_hz : float
    steps : int
        Of integration per sample.
    seconds : float
        Of each record.
    speed_hz, load_nm : float
        Nominal.
    channels : tuple of str
    tacho : str
        Shaft.
    pulses : int
        Of the tacho per turn.
    noise : tuple of float
        Density of the sensors' noise by channel [m/s^2/sqrt(Hz)].
    spread : mapping of str to float
        Numbers of the model and the standard deviation of their logarithm.
    """

    name: str
    machine: str
    model: str
    rate_hz: float
    steps: int
    seconds: float
    speed_hz: float
    load_nm: float
    channels: tuple[str, ...]
    tacho: str
    pulses: int
    noise: tuple[float, ...]
    spread: dict[str, float]


_PEDESTAL = {
    "pedestal.mass": 0.03,
    "pedestal.stiffness": 0.03,
    "pedestal.damping": 0.08,
    "pedestal.resonator_frequency": 0.015,
    "pedestal.resonator_damping_ratio": 0.08,
}
RIGS = {
    one.name: one
    for one in (
        Rig(
            "parallel", "unsw_parallel", "lpm34", 16384.0, 8, 2.5, 10.0, 50.0,
            ("b1_y", "b3_y", "b3_x"), "input", 8, (2e-3, 2e-3, 5e-4),
            {
                "mesh.mean_stiffness": 0.03,
                "mesh.damping": 0.08,
                "gear_errors.runout": 0.05,
                "gear_errors.profile": 0.05,
                "ball_bearing.youngs_modulus": 0.03,
                "ball_bearing.radial_clearance": 0.05,
                "seats.bearing_1.damping": 0.08,
                "seats.bearing_3.damping": 0.08,
                "pinion.mass": 0.02,
                **_PEDESTAL,
            },
        ),
        Rig(
            "bearing", "mfpt", "bearing5", 32768.0, 4, 1.6, 25.0, 0.0,
            ("accel",), "shaft", 8, (2e-4,),
            {
                "bearing.youngs_modulus": 0.03,
                "bearing.radial_clearance": 0.05,
                "shaft.mass": 0.03,
                "shaft.damping": 0.08,
                "radial_load": 0.02,
                **_PEDESTAL,
            },
        ),
        Rig(
            "planetary", "unsw_planetary", "planetary18", 16384.0, 8, 3.2, 32 / 15, 46.875,
            ("ring", "carrier", "sun"), "carrier", 60, (2e-3, 5e-3, 3e-3),
            {
                "mesh.mean_stiffness": 0.03,
                "mesh.damping": 0.08,
                "gear_errors.runout": 0.05,
                "gear_errors.profile": 0.05,
                "planet_seat.stiffness": 0.03,
                "ring_support.stiffness": 0.03,
                "sun_support.stiffness": 0.03,
                "planet.mass": 0.02,
            },
        ),
    )
}  # fmt: skip
