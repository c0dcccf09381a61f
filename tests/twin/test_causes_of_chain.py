"""Causes of the measuring chain: read off records that have them, and not off records that have not."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gearsim_dsp.electrical import find_electrical_lines
from gearsim_io.importers import import_file
from gearsim_io.machines import load_machine
from gearsim_sim.scenario import parse_scenario
from gearsim_twin.causes import CAUSES, Context
from gearsim_twin.causes.antialias_rolloff import edge_of_band
from gearsim_twin.causes.clipping import find_limit
from gearsim_twin.causes.dropouts import find_bursts
from gearsim_twin.causes.inverter_lines import line_ratio
from gearsim_twin.causes.lines import SlowPart
from gearsim_twin.causes.sensor_resonance import mounted_db
from gearsim_twin.causes.spectra_beside import beside
from gearsim_twin.causes.unit_or_gain_error import known_factor
from gearsim_twin.view import view_of
from tests.twin.chain_cases import RATE_HZ, accelerometers, context, healthy, record

RIGS = ("parallel", "planetary", "bearing")
CHAIN = (
    "mains_interference",
    "inverter_lines",
    "dropouts",
    "clipping",
    "antialias_rolloff",
    "coloured_floor",
    "unit_or_gain_error",
    "sensor_resonance",
)


def first(name: str, seen: Context) -> dict[str, Any]:
    """The first guess of a cause, which its extension must turn into a scenario that can be run."""
    cause = CAUSES[name]
    assert cause.applies(seen)
    starts = cause.starts(seen)
    assert starts, f"{name} sees nothing"
    before = copy.deepcopy(seen.contents[0])
    content = cause.extend(seen.contents[0], starts[0], seen)
    assert seen.contents[0] == before
    assert content != before
    parse_scenario(content, Path("extended.yaml"))
    assert cause.signature(starts[0])
    for parameter in cause.parameters:
        value = float(starts[0][parameter.name])
        assert parameter.prior.low <= value <= parameter.prior.high
    return starts[0]


@pytest.mark.parametrize("rig", RIGS)
@pytest.mark.parametrize("seed", [3, 4])
def test_healthy_records_have_none(rig: str, seed: int) -> None:
    seen = healthy(rig, seed)
    found = {name: starts for name in CHAIN if (starts := CAUSES[name].starts(seen))}
    assert not found


@pytest.mark.parametrize("rig", RIGS)
@pytest.mark.parametrize(("part", "mains_hz"), [(0.01, 59.97), (0.5, 60.04)])
def test_hum_is_found_between_the_orders(rig: str, part: float, mains_hz: float) -> None:
    level = part * float(healthy(rig, 3).views[0].record.data.std())
    mains = {"amplitude": f"{level} m/s^2", "frequency": f"{mains_hz} Hz"}
    start = first("mains_interference", context(rig, record(rig, 5, **accelerometers(mains=mains))))
    assert start["frequency_hz"] == pytest.approx(mains_hz, abs=max(0.02, 4 * start["std:frequency_hz"]))
    assert start["amplitude_m_s2"] == pytest.approx(level, rel=0.15)
    assert start["part:3"] == pytest.approx(0.4, rel=0.15)


@pytest.mark.parametrize("rig", RIGS)
@pytest.mark.parametrize(("part", "carrier_hz", "output_hz"), [(0.1, 4011.0, 47.3), (0.5, 3127.3, 31.7)])
def test_a_converter_is_found_with_its_settings(
    rig: str, part: float, carrier_hz: float, output_hz: float
) -> None:
    level = part * float(healthy(rig, 3).views[0].record.data.std())
    settings = {
        "amplitude": f"{level} m/s^2",
        "carrier": f"{carrier_hz} Hz",
        "output": f"{output_hz} Hz",
        "modulation": 0.6,
    }
    start = first("inverter_lines", context(rig, record(rig, 6, **accelerometers(inverter=settings))))
    assert start["carrier_hz"] == pytest.approx(carrier_hz, abs=0.05)
    assert start["output_hz"] == pytest.approx(output_hz, abs=0.05)
    assert start["amplitude_m_s2"] == pytest.approx(level, rel=0.1)
    # Heights are known to a few per cent, J1(pi M) / J0(pi M / 2) is steep: some hundredths of M.
    assert start["modulation"] == pytest.approx(0.6, abs=0.08)


def test_line_ratios_are_those_of_a_sampled_leg() -> None:
    """Against the spectrum of the product that the leg gives, with commensurable frequencies."""
    n, carrier, output, modulation = 4096, 512, 16, 0.7
    t = np.arange(n) / n
    duty = 0.5 * np.pi * (1 + modulation * np.cos(2 * np.pi * output * t))
    leg = sum(np.sin(m * duty) * np.sin(2 * np.pi * m * carrier * t) for m in (1, 2, 3))
    lines = np.abs(np.fft.rfft(leg)) / (n / 2)
    for m, side in ((1, 2), (2, 1), (2, 3), (3, 2)):
        expected = lines[m * carrier + side * output] / lines[carrier]
        assert line_ratio(m, side, modulation) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("shows", ["zero", "hold"])
@pytest.mark.parametrize("rig", RIGS)
def test_dropouts_are_counted(rig: str, shows: str) -> None:
    lost = {"rate": "8 Hz", "duration": "6 ms", "shows": shows}
    start = first("dropouts", context(rig, record(rig, 7, **accelerometers(dropouts=lost))))
    assert start["shows"] == shows
    # Poisson: some 32 bursts a channel; four standard deviations.
    assert abs(start["rate_hz"] - 8.0) < 4 * start["std:rate_hz"]
    assert abs(start["duration_s"] - 6e-3) < 4 * start["std:duration_s"]


def test_dropouts_are_seen_through_noise_and_are_no_clipping() -> None:
    draws = np.random.default_rng(1)
    x = draws.standard_normal(100_000)
    assert find_bursts(x, RATE_HZ) is None
    for start in (10_000, 40_000, 77_000):
        x[start : start + 300] = 0.0
    bursts = find_bursts(x + 1e-3 * draws.standard_normal(x.size), RATE_HZ)
    assert bursts is not None
    assert (bursts.count, bursts.shows) == (3, "zero")
    assert find_limit(x) is None


def test_codes_of_a_converter_are_neither_dropouts_nor_clipping() -> None:
    x = np.random.default_rng(2).standard_normal(100_000)
    coarse = np.round(x / 0.05) * 0.05
    assert find_bursts(coarse, RATE_HZ) is None
    assert find_limit(coarse) is None


@pytest.mark.parametrize("rig", RIGS)
@pytest.mark.parametrize("part", [0.8, 0.4])
def test_clipping_tells_the_range(rig: str, part: float) -> None:
    top = float(np.abs(healthy(rig, 3).views[0].record.data).max(axis=1).max())
    limit = f"{part * top} m/s^2"
    seen = context(rig, record(rig, 8, **accelerometers(range=limit)))
    start = first("clipping", seen)
    assert start["range_m_s2"] == pytest.approx(part * top, rel=1e-5)
    assert not CAUSES["dropouts"].starts(seen)


@pytest.mark.parametrize("rig", RIGS)
@pytest.mark.parametrize("corner_hz", [3000.0, 8000.0])
def test_a_roll_off_tells_its_corner(rig: str, corner_hz: float) -> None:
    seen = context(rig, record(rig, 9, **accelerometers(bandwidth=f"{corner_hz} Hz")))
    start = first("antialias_rolloff", seen)
    assert start["kind"] == "bandwidth"
    assert start["corner_hz"] == pytest.approx(corner_hz, rel=0.1)
    assert start["component"] == "all"


def test_a_steep_filter_is_told_from_a_sensor() -> None:
    sampling = {"oversampling": 2, "pass_band": 0.3, "stop_band": 0.45}
    seen = context("bearing", record("bearing", 9, sensors={"accelerometers": {"sampling": sampling}}))
    start = first("antialias_rolloff", seen)
    assert start["kind"] == "converter"
    assert 0.3 * RATE_HZ < start["corner_hz"] < 0.45 * RATE_HZ


def test_a_missing_filter_shows_orders_beyond_half_the_rate() -> None:
    """The planetary rig's many mesh lines, at a speed that changes enough to tell images from lines."""
    ramp = [{"at": "0.2 s", "set": {"speed": "2.6 Hz", "ramp": "3.5 s"}}]
    sampling = {"oversampling": 4, "antialias": "none"}
    slow = {"sample_rate": "5120 Hz", "timeline": ramp}
    open_end = {"accelerometers": {"sampling": sampling}}
    bare = context("planetary", record("planetary", 9, **slow, sensors=open_end), follow=True)
    start = first("antialias_rolloff", bare)
    assert start["kind"] == "none"
    filtered = context("planetary", record("planetary", 9, **slow), follow=True)
    assert not CAUSES["antialias_rolloff"].starts(filtered)


