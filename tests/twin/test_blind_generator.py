"""The generator of the blind tests: right by another path than the product's, and the same for a seed."""

from __future__ import annotations

import numpy as np
import pytest
from blind import motion, sizing
from blind.chain import sampled
from blind.effects import CAUSES, EFFECTS, SEVERITIES, noise_of, size_of
from blind.making import Hidden, build_of, make, place_in
from blind.plan import KINDS, drawn, planned
from blind.rigs import RIGS
from blind.severity import stands_out_db
from blind.sizing import plain_data, stands_out

from gearsim_sim.engine import Engine
from gearsim_sim.events import FaultSpec
from gearsim_sim.model.faults import REGISTRY
from gearsim_sim.model.plants import make_plant
from gearsim_sim.verify.machines import params_of

STEP_HZ = 131072.0
SECONDS = 0.25
# What two integrators may differ by: the product's own scheme is right within 1e-3 (docs/accuracy.md), low
# channels of tiny levels within 1e-2 of the machine's; an element entered wrongly is off by far more.
AGREE = 0.02
FAULTS = {
    "bearing5": ("inner_race_spall", "test", {}),
    "lpm34": ("gear_tooth_crack", "gears.pinion", {}),
    "planetary18": ("planet_position_error", "planet_2", {}),
}


def _course(speed_hz: float, load_nm: float) -> motion.Course:
    lead = motion.lead_steps(1 / STEP_HZ)
    halves = 2 * (lead + round(SECONDS * STEP_HZ)) + 1
    seconds = (np.arange(halves) / 2 - lead) / STEP_HZ
    turns = 0.5 + speed_hz * seconds
    return motion.Course(1 / STEP_HZ, turns, np.full(halves, speed_hz), np.full(halves, load_nm))


@pytest.mark.parametrize("model", FAULTS)
def test_it_agrees_with_the_products_engine(model: str) -> None:
    kind, component, params = FAULTS[model]
    machine, seed, rate = params_of(model), 3, 16384
    plant = make_plant(machine, seed)
    if component not in REGISTRY[kind].components(plant):
        component = REGISTRY[kind].components(plant)[0]
    spec = FaultSpec(kind, component, params)
    added = REGISTRY[kind].build(spec, plant, seed).contributions
    limits = plant.limits
    course = _course(limits.speed_hz, limits.load_nm)
    own = sampled(motion.run(plant, course, motion.Extras(added), tuple(plant.sites)), 8, filtered=True)
    theirs = Engine(machine, seed, rate, 8, (spec,)).advance(own.shape[1]).accel
    inside = slice(400, -400)  # away from the ends of the filters
    level = np.std(theirs[:, inside], axis=1)
    difference = np.std(own[:, inside] - theirs[:, inside], axis=1)
    assert np.all(difference < AGREE * np.maximum(level, 0.1 * level.max()))


def test_its_integrator_is_of_fourth_order() -> None:
    """Against steps four times as fine: half the step, a sixteenth of the error."""
    plant = make_plant(params_of("bearing5"), 3)

    def end(rate: float) -> np.ndarray:
        lead = motion.lead_steps(1 / rate)
        halves = 2 * (lead + round(0.02 * rate)) + 1
        seconds = (np.arange(halves) / 2 - lead) / rate
        course = motion.Course(1 / rate, 30.0 * seconds, np.full(halves, 30.0), np.zeros(halves))
        found = motion.run(plant, course, motion.Extras(), ("drive_end",))
        return found[:, :: round(rate / 32000)]

    truth = end(512000.0)
    errors = [float(np.max(np.abs(end(rate) - truth))) for rate in (32000.0, 64000.0)]
    # Contacts have a kink of higher order only where they touch, which costs a little.
    assert np.log2(errors[0] / errors[1]) > 2.5


@pytest.mark.parametrize("rig", RIGS)
def test_every_effect_can_be_entered(rig: str) -> None:
    for name, effect in EFFECTS.items():
        if rig not in effect.rigs:
            continue
        for severity in SEVERITIES:
            size = size_of(name, rig, severity)
            if size is None:
                continue
            build = build_of(Hidden(rig, ((name, size),)), np.random.default_rng(4))
            plant, _ = place_in(build, 5)
            assert plant.sites
            assert [one["name"] for one in build.truths] == [name if name in CAUSES else "unknown"]


def test_one_seed_gives_one_record_and_an_effect_leaves_the_noise() -> None:
    size = size_of("mains_interference", "bearing", "medium")
    assert size is not None
    plain = make(Hidden("bearing", ()), (1, 2), records=1, seconds=0.3)
    again = make(Hidden("bearing", ()), (1, 2), records=1, seconds=0.3)
    other = make(Hidden("bearing", ()), (1, 3), records=1, seconds=0.3)
    hum = make(Hidden("bearing", (("mains_interference", size),)), (1, 2), records=1, seconds=0.3)
    data = [made.records[0].data[0].astype(float) for made in (plain, again, other, hum)]
    assert np.array_equal(data[0], data[1])
    assert not np.array_equal(data[0], data[2])
    added = data[3] - data[0]
    spectrum = np.abs(np.fft.rfft(added * np.hanning(added.size)))
    f = np.fft.rfftfreq(added.size, 1 / RIGS["bearing"].rate_hz)
    assert f[np.argmax(spectrum)] == pytest.approx(hum.truth["effects"][0]["hz"][0], abs=4.0)
    # Of all that is not hum (far above its harmonics) nothing has changed but the converter's rounding.
    assert spectrum[f > 2000].max() < 1e-4 * spectrum.max()


