"""Spalls of races: geometry, the ball's way through them, severity, refusals."""

import json

import numpy as np
import pytest

from gearsim_io.errors import InputError
from gearsim_sim.engine import Engine
from gearsim_sim.events import FaultSpec
from gearsim_sim.model.faults import REGISTRY, fault_kind
from gearsim_sim.model.plants import make_plant
from gearsim_sim.model.spall import Spall, reachable_depth
from gearsim_sim.params import load_parallel_params
from gearsim_sim.params.parallel import BEARINGS

BALL, OUTER, INNER = 3.56e-3, 22.81e-3, 15.69e-3
RATE_HZ = 65536.0
RACE_SPALLS = ("inner_race_spall", "outer_race_spall")


@pytest.fixture(scope="module")
def params():
    return load_parallel_params()


@pytest.fixture(scope="module")
def plant(params):
    return make_plant(params, 1)


def build(plant, kind, **given):
    """The spall of that kind at bearing_3."""
    (spall,) = REGISTRY[kind].build(FaultSpec(kind, "bearing_3", given), plant).contributions
    assert isinstance(spall, Spall)
    return spall


def test_reachable_depth_of_the_thesis():
    """19.1 um on the outer and 27.6 um on the inner race for 0.8 mm (thesis 5.3.2 and 5.3.3)."""
    outer = reachable_depth(0.8e-3, race_radius_m=OUTER, ball_radius_m=BALL, on_inner_race=False)
    inner = reachable_depth(0.8e-3, race_radius_m=INNER, ball_radius_m=BALL, on_inner_race=True)
    assert outer == pytest.approx(19.1e-6, abs=0.1e-6)
    assert inner == pytest.approx(27.6e-6, abs=0.1e-6)


@pytest.mark.parametrize(
    ("kind", "radius", "sign"), [("outer_race_spall", OUTER, 1), ("inner_race_spall", INNER, -1)]
)
def test_path_of_the_ball_keeps_its_radius_from_the_edges(plant, kind, radius, sign):
    """The centre of the ball, drawn in the plane, is one ball radius away from the nearer edge."""
    spall = build(plant, kind, width_m=1.5e-3)
    edges = [radius * np.exp(1j * s * spall.half_width_rad) for s in (-1, 1)]
    for offset in np.linspace(-1, 1, 41) * spall.half_width_rad:
        path = radius - sign * BALL + sign * spall.drop(offset)
        distance = min(abs(path * np.exp(1j * offset) - edge) for edge in edges)
        assert distance == pytest.approx(BALL, rel=1e-12)


def test_drop_is_smooth_but_for_the_change_of_edges(plant):
    """No step anywhere, tangent to the race at entry, a sharp turn half-way."""
    spall = build(plant, "outer_race_spall")
    offsets = np.linspace(-1.2, 1.2, 24001) * spall.half_width_rad
    drop = np.array([spall.drop(offset) for offset in offsets])
    slope = np.diff(drop) / np.diff(offsets)
    jumps = np.abs(np.diff(slope))
    middle = np.argmax(jumps)
    assert abs(offsets[middle + 1]) < 1e-3 * spall.half_width_rad
    assert drop.max() == pytest.approx(19.04e-6, abs=0.01e-6)
    others = np.delete(jumps, [middle - 1, middle, middle + 1])
    assert others.max() < 0.001 * jumps[middle]


def test_shallow_spall_carries_the_ball_on_its_floor(plant):
    spall = build(plant, "outer_race_spall", width_m="3 mm", depth_m="10 um")
    assert spall.drop(0.0) == spall.drop(0.3 * spall.half_width_rad) == pytest.approx(10e-6)
    assert 0 < spall.drop(0.99 * spall.half_width_rad) < 10e-6


def test_default_outer_spall_is_in_the_load_zone(plant):
    for i, name in enumerate(BEARINGS):
        fault = REGISTRY["outer_race_spall"].build(FaultSpec("outer_race_spall", name), plant)
        assert fault.contributions[0].bearing == i
        assert fault.contributions[0].position_rad == plant.bearings[i].law.load_direction_rad


