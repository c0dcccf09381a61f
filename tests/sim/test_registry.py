"""What must hold of every fault on every model, read from the registries: new ones are covered at once.

All runs are short and at a low sample rate (the engine integrates at its lowest step rate then); a stretch
is a bit more than a turn of the reference shaft, in which everything that turns with it has passed once.
"""

import json
import math
from functools import cache

import numpy as np
import pytest
from ruamel.yaml import YAML

from gearsim_io.errors import InputError
from gearsim_io.quantities import Si, validate
from gearsim_sim.engine import Engine
from gearsim_sim.events import Clear, FaultSpec, Inject, SetOperatingPoint
from gearsim_sim.model.faults import REGISTRY
from gearsim_sim.scenario import load_scenario, scenario_names
from gearsim_sim.verify.machines import SEED, load_for, machine_of, model_names, params_of, plant_of

RATE_HZ = 4096.0
KINDS = sorted(REGISTRY)


def carriers(kind):
    """Models of which some component can have this fault."""
    return [model for model in model_names() if REGISTRY[kind].components(plant_of(model))]


def kinds_of(model):
    return [kind for kind in KINDS if REGISTRY[kind].components(plant_of(model))]


def spec_of(model, kind, severity=1.0, which=0):
    components = REGISTRY[kind].components(plant_of(model))
    return FaultSpec(kind, components[which % len(components)], severity=severity)


def stretch(model):
    """Samples of a bit more than one turn."""
    return math.ceil(RATE_HZ * max(0.1, 1.1 / plant_of(model).limits.speed_hz))


def engine(model, faults=(), load_nm=None):
    return Engine(params_of(model), SEED, RATE_HZ, faults=faults, load_nm=load_nm)


@cache
def healthy(model, load_nm=None):
    return engine(model, (), load_nm).advance(stretch(model)).accel


def with_faults(model, faults, load_nm=None):
    return engine(model, faults, load_nm).advance(stretch(model)).accel


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


def rotating_specs(model, severity):
    """Every kind, each on another component, so that they spread over the machine."""
    return [spec_of(model, kind, severity, number) for number, kind in enumerate(kinds_of(model))]


def test_models_that_can_carry_each_kind_exist():
    for kind in KINDS:
        assert carriers(kind), kind


@pytest.mark.parametrize("model", model_names())
def test_severity_zero_is_healthy_bit_for_bit(model):
    """All kinds at once; where a bit differs, the culprits are looked for one by one."""
    faults = rotating_specs(model, 0.0)
    if not np.array_equal(with_faults(model, faults), healthy(model)):
        guilty = [one for one in faults if not np.array_equal(with_faults(model, [one]), healthy(model))]
        pytest.fail(f"severity 0 changes bits: {guilty or 'all together'}")


@pytest.mark.parametrize("model", model_names())
def test_injected_severity_zero_is_healthy_bit_for_bit(model):
    def injected(faults):
        running = engine(model)
        for number, one in enumerate(faults):
            running.inject(one, 0.02, at_sample=20 + 5 * number)
        return running.advance(stretch(model)).accel

    faults = rotating_specs(model, 0.0)
    if not np.array_equal(injected(faults), healthy(model)):
        guilty = [one for one in faults if not np.array_equal(injected([one]), healthy(model))]
        pytest.fail(f"injected severity 0 changes bits: {guilty or 'all together'}")


@pytest.mark.parametrize("model", model_names())
def test_severity_zero_changes_no_bit_of_another_fault(model):
    faults = rotating_specs(model, 0.0)
    acting = spec_of(model, faults[0].kind, 1.0, which=1)
    others = [one for one in faults if one.name != acting.name]
    assert np.array_equal(with_faults(model, [acting, *others]), with_faults(model, [acting]))


@pytest.mark.parametrize("kind", KINDS)
def test_a_small_severity_has_a_small_effect(kind):
    """A hundredth of a slight fault does at most a tenth of its effect, and the fault does something.

    Most effects are in proportion; contact makes some grow with a power of 2/3 and more, 0.01^(2/3) = 0.05.
    Slight is a tenth: at full severity some saturate (preload takes the last play out of a bearing).
    """
    for model in carriers(kind):
        load = load_for(model, kind)
        normal = healthy(model, load)
        full = rms(with_faults(model, [spec_of(model, kind)], load) - normal)
        slight, small = (
            rms(with_faults(model, [spec_of(model, kind, severity)], load) - normal)
            for severity in (0.1, 0.001)
        )
        assert full > 1e-6 * rms(normal), model
        assert small < 0.1 * slight + 1e-9 * rms(normal), (model, small, slight)  # and rounding


@pytest.mark.parametrize("kind", KINDS)
def test_a_fault_grows_during_a_run(kind):
    """Nothing before it is injected, little in the first tenth of its ramp, all of it in the end."""
    model = carriers(kind)[0]
    load = load_for(model, kind)
    running, at = engine(model, (), load), 100
    ramp_s = 0.5 * stretch(model) / RATE_HZ
    running.inject(spec_of(model, kind), ramp_s, at_sample=at)
    change = running.advance(stretch(model)).accel - healthy(model, load)
    assert not np.any(change[:, : at - running.lookahead_samples])
    soon = at + int(0.1 * ramp_s * RATE_HZ)
    # 10 u^3 - 15 u^4 + 6 u^5 is 0.009 at u = 0.1; the filter looks ahead, contact may take a root of it.
    assert rms(change[:, at:soon]) < 0.2 * rms(change[:, soon:])
    assert np.any(change[:, soon:])


