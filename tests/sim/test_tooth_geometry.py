"""Geometry of involute teeth: contact ratios, thicknesses, what can be assembled and what cannot."""

import math

import pytest

from gearsim_sim.model.tooth.contact_ratio import contact_ratio_external, contact_ratio_internal

ALPHA = math.radians(20)
BASE_PITCH = math.pi * 2e-3 * math.cos(ALPHA)


def test_contact_ratios_of_the_thesis():
    """Table 7.5 gives the printed 1.64 and 1.89, here in full: half a unit of the last digit allowed."""
    base = [radius * math.cos(ALPHA) for radius in (40e-3, 20e-3, 80e-3)]
    sun = contact_ratio_external(42e-3, base[0], 22e-3, base[1], 60e-3, ALPHA, BASE_PITCH)
    ring = contact_ratio_internal(22e-3, base[1], 78e-3, base[2], 60e-3, ALPHA, BASE_PITCH)
    assert sun == pytest.approx(1.64, abs=0.005)
    assert ring == pytest.approx(1.89, abs=0.005)
