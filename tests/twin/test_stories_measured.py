"""The stories of docs/stories.md on measured records: what is wrong, why, and what another record says of it.

Bounds are those of what a record can tell (intervals of speeds, steps of spectra, arcs that data sets state),
not of what came out.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.stories import (
    STORIES,
    cwru_filter,
    cwru_race,
    gear0,
    hit_converter,
    hit_wide_spall,
    mfpt_slip,
    turbine,
)
from gearsim_twin.case import load_case
from gearsim_twin.causes import CAUSES
from gearsim_twin.stated import score_stated

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def records(record_file):
    """All measured records, each read once; a story skips where one of its own is missing."""
    every = Measured()

    def of(*names):
        for name in names:
            record_file(name)
        return every

    return of


@pytest.fixture(scope="module")
def mfpt(records):
    return mfpt_slip.tell(
        records(*(f"mfpt/{race}_{k}.mat" for race in mfpt_slip.RACES.values() for k in (1, 3, 5)))
    )


@pytest.mark.records
def test_mfpt_turns_slower_than_its_nameplate(mfpt):
    for each in (*mfpt["outer"], *mfpt["inner"]):
        assert each.stated_hz == 25.0
        assert each.ci95_hz[1] < 25.0, each.name
        assert each.speed_hz == pytest.approx(24.8, abs=0.1)


@pytest.mark.records
@pytest.mark.parametrize("race", ["outer", "inner"])
def test_mfpt_slip_of_two_loads_predicts_the_third(mfpt, race):
    *learnt, last = mfpt[race]
    told = mfpt_slip.predicted(learnt, last.force_n)
    half = 1.96 * math.hypot(told.std, last.std)
    assert abs(last.slip - told.slip) < half
    # Pure rolling is what the model has: the prediction is nearer.
    assert abs(last.slip - told.slip) < abs(last.slip)


@pytest.mark.records
def test_mfpt_loads_do_not_tell_a_law_as_the_speeds_are_known(mfpt):
    """Slip falls from load to load on both races, by less than what the speeds are not known by."""
    for rows in mfpt.values():
        assert rows[0].slip > rows[1].slip > rows[2].slip > 0
        assert math.isinf(mfpt_slip.predicted(rows[:2], rows[2].force_n).halving_force_n)
        assert rows[0].slip - rows[2].slip < 1.96 * math.hypot(rows[0].std, rows[2].std)


@pytest.mark.records
def test_mfpt_inner_race_5_is_read_at_its_own_speed(mfpt):
    """Once 0.8 % low: its angle is not known, and the orders were those of the nameplate's 25 Hz."""
    last = mfpt["inner"][-1]
    assert abs(last.slip) < 0.003


@pytest.fixture(scope="module")
def wide(records):
    return hit_wide_spall.tell(records(hit_wide_spall.LEARNT, hit_wide_spall.SHORTER))


@pytest.mark.records
def test_hit_wide_spall_is_as_long_as_stated(wide):
    assert wide.learnt.kind == "wide"
    # Edges of an eroded arc are some tenths of a millimetre wide.
    assert wide.learnt.length_m == pytest.approx(wide.arc_m[0], rel=0.15)


@pytest.mark.records
def test_hit_time_of_a_crossing_goes_as_one_over_the_speed(wide):
    """Learnt at 600 rpm; held out is the shorter spall at 1200 rpm, a quarter of the arc."""
    low, high = wide.shorter.ci95_m
    assert low < 0.25 * wide.learnt.length_m < high
    # An echo would have kept its time, and stood for twice the way at twice the speed.
    assert not low < 0.25 * wide.learnt.length_m * wide.shorter.speed_hz / wide.learnt.speed_hz < high
    assert wide.learnt.apart_s == pytest.approx(wide.learnt.crossing_s, rel=0.2)


@pytest.mark.records
def test_hit_extended_model_keeps_the_way_at_other_speeds(wide):
    low, high = wide.learnt.ci95_m
    times = [each.crossing_s * each.speed_hz for each in wide.extended]
    for each, way in zip(wide.extended, times, strict=True):
        assert low < each.length_m < high, each.speed_hz
        assert way == pytest.approx(times[0], rel=0.1)


@pytest.mark.records
def test_hit_converter_lines_stay_where_they_are(records):
    slow, fast = hit_converter.tell(records(*hit_converter.NAMES))
    assert fast.speed_hz / slow.speed_hz == pytest.approx(2.0, rel=0.02)
    assert abs(slow.carrier_hz - fast.carrier_hz) < 0.02  # a tenth of a line of 5.12 s
    assert slow.carrier_hz == pytest.approx(12000.0, rel=5e-4)
    assert slow.order / fast.order > 1.9


