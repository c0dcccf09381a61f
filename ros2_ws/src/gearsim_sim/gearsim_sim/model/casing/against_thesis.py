"""The updating of the casing against the modal test of the thesis."""

from __future__ import annotations

from gearsim_sim.model.casing.measured import SHIFT, TABLE_3_1, pair_in_order
from gearsim_sim.model.casing.params import CasingParams
from gearsim_sim.model.casing.updating import (
    FreeModel,
    Match,
    Tell,
    Update,
    mirror_prior,
    single_prior,
    update_thickness,
)

BASIS = "thesis Table 3.1"
MODES = TABLE_3_1[-1][1] + SHIFT


def pair_with_thesis(model: FreeModel) -> Match:
    """Pairs by order, since the thesis prints no shapes."""
    pairs = pair_in_order(model.frequencies_hz)
    return Match(pairs.measured_hz, pairs.modes - 1)


def update_to_thesis(params: CasingParams, most_steps: int, *, mirrored: bool, tell: Tell) -> Update:
    """Update plate thickness by regions; see `update_thickness`.

    Parameters
    ----------
    params : CasingParams
    most_steps : int
    mirrored : bool
        Let mirror images change alike: fewer parameters, none of which rests on a chosen side.
    tell : callable
    """
    prior = mirror_prior if mirrored else single_prior
    return update_thickness(params, pair_with_thesis, MODES, prior, most_steps=most_steps, tell=tell)