def test_the_yardstick_counts_decibels() -> None:
    rng = np.random.default_rng(3)
    rate = 16384.0
    t = np.arange(16384) / rate
    noise = 0.1 * rng.standard_normal((1, t.size))
    tones = sum(np.cos(2 * np.pi * (400.25 + 200 * k) * t) for k in range(8))
    plain, louder = noise + 0.2 * tones, noise + 0.2 * 2.0 * tones
    same = stands_out_db(plain.astype(np.float32), plain.astype(np.float32), rate)
    assert same == pytest.approx(0.0, abs=1e-9)
    assert stands_out_db(plain.astype(np.float32), louder.astype(np.float32), rate) == pytest.approx(
        6.0, abs=0.7
    )


def test_noise_that_scatters_is_no_change() -> None:
    """Single lines of two drawings of one noise differ by ten decibels; bands do not."""
    rng = np.random.default_rng(4)
    one, other = (rng.standard_normal((1, 40000)).astype(np.float32) for _ in range(2))
    rate = 32768.0
    assert stands_out_db(one, other, rate) > 8.0
    assert stands_out_db(one, other, rate, random=True) < 3.0
    assert stands_out_db(one, 4.0 * other, rate, random=True) == pytest.approx(12.0, abs=2.5)


@pytest.mark.parametrize(
    ("name", "severity", "db"), [("sensor_resonance", "medium", 12.0), ("mains_interference", "mild", 6.0)]
)
def test_a_size_is_sought_on_the_machine_of_the_case(name: str, severity: str, db: float) -> None:
    case, seed = drawn("bearing", ((name, severity),), (3, 1))
    plain = plain_data("bearing", case.noise, seed)
    assert stands_out("bearing", case.effects[0], case.noise, seed, plain) == pytest.approx(db, abs=2.0)
    assert case.noise == noise_of([name], "bearing")


def test_a_wrong_label_is_told_by_what_the_records_ran_at() -> None:
    made = make(Hidden("bearing", (("mislabelled_record", 1.5),)), (21, 0), seconds=0.3)
    (truth,) = made.truth["effects"]
    assert set(truth) == {"name", "parameters", "hz", "size"}
    if made.truth["speed_hz"] == RIGS["bearing"].speed_hz:
        assert truth["parameters"] == {"speed_ratio": 0.5}  # a tacho with twice the pulses
        return
    speeds = []
    for record in made.records[:2]:
        (tacho,) = record.tachos
        turns = (tacho.samples.size - 1) / tacho.pulses_per_revolution
        speeds.append(turns * record.sample_rate_hz / (tacho.samples[-1] - tacho.samples[0]))
    ratio = np.mean(speeds) / RIGS["bearing"].speed_hz
    assert truth["parameters"]["speed_ratio"] == pytest.approx(ratio, rel=3e-4)


def test_a_loud_hall_drowns_quiet_sensors() -> None:
    assert noise_of(["casing_resonance", "bearing_spall_outer"], "bearing") > 1.0
    assert noise_of(["casing_resonance", "clipping"], "bearing") < 1.0
    assert noise_of(["clipping"], "bearing") == 1.0


def test_plans_deal_all_causes_before_any_comes_again() -> None:
    plans = [planned(7, index) for index in range(200)]
    counted = {kind: sum(plan.kind == kind for plan in plans) for kind in KINDS}
    assert counted == {"single": 120, "pair": 30, "none": 20, "outside": 30}
    first = [plan.effects[0][0] for plan in plans if plan.kind == "single"][: len(CAUSES)]
    assert sorted(first) == sorted(CAUSES)
    assert plans[13] == planned(7, 13)
    pairs = [plan for plan in plans if plan.kind == "pair"]
    assert all(plan.effects[0][0] != plan.effects[1][0] for plan in pairs)
    assert [plan.effects for plan in plans] != [planned(8, index).effects for index in range(200)]


def test_plans_of_one_rig_are_of_that_rig() -> None:
    plans = [planned(7, index, "bearing") for index in range(100)]
    assert {plan.rig for plan in plans} == {plan.only for plan in plans} == {"bearing"}
    able = {name for name, e in CAUSES.items() if "bearing" in e.rigs and _sizes(name, "bearing")}
    first = [plan.effects[0][0] for plan in plans if plan.kind == "single"][: len(able)]
    assert sorted(first) == sorted(able)
    assert plans[13].kind == planned(7, 13).kind


def _sizes(name: str, rig: str) -> list[float]:
    return [size for s in SEVERITIES if (size := size_of(name, rig, s)) is not None]


@pytest.mark.parametrize(("most_db", "target_db"), [(20.9, 24.0), (17.0, 24.0), (30.0, 24.0)])
def test_what_a_machine_hardly_reaches_is_enough(
    monkeypatch: pytest.MonkeyPatch, most_db: float, target_db: float
) -> None:
    """An effect whose level grows with its size, to `most_db` and no further."""
    tried: list[float] = []

    def levels_off(_rig: str, effect: tuple[str, float], *_: object) -> float:
        tried.append(effect[1])
        return min(most_db, 30.0 + 20.0 * np.log10(effect[1] / 1e-3))

    monkeypatch.setattr(sizing, "stands_out", levels_off)
    asked = (
        "parallel",
        "bearing_spall_outer",
        target_db,
        3e-4,
        10.0,
        (1,),
        np.zeros((1, 8), dtype=np.float32),
    )
    if most_db < 0.8 * target_db:
        with pytest.raises(sizing.OutOfReachError, match="by 17"):
            sizing.search(*asked)
        return
    found = levels_off("", ("", sizing.search(*asked)))
    assert found == pytest.approx(min(most_db, target_db), abs=3.0)
