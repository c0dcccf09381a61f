"""The accelerometer chain against scipy's filters, closed forms and simple counting."""

import itertools

import numpy as np
import pytest
from scipy import signal, stats

from gearsim_io.errors import InputError
from gearsim_io.nameplate import Channel, Machine, Shaft
from gearsim_io.quantities import validate
from gearsim_sim.sensors.chain import STAGES, MeasuringChain
from gearsim_sim.sensors.delay import Delay, taps
from gearsim_sim.sensors.draws import generator, normal
from gearsim_sim.sensors.mounting import mountings
from gearsim_sim.sensors.rolloff import lowpass
from gearsim_sim.sensors.rows import Row
from gearsim_sim.sensors.settings import SensorsModel, chain, chain_names
from gearsim_sim.sensors.table import sensor_table

RATE = 65536.0


def _chain(*rows, rate=RATE, seed=1, sites=("a", "b")):
    return MeasuringChain(rows, sites, rate, seed)


def _run(chain, motion, cuts=()):
    """All samples of `motion` that have the context which the chain needs, in pieces ending at `cuts`."""
    total = motion.shape[1] - chain.past - chain.ahead
    pieces = []
    for start, stop in itertools.pairwise([0, *cuts, total]):
        window = motion[:, start : stop + chain.past + chain.ahead]
        pieces.append(chain.process(window, start, stop - start))
    return np.concatenate(pieces, axis=1)


def _noise_motion(samples, seed=0):
    return np.random.default_rng(seed).standard_normal((2, samples)) * 20


@pytest.mark.parametrize("bandwidth_hz", [200.0, 3000.0, 10_000.0, 25_600.0])
def test_rolloff_is_scipys_butterworth(bandwidth_hz):
    b, a = signal.butter(2, bandwidth_hz, fs=RATE)
    ours = lowpass(bandwidth_hz, RATE)
    np.testing.assert_allclose(ours, (*b, *a[1:]), rtol=1e-9, atol=1e-12)
    motion = _noise_motion(5000)
    chain = _chain(Row("c", "b", bandwidth_hz=bandwidth_hz))
    np.testing.assert_allclose(_run(chain, motion)[0], signal.lfilter(b, a, motion[1]), rtol=1e-5, atol=1e-5)


def test_measured_response_is_3_db_down_at_the_bandwidth():
    motion = np.zeros((2, 1 << 15))
    motion[0, 0] = 1.0
    chain = _chain(Row("c", "a", bandwidth_hz=4096.0))
    gain = np.abs(np.fft.rfft(_run(chain, motion)[0]))
    step_hz = RATE / motion.shape[1]
    assert gain[round(4096 / step_hz)] == pytest.approx(np.sqrt(0.5), rel=1e-4)
    assert gain[round(41 / step_hz)] == pytest.approx(1.0, abs=1e-4)
    assert gain.max() < 1.0001  # no resonance
    octave = gain[round(2048 / step_hz)] / gain[round(1024 / step_hz)]
    assert octave == pytest.approx(np.sqrt((1 + 0.25**4) / (1 + 0.5**4)), rel=0.01)


def test_bandwidth_beyond_the_sampled_band_changes_nothing():
    motion = _noise_motion(1000)
    chain = _chain(Row("c", "a", bandwidth_hz=25_600.0), rate=12_000.0)
    np.testing.assert_array_equal(_run(chain, motion)[0], motion[0].astype(np.float32))


@pytest.mark.parametrize("rate", [12_000.0, 65_536.0, 97_656.0])
def test_noise_has_its_density_at_any_rate_and_is_white_and_normal(rate):
    density = 3e-3
    chain = _chain(Row("c", "a", noise_density=density), rate=rate)
    noise = _run(chain, np.zeros((2, 1 << 18)))[0].astype(float)
    frequency, psd = signal.welch(noise, rate, nperseg=2048)
    level = np.sqrt(psd[2:-2])
    assert np.median(level) == pytest.approx(density, rel=0.02)
    thirds = np.array_split(level, 3)
    assert max(t.mean() for t in thirds) / min(t.mean() for t in thirds) < 1.03
    assert frequency[-1] == rate / 2
    assert stats.kstest(noise[::7] / noise.std(), "norm").pvalue > 1e-3