@pytest.mark.parametrize("rig", RIGS)
@pytest.mark.parametrize("part", [0.002, 0.01])
def test_a_floor_tells_its_density(rig: str, part: float) -> None:
    density = part * float(healthy(rig, 3).views[0].record.data.std(axis=1).max())
    noise = accelerometers(noise_density=f"{density} m/s^2/Hz^0.5", noise_corner="300 Hz")
    start = first("coloured_floor", context(rig, record(rig, 10, **noise)))
    assert start["density"] == pytest.approx(density, rel=0.1)
    assert 100 < start["corner_hz"] < 900


@pytest.mark.parametrize("rig", RIGS)
@pytest.mark.parametrize("factor", [1.4, 9.80665, 0.1])
def test_a_wrong_unit_is_one_factor_on_everything(rig: str, factor: float) -> None:
    seen = healthy(rig, 3)
    measured = seen.views[0].record
    scaled = dataclasses.replace(measured, data=measured.data * np.float32(factor))
    start = first("unit_or_gain_error", context(rig, scaled))
    # The model's own parameters are some per cent off: a few per cent of level.
    assert start["factor"] == pytest.approx(factor, rel=0.12)
    assert start["component"] == "all"


def test_known_factors_are_named() -> None:
    assert "m/s^2 taken for g" in known_factor(9.7)
    assert "1e-3" in known_factor(1.01e-3)
    assert known_factor(3.3) == ""


