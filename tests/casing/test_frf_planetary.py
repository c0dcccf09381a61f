"""The planetary stage heard through its housing's frequency responses: six forces and a torque."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from gearsim_io.errors import InputError
from gearsim_sim.frf.file import find_responses
from gearsim_sim.frf.of_machine import machine_responses
from gearsim_sim.frf.responses import responses_of
from gearsim_sim.models import MODELS, parameters
from gearsim_sim.scenario import parse_scenario

RATE_HZ = 65536.0
SITE = "ring_top_y"


def scenario(**more):
    each = {"modes": {"site": SITE}, "frf": {"site": SITE, "path": "frf"}}
    content = {
        "machine": "unsw_planetary",
        "model": "planetary_cb",
        "operating_point": {"speed": "2.1333 Hz", "load": "46.875 N*m"},
        "sensors": {"accelerometers": {"chain": "ideal", "channels": list(each), "each": each}},
    }
    return parse_scenario({**content, **more}, Path("test.yaml").absolute())


@pytest.fixture(scope="module")
def casing():
    return parameters(scenario()).casing


def test_responses_are_those_of_the_matrices_for_forces_and_the_torque_on_the_ring(casing):
    """Each push against the solution of (K + i w C - w^2 M) q = f, without what sites lack.

    Modes above the first one left out, at 8.7 kHz, follow without delay: a hundredth of a per cent at 300 Hz.
    """
    bare = tuple(dataclasses.replace(one, correction=0 * one.correction) for one in casing.sites)
    responses = responses_of(dataclasses.replace(casing, sites=bare), "test")
    assert responses.inputs == (
        *("ring_x", "ring_y", "ring_rz"),
        *("sun_x", "sun_y"),
        *("carrier_x", "carrier_y"),
    )
    dofs = [casing.dof(*pair) for pair in (("ring", "uy"), ("ring", "rz"), ("carrier", "ux"))]
    for frequency in (8.0, 60.0, 300.0):
        w = 2 * np.pi * frequency
        dynamic = casing.stiffness + 1j * w * casing.damping - w**2 * casing.mass
        q = np.linalg.solve(dynamic, np.eye(casing.size)[:, dofs])
        found = responses.of_inputs(("ring_y", "ring_rz", "carrier_x")).accelerances(np.array([frequency]))
        expected = -(w**2) * np.array([site.rows for site in bare]) @ q
        largest = np.abs(expected).max(axis=0)
        assert np.all(np.abs(found[..., 0] - expected) < 1e-3 * largest)


def test_the_shipped_responses_are_those_of_the_shipped_housing(casing):
    responses = machine_responses(parameters(scenario()))
    assert responses.valid_hz > 20000
    assert responses.belongs_to(casing)
    assert responses.sites == tuple(site.name for site in casing.sites)
    assert responses.inputs == responses_of(casing, "test").inputs
    # The same housing with a stiffer seat of the ring is another one: turns count by their own size.
    stiffer = casing.stiffness.copy()
    rz = casing.dof("ring", "rz")
    stiffer[rz, rz] *= 1.001
    assert not responses.belongs_to(dataclasses.replace(casing, stiffness=stiffer))


def test_both_paths_agree_as_far_as_the_modes_in_the_loop_reach():
    """Line by line; the torque on the ring is most of what the housing feels and belongs to it."""
    output = MODELS["planetary_cb"](scenario()).advance(round(0.5 * RATE_HZ))
    assert output.site_names == (SITE, "frf:" + SITE)
    assert set(output.forces) == set(find_responses("unsw_planetary_housing").inputs)
    window = np.hanning(output.sample_count)
    modes, through = (np.fft.rfft(window * (one - one.mean())) for one in output.accel)
    frequency = np.fft.rfftfreq(output.sample_count, 1 / RATE_HZ)
    for low, high, share in ((50, 2000, 0.02), (2000, 5000, 0.05)):
        band = (frequency >= low) & (frequency < high)
        differ = np.linalg.norm(modes[band] - through[band]) / np.linalg.norm(through[band])
        assert differ < share


def test_portions_change_no_bit():
    whole = MODELS["planetary_cb"](scenario()).advance(3000)
    model = MODELS["planetary_cb"](scenario())
    parts = [model.advance(count) for count in (1, 1999, 1000)]
    assert np.array_equal(whole.accel, np.hstack([part.accel for part in parts]))


def test_responses_of_another_casing_are_refused_by_the_key_that_names_them():
    named = parameters(scenario(parameters={"flexible_casing.responses": "unsw_casing_updated"}))
    with pytest.raises(
        InputError, match=r"flexible_casing\.responses: got unsw_casing_updated, expected those"
    ):
        machine_responses(named)
    with pytest.raises(InputError, match=r"whose machine names flexible_casing\.responses"):
        machine_responses(type(named)(named.gearbox, named.casing))
