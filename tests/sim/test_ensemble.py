"""An ensemble gives for each variant what the engine gives for it alone, whatever runs beside it.

Both loops do the same sums in another order, so their outputs agree to rounding, not to the last bit: the
scheme's sums have about 200 terms, and the gearbox forgets a disturbance within a tenth of a second, so that
rounding of 1e-16 stays below 1e-9 of the signal. Among themselves, lanes do the same operations in the same
order: there the last bit must agree. Ensembles look up the functions of meshes at every step, engines at
nodes; here these do so at every step too, but for one test, which shows what the nodes leave.
"""

from dataclasses import replace

import numpy as np
import pytest

from gearsim_io.errors import InputError
from gearsim_sim import stepper
from gearsim_sim.engine import Engine
from gearsim_sim.ensemble import Ensemble, Variant
from gearsim_sim.events import FaultSpec
from gearsim_sim.integrate.vectors import LANES
from gearsim_sim.lane_tables import TABLES
from gearsim_sim.model.faults import REGISTRY
from gearsim_sim.model.plants import make_plant
from gearsim_sim.params import load_parallel_params, load_planetary_params

RATE_HZ = 65536.0
HALF_SECOND = 32768
OUTER = FaultSpec("outer_race_spall", "bearing_3", {"width_m": "0.8 mm"}, 1.0, "outer")
INNER = FaultSpec("inner_race_spall", "bearing_1", {}, 0.7, "inner")


@pytest.fixture(autouse=True)
def _every_step(monkeypatch):
    monkeypatch.setattr(stepper, "node_stride", lambda *_: 1)


def changed(**overrides):
    return load_parallel_params(overrides={key.replace("__", "."): value for key, value in overrides.items()})


@pytest.fixture(scope="module")
def params():
    return load_parallel_params()


@pytest.fixture(scope="module")
def variants(params):
    """All that may differ: seed, faults, operating point, clearance, damping, stiffness, masses."""
    return [
        Variant(params, 1),
        Variant(params, 2, (OUTER, INNER), 8.0, 30.0),
        Variant(changed(ball_bearing__radial_clearance="12 um"), 3, (INNER,)),
        Variant(changed(pedestal__mass="9 kg", mesh__damping="900 N*s/m"), 4, (OUTER,), 12.0, 60.0),
    ]


@pytest.fixture(scope="module")
def together(variants):
    return Ensemble(variants, RATE_HZ).advance(HALF_SECOND)


def relative(found, expected):
    """Largest difference over the rms of each row."""
    rms = np.sqrt(np.mean(np.square(expected), axis=-1))
    return float(np.max(np.max(np.abs(found - expected), axis=-1) / rms))


def test_nodes_of_the_engine_leave_a_thousandth_of_a_percent(variants, together, monkeypatch):
    monkeypatch.undo()
    alone = Engine(variants[0].params, 1, RATE_HZ).advance(HALF_SECOND)
    assert 1e-9 < relative(together.accel[0], alone.accel) < 2e-5


@pytest.mark.parametrize("number", range(4))
def test_a_variant_is_what_the_engine_gives_to_rounding(variants, together, number):
    params, seed, faults, speed, load = variants[number]
    engine = Engine(params, seed, RATE_HZ, 4, faults, speed_hz=speed, load_nm=load)
    alone = engine.advance(HALF_SECOND)
    assert together.site_names == alone.site_names
    assert together.shaft_names == alone.shaft_names
    assert relative(together.accel[number], alone.accel) < 1e-9
    assert np.array_equal(together.turns[number], alone.turns)
    assert np.abs(together.fraction[number] - alone.fraction).max() < 1e-12
    assert relative(together.speed_hz[number], alone.speed_hz) < 1e-12
    for name, signal in zip(together.signal_names, together.signals[number], strict=True):
        assert relative(signal, alone.signals[name]) < 1e-10


def kinds(plant):
    """Kinds of faults that an ensemble of this machine can have."""
    for kind in REGISTRY.values():
        for component in kind.components(plant)[:1]:
            fault = kind.build(FaultSpec(kind.name, component, {}), plant)
            if {one.table for one in fault.contributions} <= set(TABLES):
                yield FaultSpec(kind.name, component, {}, 0.8, kind.name)


def test_every_kind_of_fault_is_that_of_the_engine(params):
    """One variant for each; 0.1 s, in which balls cross pits and all teeth of the pinion mesh."""
    found = list(kinds(make_plant(params, 1)))
    assert len(found) > 15
    together = Ensemble([Variant(params, 1, (spec,)) for spec in found], RATE_HZ).advance(6554)
    healthy = Engine(params, 1, RATE_HZ).advance(6554).accel
    for number, spec in enumerate(found):
        alone = Engine(params, 1, RATE_HZ, 4, (spec,)).advance(6554).accel
        assert relative(together.accel[number], alone) < 1e-9, spec.kind
        # The fault has been felt; under this load teeth never part, so that play between them is not.
        assert relative(alone, healthy) > 1e-6 or spec.kind == "gear_backlash", spec.kind


def test_other_kinds_of_faults_are_refused(params):
    plant = make_plant(params, 1)
    usable = {spec.kind for spec in kinds(plant)}
    refused = [kind for kind in REGISTRY.values() if kind.components(plant) and kind.name not in usable]
    for kind in refused:
        spec = FaultSpec(kind.name, kind.components(plant)[0], {})
        with pytest.raises(InputError, match="single engine"):
            Ensemble([Variant(params, 1, (spec,))], RATE_HZ)


