"""Causes in bearings: first guesses from simulated records with a hidden effect, and what they become."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from bearing_cases import COMPONENT, context_of, fault, hidden, record_of

from gearsim_io.machines import load_machine
from gearsim_sim.scenario import parse_scenario
from gearsim_sim.simulation import to_record
from gearsim_twin.causes.bearing_clearance import _GUESSES_M, BearingClearance
from gearsim_twin.causes.bearing_geometry import BearingGeometry, spin_of
from gearsim_twin.causes.bearing_model import fault_of, force_n, most_growth_m, seat_of
from gearsim_twin.causes.bearing_signs import signs_of
from gearsim_twin.causes.bearing_spall_ball import BearingSpallBall
from gearsim_twin.causes.bearing_spall_inner import BEARING_SPALL_INNER
from gearsim_twin.causes.bearing_spall_outer import BEARING_SPALL_OUTER
from gearsim_twin.causes.cage_motion import cage_motion
from gearsim_twin.causes.cage_slip import CageSlip, load_law
from gearsim_twin.causes.context import Context
from gearsim_twin.causes.looseness import Looseness
from gearsim_twin.causes.oil_film import OilFilm
from gearsim_twin.causes.wide_spall import WideSpall
from gearsim_twin.compare.discrepancy import compare
from gearsim_twin.compare.features import features, make_plan
from gearsim_twin.screen import _SMALLER

SPALLS = {
    "outer_race_spall": BEARING_SPALL_OUTER,
    "inner_race_spall": BEARING_SPALL_INNER,
    "rolling_element_spall": BearingSpallBall(),
}
GUESSING = (*SPALLS.values(), WideSpall(), CageSlip(), BearingGeometry())
SHORT_S = 0.2


def runs(content):
    """A content that loads and simulates; finite samples come out."""
    record = to_record(parse_scenario(content, Path("model.yaml")), SHORT_S)
    assert np.all(np.isfinite(record.data))
    assert np.ptp(record.data) > 0


@pytest.mark.parametrize("kind", SPALLS)
@pytest.mark.parametrize(
    ("rig", "seed", "width_m"),
    [("hit_sq", 2, 3e-4), ("hit_sq", 3, 8e-4), ("hit_sq", 4, 1.6e-3), ("mfpt", 5, 6e-4)],
)
def test_a_spall_is_guessed_by_its_own_cause_alone(rig, seed, kind, width_m):
    context = hidden(rig, kind, seed, width_m=width_m)
    starts = {cause.name: cause.starts(context) for cause in GUESSING}
    own = starts[SPALLS[kind].name]
    assert own
    assert own[0]["component"] == COMPONENT[rig]
    assert all(not starts[cause.name] for other, cause in SPALLS.items() if other != kind)
    assert not starts["cage_slip"]
    assert not starts["bearing_geometry"]
    # A width by events, or guesses a factor of 2.4 apart: within a factor of 1.6 of one of them.
    ratios = [abs(math.log(float(start["width_m"]) / width_m)) for start in own]
    assert min(ratios) < math.log(1.6)
    for start in own:
        extended = SPALLS[kind].extend(context.contents[0], start, context)
        assert fault_of(extended, kind, COMPONENT[rig]) is not None
        assert fault_of(context.contents[0], kind, COMPONENT[rig]) is None
    runs(extended)


@pytest.mark.parametrize(("kind", "width_m"), [("outer_race_spall", 8e-4), ("inner_race_spall", 1.6e-3)])
def test_the_bearing_of_four_alike_is_named(kind, width_m):
    context = hidden("lpm34", kind, 4, width_m=width_m)
    starts = SPALLS[kind].starts(context)
    assert starts[0]["component"] == "bearing_3"
    assert {start["component"] for start in starts} <= {"bearing_3", "bearing_4"}  # of the same shaft


@pytest.mark.parametrize(("rig", "seed"), [("lpm34", 1), ("hit_sq", 1), ("mfpt", 1), ("hit_sq", 2)])
def test_nothing_is_guessed_from_sound_bearings(rig, seed):
    context = context_of(rig, record_of(rig, seed=seed))
    assert [start for cause in GUESSING for start in cause.starts(context)] == []


@pytest.mark.parametrize("kind", ["outer_race_spall", "wide_spall"])
def test_what_the_model_has_already_is_not_guessed_again(kind):
    spall = fault("hit_sq", kind)
    context = context_of("hit_sq", record_of("hit_sq", spall, seed=5), changed={"faults": [spall]})
    assert [start for cause in GUESSING for start in cause.starts(context)] == []


@pytest.mark.parametrize("race", ["outer", "inner"])
def test_the_length_of_a_wide_spall_is_told_by_its_two_events(race):
    context = hidden("hit_sq", "wide_spall", 6, race=race, length_m=3e-3, depth_m=1e-5)
    start = WideSpall().starts(context)[0]
    assert start["race"] == race
    assert start["length_m"] == pytest.approx(3e-3, rel=0.12)  # the sizing's own tolerance in its tests
    extended = WideSpall().extend(context.contents[0], start, context)
    runs(extended)
    assert extended["faults"][-1]["params"]["race"] == race


@pytest.mark.parametrize(
    ("rig", "kind", "slip"),
    [
        ("hit_sq", "outer_race_spall", 0.003),
        ("hit_sq", "inner_race_spall", 0.003),
        ("hit_sq", "outer_race_spall", 0.02),
        ("lpm34", "inner_race_spall", 0.01),
        ("lpm34", "outer_race_spall", 0.02),
    ],
)
def test_slip_is_read_off_either_race(rig, kind, slip):
    spall = fault(rig, kind)
    record = record_of(rig, spall, fault(rig, "cage_slip", slip=slip), seed=7)
    context = context_of(rig, record, changed={"faults": [spall]})
    (start,) = CageSlip().starts(context)
    assert start["component"] == COMPONENT[rig]
    assert abs(float(start["slip"]) - slip) < 3.5 * float(start["std:slip"])
    assert float(start["std:slip"]) < 3e-4
    extended = CageSlip().extend(context.contents[0], start, context)
    params = fault_of(extended, "cage_slip", COMPONENT[rig])
    assert params["slip"] == start["slip"]
    assert "halving_force_n" not in params
    runs(extended)


def test_slip_and_dimensions_move_both_races_alike():
    """The deviation of c is the same whether it is read off the BPFO or the BPFI, and so is its cause."""
    plate = load_machine("hit_sq").bearing("test_bearing")
    gamma = plate.element_diameter_m / plate.pitch_diameter_m
    slip = 0.008
    other = 1 - (1 - gamma) * (1 - slip)  # the g that moves the cage as much as the slip
    spalls = [fault("hit_sq", kind) for kind in ("outer_race_spall", "inner_race_spall")]
    pitch = plate.element_diameter_m / other
    built = {"nameplate.bearings.test_bearing.pitch_diameter": f"{pitch} m"}
    views = [
        context_of("hit_sq", record_of("hit_sq", spall, *more, **changes)).views[0]
        for spall in spalls
        for more, changes in (([fault("hit_sq", "cage_slip", slip=slip)], {}), ([], {"parameters": built}))
    ]
    shares = [cage_motion(view, "test_bearing").share for view in views]
    assert shares == pytest.approx([(1 - gamma) * (1 - slip)] * 4, rel=4e-4)  # a twentieth of a line


def test_the_ratio_of_spin_to_cage_tells_slip_elements_and_angle_apart():
    """Against derivatives: 1 for slip, (1 + g^2) / (g (1 + g)) for elements, 2 g / (1 + g) for the angle."""
    size, angle = 0.2, math.radians(15)
    gamma = size * math.cos(angle)
    before = (1 - gamma**2) / (2 * size)
    change = 1e-6
    cage = -gamma * change / (1 - gamma)
    for way, ratio in (
        ("element_diameter", (1 + gamma**2) / (gamma * (1 + gamma))),
        ("contact_angle", 2 * gamma / (1 + gamma)),
    ):
        spin = spin_of(size, gamma, change, way) / before - 1
        assert spin / cage == pytest.approx(ratio, rel=1e-4)


@pytest.mark.parametrize(("factor", "seed"), [(1.04, 1), (0.96, 2)])
def test_other_elements_are_read_off_the_races(factor, seed):
    name = "nameplate.bearings.test_bearing.element_diameter"
    record = record_of(
        "hit_sq", fault("hit_sq", "inner_race_spall"), seed=seed, parameters={name: f"{7.94 * factor} mm"}
    )
    context = context_of("hit_sq", record)
    start = next(s for s in BearingGeometry().starts(context) if s["by"] == "element_diameter")
    std = float(start["std:diameter_ratio_change"])
    assert abs(float(start["diameter_ratio_change"]) - (factor - 1)) < 3.5 * std
    assert std < 4e-3
    extended = BearingGeometry().extend(context.contents[0], start, context)
    assert seat_of(extended, "test_bearing").law.ball_radius_m == pytest.approx(3.97e-3 * factor, rel=4e-3)
    assert len(CageSlip().starts(context)) == (factor > 1)  # slip makes the cage slower, never faster
    runs(extended)


def test_a_contact_angle_is_told_by_the_spin_of_an_element():
    name = "nameplate.bearings.test_bearing.contact_angle"
    faults = [fault("hit_sq", kind) for kind in ("outer_race_spall", "rolling_element_spall")]
    context = context_of("hit_sq", record_of("hit_sq", *faults, seed=3, parameters={name: "12 deg"}))
    start = BearingGeometry().starts(context)[0]
    assert start["by"] == "contact_angle"
    extended = BearingGeometry().extend(context.contents[0], start, context)
    assert seat_of(extended, "test_bearing").law.contact_angle_rad == pytest.approx(
        math.radians(12), rel=0.03
    )
    runs(extended)


def test_another_number_of_elements_is_seen():
    name = "nameplate.bearings.test_bearing.rolling_elements"
    context = context_of(
        "hit_sq", record_of("hit_sq", fault("hit_sq", "outer_race_spall"), parameters={name: 8})
    )
    (start,) = BearingGeometry().starts(context)
    assert start["rolling_elements"] == 8
    extended = BearingGeometry().extend(context.contents[0], start, context)
    assert seat_of(extended, "test_bearing").law.balls_per_row == 8
    runs(extended)


def test_the_force_on_a_bearing_goes_with_the_load():
    """A spur gear's force on its bearings is the torque over the base radius, beside some weight."""
    forces = [
        force_n(
            {"machine": "unsw_parallel", "model": "lpm34", "operating_point": {"load": load}}, "bearing_3"
        )
        for load in ("25 N*m", "50 N*m", "100 N*m")
    ]
    assert np.diff(np.log2(forces)) == pytest.approx([1.0, 1.0], abs=0.05)


