"""Accelerometers that hear the casing through its frequency responses, `path: frf`."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from gearsim_io.errors import InputError
from gearsim_sim.events import FaultSpec
from gearsim_sim.frf.bank import accelerations_of
from gearsim_sim.frf.file import find_responses
from gearsim_sim.frf.of_machine import machine_responses
from gearsim_sim.model.on_casing import own_modes, site_row
from gearsim_sim.models import MODELS, parameters
from gearsim_sim.scenario import parse_scenario
from gearsim_sim.simulation import Simulation

RATE_HZ = 65536.0
SITE = "b3_top_y"
SPALL = {"kind": "outer_race_spall", "component": "bearing_3", "params": {"width_m": "0.8 mm"}}


def scenario(**more):
    each = {"modes": {"site": SITE}, "frf": {"site": SITE, "path": "frf"}}
    content = {
        "machine": "unsw_parallel",
        "model": "cb146",
        "operating_point": {"speed": "10 Hz", "load": "50 N*m"},
        "sensors": {"accelerometers": {"chain": "ideal", "channels": list(each), "each": each}},
        "faults": [SPALL],
    }
    return parse_scenario({**content, **more}, Path("test.yaml").absolute())


def with_accelerometers(**accelerometers):
    return {"sensors": {"accelerometers": {"chain": "ideal", **accelerometers}}}


@cache
def ran():
    """A second and a half of the scenario."""
    return MODELS["cb146"](scenario()).advance(round(1.5 * RATE_HZ))


def lines_of(signal):
    window = np.hanning(signal.shape[-1])
    return np.fft.rfft(window * (signal - signal.mean(axis=-1, keepdims=True)))


def test_both_paths_agree_as_far_as_the_modes_in_the_loop_reach():
    """Power in bands within 0.1 dB to 2 kHz and 1 dB to 3.5 kHz, see docs/casing_responses.md.

    The difference, line by line, is that of the two models' responses with the forces of this run.
    """
    output = ran()
    assert output.site_names == (SITE, "frf:" + SITE)
    modes, through = (lines_of(signal) for signal in output.accel)
    frequency = np.fft.rfftfreq(output.sample_count, 1 / RATE_HZ)
    casing = parameters(scenario()).casing
    omega, ratios, shapes = own_modes(casing, "test")
    row = site_row(casing.site(SITE), casing, omega, shapes)
    whole = find_responses("unsw_casing_updated").of_sites([SITE]).of_inputs(tuple(output.forces))
    for low, high, level_db, share in (
        (60, 1000, 0.1, 0.02),
        (1000, 2000, 0.1, 0.05),
        (2000, 3500, 1.0, 0.3),
    ):
        band = (frequency >= low) & (frequency < high)
        w = 2 * np.pi * frequency[band]
        each = 1 / (omega[:, None] ** 2 - w**2 + 2j * ratios[:, None] * omega[:, None] * w)
        forces = lines_of(np.array(list(output.forces.values())))[:, band]
        seats = np.array([shapes[casing.dof(name[:2], "u" + name[-1])] for name in output.forces])
        differ = -(w**2) * ((row * seats) @ each) - whole.accelerances(frequency[band])[0]
        expected = np.linalg.norm((differ * forces).sum(axis=0)) / np.linalg.norm(through[band])
        found = np.linalg.norm(modes[band] - through[band]) / np.linalg.norm(through[band])
        assert found < expected + 0.003  # what windows and filters leave
        assert found < share
        power = np.linalg.norm(modes[band]) / np.linalg.norm(through[band])
        assert abs(20 * np.log10(power)) < level_db


def test_there_is_no_transient_at_the_start():
    """Slow modes that were not at rest would swing for a second, twenty times as much as the machine does."""
    low = butter(4, 40.0, fs=RATE_HZ, output="sos")
    modes, through = (sosfiltfilt(low, signal) for signal in ran().accel)
    early = slice(round(0.2 * RATE_HZ), round(0.7 * RATE_HZ))  # away from the filter's ends
    assert np.std((modes - through)[early]) < 0.5 * np.std(modes[early])


def test_offline_is_what_the_stream_gives():
    output = ran()
    responses = find_responses("unsw_casing_updated").of_sites([SITE])
    again = accelerations_of(responses, output.forces, RATE_HZ)[0]
    late = slice(round(1.2 * RATE_HZ), -64)  # it begins at rest at sample 0, and does not know what follows
    stream = output.accel[1, late]
    assert np.abs(np.diff(again[late] - stream, 2)).max() < 1e-6 * np.abs(np.diff(stream, 2)).max()


def test_portions_and_company_change_no_bit():
    model = MODELS["cb146"](scenario())
    cuts = (1, 40, 3000, 959)
    parts = [model.advance(count) for count in cuts]
    accel = np.hstack([part.accel for part in parts])
    assert np.array_equal(accel, ran().accel[:, : sum(cuts)])
    assert [part.first_sample for part in parts] == [0, 1, 41, 3041]
    assert model.next_sample == sum(cuts)
    for name in ("turns", "fraction", "speed_hz"):
        whole = getattr(ran(), name)[:, : sum(cuts)]
        assert np.array_equal(np.hstack([getattr(part, name) for part in parts]), whole)
    alone = MODELS["cb146"](scenario(**with_accelerometers(channels=["a"], each={"a": {"site": SITE}})))
    assert np.array_equal(alone.advance(4000).accel[0], accel[0])


def test_a_rig_with_such_sensors_repeats_what_happened_live():
    live = Simulation(scenario(faults=[], batch_samples=1000))
    batches = live.advance(1500)
    live.inject(FaultSpec("outer_race_spall", "bearing_3", {"width_m": 8e-4}, 1.0, "later"), 0.02)
    batches += live.advance(2500)
    again = Simulation(scenario(faults=[], batch_samples=1000).with_events(live.truth().events))
    signals = [
        np.hstack([batch.data for batch in run if hasattr(batch, "data")])
        for run in (batches, again.advance(4000))
    ]
    assert signals[0].shape == (2, 4000)
    assert np.array_equal(*signals)


def test_all_accelerometers_may_take_that_path():
    only = scenario(
        **with_accelerometers(channels=["b3_y", "wall"], path="frf", each={"wall": {"site": {SITE: 0.5}}})
    )
    batch = Simulation(only).advance(4096)[0]
    assert batch.channels == ("b3_y", "wall")
    assert np.allclose(batch.data[1], 0.5 * ran().accel[1, :4096], rtol=1e-5, atol=1e-6)


def test_what_comes_through_from_other_sites_takes_the_path_too():
    each = {"a": {"site": SITE, "cross_axis": {"b1_y": 0.1}, "path": "frf"}, "b": {"site": "b1_y"}}
    table = scenario(**with_accelerometers(channels=["a", "b"], each=each)).sensors
    looks = [row.looks_at for row in table.accelerometers]
    assert looks == [(("frf:" + SITE, 1.0), ("frf:b1_y", 0.1)), (("b1_y", 1.0),)]


def test_the_shipped_responses_reach_20_khz_and_are_small():
    responses = find_responses("unsw_casing_updated")
    assert responses.valid_hz > 20000
    assert len(responses.omega) > 800
    casing = parameters(scenario()).casing
    assert responses.belongs_to(casing)
    assert set(responses.sites) >= {site.name for site in casing.sites}


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"model": "lpm34"}, "path: got frf, expected a model in a flexible casing"),
        (
            {"parameters": {"casing.reduced": "unsw_casing"}},
            "casing.responses: got unsw_casing_updated, expected those",
        ),
        ({"parameters": {"casing.responses": "none"}}, "responses: got none, expected one of unsw_casing"),
        (
            with_accelerometers(channels=["a"], each={"a": {"site": "roof", "path": "frf"}}),
            "site: got roof, expected one of b1_x",
        ),
    ],
)
def test_what_cannot_be_is_one_line(more, message):
    with pytest.raises(InputError, match=message) as told:
        Simulation(scenario(**more))
    assert "\n" not in str(told.value)


def test_a_path_that_does_not_exist_is_told():
    with pytest.raises(InputError, match="path"):
        scenario(**with_accelerometers(path="air"))


def test_a_casing_of_ones_own_without_responses_is_told():
    params = parameters(scenario())
    bare = type(params)(params.gearbox, params.casing, params.finite, None)
    with pytest.raises(InputError, match=r"whose machine names casing\.responses"):
        machine_responses(bare)
