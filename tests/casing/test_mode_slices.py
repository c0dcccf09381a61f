"""Many modes found slice by slice are all there is, in order, and orthogonal across the seams."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from small_casing import small_structure

from gearsim_sim.model.casing import slices
from gearsim_sim.model.casing.eigen import lowest_modes

COUNT = 130


@cache
def parts():
    """Stiffness and mass with the masters held, and modes found at once."""
    structure = small_structure(free=False)
    held = np.concatenate(list(structure.masters.values()))
    others = np.setdiff1d(np.arange(structure.size), held)
    stiffness = structure.stiffness[others][:, others].tocsc()
    mass = structure.mass[others][:, others].tocsc()
    return stiffness, mass, lowest_modes(stiffness, mass, COUNT)


@pytest.mark.parametrize("span", [24, 50, 100])
def test_slices_give_what_one_basis_gives(span, monkeypatch):
    monkeypatch.setattr(slices, "SPAN", span)
    stiffness, mass, (squares, shapes) = parts()
    found, sliced = slices.sliced_modes(stiffness, mass, COUNT)
    assert np.allclose(found, squares, rtol=1e-9)
    assert np.abs(sliced.T @ (mass @ sliced) - np.eye(COUNT)).max() < 1e-8
    # Neighbours may be mixed where frequencies nearly coincide; the space is the same, and signs are fixed.
    assert np.abs(np.abs(np.sum(shapes * (mass @ sliced), axis=0)) - 1).max() < 1e-5


def test_few_modes_are_found_at_once():
    stiffness, mass, (squares, shapes) = parts()
    found, sliced = slices.sliced_modes(stiffness, mass, COUNT)
    assert np.array_equal(found, squares)
    assert np.array_equal(sliced, shapes)


def test_a_mode_that_a_slice_does_not_find_is_missed(monkeypatch):
    """The pivots count it, so no slice is joined that lacks it."""
    monkeypatch.setattr(slices, "SPAN", 50)

    def blind(stiffness, mass, count, *, shift=0.0, factor=None):
        squares, shapes = lowest_modes(stiffness, mass, count, shift=shift, factor=factor)
        if shift == 0.0:
            return squares, shapes
        lost = int(np.searchsorted(squares, shift)) - 1  # the last one below the shift
        return np.delete(squares, lost), np.delete(shapes, lost, axis=1)

    monkeypatch.setattr(slices, "lowest_modes", blind)
    stiffness, mass, _ = parts()
    with pytest.raises(ArithmeticError, match="no slice joins"):
        slices.sliced_modes(stiffness, mass, COUNT)
