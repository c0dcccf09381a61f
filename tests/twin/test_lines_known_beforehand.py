"""Lines of known places and heights; hum that hides beside orders; noise between lines."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from gearsim_dsp.spectra import welch_psd
from gearsim_io.machines import load_machine
from gearsim_io.record import PulseTrain, Record
from gearsim_twin.causes import CAUSES
from gearsim_twin.causes.between_lines import between_lines, noise_density
from gearsim_twin.causes.coloured_floor import floor_db
from gearsim_twin.causes.context import Context
from gearsim_twin.causes.expected_lines import odds_of_lines, odds_of_sine
from gearsim_twin.causes.hum_in_all import hum_in_all
from gearsim_twin.causes.lines import slow_part
from gearsim_twin.choices import Candidate
from gearsim_twin.holdout import Gain
from gearsim_twin.stated_floor import without_floor
from gearsim_twin.view import View, view_of

RATE_HZ, SECONDS = 4096.0, 1.6
T = np.arange(int(RATE_HZ * SECONDS)) / RATE_HZ
PARTS = {1: 1.0, 3: 0.5, 5: 0.3}
HUM = {"amplitude_m_s2": 0.02, "frequency_hz": 50.0, "part:3": 0.5, "part:5": 0.3, "share:accel": 1.0}


def _view(samples: NDArray[np.float64], shaft_hz: float = 24.0) -> View:
    pulses = np.arange(0.3, shaft_hz * SECONDS * 8 - 1) / (8 * shaft_hz) * RATE_HZ
    record = Record(
        sample_rate_hz=RATE_HZ,
        channels=("accel",),
        unit="m/s^2",
        data=samples.astype(np.float32)[None, :],
        tachos=(PulseTrain("shaft", 8.0, pulses),),
        machine="mfpt",
    )
    return view_of(record, load_machine("mfpt"))


def _hummed(shaft_hz: float, hum: float, seed: int, orders: float = 0.02, swell: float = 0.0) -> View:
    x = 0.01 * np.random.default_rng(seed).standard_normal(T.size)
    for k, part in PARTS.items():
        x += hum * part * np.cos(2 * np.pi * k * 50.0 * T + k + seed)
        level = orders * (1 + swell * np.cos(2 * np.pi * T / SECONDS))
        x += level * part * np.cos(2 * np.pi * 2 * k * shaft_hz * T + 0.7 * k)
    return _view(x, shaft_hz)


def _context(*views: View) -> Context:
    return cast(Context, SimpleNamespace(views=views[:1], more_views=views[1:]))


def test_odds_are_those_of_a_sine_of_unknown_phase() -> None:
    """Averaged over noise alone odds are 1 (as of any likelihood ratio); a sine that is there raises them."""
    rng = np.random.default_rng(3)
    found = rng.standard_normal((5000, 2))
    odds = np.exp([odds_of_sine(one, np.eye(2), np.array([1.5]))[0] for one in found])
    assert odds.mean() == pytest.approx(1.0, abs=4 * odds.std() / 5000**0.5)
    there = odds_of_lines([(6.0, np.array([6.0, 0.0]), np.eye(2)), (4.0, np.array([0.0, -4.0]), np.eye(2))])
    assert there == pytest.approx(0.5 * (36 + 16), abs=8.0)
    assert odds_of_lines([(6.0, np.array([0.5, 0.5]), np.eye(2))]) < -3.0


def test_hum_is_seen_again_only_where_it_is() -> None:
    """0.12 Hz beside order 2; the other record has the order alone, or hum a hundredth as high."""
    again = cast(Any, CAUSES["mains_interference"]).seen_again
    assert again(HUM, _context(_hummed(25.06, 0.02, 1))) > 20.0
    assert again(HUM, _context(_hummed(25.06, 0.0, 2))) < -5.0
    assert again(HUM, _context(_hummed(24.3, 2e-4, 3))) < -20.0


def test_a_converter_is_seen_again_only_where_it_is() -> None:
    values = {"amplitude_m_s2": 0.003, "carrier_hz": 1210.0, "output_hz": 31.0, "modulation": 0.6}
    values["share:accel"] = 1.0
    again = cast(Any, CAUSES["inverter_lines"]).seen_again
    noise = 0.01 * np.random.default_rng(5).standard_normal(T.size)
    lines = 0.003 * np.cos(2 * np.pi * 1210.0 * T) + 0.0008 * sum(
        np.cos(2 * np.pi * (1210.0 + n * 31.0) * T) for n in (-2, 2)
    )
    assert again(values, _context(_view(noise + lines))) > 10.0
    assert again(values, _context(_view(noise))) < -10.0


def test_hum_beside_an_order_is_told_by_two_records() -> None:
    """0.04 and 0.10 Hz apart: hidden in either record, not in both together."""
    found = hum_in_all(_context(_hummed(24.98, 0.02, 6), _hummed(25.05, 0.02, 7)), "accel", (50.0, 60.0))
    assert found is not None
    frequency, std, amplitude, amplitude_std = found
    assert abs(frequency - 50.0) < 3 * std < 0.05
    assert abs(amplitude[1] - 0.02) < 3 * amplitude_std
    assert amplitude[1] == pytest.approx(0.02, rel=0.35)


@pytest.mark.parametrize("swell", [0.0, 0.4])
def test_orders_alone_are_no_hum_in_two_records(swell: float) -> None:
    views = _hummed(24.98, 0.0, 8, 0.05, swell), _hummed(25.05, 0.0, 9, 0.05, -swell)
    assert hum_in_all(_context(*views), "accel", (50.0, 60.0)) is None


def test_noise_between_lines_is_read_without_bias() -> None:
    """Errors of bands of all widths average out; lines in a bin of 25 change little."""
    errors = []
    for seed in range(12):
        x = np.random.default_rng(seed).standard_normal(60000)
        psd = welch_psd(x, 1000.0, 0.05)
        edges = np.geomspace(2.0, 450.0, 30)
        level, std = noise_density(psd, np.ones(psd.density.size, dtype=bool), edges)
        psd.density[::25] *= 1e4
        lined, _ = noise_density(psd, np.ones(psd.density.size, dtype=bool), edges)
        assert np.nanmax(lined[20:] - level[20:]) < 0.5
        errors.append((level - 10 * np.log10(2.0 / 1000.0)) / std)
    mean = np.nanmean(errors, axis=0)
    assert np.nanmean(mean) == pytest.approx(0.0, abs=4 / np.sqrt(np.size(errors)))
    assert 0.7 < np.nanstd(errors) < 1.3


def test_a_floor_is_read_off_beside_orders_and_tones() -> None:
    """1/f noise, orders 40 dB over it; levels are those of the noise down to the lowest band."""
    rng, corner = np.random.default_rng(11), 200.0
    shape = np.fft.rfft(rng.standard_normal(T.size))
    f = np.fft.rfftfreq(T.size, 1 / RATE_HZ)
    shape[1:] *= np.sqrt(1 + corner / f[1:])
    noise = 0.01 * np.fft.irfft(shape, T.size)
    lines = sum(0.05 * np.cos(2 * np.pi * 24.0 * k * T) for k in range(1, 60))
    quiet = _view(1e-6 * rng.standard_normal(T.size))
    data = between_lines([(_view(noise + lines), quiet)], "accel")
    assert data is not None
    error = data.measured_db - floor_db(data.frequency_hz, 0.01 * (2 / RATE_HZ) ** 0.5, corner)
    assert np.mean(error / data.std_db) == pytest.approx(0.0, abs=4 / error.size**0.5)


def test_a_floor_that_a_cause_states_is_added_in_closed_form() -> None:
    row = {"noise_density": "0.002 m/s^2/Hz^0.5", "noise_corner": "300 Hz", "bandwidth": "900 Hz"}
    content = {"sensors": {"accelerometers": {"each": {"accel": row, "other": {"gain_error": 0.1}}}}}
    bare, chain = without_floor(content)
    assert bare["sensors"]["accelerometers"]["each"] == {
        "accel": {"bandwidth": "900 Hz"},
        "other": {"gain_error": 0.1},
    }
    f = np.array([3.0, 300.0, 2e4])
    assert chain.of("accel").floor(f) == pytest.approx(0.002**2 * (1 + 300.0 / f), rel=2e-3)
    assert content["sensors"]["accelerometers"]["each"]["accel"] == row


@pytest.mark.parametrize("more", [{"range": "50 m/s^2"}, {"noise_density": "3 ug/Hz^0.5"}])
def test_a_floor_that_must_be_drawn_stays(more: dict[str, str]) -> None:
    row = {"noise_density": "0.002 m/s^2/Hz^0.5"} | more
    content = {"sensors": {"accelerometers": {"each": {"accel": row}}}}
    assert without_floor(content)[0] == content
    assert not without_floor(content)[1].channels


@pytest.mark.parametrize(
    ("proof", "nats", "holds"), [(8.0, -3.5, True), (8.0, -5.0, False), (0.0, -3.5, False)]
)
def test_what_is_found_again_outweighs_what_levels_say_against_it(
    proof: float, nats: float, holds: bool
) -> None:
    """Dropouts drawn at other times than those of the record, surely worse by some nats."""
    fitted = SimpleNamespace(
        trial=SimpleNamespace(model=SimpleNamespace(extensions=[SimpleNamespace(cause=0)]))
    )
    candidate = Candidate(cast(Any, fitted), 5.0, proof_nats=proof)
    gain = Gain("statistics", 0.01, (0.0, 0.02), nats, (nats - 1.0, nats + 1.0))
    assert candidate.holds(gain, trifle_db=0.02) is holds


def test_the_height_of_hum_is_less_sure_the_nearer_an_order() -> None:
    stds = []
    for shaft_hz in (24.3, 25.07, 25.03):
        slow = slow_part(_hummed(shaft_hz, 0.02, 12), "accel", 800.0)
        stds.append(slow.amplitude_std(50.0, slow.without_orders(800.0)))
    # Of a sine in white noise of variance s^2 seen through a Hann window: s sqrt(2 x 1.5 / n).
    assert stds[0] == pytest.approx(0.01 * (3.0 / T.size) ** 0.5, rel=0.35)
    assert stds[0] < 0.6 * stds[1] < 0.36 * stds[2]
