"""Pits, rough zones and waviness: paths drawn in the plane, smoothness, randomness."""

import math

import numpy as np
import pytest

from gearsim_sim.model.periodic import PeriodicSeries
from gearsim_sim.model.pit import (
    element_edge,
    inside_fraction,
    race_edge,
    rounded_drop,
    wide_pit_path,
)
from gearsim_sim.model.surface import (
    ball_series,
    bucket,
    normal_numbers,
    rough_series,
    rough_zone,
    table_lookup,
    waviness_series,
)

BALL, OUTER, INNER = 3.56e-3, 22.81e-3, 15.69e-3


def lowest_race_pit(offset, half_width, race, inner, rounding):
    """How far a circle goes down over a pit with edges of this rounding, by search along the boundary."""
    side = 1 if inner else -1  # of the ball, seen from the race
    below = race - side * rounding
    centres = below * np.exp(1j * np.array([-1, 1]) * half_width)
    way = np.exp(1j * offset)
    reach = BALL + rounding

    def touches(drop):
        return np.abs((race + side * (BALL - drop)) * way - centres).min() < reach

    low, high = 0.0, 1e-3
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if touches(middle) else (middle, high)
    return low


@pytest.mark.parametrize(("inner", "race"), [(False, OUTER), (True, INNER)])
@pytest.mark.parametrize("rounding", [0.0, 0.2e-3])
def test_race_pit_against_a_circle_let_down(inner, race, rounding):
    half = 0.6e-3 / race
    edge = race_edge(race, BALL, inner=inner, rounding_m=rounding)
    for offset in np.linspace(-0.95, 0.95, 9) * half:
        expected = lowest_race_pit(offset, half, race, inner, rounding)
        assert rounded_drop(offset, half, 1.0, edge) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(("inner", "race"), [(False, OUTER), (True, INNER)])
def test_ball_pit_against_a_circle_without_an_arc(inner, race):
    """The pit's edges are points of the ball; it comes down until one of them touches the race."""
    half = 0.5e-3 / BALL
    edge = element_edge(race, BALL, inner=inner)
    side = 1 if inner else -1
    for turned in np.linspace(-0.95, 0.95, 9) * half:
        toward_race = -side * np.exp(1j * (turned + np.array([-half, half])))
        corners = BALL * toward_race

        def overlap(drop, corners=corners):
            distance = np.abs(race + side * (BALL - drop) + corners)
            return np.any(distance < race) if inner else np.any(distance > race)

        low, high = 0.0, 1e-3
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if overlap(middle) else (middle, high)
        assert rounded_drop(turned, half, 1.0, edge) == pytest.approx(low, abs=1e-12)


def test_average_over_a_step_is_the_integral():
    """The mean of the jumping function over a step, by quadrature, for every position of the jumps."""
    rng = np.random.default_rng(1)
    for _ in range(50):
        half, travel, offset = rng.uniform(0.5, 3), rng.uniform(0.1, 4), rng.uniform(-5, 5)
        fine = offset + travel * (np.arange(20000) + 0.5) / 20000 - travel / 2
        expected = np.mean(np.abs(fine) < half)
        assert inside_fraction(offset, half, travel) == pytest.approx(expected, abs=2e-4)
    assert inside_fraction(0.1, 1.0, 0.0) == 1.0
    assert inside_fraction(-1.5, 1.0, 0.0) == 0.0


def test_averaged_jumps_have_the_right_sum_wherever_they_fall():
    """A pit crossed in 7.3 steps weighs 7.3, however the steps lie; plain switching gives 7 or 8."""
    for start in np.linspace(0, 1, 11):
        steps = np.arange(-20, 20) + start
        assert sum(inside_fraction(s, 3.65, 1.0) for s in steps) == pytest.approx(7.3, abs=1e-12)
    assert {sum(inside_fraction(s, 3.65, 0.0) for s in np.arange(-20, 20) + start) for start in (0, 0.5)} == {
        7.0,
        8.0,
    }


def test_wide_pit_has_entry_floor_and_exit():
    half, depth, patch = 8e-3 / OUTER, 30e-6, 0.1e-3 / OUTER
    edge = race_edge(OUTER, BALL, inner=False)
    span, path = wide_pit_path(half, depth, edge, patch, 4000)
    offsets = np.linspace(-span, span, path.size)
    assert path == pytest.approx(path[::-1], abs=1e-12)
    exact = np.array([rounded_drop(offset, half, depth, edge) for offset in offsets])
    # the window spans 0.1 mm: where the path is curved by 1/r' only, it lifts it by patch^2 / (18 r')
    inside = np.abs(np.abs(offsets) - half + 0.25e-3 / OUTER) < 0.1e-3 / OUTER
    assert path[inside] == pytest.approx(exact[inside], abs=(0.1e-3) ** 2 / 18 / BALL * 1.3)
    floor = np.abs(offsets) < half - 1.0e-3 / OUTER
    assert path[floor] == pytest.approx(depth, rel=1e-9)
    assert path[0] == path[-1] == 0.0
    # no corner anywhere: the slope changes by less than a tenth of the corner's within a tenth of the patch
    slope = np.gradient(path, offsets)
    step = max(1, int(0.1 * patch / (offsets[1] - offsets[0])))
    corner = np.abs(np.gradient(exact, offsets)).max()
    assert np.abs(slope[step:] - slope[:-step]).max() < 0.12 * corner


