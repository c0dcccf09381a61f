"""The updating of a casing against the modes that a test identified, paired by MAC (thesis 3.4.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearsim_io.errors import InputError
from gearsim_sim.model.casing.identify import IdentifiedModes, identify
from gearsim_sim.model.casing.material import Array
from gearsim_sim.model.casing.modal_test import ModalTest, TestPlan
from gearsim_sim.model.casing.pairing import mac, pair_by_mac
from gearsim_sim.model.casing.params import CasingParams
from gearsim_sim.model.casing.updating import (
    FreeModel,
    Match,
    Tell,
    Update,
    mirror_prior,
    update_thickness,
)

BAND_HZ = (100.0, 2000.0)  # modes of the thesis's test (3.3)
# Of the model: in that band, and half as many beyond.
MODES = 60
# Of an identified frequency and of what strips cannot follow of a weld, relative.
FREQUENCY_STD = 0.002


@dataclass(frozen=True)
class TestedUpdate:
    """An updating and the test it rests on."""

    __test__ = False

    identified: IdentifiedModes
    update: Update
    plan: TestPlan

    def macs(self, *, after: bool) -> Array:
        """Of all identified modes (rows) and all modes of the model."""
        return model_mac(self.plan, self.identified, self.update.after if after else self.update.before)


def update_to_test(
    params: CasingParams, plan: TestPlan, test: ModalTest, most_steps: int, tell: Tell
) -> TestedUpdate:
    """Identify modes of a test and update plate thickness to their frequencies.

    Mirror images of a strip change alike: frequencies of a symmetric casing cannot tell them apart.

    Parameters
    ----------
    params : CasingParams
    plan : TestPlan
        Its nodes are those of `params`' mesh.
    test : ModalTest
    most_steps : int
    tell : callable
    """
    tell("poles and shapes")
    return update_to_modes(params, plan, identify(test, *BAND_HZ), most_steps, tell)


def update_to_modes(
    params: CasingParams, plan: TestPlan, identified: IdentifiedModes, most_steps: int, tell: Tell
) -> TestedUpdate:
    """As `update_to_test`, to modes that have been identified.

    Raises
    ------
    InputError
        If there are none, or none of them is like a mode of the casing.
    """
    if not len(identified.frequencies_hz):
        raise InputError(params.name, "modal test", "no modes", "some that two references agree on")

    def pairing(model: FreeModel) -> Match:
        values = model_mac(plan, identified, model)
        rows, columns = pair_by_mac(values, identified.frequencies_hz, model.frequencies_hz)
        if not len(rows):
            what = f"{len(identified.frequencies_hz)} modes, none of them like one of the model"
            raise InputError(params.name, "modal test", what, "at least one pair")
        missed = len(identified.frequencies_hz) - len(rows)
        return Match(identified.frequencies_hz[rows], columns, values[rows, columns], missed)

    update = update_thickness(
        params,
        pairing,
        _modes_for(float(identified.frequencies_hz[-1])),
        mirror_prior,
        frequency_std=FREQUENCY_STD,
        most_steps=most_steps,
        tell=tell,
    )
    return TestedUpdate(identified, update, plan)


def _modes_for(highest_hz: float) -> int:
    """How many of the model's modes to compute: those of plates are as dense at all frequencies."""
    return max(MODES, int(np.ceil(MODES * highest_hz / BAND_HZ[1])))


def model_mac(plan: TestPlan, identified: IdentifiedModes, model: FreeModel) -> Array:
    """MAC of identified modes and all of a model's, shape (identified, modes)."""
    return mac(identified.shapes, plan.rows(model).astype(np.complex128))