@pytest.mark.parametrize("model", model_names())
def test_any_chunks_give_the_same_bits(model):
    """With all kinds running at once, injected, cleared and at a changing operating point."""
    total = stretch(model)
    limits = plant_of(model).limits
    events = [SetOperatingPoint(0.95 * limits.speed_hz, 0.9 * limits.load_nm, 0.05, total // 3)]
    for number, one in enumerate(rotating_specs(model, 0.5)):
        events.append(Inject(one, 0.03, 7 + 11 * number))
        if number % 2:
            events.append(Clear(one.name, 0.03, total // 2 + 3 * number))
    whole = engine(model).advance(total, events)
    assert np.all(np.isfinite(whole.accel))
    for chunk in (1, 7, 300):
        running = engine(model)
        parts = [running.advance(min(chunk, total), events)]
        parts += [running.advance(min(chunk, total - at)) for at in range(chunk, total, chunk)]
        for name in ("accel", "turns", "fraction", "speed_hz"):
            joined = np.concatenate([getattr(part, name) for part in parts], axis=1)
            assert np.array_equal(joined, getattr(whole, name)), (name, chunk)
        for name, values in whole.signals.items():
            assert np.array_equal(np.concatenate([part.signals[name] for part in parts]), values), name


def contributions(model, kind, seed):
    fault = REGISTRY[kind].build(spec_of(model, kind), plant_of(model), seed)
    return [(one.table, one.numbers(), one.samples()) for one in fault.contributions]


@pytest.mark.parametrize("kind", KINDS)
def test_the_seed_decides_on_everything_random(kind):
    """Built twice with one seed a fault is the same to the bit."""
    for model in carriers(kind):
        first, second = contributions(model, kind, 5), contributions(model, kind, 5)
        assert len(first) == len(second) > 0
        for one, other in zip(first, second, strict=True):
            assert one[:2] == other[:2]
            assert (one[2] is None) == (other[2] is None)
            assert one[2] is None or np.array_equal(one[2], other[2])


@pytest.mark.parametrize("kind", KINDS)
def test_parameters_survive_json_and_yaml(kind, tmp_path):
    defaults = REGISTRY[kind].params_model()
    given = {name: value for name, value in defaults.model_dump(mode="json").items() if value is not None}
    assert validate(type(defaults), json.loads(json.dumps(given)), "json") == defaults
    model = carriers(kind)[0]
    content = {
        "machine": machine_of(model)[0],
        "model": model,
        "operating_point": {"speed": "1 Hz", "load": "0 N*m"},
        "faults": [{"kind": kind, "component": spec_of(model, kind).component, "params": given}],
    }
    path = tmp_path / "one.yaml"
    with path.open("w", encoding="utf-8") as file:
        YAML().dump(content, file)
    (spec,) = load_scenario(path).faults
    assert validate(type(defaults), spec.params, "yaml") == defaults


def si_of(field):
    """The mark of a physical number, also inside `... | None`."""
    marks = [
        *field.metadata,
        *(m for part in getattr(field.annotation, "__args__", ()) for m in metadata(part)),
    ]
    return next((mark for mark in marks if isinstance(mark, Si)), None)


def metadata(part):
    return getattr(part, "__metadata__", ())


def outside(mark):
    """Values just beyond the bounds of a number."""
    if mark.gt is not None:
        yield mark.gt
    if mark.ge is not None:
        yield np.nextafter(mark.ge, -np.inf)
    if mark.lt is not None:
        yield mark.lt
    if mark.le is not None:
        yield np.nextafter(mark.le, np.inf)
    yield math.inf
    yield math.nan


@pytest.mark.parametrize("kind", KINDS)
def test_every_number_has_a_range_and_is_refused_outside(kind):
    params = REGISTRY[kind].params_model
    for name, field in params.model_fields.items():
        mark = si_of(field)
        if mark is None:
            continue
        assert not (mark.gt is None and mark.ge is None), (name, "needs a lower bound")
        for value in outside(mark):
            with pytest.raises(InputError) as error:
                validate(params, {name: float(value)}, "here")
            assert error.value.field == name
    with pytest.raises(InputError):
        validate(params, {"no_such_parameter": 1.0}, "here")


@cache
def shown_kinds():
    """Kinds of fault in the shipped scenarios."""
    shown = set()
    for name in scenario_names():
        scenario = load_scenario(name)
        injected = [event.fault for event in scenario.events if isinstance(event, Inject)]
        shown |= {one.kind for one in (*scenario.faults, *injected)}
    return shown


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_described_and_has_an_example(kind):
    assert REGISTRY[kind].summary
    assert REGISTRY[kind].look_for
    assert kind in shown_kinds()


@pytest.mark.parametrize("kind", KINDS)
def test_what_cannot_be_is_refused(kind):
    """Components that a machine does not have, severities beyond the range."""
    model = carriers(kind)[0]
    with pytest.raises(InputError) as error:
        REGISTRY[kind].build(FaultSpec(kind, "flux_capacitor"), plant_of(model))
    assert error.value.field == "component"
    for severity in (-0.1, 2.1, math.nan):
        with pytest.raises(InputError) as error:
            REGISTRY[kind].build(spec_of(model, kind, severity), plant_of(model))
        assert error.value.field == "severity"