def ball_forces(engine, output, spall, bearing):
    """Contact force of each ball of the spalled row at each sample, from the ring's displacement."""
    turns = 0.5 + 10.0 * np.arange(output.sample_count) / engine.sample_rate_hz
    x, y = (output.probes[f"b3_{axis}.displacement_m"] for axis in "xy")
    result = []
    for azimuth in bearing.azimuths_rad[: bearing.balls_per_row]:
        angle = azimuth + 2 * np.pi * bearing.cage_ratio * turns
        middle = spall.position_rad + (2 * np.pi * turns if spall.on_inner_race else 0)
        away = np.angle(np.exp(1j * (angle - middle)))
        drop = np.array([spall.drop(a) if abs(a) < spall.half_width_rad else 0.0 for a in away])
        gap = x * np.cos(angle) + y * np.sin(angle) - bearing.clearance_m - drop
        inside = np.abs(away) < spall.half_width_rad
        result.append((bearing.load_factor * np.maximum(gap, 0) ** 1.5, inside))
    return result


def crossings(forces):
    """(forces during a crossing) for every crossing by a ball that carries 40 N at the entry."""
    for force, inside in forces:
        starts = np.flatnonzero(inside[1:] & ~inside[:-1]) + 1
        ends = np.flatnonzero(~inside[1:] & inside[:-1]) + 1
        for start in starts:
            end = ends[ends > start]
            if end.size and force[start] > 40:
                yield force[start : end[0]]


@pytest.mark.parametrize("kind", RACE_SPALLS)
def test_entry_to_impact_time(params, plant, kind):
    """About 0.6 ms for 0.8 mm at 10 Hz on either race (thesis 5.8).

    On the contact force of the ball: from entry, where 5 % of its load is gone, to the impact, where it
    changes from the entry edge to the exit edge: the middle of the stretch in which it is loose.
    """
    rate = 4 * RATE_HZ
    engine = Engine(
        params,
        1,
        rate,
        2,
        [FaultSpec(kind, "bearing_3")],
        probes=("b3_x.displacement_m", "b3_y.displacement_m"),
    )
    spall = build(plant, kind)
    times = []
    for force in crossings(
        ball_forces(engine, engine.advance(int(0.5 * rate)), spall, plant.bearings[2].law)
    ):
        loose = np.flatnonzero(force == 0)
        assert loose.size > 0.1e-3 * rate  # contact is lost
        entry = np.flatnonzero(force < 0.95 * force[0])[0]
        times.append((0.5 * (loose[0] + loose[-1]) - entry) / rate)
    assert len(times) >= 6
    assert np.median(times) == pytest.approx(0.6e-3, abs=0.06e-3)


@pytest.mark.parametrize("kind", RACE_SPALLS)
def test_event_spacing_in_the_acceleration(params, kind):
    """At the pedestal unloading and reloading stand 0.6 ms or somewhat more apart.

    How much more depends on the depth: 0.7 ms on the outer and 0.8 ms on the inner race, since balls
    without inertia lift off before they reach the middle of the pit.
    """
    outputs = []
    for severity in (0.0, 1.0):
        fault = FaultSpec(kind, "bearing_3", severity=severity)
        outputs.append(Engine(params, 1, RATE_HZ, 4, [fault]).advance(int(RATE_HZ)).accel[5])
    added = outputs[1] - outputs[0]
    reach = int(0.9e-3 * RATE_HZ)
    spacing = []
    strength = np.abs(added)
    while len(spacing) < 8:
        peak = int(np.argmax(strength[reach:-reach])) + reach
        around = added[peak - reach : peak + reach]
        spacing.append(abs(int(np.argmax(around)) - int(np.argmin(around))) / RATE_HZ)
        strength[max(0, peak - 600) : peak + 600] = 0
    assert 0.5e-3 < np.median(spacing) < 0.9e-3, spacing


