import numpy as np
import pytest
from bearing_signals import noise, rotating_lines, turns_of

from gearsim_dsp.electrical import find_electrical_lines
from gearsim_dsp.quality import check_samples

RATE = 12_000.0


def _kinds(x):
    return [issue.issue for issue in check_samples(np.asarray(x, dtype=np.float32), "ch")]


def test_a_sound_signal_has_no_issue():
    for seed in range(20):
        assert _kinds(noise(np.random.default_rng(seed), 24_000)) == []


def test_coarse_quantisation_is_no_dropout():
    x = np.round(4 * noise(np.random.default_rng(1), 24_000)) / 4
    assert _kinds(x) == []


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_not_finite(value):
    x = noise(np.random.default_rng(1), 1000)
    x[[100, 200]] = value
    (issue,) = check_samples(x, "ch")
    assert issue.issue == "not_finite"
    assert issue.fatal
    assert "2 of 1000" in issue.detail
    assert "100" in issue.detail


@pytest.mark.parametrize(
    ("x", "kind"),
    [
        (np.zeros(1000), "constant_channel"),
        (np.full(1000, 3.5), "constant_channel"),
        (np.arange(10.0), "too_short"),
    ],
)
def test_fatal_issues(x, kind):
    (issue,) = check_samples(x, "ch")
    assert (issue.issue, issue.fatal) == (kind, True)


def test_clipping_is_seen_and_the_limits_named():
    x = np.clip(noise(np.random.default_rng(2), 24_000, 0.9), -1.5, 1.5)
    (issue,) = check_samples(x, "ch")
    assert issue.issue == "clipping"
    assert not issue.fatal
    assert "1.5" in issue.detail


def test_one_sided_clipping_is_seen():
    assert _kinds(np.minimum(noise(np.random.default_rng(3), 24_000, 0.9), 1.2)) == ["clipping"]


def test_a_held_value_is_a_dropout():
    x = noise(np.random.default_rng(4), 24_000)
    x[5000:5200] = x[5000]
    (issue,) = check_samples(x, "ch")
    assert issue.issue == "dropout"
    assert "200" in issue.detail


def test_json_has_the_three_keys_of_the_contract():
    (issue,) = check_samples(np.zeros(100), "ch")
    assert set(issue.to_json()) == {"issue", "channel", "detail"}


def _turning(seconds=5.0):
    turns = turns_of(24.2, seconds, RATE)
    lines = rotating_lines(turns, dict.fromkeys(range(1, 9), 0.2))
    return noise(np.random.default_rng(5), turns.size) + lines, np.arange(turns.size) / RATE


@pytest.mark.parametrize("supply", [49.97, 60.02])
def test_supply_lines_are_named(supply):
    x, t = _turning()
    x = x + 0.1 * sum(np.cos(2 * np.pi * supply * k * t) for k in (1, 2, 3, 4, 6, 8))
    found = find_electrical_lines(x, RATE, 0.0, [24.2])
    assert found.supply_hz == pytest.approx(supply, abs=0.5)
    assert len(found.supply_lines_hz) >= 5
    assert found.supply_lines_hz[1] == pytest.approx(2 * supply, abs=0.1)


def test_shaft_lines_are_not_taken_for_the_supply():
    x, _ = _turning()
    found = find_electrical_lines(x, RATE, 0.0, [24.2])
    assert found.supply_lines_hz == ()
    assert found.carriers_hz == ()


def test_an_inverter_carrier_is_named():
    x, t = _turning()
    x = x + 0.5 * np.cos(2 * np.pi * 2500.4 * t) + 0.3 * np.cos(2 * np.pi * 5000.8 * t)
    found = find_electrical_lines(x, RATE, 0.0, [24.2])
    assert found.carriers_hz == pytest.approx((2500.4,), abs=0.2)


def test_a_short_signal_says_nothing():
    assert find_electrical_lines(np.zeros(1000), RATE).supply_hz == 0.0


def test_harmonics_of_a_mesh_whose_speed_is_not_known_well_are_no_inverter():
    """32 teeth at 12.5 Hz pass at 400 Hz: each fifth harmonic is a multiple of 500 Hz and has its double."""
    t = np.arange(round(6 * RATE)) / RATE
    x = noise(np.random.default_rng(6), t.size)
    x = x + sum(3.0 / k**0.5 * np.cos(2 * np.pi * 400.0 * k * t + k) for k in range(1, 15))
    known = find_electrical_lines(x, RATE, 0.0, [12.5, 400.0], 1e-4)
    unknown = find_electrical_lines(x, RATE, 0.0, [12.7, 406.4], 1e-3)
    assert known.carriers_hz == unknown.carriers_hz == ()


def test_a_carrier_among_mesh_harmonics_is_named():
    t = np.arange(round(6 * RATE)) / RATE
    x = noise(np.random.default_rng(7), t.size)
    x = x + sum(3.0 / k**0.5 * np.cos(2 * np.pi * 385.0 * k * t + k) for k in range(1, 15))
    x = x + 2.0 * np.cos(2 * np.pi * 2500.0 * t) + np.cos(2 * np.pi * 5000.0 * t)
    assert find_electrical_lines(x, RATE, 0.0, [12.0], 1e-3).carriers_hz == pytest.approx((2500.0,), abs=0.1)
