"""Slip of the cage: BPFO, BPFI and FTF off their kinematic values, and not quite periodic (thesis 8.2.1)."""

from __future__ import annotations

import math
from typing import Annotated

from gearsim_io.errors import InputError
from gearsim_sim.model.bearing_faults import BearingTerm, Term
from gearsim_sim.model.cage_slip import jitter_key
from gearsim_sim.model.faults.bearing_parts import find_seat
from gearsim_sim.model.faults.kind import FaultKind, bearing_names
from gearsim_sim.model.plant import Plant
from gearsim_sim.params.fields import SiKeyed, Strict

_NEVER_HALVED_N = 1e12


class CageSlipParams(Strict):
    """See `gearsim_sim.model.cage_slip`."""

    slip: Annotated[float, SiKeyed("", ge=0, le=0.5)] = 0.01
    """Share of its kinematic speed that the cage lags by without load."""
    halving_force_n: Annotated[float, SiKeyed("N", gt=0)] | None = None
    """Radial force that halves the slip; by default it does not depend on the load."""
    jitter_rad: Annotated[float, SiKeyed("rad", ge=0, le=0.5)] = 0.01
    """Greatest angle by which the cage runs ahead or behind at random."""
    pocket_play_rad: Annotated[float, SiKeyed("rad", ge=0, le=0.5)] = 0.005
    """Greatest angle, seen from the bearing's axis, of an element out of the middle of its pocket."""
    knot_turns: Annotated[float, SiKeyed("", gt=0, le=100)] = 0.3
    """Turns of the cage from one random angle to the next."""
    walk: Annotated[float, SiKeyed("", ge=0, le=1)] = 0.0
    """Share of the slip that wanders at random, so that the phase walks without limit."""


def place(params: CageSlipParams, component: str, plant: Plant, seed: int) -> tuple[BearingTerm, ...]:
    """Slip, jitter of the cage, and play of the elements, each if there is any."""
    index, seat = find_seat(plant, component)
    limit = 0.25 * seat.law.ball_spacing_rad
    if params.pocket_play_rad > limit:
        expected = f"at most {limit:.3g} rad, a quarter of the spacing"
        raise InputError(component, "pocket_play_rad", params.pocket_play_rad, expected)
    knots = 1 / params.knot_turns
    terms = []
    if params.slip > 0:
        halving = params.halving_force_n or _NEVER_HALVED_N
        key = jitter_key(seed, f"{component}/slip")
        terms.append(BearingTerm(index, Term.SLIP, (params.slip, halving, params.walk, knots, key)))
    for what, amplitude, name in (
        (Term.CAGE_JITTER, params.jitter_rad, "jitter"),
        (Term.POCKET_PLAY, params.pocket_play_rad, "play"),
    ):
        if amplitude > 0:
            turns = amplitude / (2 * math.pi)
            terms.append(BearingTerm(index, what, (turns, knots, jitter_key(seed, f"{component}/{name}"))))
    if not terms:
        raise InputError(component, "slip", 0.0, "some slip, jitter or play")
    return tuple(terms)


KIND = FaultKind(
    name="cage_slip",
    summary="cage slower than its kinematic speed, with bounded random jitter of cage and elements",
    params_model=CageSlipParams,
    components=bearing_names,
    place=place,
    look_for="with another bearing fault: its frequencies lie below the kinematic ones, and their higher "
    "harmonics are smeared",
)
