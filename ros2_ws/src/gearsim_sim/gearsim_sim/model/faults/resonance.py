"""An added resonance at a measuring site: a mass on a spring (`SideOscillator` on one place)."""

from __future__ import annotations

from typing import Annotated

from gearsim_sim.model.contributions import Contribution
from gearsim_sim.model.faults.kind import FaultKind
from gearsim_sim.model.faults.on_site import hangable_sites, site_directions
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.side_oscillator import SideOscillator
from gearsim_sim.params.fields import SiKeyed, Strict


class ResonanceParams(Strict):
    """The mass that swings, its frequency on a held base, and its damping."""

    mass_kg: Annotated[float, SiKeyed("kg", gt=0, le=1000)] = 0.5
    """Mass that swings."""
    frequency_hz: Annotated[float, SiKeyed("Hz", gt=0, le=20000)] = 3000.0
    """Its natural frequency on a held base."""
    damping_ratio: Annotated[float, SiKeyed("", ge=0, lt=1)] = 0.02
    """Its damping over the critical one."""


def place(params: ResonanceParams, component: str, plant: Plant, seed: int) -> tuple[Contribution, ...]:  # noqa: ARG001
    """The oscillator."""
    return tuple(
        SideOscillator((direction,), params.mass_kg, params.frequency_hz, params.damping_ratio)
        for direction in site_directions(plant, component)
    )


KIND = FaultKind(
    name="resonance",
    summary="a part of the structure that swings at a measuring site",
    params_model=ResonanceParams,
    components=hangable_sites,
    place=place,
    look_for="a hump in the spectrum at the added frequency wherever broad-band excitation reaches "
    "it; lines and impulses near it ring longer",
)
