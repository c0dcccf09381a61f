"""What spalls and films do to signals: events and their distance, accuracy, softness, rollers."""

import math

import numpy as np
import pytest

from gearsim_sim.engine import Engine
from gearsim_sim.events import FaultSpec
from gearsim_sim.model.bearing_loop import ninth_root
from gearsim_sim.model.faults import of_bearings
from gearsim_sim.params import load_parallel_params
from gearsim_sim.params.bearing import Element

RATE_HZ = 65536.0
NAME = "bearing_3"
PROBES = ("b3_x.force_n", "b3_y.force_n", "b3_y.displacement_m")
OUTER, INNER, SPEED_HZ = 22.81e-3, 15.69e-3, 10.0
CAGE_HZ = 0.5 * SPEED_HZ * (1 - 7.12 / 38.5)


@pytest.fixture(scope="module")
def params():
    return load_parallel_params()


@pytest.fixture(scope="module")
def quiet(params):
    return params.with_physics(
        runout=False,
        tooth_profile=False,
        tooth_pitch=False,
        tooth_surface=False,
        mesh_stiffness_variation=False,
    )


@pytest.fixture(scope="module")
def healthy(params):
    return run(params, [], 4096)


def run(params, faults, samples, *, rate_hz=RATE_HZ, oversampling=4):
    specs = [FaultSpec(kind, NAME, given) for kind, given in faults]
    return Engine(params, 1, rate_hz, oversampling, specs, probes=PROBES).advance(samples)


def crossing_times(force, rate_hz):
    """Seconds from the entry edge to the exit edge, of all crossings that the force alone shows.

    At either edge the path of the ball begins or ends with the same curvature: the second derivative of
    the force jumps there, by as much at the exit as at the entry. So the third difference has its first
    peak after 3 ms of silence at the entry, and its last peak of at least half that height at the exit.
    What lies between, lift-off and return, is stronger; the ringing of the shaft afterwards is weaker.
    """
    jumps = np.abs(np.diff(force, 3))
    silence = round(0.003 * rate_hz)
    loud = np.flatnonzero(jumps > 2e-3 * jumps.max())
    starts = [i for i, before in zip(loud[1:], loud, strict=False) if i - before > silence]
    times = []
    for start in starts:
        entry = start + int(np.argmax(jumps[start : start + 5]))
        after = jumps[entry : entry + 3 * silence]
        times.append(np.flatnonzero(after > 0.5 * after[0])[-1] / rate_hz)
    return np.array(times)


@pytest.mark.parametrize("width_m", [0.4e-3, 0.8e-3, 3e-3])
@pytest.mark.parametrize(
    ("kind", "contact_m_per_s"),
    [
        ("outer_race_spall", 2 * math.pi * CAGE_HZ * OUTER),
        ("inner_race_spall", 2 * math.pi * (SPEED_HZ - CAGE_HZ) * INNER),
    ],
)
def test_width_of_a_spall_from_the_contact_force_alone(quiet, kind, contact_m_per_s, width_m):
    """Within 10 % over 0.4 to 3 mm, on either race."""
    rate = 4 * RATE_HZ
    output = run(quiet, [(kind, {"width_m": width_m})], int(0.2 * rate), rate_hz=rate, oversampling=2)
    times = crossing_times(output.probes["b3_y.force_n"], rate)
    assert times.size >= 3
    assert np.median(times) * contact_m_per_s == pytest.approx(width_m, rel=0.1)


@pytest.mark.parametrize("kind", [kind.name for kind in of_bearings.KINDS])
def test_default_oversampling_is_accurate(params, healthy, kind):
    """4 steps per sample against 16: the error is below 1e-3 of what the fault adds to its bearing."""
    # a ball that passes the load zone within the record
    given = {"ball": 4} if kind in ("rolling_element_spall", "off_size_ball") else {}
    fine, coarse = (run(params, [(kind, given)], 4096, oversampling=steps).accel[4:6] for steps in (16, 4))
    effect = coarse - healthy.accel[4:6]
    limit = 3e-3 if kind.endswith("film") else 1e-3  # the film's own step is of first order
    assert np.std(coarse - fine) < limit * np.std(effect)


def band(values, low_hz, high_hz):
    spectrum = np.fft.rfft((values - values.mean()) * np.hanning(values.size))
    frequency = np.fft.rfftfreq(values.size, 1 / RATE_HZ)
    return float(np.sqrt(np.sum(np.abs(spectrum[(frequency > low_hz) & (frequency < high_hz)]) ** 2)))


@pytest.mark.parametrize(
    ("fault", "least_db", "most_db"),
    [
        (("outer_race_spall", {}), 1.5, 4.0),
        (("extended_roughness", {"race": "outer", "roughness_m": "1.5 um"}), 6.0, 12.0),
    ],
)
def test_warm_oil_softens_roughness_more_than_spalls(params, fault, least_db, most_db):
    """From 10 to 20 kHz, oil of 0.1 Pa s; the thesis expects little for spalls, more for rough faults."""
    film = ("oil_film", {"viscosity_pa_s": 0.1})
    added = []
    for others in ([], [film]):
        pair = [run(params, [*others, *more], 16384).accel[5] for more in ([fault], [])]
        added.append(band(pair[0] - pair[1], 10e3, 20e3))
    assert least_db < 20 * math.log10(added[0] / added[1]) < most_db


def test_ninth_root():
    x = np.geomspace(1e-12, 1e-2, 400)
    assert np.array([ninth_root.py_func(value) for value in x]) == pytest.approx(x ** (1 / 9), rel=1e-12)
    assert ninth_root.py_func(0.0) < 1e-3


def test_roller_bearings_run(params):
    """The shaft sinks as deep as the readable law says, and less under a spall than its depth."""
    rollers = {
        "element": Element.ROLLER,
        "element_length_m": 6e-3,
    }
    law = params.model.ball_bearing.model_copy(update=rollers)
    machine = params.model_copy(
        update={"model": params.model.model_copy(update={"ball_bearing": law})}
    ).with_physics(
        runout=False,
        tooth_profile=False,
        tooth_pitch=False,
        tooth_surface=False,
        mesh_stiffness_variation=False,
    )
    output = run(machine, [], 4096)
    bearing = Engine(machine, 1, RATE_HZ).plant.bearings[2].law
    assert bearing.exponent == pytest.approx(10 / 9)
    force = np.hypot(output.probes["b3_x.force_n"], output.probes["b3_y.force_n"]).mean()
    # the mean over azimuths against 24 rollers that pass
    expected = bearing.mean_displacement_m(float(force))
    assert -output.probes["b3_y.displacement_m"].mean() == pytest.approx(expected, rel=0.02)
    spalled = run(machine, [("outer_race_spall", {})], 4096)
    assert 0.1 < np.std(spalled.accel[5] - output.accel[5]) < 100
    film = run(machine, [("oil_film", {"viscosity_pa_s": 0.2})], 4096)
    rise = film.probes["b3_y.displacement_m"].mean() - output.probes["b3_y.displacement_m"].mean()
    assert 0.1e-6 < rise < 3e-6  # the film lifts the shaft by about its thickness
