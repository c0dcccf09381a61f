"""What of a machine may be a little different from its description, by kind of model."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["KNOBS", "Knob"]


@dataclass(frozen=True, slots=True)
class Knob:
    """Numbers of the machine's model that are scaled by one factor.

    Attributes
    ----------
    name : str
        For people.
    parameters : tuple of str
        Dotted names in the `model` section; those that a machine lacks are left out.
    factor : float
        Within which the numbers are known (one standard deviation) where their source is a table or a
        drawing; for what is assumed or was fitted see `ASSUMED_POWER`.
    needs : str
        A number of the model that must not be 0, as one with which a part is switched on; "" for none.
    """

    name: str
    parameters: tuple[str, ...]
    factor: float
    needs: str = ""


ASSUMED_POWER = 2.0
"""What is assumed is known within the factor to this power."""

_PEDESTAL = (
    Knob("pedestal mass", ("pedestal.mass",), 1.08),
    Knob("pedestal stiffness", ("pedestal.stiffness",), 1.08),
    Knob("pedestal damping", ("pedestal.damping",), 1.2),
    Knob("housing resonance", ("pedestal.resonator_frequency",), 1.04),
    Knob("damping of the housing resonance", ("pedestal.resonator_damping_ratio",), 1.2),
)
_ERRORS = tuple(f"gear_errors.{name}" for name in ("runout", "profile", "pitch_rms", "surface_rms"))
_SEATS = tuple(f"seats.bearing_{k}.damping" for k in (1, 2, 3, 4))

_GEARBOX = (
    Knob("mesh stiffness", ("mesh.mean_stiffness",), 1.1),
    Knob("transmission error", _ERRORS, 1.15),
    Knob("bearing stiffness", ("ball_bearing.youngs_modulus",), 1.1),
    Knob("damping of bearings and mesh", (*_SEATS, "mesh.damping"), 1.25),
)
_PLANETARY = (
    Knob("mesh stiffness", ("mesh.mean_stiffness",), 1.1),
    Knob("transmission error", _ERRORS, 1.15),
    Knob("planet seats", ("planet_seat.stiffness",), 1.15),
    Knob("support of the ring", ("ring_support.stiffness",), 1.15),
    Knob("support of the sun", ("sun_support.stiffness",), 1.15),
    Knob("torsional support of the ring", ("ring_support.torsional_stiffness",), 1.15),
    Knob("damping of supports", ("ring_support.damping", "sun_support.damping"), 1.25),
    Knob("damping of meshes and planets", ("mesh.damping", "planet_seat.damping"), 1.25),
    Knob("casing", ("casing.mass",), 1.15, needs="casing.included"),
)
_RIG = (
    Knob("bearing stiffness", ("bearing.youngs_modulus",), 1.1),
    Knob("radial load", ("radial_load",), 1.08),
    Knob("shaft mass", ("shaft.mass",), 1.08),
    Knob("damping of the bearing", ("shaft.damping",), 1.25),
)

KNOBS: dict[str, tuple[Knob, ...]] = {
    "lpm22": _GEARBOX,
    "lpm34": (*_GEARBOX, *_PEDESTAL),
    "cb146": _GEARBOX,
    "cb182": _GEARBOX,
    "planetary18": _PLANETARY,
    "planetary_cb": _PLANETARY[:-1],
    "bearing2": _RIG,
    "bearing4": (*_RIG, *_PEDESTAL[:3]),
    "bearing5": (*_RIG, *_PEDESTAL),
}
"""By name of the model."""