@pytest.mark.parametrize("kind", RACE_SPALLS)
def test_zero_severity_equals_healthy_bit_for_bit(params, kind):
    healthy = Engine(params, 5, RATE_HZ).advance(4000)
    fault = FaultSpec(kind, "bearing_2", severity=0.0)
    for engine in (Engine(params, 5, RATE_HZ, 4, [fault]), Engine(params, 5, RATE_HZ)):
        engine.inject(fault, at_sample=700)
        faulty = engine.advance(4000)
        assert np.array_equal(faulty.accel, healthy.accel)
        assert np.array_equal(faulty.fraction, healthy.fraction)


@pytest.mark.parametrize("kind", RACE_SPALLS)
def test_severity_is_continuous_and_the_seed_decides(params, kind):
    def accel(severity, seed=5):
        position = {"position_rad": -np.pi / 2 - 2 * np.pi * 0.55} if "inner" in kind else {}
        fault = FaultSpec(kind, "bearing_3", position, severity=severity)
        return Engine(params, seed, RATE_HZ, 4, [fault]).advance(3000).accel

    healthy, slight, full = accel(0.0), accel(1e-3), accel(1.0)
    assert 0 < np.abs(slight - healthy).max() < 0.02 * np.abs(full - healthy).max()
    assert np.array_equal(full, accel(1.0))
    assert not np.array_equal(full, accel(1.0, seed=6))


@pytest.mark.parametrize("kind", RACE_SPALLS)
def test_parameters_survive_json_and_units(plant, kind):
    plain = build(plant, kind, width_m=1.2e-3, depth_m=2e-5, position_rad=0.3, row=2)
    worded = build(plant, kind, width_m="1.2 mm", depth_m="20 um", position_rad="0.3 rad", row=2)
    assert plain.numbers() == pytest.approx(worded.numbers(), rel=1e-12)
    model = REGISTRY[kind].params_model
    dumped = json.loads(json.dumps(model.model_validate({"width_m": "1.2 mm"}).model_dump()))
    assert model.model_validate(dumped) == model.model_validate({"width_m": 1.2e-3})


def test_several_faults_add_up_to_more(params):
    """Spalls at different bearings act each at its own; two rows of one bearing may both be spalled."""
    faults = [
        FaultSpec("outer_race_spall", "bearing_3"),
        FaultSpec("outer_race_spall", "bearing_3", {"row": 2}, fault_id="other row"),
        FaultSpec("inner_race_spall", "bearing_1"),
    ]
    healthy = Engine(params, 1, RATE_HZ).advance(9000).accel
    one = Engine(params, 1, RATE_HZ, 4, faults[:1]).advance(9000).accel
    three = Engine(params, 1, RATE_HZ, 4, faults).advance(9000).accel
    assert np.std(three[5] - one[5]) > 0.5 * np.std(one[5] - healthy[5])
    assert np.std(three[1] - healthy[1]) > 2 * np.std(one[1] - healthy[1])


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"width_m": 9e-3}, "width_m"),
        ({"width_m": 0.0}, "width_m"),
        ({"width_m": float("nan")}, "width_m"),
        ({"width_m": "0.8 kg"}, "width_m"),
        ({"depth_m": -1e-6}, "depth_m"),
        ({"row": 3}, "row"),
        ({"position_rad": 100.0}, "position_rad"),
        ({"breadth": 1e-3}, ""),  # a key that is not there is the value, see the test of names
    ],
)
def test_impossible_parameters_are_named(plant, given, field):
    with pytest.raises(InputError) as error:
        build(plant, "inner_race_spall", **given)
    assert error.value.field == field


def test_unknown_kind_bearing_and_severity(plant):
    with pytest.raises(InputError, match="outer_race_spall"):
        fault_kind("crack")
    with pytest.raises(InputError, match="bearing_3"):
        REGISTRY["outer_race_spall"].build(FaultSpec("outer_race_spall", "gear"), plant)
    spec = FaultSpec("outer_race_spall", "bearing_1", severity=3.0)
    with pytest.raises(InputError, match="0 to 2"):
        REGISTRY["outer_race_spall"].build(spec, plant)