@pytest.mark.records
def test_cwru_one_race_tells_what_it_is_not_and_what_would_decide(records):
    told = cwru_race.tell(records(cwru_race.RECORD))
    assert told.off == pytest.approx(0.0033, abs=3e-4)
    left = {each.name: each for each in told.explanations if not each.why_not}
    assert set(left) == {"elements", "contact angle"}
    assert {each.name for each in told.explanations} - set(left) == {"slip", "speed"}
    # Both put the BPFI at the same place, and the BSF at two that a record with a ball fault would part.
    one, other = left["elements"], left["contact angle"]
    assert one.bpfi_order == pytest.approx(other.bpfi_order, rel=1e-9)
    assert abs(one.bsf_order / other.bsf_order - 1) > 0.01
    assert not told.spun
    # Gain on the last third: the nameplate is 0.33 % off there.
    assert abs(told.held_out / told.learnt - 1) < 0.1 * abs(told.held_out / told.nameplate - 1)


@pytest.mark.records
def test_cwru_filter_ends_the_band_and_fools_the_kurtogram(records):
    told = cwru_filter.tell(records(*cwru_filter.RECORDS))
    for each in told.values():
        assert 19e3 < each.corner_hz < 22.5e3
        assert each.filtered_db < 0.7 * each.flat_db
    faulty = told["cwru/135_0.mat"]
    assert faulty.maximum.low_hz >= 14e3
    assert faulty.share < 1e-5
    assert faulty.chosen.high_hz < 12e3
    assert faulty.maximum.kurtosis > faulty.chosen.kurtosis


@pytest.mark.records
def test_turbine_has_112_teeth_and_a_falling_speed(records):
    told = turbine.tell(records(turbine.RECORD))
    assert told.speed_hz[0] / told.speed_hz[-1] == pytest.approx(1.047, abs=0.01)
    assert told.best == 112
    others = [db for teeth, db in zip(told.wheels, told.held_out_db, strict=True) if teeth != 112]
    assert told.height(112)[1] > max(others) + 10.0
    assert told.height(121)[1] < 5.0
    assert told.mesh_db > 1.0  # the speed falls by a quarter of a percent only in the last third


@pytest.mark.records
def test_gear0_explained_and_unexplained_parts_are_the_same_on_the_last_third(records):
    told = gear0.tell(records(gear0.RECORD))
    assert told.speed_hz == pytest.approx(33.33, abs=0.01)
    for each in (told.learnt, told.held_out):
        assert 0.8 < each.mesh < each.pinion < 0.9
        assert 0.01 < each.mate < 0.03
        assert 0.08 < each.unexplained < 0.13
    # Three of the four strongest strange lines come again, within a line and a half of the last third.
    again = sum(min(abs(line - other) for other in told.strange_again) < 0.012 for line in told.strange)
    assert again >= 3
    assert all(abs(2 * line - round(2 * line)) > 0.04 for line in told.strange)


def spall(component, width_m):
    return CAUSES["bearing_spall_outer"], {"component": component, "width_m": width_m}


@pytest.mark.records
def test_a_spall_and_other_dimensions_mend_the_envelope_of_cwru(record_file):
    """On the last third; the model's resonances are not those of the motor, so that most of it stays."""
    case = load_case([record_file(cwru_race.RECORD)], "cwru_drive_end", "bearing5")
    geometry = {"diameter_ratio_change": -0.0131, "rolling_elements": 9.0, "by": "element_diameter"}
    built = (CAUSES["bearing_geometry"], {"component": "drive_end", "told": "element_diameter", **geometry})
    models = {"nominal": [], "extended": [spall("drive_end", 4e-4), built]}
    scores = score_stated(case, models, seconds=3.0).by_domain["envelope"].models
    assert scores["extended"].value < scores["nominal"].value - 1.5


@pytest.mark.records
def test_a_spall_learnt_under_two_loads_gains_under_the_third(record_file):
    files = [record_file(f"mfpt/OuterRaceFault_vload_{k}.mat") for k in (1, 3, 5)]
    case = load_case(files[:2], "mfpt", "bearing5", holdout=files[2:])
    scores = score_stated(case, {"nominal": [], "spall": [spall("test_bearing", 3e-4)]}, seconds=2.0)
    for domain, least_db in (("envelope", 0.3), ("cyclic", 0.5)):
        models = scores.by_domain[domain].models
        assert models["spall"].value < models["nominal"].value - least_db, domain


def test_every_story_has_its_section_and_its_picture():
    text = (DOCS / "stories.md").read_text(encoding="utf-8")
    shown = re.findall(r"!\[[^\]]+\]\(images/stories/(\w+)\.png\)", text)
    assert sorted(shown) == sorted(STORIES)
    for name in STORIES:
        assert (DOCS / "images" / "stories" / f"{name}.png").stat().st_size < 150_000