def test_slip_that_falls_with_the_load_is_told_by_two_loads():
    """As the simulator has it: s_0 / (1 + F / F_1) = 1.2 % and 0.6 % of the cage's speed at 300 and 900 N."""
    halving, unloaded = 300.0, 0.024
    loads = ("300 N", "900 N")
    slip = fault("mfpt", "cage_slip", slip=unloaded, halving_force_n=halving)
    spall = fault("mfpt", "outer_race_spall")
    records = [
        record_of("mfpt", spall, slip, seed=k, load=load, parameters={"radial_load": load})
        for k, load in enumerate(loads)
    ]
    context = context_of("mfpt", *records)
    contents = tuple({**content, "faults": [spall]} for content in context.contents)
    start = CageSlip().starts(
        type(context)(context.case, context.views, (), (), (), contents, context.views)
    )[0]
    assert float(start["halving_force_n"]) == pytest.approx(halving, rel=0.25)
    for content in contents:
        params = fault_of(CageSlip().extend(content, start, context), "cage_slip", "test_bearing")
        force = force_n(content, "test_bearing")
        made = params["slip"] / (1 + force / params["halving_force_n"])
        assert made == pytest.approx(unloaded / (1 + force / halving), rel=0.05)


def test_the_law_of_the_load_is_not_made_of_noise():
    rng = np.random.default_rng(1)
    force, std = np.array([100.0, 400.0, 1200.0]), np.full(3, 5e-4)
    found = [load_law(force, 0.006 + std * rng.standard_normal(3), std, 400.0)[0] for _ in range(200)]
    # A gain of 2 in chi-squared by one more parameter, one-sided: by chance in 8 % of cases.
    assert np.mean(np.isfinite(found)) < 0.15


