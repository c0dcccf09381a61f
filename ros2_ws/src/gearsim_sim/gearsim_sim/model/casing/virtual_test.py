"""A hammer test of a casing that is not as described, and the updating that has to find it out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearsim_sim.model.casing.from_test import BAND_HZ, MODES, TestedUpdate, update_to_test
from gearsim_sim.model.casing.hammer import make_specimen, strike
from gearsim_sim.model.casing.identify import require_ema
from gearsim_sim.model.casing.material import Array
from gearsim_sim.model.casing.mesh import Mesh
from gearsim_sim.model.casing.modal_test import ModalTest, plan_test
from gearsim_sim.model.casing.params import CasingParams
from gearsim_sim.model.casing.structure import thicknesses_m
from gearsim_sim.model.casing.updating import Tell, free_model, hung_up

# Modes of the specimen, to some way beyond the band; those above act by their flexibility.
SPECIMEN_MODES = 80
LINE_HZ = 1.0


@dataclass(frozen=True)
class VirtualTest:
    """What was done, what was found, and what was true."""

    mesh: Mesh
    test: ModalTest
    tested: TestedUpdate
    true_change: Array
    """Relative deviation of each region's thickness."""


def run_virtual_test(params: CasingParams, seed: int, most_steps: int, tell: Tell) -> VirtualTest:
    """Plan, strike, identify and update; only the frequency responses pass from specimen to updating.

    Parameters
    ----------
    params : CasingParams
    seed : int
        Of the specimen and of the errors of measurement.
    most_steps : int
    tell : callable
    """
    require_ema()
    mesh = hung_up(params)
    tell("plan of the test")
    plan = plan_test(free_model(params, mesh, thicknesses_m(params, mesh.regions), MODES))
    tell("modes of the specimen")
    specimen = make_specimen(params, mesh, SPECIMEN_MODES, seed)
    tell("blows of the hammer")
    lines = np.arange(0.0, 1.1 * BAND_HZ[1] + LINE_HZ, LINE_HZ)
    test = strike(specimen, plan, lines, seed)
    tested = update_to_test(params, plan, test, most_steps, tell)
    return VirtualTest(mesh, test, tested, specimen.change)
