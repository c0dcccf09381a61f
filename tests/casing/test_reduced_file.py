"""The file of a reduced casing: what is written is read back, what is damaged is refused in one line."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from gearsim_io.errors import InputError
from gearsim_sim.model.casing.reduced import (
    ReducedCasing,
    Site,
    load_reduced,
    modal_damping,
    save_reduced,
)

MODES = 5


@pytest.fixture
def casing() -> ReducedCasing:
    rng = np.random.default_rng(3)
    n = 12 + MODES
    half = rng.normal(size=(n, n))
    mass = half @ half.T + n * np.eye(n)
    stiffness = 1e6 * (half.T @ half + np.eye(n))
    site = Site("top", (0.0, 1.0, 0.0), (0.1, 0.2, 0.0), rng.normal(size=n), rng.normal(size=12))
    return ReducedCasing(
        name="random",
        masters=("b1", "b2"),
        positions_m=rng.normal(size=(2, 3)),
        mass=mass,
        stiffness=stiffness,
        damping=modal_damping(mass, stiffness, 0.04),
        sites=(site,),
        valid_hz=1234.5,
        provenance={"source": "a test"},
    )


def test_what_is_written_is_read_back(casing, tmp_path):
    path = tmp_path / "casing.npz"
    save_reduced(casing, path)
    again = load_reduced(path)
    assert [p.name for p in tmp_path.iterdir()] == ["casing.npz"]
    for name in ("mass", "stiffness", "damping", "positions_m"):
        assert np.array_equal(getattr(again, name), getattr(casing, name))
    assert (again.name, again.masters, again.valid_hz) == (casing.name, casing.masters, casing.valid_hz)
    assert again.provenance == casing.provenance
    site = again.site("top")
    assert site.direction == (0.0, 1.0, 0.0)
    assert np.array_equal(site.rows, casing.sites[0].rows)
    assert np.array_equal(site.correction, casing.sites[0].correction)
    assert (again.size, again.modes, again.dof("b2", "uy")) == (12 + MODES, MODES, 7)


def test_damping_is_the_ratio_asked_for_in_every_mode(casing):
    speeds, shapes = casing.own_modes
    modal = shapes.T @ casing.damping @ shapes
    assert np.allclose(modal, np.diag(2 * 0.04 * speeds), atol=1e-8 * speeds.max())


def test_unknown_names_tell_the_known_ones(casing):
    with pytest.raises(InputError, match="one of top"):
        casing.site("bottom")
    with pytest.raises(InputError, match="one of b1, b2"):
        casing.dof("b3", "uy")
    with pytest.raises(InputError, match="ux, uy, uz"):
        casing.dof("b1", "y")


def test_bad_files_are_one_line(casing, tmp_path):
    with pytest.raises(InputError, match="no such file"):
        load_reduced(tmp_path / "none.npz")
    (tmp_path / "text.npz").write_text("not an archive")
    with pytest.raises(InputError, match="gearsim casing reduce"):
        load_reduced(tmp_path / "text.npz")
    np.savez(tmp_path / "other.npz", x=np.arange(3))
    with pytest.raises(InputError, match="gearsim casing reduce"):
        load_reduced(tmp_path / "other.npz")
    save_reduced(casing, tmp_path / "whole.npz")
    data = (tmp_path / "whole.npz").read_bytes()
    (tmp_path / "half.npz").write_bytes(data[: len(data) // 2])
    with pytest.raises(InputError, match="gearsim casing reduce"):
        load_reduced(tmp_path / "half.npz")


def test_arrays_that_do_not_fit_are_named(casing, tmp_path):
    path = tmp_path / "bad.npz"
    save_reduced(dataclasses.replace(casing, stiffness=casing.stiffness[:-1, :-1]), path)
    with pytest.raises(InputError, match=r"stiffness: got shape \(16, 16\), expected shape \(17, 17\)"):
        load_reduced(path)
    save_reduced(dataclasses.replace(casing, mass=np.full_like(casing.mass, np.nan)), path)
    with pytest.raises(InputError, match="mass: got numbers that are not finite"):
        load_reduced(path)