def test_both_races_together_tell_a_speed_from_a_cage():
    """A record over an angle that is 0.5 % off: the sum of BPFO and BPFI says so."""
    record = record_of("hit_sq", fault("hit_sq", "outer_race_spall"), fault("hit_sq", "inner_race_spall"))
    (view,) = context_of("hit_sq", record).views
    wrong = 0.005
    phase = type(view.phase)(view.phase.samples, view.phase.turns * (1 + wrong))
    value = view.speed.value_hz * (1 + wrong)
    loose = type(view.speed)(value, (0.98 * value, 1.02 * value), view.speed.source, phase)
    off = type(view)(view.record, view.machine, loose)
    motion = cage_motion(off, "test_bearing")
    assert motion.speed_error == pytest.approx(-wrong, abs=5e-4)
    gamma = 7.94 / 39.04
    assert motion.share == pytest.approx(1 - gamma, rel=1e-3)


def test_widths_beyond_the_bearing_are_held():
    context = hidden("hit_sq", "outer_race_spall", 2, width_m=8e-4)
    huge = {"component": "test_bearing", "width_m": 1e-2, "length_m": 0.1, "depth_m": 5e-4, "race": "inner"}
    for cause in (*SPALLS.values(), WideSpall()):
        runs(cause.extend(context.contents[0], huge, context))
    assert most_growth_m(context.contents[0], "test_bearing") > 2e-5


