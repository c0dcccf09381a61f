"""Levels of the seven domains against closed forms."""

import math
import time

import numpy as np
import pytest
from compare_signals import (
    DECAY_S,
    RATE_HZ,
    RESONANCE_HZ,
    SECONDS,
    SPEED_HZ,
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

from gearsim_dsp.kinematics import bearing_orders
from gearsim_io.errors import InputError
from gearsim_twin.compare.features import features
from gearsim_twin.compare.places import DOMAINS, Place

BPFO = bearing_orders(machine().bearings[0]).bpfo
BPFO_LABEL = "BPFO of bearing_1 and 3 alike"


def test_the_level_of_a_line_is_its_mean_square_wherever_it_lies_between_bins():
    table = ((1, 0.3), (3, 0.05), (32, 0.8), (33, 0.02), (64.0, 0.004))
    found = measured(record(noise(1, 0.002) + lines(table=table)))
    for order, amplitude in table:
        value, std = level(found, domain="orders", at=float(order))
        # the resampling's taps and the rounding of bins: 0.05 dB; noise: three deviations
        assert value == pytest.approx(20 * math.log10(amplitude / math.sqrt(2)), abs=0.05 + 3 * std)


def test_noise_between_lines_has_the_density_of_its_filter():
    found = measured(record(noise(2) + lines()))
    hz = np.array([p.at for p in found.places if p.domain == "psd"])
    rows = np.array([p.domain == "psd" for p in found.places])
    response = 1 / np.abs(1 - 0.5 * np.exp(-2j * np.pi * hz / RATE_HZ)) ** 2
    expected = 10 * np.log10(0.2**2 * response * 2 / RATE_HZ)
    z = (found.level_db[rows] - expected) / found.std_db[rows]
    wide = hz < 8000  # above, the density bends within a band
    assert np.abs(np.mean(z[wide])) < 0.5
    assert np.std(z[wide]) == pytest.approx(1.0, abs=0.35)


def test_a_strange_tone_is_found_with_its_frequency_and_taken_out_of_the_noise():
    t = np.arange(int(SECONDS * RATE_HZ)) / RATE_HZ
    tone = 0.05 * np.sin(2 * np.pi * 1237.3 * t)
    plain = measured(record(noise(3) + lines()))
    found = measured(record(noise(3) + lines() + tone))
    (place,) = [p for p in found.places if p.kind == "tone"]
    assert place.unit == "Hz"
    assert place.at == pytest.approx(1237.3, abs=0.2)
    value, std = level(found, kind="tone")
    # five bins of noise under it add 0.2 dB
    assert value == pytest.approx(20 * math.log10(0.05 / math.sqrt(2)) + 0.2, abs=0.1 + 3 * std)
    assert not [p for p in plain.places if p.kind == "tone"]
    near = [p.at for p in found.places if p.domain == "psd" and abs(p.at - 1237.3) < p.width / 2]
    before, after = (level(f, domain="psd", at=near[0])[0] for f in (plain, found))
    assert after == pytest.approx(before, abs=0.3)


def test_what_a_simulation_without_noise_shows_far_below_the_measured_noise_is_no_place():
    t = np.arange(int(SECONDS * RATE_HZ)) / RATE_HZ
    faint = sum(1e-4 * np.sin(2 * np.pi * (2003.7 + 83 * k) * t) for k in range(20))
    loud = 0.05 * np.sin(2 * np.pi * 6137.3 * t)
    clear, strange = (
        view(record(noise(25) + 0.05 * np.sin(2 * np.pi * 1237.3 * t))),
        view(record(faint + loud)),
    )
    alone = [p.at for p in plan_of(strange).places if p.kind == "tone" and p.domain == "orders"]
    assert len(alone) == 10
    both = [p.at for p in plan_of(clear, strange).places if p.kind == "tone" and p.domain == "orders"]
    assert sorted(both) == pytest.approx([1237.3, 6137.3], abs=0.2)


def test_a_tone_beside_the_lines_of_a_bearing_is_still_a_tone():
    t = np.arange(int(SECONDS * RATE_HZ)) / RATE_HZ
    strikes = impacts(26, BPFO, jitter=0.0)
    hidden = 0.1 * np.sin(2 * np.pi * 3955.2 * t)
    found = measured(record(0.3 * noise(26) + lines() + strikes + hidden))
    assert np.isfinite(level(found, kind="ratio", label=BPFO_LABEL)[0])
    named = [p for p in found.places if p.kind == "tone" and p.domain == "orders" and p.label == "tone"]
    assert [p.at for p in named if abs(p.at - 3955.2) < 0.3]


def test_a_whirl_below_a_turn_is_a_tone_and_a_supply_has_its_name():
    t = np.arange(int(SECONDS * RATE_HZ)) / RATE_HZ
    found = measured(record(noise(4) + lines() + 0.1 * np.sin(2 * np.pi * 4.3 * t), noise(5)))
    (whirl,) = [p for p in found.places if p.kind == "tone"]
    assert whirl.hz(SPEED_HZ) == pytest.approx(4.3, abs=0.15)
    humming = measured(record(noise(6) + 0.1 * np.sin(2 * np.pi * 150.0 * t)))
    (hum,) = [p for p in humming.places if p.kind == "tone"]
    assert "3 x 50 Hz of a supply" in hum.words()


def test_modulated_noise_shows_its_depth_in_the_envelope():
    """(1 + m cos) n has a squared envelope ~ 1 + m^2 / 2 + 2 m cos + ..: the line has 2 m^2 of it squared."""
    depth = 0.4
    t = np.arange(int(SECONDS * RATE_HZ)) / RATE_HZ
    x = noise(7) * (1 + depth * np.cos(2 * np.pi * BPFO * SPEED_HZ * t))
    found = measured(record(x))
    expected = 10 * math.log10(2 * depth**2 / (1 + depth**2 / 2) ** 2)
    seen = [
        (found.level_db[k], found.std_db[k])
        for k, p in enumerate(found.places)
        if p.domain == "envelope" and p.label == f"1 x {BPFO_LABEL}"
    ]
    assert len(seen) >= 2
    for value, std in seen:
        assert value == pytest.approx(expected, abs=3 * std + 0.1)


def test_stationary_noise_lies_where_the_law_of_gaussian_noise_says():
    found = measured(record(noise(8, pole=0.0), noise(9, pole=0.0)))
    for domain, spread in (("envelope", 1.0), ("cyclic", 0.6)):
        rows = np.array([p.domain == domain and p.kind != "ratio" for p in found.places])
        off = found.level_db[rows] - found.levels.gauss_db[rows]
        # The law is that of mean squares; the mean of few lines' decibels lies 0.2 dB lower.
        assert abs(10 * np.log10(np.mean(10 ** (0.1 * off)))) < 0.2, domain
        assert np.std(off) < spread + 0.5, domain
        assert not np.any(found.stands_out[rows & np.isfinite(found.levels.height_db)]), domain
    rows = np.array([p.kind == "kurtosis" for p in found.places])
    assert np.all(np.abs(found.level_db[rows] - found.levels.gauss_db[rows]) < 4 * found.std_db[rows])


@pytest.mark.parametrize("slip", [-0.008, 0.004])
def test_slip_moves_the_found_frequency_and_not_the_levels(slip):
    straight = record(noise(10) + lines() + impacts(10, BPFO))
    plan = plan_of(view(straight))
    first = measured(straight, plan)
    moved = measured(record(noise(11) + lines() + impacts(11, BPFO * (1 + slip))), plan)
    value, std = level(moved, kind="ratio", label=BPFO_LABEL)
    # of 245 gaps random by 0.3 % the mean is random by 0.02 %
    assert value == pytest.approx(100 * math.log1p(slip), abs=3 * math.hypot(std, 0.02))
    for k in (1, 2):
        rows = [
            i for i, p in enumerate(plan.places) if p.label == f"{k} x {BPFO_LABEL}" and first.stands_out[i]
        ]
        assert rows
        z = (moved.level_db[rows] - first.level_db[rows]) / np.hypot(moved.std_db[rows], first.std_db[rows])
        assert np.all(np.abs(z) < 4)


def test_families_that_are_not_there_say_nothing():
    found = measured(record(noise(12) + lines() + impacts(12, BPFO)))
    for k, place in enumerate(found.places):
        if place.kind == "ratio":
            there = place.label == BPFO_LABEL
            assert np.isfinite(found.level_db[k]) == there, place.label
            assert np.isfinite(found.std_db[k]) == there


@pytest.mark.parametrize("seed", [30, 31, 32])
def test_lines_of_one_family_are_no_evidence_for_another(seed):
    """On this bearing 2 BSF - FTF is within 1.5 % of BPFO, so regular strikes look like both."""
    found = measured(record(0.3 * noise(seed) + lines() + impacts(seed, BPFO, jitter=0.0)))
    clear = [
        p.label for k, p in enumerate(found.places) if p.kind == "ratio" and np.isfinite(found.level_db[k])
    ]
    assert clear == [BPFO_LABEL]


def test_an_averaged_burst_has_the_decay_and_the_frequency_of_its_resonance():
    found = measured(record(0.1 * noise(13) + impacts(13, BPFO)))
    t = np.arange(int(SECONDS * RATE_HZ)) / RATE_HZ
    humming = measured(record(0.1 * noise(13) + impacts(13, BPFO) + 1.5 * np.sin(2 * np.pi * 2700.0 * t)))
    for one in (found, humming):
        centre, _ = level(one, domain="transient", kind="centre", label=BPFO_LABEL)
        assert 1e3 * 10 ** (centre / 10) == pytest.approx(RESONANCE_HZ, rel=0.05)
    decay, _ = level(found, domain="transient", kind="decay", label=BPFO_LABEL)
    # (sum a)^2 / sum a^2 of exp(-2 t / tau) is tau; smoothing over 0.25 ms and the band's width lengthen it
    assert DECAY_S < 1e-3 * 10 ** (decay / 10) < 1.5 * DECAY_S
    longer = measured(record(0.1 * noise(13) + impacts(13, BPFO, decay_s=3 * DECAY_S)))
    more, _ = level(longer, domain="transient", kind="decay", label=BPFO_LABEL)
    assert more - decay == pytest.approx(10 * math.log10(3), abs=1.2)


def test_two_impacts_in_a_period_are_told_by_their_spacing():
    one = impacts(14, BPFO)
    later = np.concatenate((np.zeros(round(0.005 * RATE_HZ)), 0.7 * one))[: one.size]
    found = measured(record(0.1 * noise(14) + one + later))
    spacing, _ = level(found, domain="transient", kind="spacing", label=BPFO_LABEL)
    assert 1e-3 * 10 ** (spacing / 10) == pytest.approx(0.005, rel=0.05)
    single = measured(record(0.1 * noise(14) + one))
    assert np.isnan(level(single, domain="transient", kind="spacing", label=BPFO_LABEL)[0])


def test_an_encoder_shows_torsion_in_radians():
    table = ((1.0, 2e-3), (32.0, 5e-4))
    found = measured(with_encoder(record(noise(15)), table))
    for order, amplitude in table[1:]:
        value, _ = level(found, domain="torsional", channel="input", kind="line", at=order)
        assert value == pytest.approx(20 * math.log10(amplitude / math.sqrt(2)), abs=0.1)
    # what is slower than four turns counts as the even rotation, and takes a little of the first order
    value, _ = level(found, domain="torsional", channel="input", kind="line", at=1.0)
    assert value == pytest.approx(20 * math.log10(2e-3 / math.sqrt(2)), abs=0.5)
    assert not [p for p in measured(record(noise(15))).places if p.domain == "torsional" and p.kind == "line"]


def test_unsteadiness_is_seen_where_it_is():
    t = np.linspace(0, 1, int(SECONDS * RATE_HZ))
    rising = measured(record(noise(16) * 10 ** (6 * t / 20)))
    assert level(rising, kind="drift")[0] == pytest.approx(6.0, abs=0.2)
    gap = noise(17)
    gap[20000:30000] *= 0.03
    broken = measured(record(gap))
    assert level(broken, kind="quiet")[0] < -20
    lopsided = noise(18)
    lopsided = np.where(lopsided > 0, lopsided, 0.5 * lopsided)
    up, down = (level(measured(record(x)), kind="asymmetry")[0] for x in (lopsided, -lopsided))
    assert up > 1.5
    assert down == pytest.approx(-up, abs=1e-6)


def test_what_repeats_with_the_turn_does_not_make_a_level_unsure():
    found = measured(record(lines(1.7, table=((1, 1.0), (2, 0.7)))))
    for kind in ("rms", "kurtosis"):
        _, std = level(found, domain="statistics", kind=kind, band_hz=None)
        assert std == pytest.approx(0.03)


def test_places_are_few_hundred_and_a_view_costs_less_than_half_a_second():
    quick = np.repeat(noise(19, seconds=2.5), 4), np.repeat(noise(20, seconds=2.5), 4)
    one = record(*(x + 0.1 * noise(21, seconds=10.0) for x in quick))  # as many samples as 5 s at 51200 Hz
    seen = view(one)
    plan = plan_of(seen)
    assert 150 < len(plan.places) < 600
    assert {p.domain for p in plan.places} == set(DOMAINS)
    features(seen, plan)
    begin = time.process_time()
    features(seen, plan)
    assert time.process_time() - begin < 0.5


def test_a_record_without_speed_is_compared_by_what_needs_none():
    one = record(noise(22))
    silent = type(one)(RATE_HZ, ("b1_y",), "1", one.data)
    seen = view(silent)
    unknown = type(seen)(silent, seen.machine, type(seen.speed)(math.nan, (math.nan, math.nan), "nameplate"))
    found = features(unknown, plan_of(unknown))
    assert {p.domain for p in found.places} == {"psd", "statistics"}
    assert np.all(np.isfinite(found.level_db))


def test_records_that_cannot_be_compared_are_refused():
    plan = plan_of(view(record(noise(23), noise(24))))
    with pytest.raises(InputError, match="b2_y"):
        features(view(record(noise(23))), plan)
    with pytest.raises(InputError, match="duration"):
        plan_of(view(record(noise(23, seconds=0.2))))
    with pytest.raises(InputError, match="channels"):
        plan_of(view(record(noise(23))), view(record(noise(23), channels=("b3_y",))))
    with pytest.raises(InputError, match="domain"):
        Place("colour", "b1_y", "line", 1.0, "order", 0.1)  # type: ignore[arg-type]


def test_places_are_told_in_plain_words():
    place = Place("envelope", "a", "line", 4.84, "order", 0.1, "1 x BPFO of bearing_3", (6e3, 12e3))
    assert place.words(10.0) == (
        "line 1 x BPFO of bearing_3 (48.4 Hz, order 4.84) in the 6-12 kHz envelope of a"
    )