@pytest.mark.parametrize("rig", RIGS)
@pytest.mark.parametrize(("resonance_hz", "q"), [(7000.0, 10.0), (2000.0, 5.0)])
def test_a_mounting_tells_resonance_and_q(rig: str, resonance_hz: float, q: float) -> None:
    mounting = {"resonance": f"{resonance_hz} Hz", "q": q}
    start = first("sensor_resonance", context(rig, record(rig, 12, **accelerometers(mounting=mounting))))
    assert start["resonance_hz"] == pytest.approx(resonance_hz, rel=0.04)
    assert start["q"] == pytest.approx(q, rel=0.35)
    assert start["component"] == "all"


def test_the_mounting_curve_is_that_of_a_mass_on_a_spring() -> None:
    f = np.array([100.0, 5000.0, 20000.0])
    s = 2j * np.pi * f
    w0 = 2 * np.pi * 5000.0
    expected = 20 * np.log10(np.abs(w0**2 / (s**2 + w0 * s / 8 + w0**2)))
    assert mounted_db(f, 5000.0, 8.0) == pytest.approx(expected, abs=1e-9)


@pytest.mark.records
@pytest.mark.parametrize(
    ("file", "machine", "name"),
    [
        ("hit_sm/SQ_Normal_600.mat", "hit_sq", "inverter_lines"),
        ("hit_sm/SQ_Normal_1200.mat", "hit_sq", "inverter_lines"),
        ("cwru/97_Normal_0.mat", "cwru_drive_end", "mains_interference"),
        ("cwru/135_0.mat", "cwru_drive_end", "mains_interference"),
    ],
)
def test_electricity_in_measured_records(
    record_file: Callable[[str], Path], file: str, machine: str, name: str
) -> None:
    measured = import_file(record_file(file), machine)
    start = CAUSES[name].starts(_alone(measured, machine))[0]
    if name == "inverter_lines":
        lines = find_electrical_lines(measured.data[0], measured.sample_rate_hz).carriers_hz
        assert start["carrier_hz"] == pytest.approx(min(lines, key=lambda f: abs(f - start["carrier_hz"])))
        assert start["carrier_hz"] == pytest.approx(12000.0, rel=5e-4)
    else:
        assert start["frequency_hz"] == pytest.approx(60.0, abs=0.02)


