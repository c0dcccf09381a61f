"""What is added to a gearbox in a casing, for good or as faults: masses and paths at sites, a loose foot."""

import dataclasses
import math

import numpy as np
import pytest
from lattice_casing import lattice

from gearsim_io.quantities import validate
from gearsim_sim.engine import Engine
from gearsim_sim.events import FaultSpec
from gearsim_sim.model.casing.reduced import Foot
from gearsim_sim.model.faults import REGISTRY
from gearsim_sim.model.plants import make_plant
from gearsim_sim.model.structure import StructureModel
from gearsim_sim.operation import Operation
from gearsim_sim.params import load_parallel_params
from gearsim_sim.params.casing_gearbox import CasingGearboxParams
from gearsim_sim.verify.reference import reference
from gearsim_sim.verify.trajectory import Course, run

RATE_HZ, LOAD_NM = 65536.0, 50.0
HUNG = FaultSpec("resonance", "wall_y", {"mass_kg": 0.5, "frequency_hz": 700.0, "damping_ratio": 0.02})
PATH = FaultSpec(
    "transfer_path",
    "b1_y",
    {"to": "b3_y", "mass_kg": 1.0, "frequency_hz": 900.0, "damping_ratio": 0.05},
)
LOOSE = FaultSpec("looseness", "pad_1", {"reduction": 0.9})
STRUCTURE = {
    "resonances": [{"site": "wall_y", "mass": "0.5 kg", "frequency": "700 Hz", "damping_ratio": 0.02}],
    "paths": [{"from": "b1_y", "to": "b3_y", "mass": "1 kg", "frequency": "900 Hz", "damping_ratio": 0.05}],
}


@pytest.fixture(scope="module")
def params():
    """The lattice, one of whose mounts can come loose: most of its weight stands there."""
    casing = lattice()[0]
    rows = np.zeros(casing.size)
    rows[casing.dof("b1", "uy")] = 1.0
    # A spring that is there: half of what holds that bore against lifting.
    stiffness = 0.5 * float(casing.stiffness[casing.dof("b1", "uy"), casing.dof("b1", "uy")])
    casing = dataclasses.replace(casing, feet=(Foot("pad_1", stiffness, rows),))
    return CasingGearboxParams(load_parallel_params().model_copy(update={"pedestals": False}), casing)


def engine(params, faults=(), structure=None):
    operation = Operation(structure=validate(StructureModel, structure or {}, "rig.yaml"))
    return Engine(params, 3, RATE_HZ, faults=faults, operation=operation)


def test_a_fault_of_structure_is_the_structure(params):
    """One is an interface that the casing carries, the other an oscillator that only forces join to it.

    A path carries a static load that the fault's start does not know: the casing's slowest mode, 65 Hz,
    swings after that, and has forgotten it to 1e-6 after 0.8 s.
    """
    plain, truth, ours = (
        one.advance(20000).accel[:, -2000:]
        for one in (
            engine(params),
            engine(params, structure=STRUCTURE),
            engine(params, faults=(HUNG, PATH)),
        )
    )
    assert (np.std(truth - plain, axis=1) > 0.1 * np.std(plain, axis=1)).any()
    assert np.std(ours - truth, axis=1).max() < 1e-4 * np.std(truth - plain, axis=1).max()


def test_faults_of_structure_follow_dop853(params):
    """A resonance, a path and a foot that opens and closes, all at once, grown within a millisecond."""
    plant = make_plant(params, 3)
    course = Course(0.005, 10.0, LOAD_NM, growth_s=0.001)
    normal = run(plant, course, 4 * RATE_HZ)
    foot = plant.mounts["pad_1"]
    lift = float(np.median(plant.system.direction(foot.lift) @ normal.x))
    loose = dataclasses.replace(LOOSE, params={**LOOSE.params, "clamp_n": foot.stiffness_n_per_m * lift})
    faults = [REGISTRY[one.kind].build(one, plant, 3) for one in (HUNG, PATH, loose)]
    found = run(plant, course, 4 * RATE_HZ, faults)
    steps = np.arange(1, found.count - 1, 3)
    truth = reference(found, steps.astype(float))
    error = np.sqrt(np.mean((found.accel[:, steps - 1] - truth) ** 2, axis=1))
    error /= np.sqrt(np.mean(truth**2, axis=1))
    assert error.max() < 1e-3, error
    for one in faults:
        alone = run(plant, course, 4 * RATE_HZ, [one]).accel
        assert np.std(alone - normal.accel) > 10 * error.max() * np.std(normal.accel), one.name


def test_severity_zero_changes_no_bit(params):
    whole = engine(params).advance(1500).accel
    still = [dataclasses.replace(one, severity=0.0) for one in (HUNG, PATH, LOOSE)]
    assert np.array_equal(engine(params, faults=still).advance(1500).accel, whole)
    parts = engine(params, faults=(HUNG, PATH, LOOSE))
    together = engine(params, faults=(HUNG, PATH, LOOSE)).advance(1500).accel
    assert np.array_equal(np.hstack([parts.advance(n).accel for n in (7, 1493)]), together)


def test_an_absorber_at_a_wall_takes_its_motion(params):
    """Tuned to the mesh frequency (320 Hz), hardly damped, it holds the wall still there and nowhere else."""
    mesh_hz = 320.0
    tuned = {"mass_kg": 20.0, "frequency_hz": mesh_hz, "damping_ratio": 0.001}
    lines = []
    for faults in ((), (dataclasses.replace(HUNG, params=tuned),)):
        rig = engine(params, faults=faults)
        output = rig.advance(65536)
        row = output.accel[output.site_names.index("wall_y"), -32768:]
        lines.append(abs(np.exp(-2j * math.pi * mesh_hz / RATE_HZ * np.arange(row.size)) @ row))
    assert lines[1] < 0.1 * lines[0]
