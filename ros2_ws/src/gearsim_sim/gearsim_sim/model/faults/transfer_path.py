"""An added transfer path: a mass on springs between two measuring sites (`SideOscillator` on two places)."""

from __future__ import annotations

from typing import Annotated

from gearsim_sim.model.contributions import Contribution
from gearsim_sim.model.faults.kind import FaultKind
from gearsim_sim.model.faults.on_site import joinable_sites, paired, partners
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.side_oscillator import SideOscillator
from gearsim_sim.params.fields import SiKeyed, Strict


class TransferPathParams(Strict):
    """Below its frequency the path is a spring of m w^2 / 4.

    `to` is the site at the other end; without it the next one in the same direction.
    """

    to: str | None = None
    """Measuring site at the other end; without it the next one in the same direction."""
    mass_kg: Annotated[float, SiKeyed("kg", gt=0, le=1000)] = 0.5
    """Mass in the middle of the path."""
    frequency_hz: Annotated[float, SiKeyed("Hz", gt=0, le=20000)] = 1000.0
    """Its natural frequency with both ends held."""
    damping_ratio: Annotated[float, SiKeyed("", ge=0, lt=1)] = 0.05
    """Its damping over the critical one."""


def place(params: TransferPathParams, component: str, plant: Plant, seed: int) -> tuple[Contribution, ...]:  # noqa: ARG001
    """The path."""
    to = partners(plant, component)[0] if params.to is None else params.to
    return tuple(
        SideOscillator(ends, params.mass_kg, params.frequency_hz, params.damping_ratio)
        for ends in paired(plant, component, to)
    )


KIND = FaultKind(
    name="transfer_path",
    summary="vibration finds another way: a springy mass between two measuring sites",
    params_model=TransferPathParams,
    components=joinable_sites,
    place=place,
    look_for="the band of the path appears at the far site, coherent with the near one; lines there "
    "change their height, and none is added",
)
