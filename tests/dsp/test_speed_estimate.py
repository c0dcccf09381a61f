import numpy as np
import pytest
from bearing_signals import machine, noise, rotating_lines, turns_of

from gearsim_dsp.evidence import EvidencePool
from gearsim_dsp.speed import nameplate_speed
from gearsim_dsp.window import WindowInput, analyse_window
from gearsim_io.machines import load_machine

RATE = 12_000.0


def _estimate(x, plate, seconds=2.0):
    pool = EvidencePool(plate)
    length = round(seconds * RATE)
    for start in range(0, x.size - length + 1, length // 4):
        part = WindowInput(x[start : start + length], RATE, "ch_1", start, nameplate_speed(plate), plate)
        pool.add([analyse_window(part)])
    return pool.speed()


@pytest.mark.parametrize("true_hz", [24.6, 24.87, 25.0, 25.33])
def test_speed_is_found_in_shaft_harmonics(true_hz):
    rng = np.random.default_rng(round(1000 * true_hz))
    turns = turns_of(true_hz, 4.0, RATE)
    x = noise(rng, turns.size, 0.6) + rotating_lines(turns, {1: 0.15, 2: 0.1, 3: 0.12, 5: 0.08})
    speed = _estimate(x, machine())
    assert speed.source == "estimated"
    assert speed.value_hz == pytest.approx(true_hz, rel=2e-3)
    assert speed.ci95_hz[0] <= true_hz <= speed.ci95_hz[1]


def test_noise_gives_the_nameplate_and_the_reason():
    found = [
        _estimate(noise(np.random.default_rng(seed), 24_000, 0.6), machine()).source for seed in range(60)
    ]
    assert found.count("estimated") <= 2
    speed = _estimate(noise(np.random.default_rng(0), 24_000), machine())
    assert speed.source == "nameplate"
    assert "no shaft lines" in speed.note
    assert speed.ci95_hz == pytest.approx((24.5, 25.5))


def test_a_mesh_line_sharpens_the_estimate():
    plate = load_machine("unsw_parallel")
    turns = turns_of(10.13, 4.0, RATE)
    x = noise(np.random.default_rng(1), turns.size) + rotating_lines(
        turns, {1: 0.06, 2: 0.06, 32: 0.2, 64: 0.1}
    )
    speed = _estimate(x, plate)
    assert speed.value_hz == pytest.approx(10.13, rel=3e-4)
    assert speed.relative_error < 1e-3


def test_supply_lines_alone_do_not_make_a_speed_with_wrong_certainty():
    """49.7 Hz is nearly twice 25: the estimate may follow it, but a 60 Hz supply must not be followed."""
    t = np.arange(48_000) / RATE
    x = noise(np.random.default_rng(2), t.size) + 0.3 * sum(
        np.cos(2 * np.pi * 60 * k * t) for k in range(1, 6)
    )
    speed = _estimate(x, machine())
    assert speed.source == "nameplate" or speed.ci95_hz[0] <= 25.0 <= speed.ci95_hz[1]


def test_speed_over_windows_is_their_mean_with_a_tacho():
    from gearsim_dsp.speed import Phase, ShaftSpeed

    plate = machine(tacho=True)
    pool = EvidencePool(plate)
    x = noise(np.random.default_rng(3), 24_000)
    for start, value in ((0, 24.0), (24_000, 26.0)):
        phase = Phase(np.array([0.0, 23_999.0]), np.array([0.0, value * 23_999 / RATE]))
        speed = ShaftSpeed(value, (value - 0.01, value + 0.01), "tacho", phase)
        pool.add([analyse_window(WindowInput(x, RATE, "ch_1", start, speed, plate))])
    assert pool.speed().value_hz == pytest.approx(25.0)
    assert pool.speed().source == "tacho"


@pytest.mark.parametrize("error", [-0.04, 0.035])
def test_a_nameplate_that_is_off_is_corrected(error):
    rng = np.random.default_rng(4)
    turns = turns_of(25.0, 4.0, RATE)
    x = noise(rng, turns.size) + rotating_lines(turns, {1: 0.3, 2: 0.3, 3: 0.3, 4: 0.2})
    speed = _estimate(x, machine(25.0 / (1 + error)))
    assert speed.source == "estimated"
    assert speed.value_hz == pytest.approx(25.0, rel=1e-3)


def test_the_mesh_of_a_planetary_stage_sharpens_the_estimate():
    plate = load_machine("unsw_planetary")
    stage = plate.planetary_stages[0]
    order = stage.ring_teeth * plate.shaft(stage.carrier_shaft).ratio
    nominal = plate.nominal_speed_hz
    turns = turns_of(1.008 * nominal, 8.0, RATE)
    lines = {order: 0.5, 2 * order: 0.3, 3 * order: 0.2, 1: 0.3, 2: 0.2}
    x = noise(np.random.default_rng(8), turns.size) + rotating_lines(turns, lines)
    speed = _estimate(x, plate, 4.0)
    assert speed.source == "estimated"
    # A tenth of a line of the mesh: 0.025 Hz in 172; of the shaft's own lines it would be 6e-3.
    assert speed.value_hz == pytest.approx(1.008 * nominal, rel=1.5e-4)