def test_signs_carry_the_share_of_each_bearing_alike():
    context = hidden("lpm34", "outer_race_spall", 4, width_m=8e-4)
    signs = [sign for sign in signs_of(context.views[0]) if sign.fault == "outer_race"]
    assert signs[0].component == "bearing_3"
    assert sum(sign.share for sign in signs) <= 1.0 + 1e-9


def compared(*hidden_faults, known=(), seed=8):
    """A record of the light rig with its features, beside one of the known faults alone."""
    measured = context_of("hit_sq", record_of("hit_sq", *known, *hidden_faults, seed=seed))
    plain = context_of("hit_sq", record_of("hit_sq", *known, seed=seed + 1)).views
    plan = make_plan(measured.case, [measured.views[0], plain[0]])
    one, other = features(measured.views[0], plan), features(plain[0], plan)
    contents = tuple({**content, "faults": list(known)} for content in measured.contents)
    return Context(measured.case, measured.views, (one,), (other,), (compare(one, other),), contents, plain)


@pytest.mark.parametrize("growth_m", [5e-6, 1.5e-5])
def test_a_grown_clearance_is_asked_for_where_something_differs(growth_m):
    context = compared(fault("hit_sq", "bearing_clearance", growth_m=growth_m))
    starts = BearingClearance().starts(context)
    assert {start["component"] for start in starts} == {"test_bearing"}
    assert min(abs(math.log(float(start["growth_m"]) / growth_m)) for start in starts) < 0.01
    extended = BearingClearance().extend(context.contents[0], starts[-1], context)
    assert fault_of(extended, "bearing_clearance", "test_bearing")["growth_m"] == starts[-1]["growth_m"]
    runs(extended)
    assert BearingClearance().starts(compared()) == []


def test_growths_from_tenths_of_a_micrometre_on_are_tried():
    # Lines of a light rig change to and fro within a factor of two of growth: none lies further from a trial.
    cause = BearingClearance()
    prior = cause.parameters[0].prior
    assert cause.size == cause.parameters[0].name
    tried = [prior.value(prior.coordinate(one) + step) for one in _GUESSES_M for step in (0.0, *_SMALLER)]
    for growth_m in np.geomspace(3e-7, 2e-5, 40):
        assert min(abs(math.log(one / growth_m)) for one in tried) < math.log(2.0)


def test_a_loose_foot_that_no_mesh_lifts_is_asked_for_where_something_differs(monkeypatch):
    monkeypatch.setattr("gearsim_twin.causes.looseness.matches", lambda *_, **__: [])
    monkeypatch.setattr("gearsim_twin.causes.looseness.by_distance", lambda _, names: list(names))
    context = hidden("hit_sq", "outer_race_spall", 2, width_m=8e-4)
    starts = Looseness().starts(context)
    assert {start["component"] for start in starts} == {"test_bearing"}
    runs(Looseness().extend(context.contents[0], starts[0], context))
    assert Looseness().starts(hidden("lpm34", "outer_race_spall", 4, width_m=8e-4)) == []


def test_a_film_is_asked_for_where_the_model_has_a_defect():
    spall = fault("hit_sq", "outer_race_spall")
    context = compared(fault("hit_sq", "oil_film", viscosity_pa_s=0.3), known=(spall,))
    starts = OilFilm().starts(context)
    assert [start["component"] for start in starts] == ["test_bearing"] * 2
    guesses = [float(start["viscosity_pa_s"]) for start in starts]
    assert min(guesses) < 0.3 < max(guesses)
    runs(OilFilm().extend(context.contents[0], starts[0], context))
    assert OilFilm().starts(compared()) == []


def test_every_cause_names_what_it_may_be_taken_for_and_says_what_it_shows():
    context = hidden("hit_sq", "outer_race_spall", 3, width_m=8e-4)
    for cause in (*GUESSING, BearingClearance(), OilFilm()):
        assert cause.applies(context)
        assert cause.confused_with
        assert all(decides for _, decides in cause.confused_with)
    start = BEARING_SPALL_OUTER.starts(context)[0]
    words = BEARING_SPALL_OUTER.signature(start)
    assert "71.7 Hz" in words
    assert "outer race of test_bearing" in words