def test_noise_is_indexed_by_sample_number_and_named_by_channel():
    whole = normal(generator(7, "x"), 10_000)
    parts = generator(7, "x")
    pieces = np.concatenate([normal(parts, n) for n in (1, 2, 3, 4097, 5897)])
    np.testing.assert_array_equal(pieces, whole)
    jumped = generator(7, "x").advance(1000)  # 1000 counter steps of 4 numbers
    np.testing.assert_array_equal(normal(jumped, 50), whole[4000:4050])
    others = [normal(generator(7, "y"), 10_000), normal(generator(8, "x"), 10_000)]
    for other in others:
        assert abs(np.corrcoef(whole, other)[0, 1]) < 0.05
    alone = _run(_chain(Row("b", "b", noise_density=1e-3)), np.zeros((2, 500)))
    rows = (Row("a", "a", noise_density=1e-3), Row("b", "b", noise_density=1e-3))
    both = _run(_chain(*rows), np.zeros((2, 500)))
    np.testing.assert_array_equal(both[1], alone[0])
    assert abs(np.corrcoef(both)[0, 1]) < 0.2


@pytest.mark.parametrize("bits", [8, 16])
def test_quantisation_steps_codes_and_error(bits):
    row = Row("c", "a", full_scale=50.0, adc_bits=bits)
    motion = np.vstack([np.linspace(-60, 60, 200_001), np.zeros(200_001)])
    out = _run(_chain(row), motion)[0].astype(float)
    step = 100.0 / 2**bits
    codes = out / step
    assert np.abs(codes - np.rint(codes)).max() < 1e-6
    assert codes.min() == -(2 ** (bits - 1))
    assert codes.max() == 2 ** (bits - 1) - 1
    inside = np.abs(motion[0]) < 50 - step
    assert np.abs(out - motion[0])[inside].max() <= step / 2 * (1 + 1e-6)
    if bits == 8:
        assert np.std((out - motion[0])[inside]) == pytest.approx(step / np.sqrt(12), rel=0.02)


def test_clipping_without_converter():
    row = Row("c", "a", full_scale=5.0)
    motion = _noise_motion(1000)
    np.testing.assert_array_equal(_run(_chain(row), motion)[0], np.clip(motion[0], -5, 5).astype(np.float32))


@pytest.mark.parametrize("delay", [0.0, 1.0, 0.25, 3.6, 40.9])
def test_delay_moves_a_sine_by_exactly_so_much(delay):
    chain = _chain(Row("c", "a", delay_s=delay / RATE), Row("d", "b"))
    for frequency in (0.002, 0.05, 0.2, 0.4):
        n = np.arange(-chain.past, 3000 + chain.ahead)
        motion = np.vstack([np.sin(2 * np.pi * frequency * n)] * 2)
        late, prompt = chain.process(motion, 0, 3000)
        k = np.arange(3000)
        np.testing.assert_allclose(late, np.sin(2 * np.pi * frequency * (k - delay)), atol=2e-4)
        np.testing.assert_array_equal(prompt, np.sin(2 * np.pi * frequency * k).astype(np.float32))


def test_delay_weights_keep_a_constant():
    assert taps(0.3).sum() == pytest.approx(1.0, abs=1e-15)
    assert Delay([Row("c", "a")], RATE).past == 0


def test_everything_off_is_the_motion_itself():
    motion = _noise_motion(2000)
    chain = _chain(Row("c", "b"))
    assert chain.past == chain.ahead == 0
    np.testing.assert_array_equal(_run(chain, motion)[0], motion[1].astype(np.float32))