def same(one, other):
    """Whether all that two outputs of one variant hold is equal to the last bit."""
    return all(np.array_equal(one[name], other[name]) for name in one)


def of(output, number):
    return {
        name: getattr(output, name)[number] for name in ("accel", "turns", "fraction", "speed_hz", "signals")
    }


def test_a_variant_does_not_depend_on_the_others_nor_on_its_place(variants):
    """Alone (its modes are shared by all lanes then), or behind others, in other groups."""
    count = 3000
    beside = Ensemble(variants, RATE_HZ).advance(count)
    crowd = [variants[0]] * LANES + variants[::-1]
    turned = Ensemble(crowd, RATE_HZ, workers=2).advance(count)
    for number, variant in enumerate(variants):
        alone = Ensemble([variant], RATE_HZ).advance(count)
        assert same(of(alone, 0), of(beside, number)), number
        assert same(of(alone, 0), of(turned, LANES + 3 - number)), number


def test_portions_change_no_bit(variants, together):
    ensemble = Ensemble(variants, RATE_HZ)
    done = 0
    for count in (1, 2, 3, 27, 255, 256, 257, 1000):
        part = ensemble.advance(count)
        assert part.first_sample == done
        assert np.array_equal(part.accel, together.accel[:, :, done : done + count])
        assert np.array_equal(part.fraction, together.fraction[:, :, done : done + count])
        done += count
    assert ensemble.next_sample == done


def test_events_of_one_variant_are_those_of_the_engine_and_leave_the_others_alone(params):
    """A ramp, a fault that grows and goes, asked for on the way; the other variant keeps its bits."""
    plain = [Variant(params, 5), Variant(params, 6)]
    moved, still = Ensemble(plain, RATE_HZ), Ensemble(plain, RATE_HZ)
    engine = Engine(params, 5, RATE_HZ)
    for run in (moved, engine):
        run.advance(50)
        own = (0,) if run is moved else ()
        run.set_operating_point(*own, 14.0, 80.0, ramp_s=0.05, at_sample=200)
        run.inject(*own, OUTER, ramp_s=0.02, at_sample=1000)
        run.clear(*own, "outer", ramp_s=0.01, at_sample=5000)
    still.advance(50)
    found, quiet, expected = moved.advance(8000), still.advance(8000), engine.advance(8000)
    assert relative(found.accel[0], expected.accel) < 1e-9
    assert relative(found.speed_hz[0], expected.speed_hz) < 1e-12
    assert same(of(found, 1), of(quiet, 1))
    assert not np.array_equal(found.accel[0, :, 300:], quiet.accel[0, :, 300:])


def test_severity_zero_is_healthy_to_the_last_bit(params):
    """For every kind, although most of them take another way through the loop."""
    specs = [replace(spec, severity=0.0) for spec in kinds(make_plant(params, 1))]
    together = Ensemble([Variant(params, 1)] + [Variant(params, 1, (spec,)) for spec in specs], RATE_HZ)
    found = together.advance(1000)
    for number, spec in enumerate(specs, start=1):
        assert same(of(found, 0), of(found, number)), spec.kind


def test_sites_and_rates_are_those_of_the_engine(params):
    sites = {"up": {"y_p3": 1.0}, "across": {"x_p3": 0.6, "y_p3": 0.8}}
    found = Ensemble([Variant(params, 1)], 30000.0, 6, sites=sites).advance(3000)
    expected = Engine(params, 1, 30000.0, 6, sites=sites).advance(3000)
    assert found.site_names == ("up", "across")
    assert relative(found.accel[0], expected.accel) < 1e-9


def test_other_machines_are_those_of_the_engine_too():
    """The planetary stage has no rolling bearings, and sensors that turn with the carrier."""
    params = load_planetary_params()
    found = Ensemble([Variant(params, 1), Variant(params, 2, speed_hz=2.0)], RATE_HZ).advance(3000)
    for number, speed_hz in enumerate((None, 2.0)):
        expected = Engine(params, number + 1, RATE_HZ, speed_hz=speed_hz).advance(3000)
        assert found.site_names == expected.site_names
        assert relative(found.accel[number], expected.accel) < 1e-9


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda _: Ensemble([]), "variants"),
        (lambda p: Ensemble([Variant(p, -1)]), "seed"),
        (lambda p: Ensemble([Variant(p)], 65536.0, 1), "oversampling"),
        (lambda p: Ensemble([Variant(p, speed_hz=1e3)]), "speed_hz"),
        (lambda p: Ensemble([Variant(p)], workers=0), "workers"),
        (lambda p: Ensemble([Variant(p)]).advance(0), "n"),
        (lambda p: Ensemble([Variant(p)]).clear(1), "variant"),
    ],
)
def test_bad_input_is_named(params, make, field):
    with pytest.raises(InputError) as error:
        make(params)
    assert error.value.field == field


def test_another_structure_is_refused(params):
    bearings = tuple(
        one.__class__(
            **{**{name: getattr(one, name) for name in one.__dataclass_fields__}, "rolling_elements": 11}
        )
        for one in params.bearings
    )
    other = params.model_copy(update={"bearings": bearings})
    with pytest.raises(InputError, match=r"variants\.1"):
        Ensemble([Variant(params), Variant(other)])
