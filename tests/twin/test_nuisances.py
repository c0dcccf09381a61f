"""Gain, floor and bandwidth in closed form on levels, against the same done to the samples."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from compare_signals import (
    RATE_HZ,
    impacts,
    level,
    lines,
    machine,
    measured,
    noise,
    plan_of,
    record,
    view,
    with_encoder,
)
from scipy.signal import butter, sosfilt

from gearsim_dsp.kinematics import bearing_orders
from gearsim_io.errors import InputError
from gearsim_twin.compare.features import features
from gearsim_twin.compare.nuisances import (
    ChannelNuisance,
    Limits,
    Nuisance,
    apply,
    fit_nuisance,
    fit_nuisances,
)

BPFO = bearing_orders(machine().bearings[0]).bpfo
BPFO_LABEL = "BPFO of bearing_1 and 3 alike"
GAIN_DB, CORNER_HZ, NOISE_STD = 1.7, 5000.0, 0.15
DENSITY_DB = 10 * math.log10(NOISE_STD**2 * 2 / RATE_HZ)
TRUE = Nuisance((ChannelNuisance("b1_y", GAIN_DB, (100.0, 10e3), (DENSITY_DB, DENSITY_DB), CORNER_HZ),))


def clean(seed: int) -> np.ndarray:
    return noise(seed, 0.01, pole=0.0) + lines() + impacts(seed, BPFO, size=1.5)


def through_the_chain(x: np.ndarray, seed: int) -> np.ndarray:
    passed = sosfilt(butter(2, CORNER_HZ, fs=RATE_HZ, output="sos"), x) * 10 ** (GAIN_DB / 20)
    return passed + noise(seed + 7000, NOISE_STD, pole=0.0)


@cache
def both():
    """Features of records through the chain, and of others without it."""
    real = [record(through_the_chain(clean(seed), seed)) for seed in range(4)]
    plan = plan_of(view(real[0]))
    model = [record(clean(seed)) for seed in range(50, 54)]
    return [measured(one, plan) for one in real], [measured(one, plan) for one in model]


def differences(domain: str, nuisance: Nuisance | str | None) -> np.ndarray:
    """Measured less simulated without a chain, through a given one, or ("fitted") the best of each record."""
    rows = []
    for real, model in zip(*both(), strict=True):
        chain = fit_nuisance(real, model) if nuisance == "fitted" else nuisance
        shown = model if chain is None else apply(chain, model)
        use = (real.stands_out | shown.stands_out) & np.isfinite(real.level_db) & np.isfinite(shown.level_db)
        # Elements that slip at random scatter the height of passages by more, which seeds tell.
        use &= np.array([p.domain == domain and p.kind not in ("ratio", "passage") for p in real.places])
        rows.append((real.level_db - shown.level_db)[use])
    return np.concatenate(rows)


# What is left is the sampling of both sides (0.3 dB in a band, 0.5 to 1 dB of a modulation) and, of what
# noise dilutes, the colour within a band.
@pytest.mark.parametrize(
    ("domain", "most_db"),
    [("psd", 0.8), ("orders", 0.6), ("statistics", 0.7), ("envelope", 2.0), ("cyclic", 2.5)],
)
def test_the_chain_does_to_levels_what_it_does_to_samples(domain, most_db):
    without, through = (np.sqrt(np.mean(differences(domain, n) ** 2)) for n in (None, TRUE))
    assert through < most_db
    assert through < 0.5 * without


def test_the_chain_is_found_from_levels():
    real, model = both()
    found = fit_nuisances(list(zip(real, model, strict=True))).of("b1_y")
    assert found.gain_db == pytest.approx(GAIN_DB, abs=0.3)
    assert found.corner_hz == pytest.approx(CORNER_HZ, rel=0.1)
    hz = np.array([200.0, 1000.0, 8000.0])
    assert 10 * np.log10(found.floor(hz)) == pytest.approx(DENSITY_DB, abs=1.0)


def test_a_found_chain_is_as_good_as_the_true_one():
    for domain in ("psd", "envelope", "statistics"):
        found, true = (np.sqrt(np.mean(differences(domain, n) ** 2)) for n in ("fitted", TRUE))
        assert found < 1.3 * true + 0.2, domain


def test_what_the_model_lacks_does_not_bend_the_chain():
    struck = record(noise(80) + lines() + impacts(80, BPFO))
    plan = plan_of(view(struck))
    real, model = measured(struck, plan), measured(record(noise(81) + lines()), plan)
    nuisance = fit_nuisance(real, model)
    assert abs(nuisance.of("b1_y").gain_db) < 0.5
    left = real.level_db - apply(nuisance, model).level_db
    for k, place in enumerate(plan.places):
        lacks = real.level_db[k] - model.level_db[k]
        # A floor of a few knots takes some of a wide resonance, and little of what stands out of it.
        if place.domain == "psd" and lacks > 6.0:
            assert left[k] > 0.6 * lacks, place.words()
        if place.label == f"1 x {BPFO_LABEL}" and real.stands_out[k]:
            assert left[k] > 0.8 * lacks > 3.0, place.words()


def test_an_ideal_chain_changes_nothing_and_a_gain_shifts_powers_alone():
    model = both()[1][0]
    same = apply(Nuisance((ChannelNuisance("b1_y"),)), model)
    np.testing.assert_allclose(same.level_db, model.level_db, atol=1e-9)
    np.testing.assert_allclose(same.levels.height_db, model.levels.height_db, atol=1e-9)
    louder = apply(Nuisance((ChannelNuisance("b1_y", 6.0),)), model)
    for k, place in enumerate(model.places):
        if not np.isfinite(model.level_db[k]):
            continue
        power = place.domain in ("orders", "psd") or place.kind in ("rms", "teeth")
        assert louder.level_db[k] - model.level_db[k] == pytest.approx(6.0 if power else 0.0, abs=1e-6)


def test_a_gain_that_is_believed_to_be_right_is_found_smaller():
    one = record(noise(82) + lines())
    plan = plan_of(view(one))
    quiet, loud = measured(one, plan), measured(record(4.0 * (noise(83) + lines())), plan)
    free, sure = (fit_nuisance(loud, quiet, Limits(std)).gains_db["b1_y"] for std in (10.0, 0.05))
    assert free == pytest.approx(20 * math.log10(4.0), abs=0.3)
    assert sure < free - 1.0


def test_noise_of_an_encoder_is_a_floor_and_no_gain():
    torsion = ((1.0, 2e-3), (32.0, 5e-4), (64.0, 4e-7))
    exact = with_encoder(record(noise(84)), torsion)
    (train,) = exact.encoders
    shaken = np.sort(train.samples + 0.05 * np.random.default_rng(84).normal(size=train.samples.size))
    plan = plan_of(view(exact))
    real = measured(replace(exact, encoders=(replace(train, samples=shaken),)), plan)
    model = measured(exact, plan)
    nuisance = fit_nuisance(real, model)
    assert nuisance.of("input").gain_db == 0.0
    shown = apply(nuisance, model)
    at = {"domain": "torsional", "channel": "input"}
    assert level(model, **at, kind="line", at=64.0)[0] < level(real, **at, kind="line", at=64.0)[0] - 10
    for kind, where in (("floor", {}), ("line", {"at": 32.0}), ("line", {"at": 64.0})):
        seen, std = level(real, **at, kind=kind, **where)
        assert level(shown, **at, kind=kind, **where)[0] == pytest.approx(seen, abs=3 * std + 1.5)


def test_places_must_be_the_same():
    real, model = both()
    some = model[0].where(np.arange(len(model[0].places)) < 10)
    with pytest.raises(InputError, match="places"):
        fit_nuisance(real[0], some)
    with pytest.raises(InputError, match="pairs"):
        fit_nuisances([])


def test_noise_makes_bursts_steady_and_two_halves_alike_as_the_formulas_say():
    """A signal that is nearly always silent, loud at the end and lopsided, beside noise as strong as it."""
    t = np.linspace(0.0, 1.0, noise(90).size)
    bursts = 3.0 * np.abs(noise(90)) * ((np.arange(t.size) // 4000) % 4 == 0) * (0.6 + 0.8 * t)
    bursts -= bursts.mean()
    hiss = bursts.std() * noise(91, pole=0.0) / noise(91, pole=0.0).std()
    plan = plan_of(view(record(bursts)))
    alone, both = features(view(record(bursts)), plan), features(view(record(bursts + hiss)), plan)
    density_db = 10 * math.log10(2 * float(hiss.var()) / RATE_HZ)
    shown = apply(Nuisance((ChannelNuisance("b1_y", floor_db=(density_db,)),)), alone)
    kinds = ("fluctuation", "quiet", "loud", "asymmetry")
    for k, place in enumerate(plan.places):
        if place.kind in kinds:
            assert abs(alone.level_db[k] - both.level_db[k]) > 1.0, place.kind
            assert shown.level_db[k] == pytest.approx(both.level_db[k], abs=0.5), place.kind