def test_chunks_do_not_change_a_bit():
    rows = [
        Row("a", "a", "x", 30.0, 9000.0, 2e-3, 12, 2.5 / RATE),
        Row("b", "b", "y", 1000.0, 25_600.0, 5e-4, 24, 0.0),
        Row("c", "a", "x", None, 500.0, 1e-3, None, 7.0 / RATE),
    ]
    motion = _noise_motion(20_000)
    whole = _run(_chain(*rows), motion)
    cuts = np.cumsum(np.random.default_rng(3).integers(1, 700, 25))
    np.testing.assert_array_equal(_run(_chain(*rows), motion, cuts), whole)
    assert not np.array_equal(_run(_chain(*rows, seed=2), motion), whole)


def test_every_stage_of_the_registry_can_be_off():
    rows = [Row("c", "a")]
    assert [name for name, build in STAGES if build(rows, RATE, 0).active] == []


def test_unknown_site():
    with pytest.raises(InputError, match="sensor c: site: got top, expected one of a, b"):
        _chain(Row("c", "top"))


def _machine(full_scale=float("nan")):
    return Machine(
        name="m",
        description="",
        reference_shaft="input",
        shafts=(Shaft("input", 1.0, 10.0), Shaft("output", 1.0, 10.0)),
        channels=(Channel("p", axis="x", full_scale=full_scale), Channel("q", axis="y")),
        tacho_shafts=("input",),
        encoder_shafts=("output",),
    )


def _table(content, **kwargs):
    return sensor_table(validate(SensorsModel, content, "s.yaml"), _machine(**kwargs), "s.yaml")


def test_default_table_follows_the_machine():
    table = _table({}, full_scale=80.0)
    assert [row.channel for row in table.accelerometers] == ["p", "q"]
    assert table.accelerometers[0].full_scale == 80.0
    assert table.accelerometers[1].full_scale == chain("accelerometers", "lab").range
    assert [t.shaft for t in table.tachos] == ["input"]
    assert [(e.shaft, e.lines) for e in table.encoders] == [("output", 900)]


def test_a_scenario_changes_all_or_one():
    table = _table(
        {
            "accelerometers": {
                "channels": ["q", "top"],
                "all": {"noise_density": "off", "bandwidth": "8 kHz"},
                "each": {"top": {"site": "p", "range": "2 kilometer/s^2", "delay": "3 us", "axis": "z"}},
            },
            "encoders": {"shafts": [], "lines": 1024},
        }
    )
    q, top = table.accelerometers
    assert q.noise_density is None
    assert q.bandwidth_hz == top.bandwidth_hz == 8000
    assert (top.site, top.full_scale, top.axis) == ("p", 2000, "z")
    assert top.delay_s == pytest.approx(3e-6)
    assert table.encoders == ()


def test_sections_are_replaced_as_a_whole_and_switched_off():
    table = _table(
        {
            "accelerometers": {
                "chain": "magnet",
                "all": {"high_pass": {"corner": "2 Hz", "order": 2}},
                "each": {
                    "p": {"mounting": "off", "mains": {"amplitude": "0.1 m/s^2"}},
                    "q": {"mounting": "stud", "site": {"p": 0.6, "q": 0.8}, "cross_axis": {"p": 0.02}},
                },
            }
        }
    )
    p, q = table.accelerometers
    assert p.mounting is None
    assert (p.mains.amplitude, p.mains.frequency) == (0.1, 50.0)
    assert q.mounting == mountings()["stud"]
    assert q.high_pass == p.high_pass
    assert (p.high_pass.corner, p.high_pass.order) == (2.0, 2)
    assert q.looks_at == (("p", 0.6), ("q", 0.8), ("p", 0.02))
    assert p.looks_at == (("p", 1.0),)


def test_pickups_are_for_all_shafts_or_one():
    table = _table(
        {
            "tachos": {"shafts": ["input", "output"], "jitter": "2 us", "each": {"output": {"missing": 0.1}}},
            "torques": {"shafts": ["output"], "each": {"output": {"range": "50 N*m"}}},
        }
    )
    first, second = (tacho.pickup for tacho in table.tachos)
    assert (first.jitter, first.missing) == (2e-6, 0.0)
    assert (second.jitter, second.missing) == (2e-6, 0.1)
    (torque,) = table.torques
    assert (torque.channel, torque.site) == ("output_torque", "output_torque")
    assert (torque.unit, torque.full_scale) == ("N*m", 50.0)