@pytest.mark.parametrize(
    ("file", "machine"),
    [
        ("mfpt/baseline_1.mat", "mfpt"),
        ("gear0/3027_217_Data_Chan12.mat", "gear0"),
        ("cwru/135_0.mat", "cwru_drive_end"),
    ],
)
def test_measured_records_without_a_fault_of_the_chain(
    record_file: Callable[[str], Path], file: str, machine: str
) -> None:
    seen = _alone(import_file(record_file(file), machine), machine)
    for name in ("inverter_lines", "dropouts", "clipping"):
        assert not CAUSES[name].starts(seen)


def _alone(measured: Any, machine: str) -> Context:
    """A measured record beside silence."""

    view = view_of(measured, load_machine(machine))
    noise = np.random.default_rng(1).standard_normal(measured.data.shape).astype(np.float32)
    silent = dataclasses.replace(measured, data=noise * np.float32(1e-9))
    model = dataclasses.replace(view, record=silent)
    return Context(None, (view,), (), (), (), ({},), (model,))  # type: ignore[arg-type]


def test_hum_a_line_beside_an_order_keeps_its_amplitude_and_frequency() -> None:
    """An order fifty times as high, one line away, of a shaft whose speed wanders a little."""
    rate, seconds = 2000.0, 4.0
    t = np.arange(int(rate * seconds)) / rate
    turns = 9.96 * t + 2e-3 * np.sin(2 * np.pi * 0.4 * t)
    hum = 0.1 * np.cos(2 * np.pi * 60.01 * t + 1.0)
    x = 5.0 * np.cos(2 * np.pi * 6 * turns) + hum + 1e-3 * np.random.default_rng(3).standard_normal(t.size)
    slow = SlowPart(x, rate, turns, (1.0,))
    assert slow.amplitude(60.01) == pytest.approx(0.1, rel=0.02)
    frequency, _ = slow.refine(59.9, {1: 1e4})
    assert frequency == pytest.approx(60.01, abs=5e-3)


def test_short_dropouts_are_counted_with_those_too_short_to_see() -> None:
    """Mean length 20 samples, the shortest that can be seen 6: a quarter of them is not."""
    draws = np.random.default_rng(4)
    x = draws.standard_normal(1_000_000)
    at = 0.0
    while True:
        at += draws.exponential(500.0)
        end = at + draws.exponential(20.0)
        if end >= x.size:
            break
        x[int(np.ceil(at)) : int(np.ceil(end))] = 0.0
        at = end
    bursts = find_bursts(x, 1000.0)
    assert bursts is not None
    # Some 1,400 bursts are seen: 2.7 % of their mean length, three times that.
    assert bursts.duration_s == pytest.approx(0.020, rel=0.08)
    assert bursts.rate_hz == pytest.approx(2.0, rel=0.08)


@pytest.mark.records
@pytest.mark.parametrize("file", ["cwru/97_Normal_0.mat", "cwru/135_0.mat"])
def test_the_edge_that_fools_a_kurtogram_is_a_filter(record_file: Callable[[str], Path], file: str) -> None:
    """The recorder's filter begins some 20 kHz below a rate of 48 kHz, whatever model stands beside."""
    seen = _alone(import_file(record_file(file), "cwru_drive_end"), "cwru_drive_end")
    data = beside(seen.views[0], seen.simulated_views[0], "drive_end")
    assert data is not None
    edge = edge_of_band(data, 48000.0)
    assert edge is not None
    assert 19e3 < edge.values[0] < 22.5e3
