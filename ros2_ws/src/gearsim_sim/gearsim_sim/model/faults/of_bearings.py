"""The kinds of faults that sit in a rolling bearing."""

from __future__ import annotations

from gearsim_sim.model.faults import (
    ball_waviness,
    bearing_clearance,
    bearing_preload,
    cage_slip,
    extended_roughness,
    inner_race_spall,
    off_size_ball,
    oil_film,
    outer_race_spall,
    race_waviness,
    rolling_element_spall,
    wide_spall,
)

KINDS = (
    outer_race_spall.KIND,
    inner_race_spall.KIND,
    rolling_element_spall.KIND,
    wide_spall.KIND,
    extended_roughness.KIND,
    race_waviness.KIND,
    ball_waviness.KIND,
    off_size_ball.KIND,
    bearing_clearance.KIND,
    bearing_preload.KIND,
    cage_slip.KIND,
    oil_film.KIND,
)