@pytest.mark.parametrize("rate", [16_384.0, 65_536.0])
@pytest.mark.parametrize("name", chain_names("accelerometers"))
def test_every_shipped_chain_measures(name, rate):
    table = _table({"accelerometers": {"chain": name}})
    motion = np.tile(30 * np.sin(2 * np.pi * 100 * np.arange(20_000) / rate), (2, 1))
    chain = MeasuringChain(table.accelerometers, ("p", "q"), rate, 1)
    out = chain.process(motion, 0, 20_000)
    for seen, moved in zip(out, motion, strict=True):
        # 100 Hz comes through within the gain errors, dropouts and interference of the catalogue
        assert np.linalg.lstsq(moved[:, None], seen, rcond=None)[0][0] == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            {"accelerometers": {"chain": "x"}},
            r"chain: got x, expected one of charge_slip_ring, ",
        ),
        (
            {"accelerometers": {"channels": ["p", "z"]}},
            "sensors.accelerometers.channels: got z, expected one",
        ),
        ({"accelerometers": {"channels": ["p", "p"]}}, "expected each channel once"),
        ({"accelerometers": {"channels": ["p"], "each": {"q": {}}}}, "listed under channels"),
        ({"accelerometers": {"all": {"range": "off"}}}, "24 bits without a range"),
        ({"accelerometers": {"all": {"range": "-1 m/s^2"}}}, r"a number in m/s\^2, > 0, or off"),
        ({"accelerometers": {"all": {"range": "10 V"}}}, r"\(not V\)"),
        ({"accelerometers": {"all": {"adc_bits": 12.5}}}, "whole number of adc_bits"),
        ({"tachos": {"shafts": ["rear"]}}, "sensors.tachos: shafts: got rear, expected one of input, output"),
        ({"encoders": {"lines": 0}}, "encoders.lines: got 0"),
        (
            {"accelerometers": {"all": {"mounting": "glue"}}},
            "mounting: got glue, expected one of stud, wax, mica",
        ),
        (
            {"accelerometers": {"all": {"mounting": {"q": 3}}}},
            "mounting.resonance: got nothing, expected this key",
        ),
        (
            {"accelerometers": {"all": {"mains": {"amplitude": "1 V"}}}},
            r"mains.amplitude: got 1 V, .*\(not V\)",
        ),
        (
            {"accelerometers": {"all": {"drift": {"rms": "1 m/s^2", "tau": 1}}}},
            "one of the keys rms, time",
        ),
        (
            {"accelerometers": {"each": {"p": {"site": {"q": "x"}}}}},
            "a site, or sites with their weights, such",
        ),
        ({"accelerometers": {"sampling": {"antialias": "none"}}}, "an oversampling of 2 or more"),
        (
            {"tachos": {"each": {"output": {"jitter": "1 us"}}}},
            "tachos: each: got output, expected one of input",
        ),
        ({"tachos": {"each": {"input": {"jiter": "1 us"}}}}, "one of the keys clock, coupling, delay"),
        (
            {"torques": {"shafts": ["rear"]}},
            "sensors.torques: shafts: got rear, expected one of input, output",
        ),
        ({"torques": {"each": {"input": {}}}}, "torques: each: got input, expected one of no shaft"),
        ({"torques": {"shafts": ["input"], "all": {"range": "1 m/s^2"}}}, r"a number in N\*m, > 0, or off"),
        (
            {"torques": {"shafts": ["input"], "all": {"temperature": "off"}}},
            "zero_per_k of input_torque: got 0.02, expected a temperature beside it",
        ),
        ({"microphones": {}}, "one of the keys accelerometers, encoders, tachos, torques"),
    ],
)
def test_bad_tables_are_told_in_one_line(content, message):
    with pytest.raises(InputError, match=message) as caught:
        _table(content)
    assert str(caught.value).startswith("s.yaml: ")
    assert "\n" not in str(caught.value)