def test_bucket_begins_and_ends_with_all_derivatives_zero():
    """Faster than any power: at a tenth of the wall less than 1e-3, at a hundredth below 1e-40."""
    x = np.array([0.0, 1e-2, 1e-1, 1.0, 5.0, 9.0, 9.9, 9.99, 10.0])
    value = bucket(x, 10.0, 1.0)
    assert value[[0, -1]] == pytest.approx(0, abs=0)
    assert value[3:6] == pytest.approx(1, abs=1e-15)
    assert value[2] < 2e-4
    assert value[1] < 1e-40
    assert value == pytest.approx(value[::-1], rel=1e-9)


def test_rough_surface_is_gaussian_band_limited_and_seeded():
    circumference, rms, cutoff = 0.1, 1e-6, 0.5e-3
    series = rough_series(7, "fault", circumference, rms, cutoff)
    again = rough_series(7, "fault", circumference, rms, cutoff)
    assert np.array_equal(series.cosine, again.cosine)
    assert not np.array_equal(series.cosine, rough_series(8, "fault", circumference, rms, cutoff).cosine)
    assert not np.array_equal(series.cosine, rough_series(7, "other", circumference, rms, cutoff).cosine)
    values = series.value(np.arange(8192) / 8192)
    # 2 x 240 effective degrees of freedom: 3 sigma of the rms is 3 / sqrt(2 x 480) = 10 %
    assert values.std() == pytest.approx(rms, rel=0.1)
    wavelengths = circumference / series.orders
    power = series.cosine**2 + series.sine**2
    long, at = power[wavelengths > 3 * cutoff].mean(), power[np.abs(wavelengths / cutoff - 1) < 0.1].mean()
    assert at / long == pytest.approx(0.25 / 0.93, rel=0.5)  # one half of the amplitude at the cutoff
    assert power[wavelengths < 0.4 * cutoff].max() < 1e-3 * long


def test_rough_zone_table_is_the_surface_in_the_bucket():
    circumference, length, wall, depth, cutoff = 0.1, 12e-3, 2e-3, 10e-6, 0.5e-3
    series = rough_series(3, "fault", circumference, 1e-6, cutoff)
    table = rough_zone(series, circumference, length, wall, depth, cutoff)
    at = np.random.default_rng(0).uniform(0, 1, 500)
    rough = series.value(at * length / circumference)
    expected = bucket(at * length, length, wall) * (depth + rough)
    # interpolation 1.2e-5 of the roughness at the cutoff, 1e-3 of the little beyond it, slopes alike
    assert table_lookup(table, at) == pytest.approx(expected, abs=1e-10)


def test_odd_lobes_of_a_ball_do_not_lift_it():
    """Diameters through the centre, measured: constant for odd lobes, doubled for even ones."""
    radius = waviness_series((3, 4), (1e-6, 2e-6), np.array([0.3, 1.1]))
    both = ball_series(radius)
    turns = np.linspace(0, 1, 50)
    assert both.value(turns) == pytest.approx(radius.value(turns) + radius.value(turns + 0.5), abs=1e-18)


def test_waviness_has_the_orders_and_amplitudes_asked_for():
    series = waviness_series((5, 13), (1e-6, 3e-7), np.array([0.2, -1.0]))
    spectrum = np.fft.rfft(series.value(np.arange(64) / 64)) / 32
    assert abs(spectrum[5]) == pytest.approx(1e-6)
    assert abs(spectrum[13]) == pytest.approx(3e-7)
    assert np.angle(spectrum[5]) == pytest.approx(0.2)


def test_table_look_up_is_the_series():
    series = PeriodicSeries(0.1, np.array([2, 5]), np.array([1.0, 0.3]), np.array([-0.5, 0.2]))
    at = np.array([0.0, 0.123, 0.999, 1.0])
    # (2 pi / 48)^4 / 384 of the highest order's amplitude
    assert table_lookup(series.table(), at) == pytest.approx(series.value(at), abs=1e-6)


def test_numbers_depend_on_seed_and_name_only():
    assert np.array_equal(normal_numbers(1, "a", 5), normal_numbers(1, "a", 9)[:5])
    assert not np.any(normal_numbers(1, "a", 5) == normal_numbers(2, "a", 5))


def test_drop_is_cut_off_at_the_floor_and_far_inside():
    edge = race_edge(OUTER, BALL, inner=False)
    assert rounded_drop(0.0, 1.0, 20e-6, edge) == 20e-6
    assert math.isfinite(rounded_drop(0.0, 3.0, 1.0, edge))
