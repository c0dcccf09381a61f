"""A user's own matrices: every format gives the same reduction, and what is wrong is told in one line."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.io
import scipy.sparse
from pyyeti.nastran import op4
from ruamel.yaml import YAML
from small_casing import small_params, small_structure

from gearsim_io.errors import InputError
from gearsim_sim.model.casing.export import write_matrices
from gearsim_sim.model.casing.matrix_files import read_matrix
from gearsim_sim.model.casing.reduce_file import reduce_description
from gearsim_sim.model.casing.user_casing import load_user_casing


def chain(count: int = 30) -> tuple[scipy.sparse.csc_array, scipy.sparse.csc_array]:
    """Masses in a row between springs, each three displacements: a structure of 3 count rows."""
    line = scipy.sparse.diags_array(
        [-np.ones(count - 1), np.full(count, 2.0), -np.ones(count - 1)], offsets=[-1, 0, 1]
    )
    stiffness = scipy.sparse.kron(line, np.array([[3.0, 1, 0], [1, 3, 1], [0, 1, 3]]) * 1e6)
    return scipy.sparse.csc_array(stiffness), scipy.sparse.csc_array(scipy.sparse.eye_array(3 * count) * 2.0)


ABOUT = {
    "name": "chain",
    "stiffness": {"file": "k.npz"},
    "mass": {"file": "m.npz"},
    "damping_ratio": 0.02,
    "masters": {"left": {"rows": [0, 1, 2, 3, 4, 5], "position": ["0 m", "0 m", "0 m"]}},
    "sensors": {
        "tip": {"rows": [87, 88, 89], "direction": [0, 3, 4], "position": ["1 m", "0 m", "0 m"]},
    },
}


def write(folder, stiffness=None, mass=None, **changes):
    spring, weight = chain()
    scipy.sparse.save_npz(folder / "k.npz", spring if stiffness is None else stiffness)
    scipy.sparse.save_npz(folder / "m.npz", weight if mass is None else mass)
    path = folder / "chain.yaml"
    with path.open("w") as file:
        YAML(typ="safe").dump({**ABOUT, **changes}, file)
    return path


def reduce(path, modes=10):
    return reduce_description(str(path), modes, (), None, lambda _step, _done: None)


def test_files_of_a_built_casing_reduce_to_the_same(tmp_path):
    from gearsim_sim.model.casing.build import reduce_casing

    write_matrices(small_structure(free=False), small_params(), tmp_path)
    own = reduce_casing(small_params(), modes=20)
    from_files = reduce(tmp_path / "casing.yaml", modes=20)
    assert from_files.masters == own.masters
    assert np.allclose(from_files.positions_m, own.positions_m)
    for name in ("mass", "stiffness"):
        first, second = getattr(own, name), getattr(from_files, name)
        assert np.allclose(first, second, atol=1e-7 * np.abs(first).max())
    shared = {site.name for site in from_files.sites}
    assert {"b1_y", "b3_y"} <= shared
    site, again = own.site("b3_y"), from_files.site("b3_y")
    assert np.allclose(site.rows, again.rows, atol=1e-6 * np.abs(site.rows).max())


def test_every_format_is_read_alike(tmp_path):
    stiffness, _ = chain()
    scipy.sparse.save_npz(tmp_path / "k.npz", stiffness)
    scipy.io.mmwrite(tmp_path / "k.mtx", stiffness)
    op4.write(str(tmp_path / "k.op4"), {"KAAX": stiffness.toarray(), "OTHER": np.eye(3)}, binary=True)
    op4.write(str(tmp_path / "text.op4"), {"KAAX": stiffness.toarray()}, binary=False, digits=16)
    (tmp_path / "k.pch").write_text(punch("KAAX", stiffness.toarray()))
    for file, name in (("k.npz", ""), ("k.mtx", ""), ("k.op4", "kaax"), ("text.op4", ""), ("k.pch", "KAAX")):
        matrix = read_matrix(tmp_path / file, name).matrix
        assert np.allclose(matrix.toarray(), stiffness.toarray(), rtol=1e-9), file
    with pytest.raises(InputError, match="kaax, other"):
        read_matrix(tmp_path / "k.op4")


def punch(name: str, matrix: np.ndarray) -> str:
    """A DMIG of form 6 whose rows are components 1 to 3 of grid points 101, 102, ..."""

    def label(row: int) -> tuple[int, int]:
        return 101 + row // 3, 1 + row % 3

    lines = [f"DMIG    {name:<8}       0       6       2       0{'':16}{len(matrix):>8}"]
    for column in range(len(matrix)):
        grid, component = label(column)
        lines.append(f"DMIG*   {name:<16}{grid:>16}{component:>16}")
        for row in range(column, len(matrix)):
            if matrix[row, column]:
                point, direction = label(row)
                lines.append(f"*       {point:>16}{direction:>16}{matrix[row, column]:>16.9E}")
    return "\n".join(lines) + "\n"


def test_punch_files_label_their_rows(tmp_path):
    stiffness, mass = chain()
    (tmp_path / "k.pch").write_text(punch("KAAX", stiffness.toarray()))
    path = write(
        tmp_path,
        mass=mass,
        sensors={"tip": {"grid": 130, "direction": [0, 1, 0], "position": ["0 m", "0 m", "0 m"]}},
    )
    path.write_text(path.read_text().replace("k.npz", "k.pch"))
    _, structure = load_user_casing(path)
    assert structure.sensors["tip"][1].tolist() == [87, 88, 89]
    path.write_text(path.read_text().replace("grid: 130", "grid: 131"))
    with pytest.raises(InputError, match="grid point with components 1 to 3"):
        load_user_casing(path)


def test_a_chain_keeps_its_statics(tmp_path):
    reduced = reduce(write(tmp_path))
    stiffness, _ = chain()
    force = np.zeros(90)
    force[1] = 1.0
    full = scipy.sparse.linalg.spsolve(stiffness, force)
    coordinates = np.linalg.solve(reduced.stiffness, np.concatenate([force[:6], np.zeros(10)]))
    expected = full[[87, 88, 89]] @ [0, 0.6, 0.8]
    assert reduced.site("tip").rows @ coordinates == pytest.approx(expected, rel=1e-9)


def spoilt(entry: tuple[int, int], value: float, *, of_mass: bool = False) -> scipy.sparse.csc_array:
    matrix = chain()[1 if of_mass else 0].tolil()
    matrix[entry] = value
    return scipy.sparse.csc_array(matrix)


def cut(row: int) -> scipy.sparse.csc_array:
    """The chain without the springs between the masses before and after `row`."""
    matrix = chain()[0].tolil()
    matrix[:row, row:] = 0
    matrix[row:, :row] = 0
    return scipy.sparse.csc_array(matrix)


def loose() -> scipy.sparse.csc_array:
    """The chain with a last mass that one spring holds in one direction only: the others cost nothing."""
    matrix = chain()[0].toarray()
    matrix[87:, :] = matrix[:, 87:] = 0
    along = np.array([1.0, 2.0, -1.0])
    both = np.concatenate([along, -along])
    matrix[84:, 84:] += 1e6 * np.outer(both, both)
    return scipy.sparse.csc_array(matrix)


def negative() -> scipy.sparse.csc_array:
    matrix = chain()[0].toarray()
    matrix[40, 40] = 1.0
    return scipy.sparse.csc_array(matrix)


@pytest.mark.parametrize(
    ("matrices", "told"),
    [
        ({"stiffness": spoilt((10, 11), 5.0)}, r"stiffness: got 2e\+06 at \(11, 10\) but 5 at \(10, 11\)"),
        ({"mass": spoilt((3, 4), 1.0, of_mass=True)}, "expected a symmetric matrix"),
        ({"mass": chain(29)[1]}, "mass: got 87 rows, expected 90 rows, as the stiffness has"),
        ({"stiffness": chain()[0][:, :50]}, "90 rows and 50 columns, expected a square matrix"),
        ({"mass": spoilt((3, 3), -1.0, of_mass=True)}, "-1 on the diagonal of row 3"),
        ({"stiffness": negative()}, "an indefinite matrix"),
        ({"stiffness": cut(45)}, r"2 parts without connection \(the smallest of 45 rows, with row"),
        ({"stiffness": loose()}, "a mechanism: with the masters held 3 rows move freely"),
        ({"stiffness": spoilt((3, 3), np.nan)}, "not finite"),
        ({"mass": scipy.sparse.csc_array((90, 90))}, "nothing but zeros"),
    ],
)
def test_matrices_that_cannot_be_are_told_in_one_line(matrices, told, tmp_path):
    with pytest.raises(InputError, match=told) as error:
        reduce(write(tmp_path, **matrices))
    assert "\n" not in str(error.value)


def test_an_indefinite_mass_is_told(tmp_path):
    mass = spoilt((3, 4), 5.0, of_mass=True).tolil()
    mass[4, 3] = 5.0
    with pytest.raises(InputError, match="mass: got an indefinite matrix"):
        reduce(write(tmp_path, mass=scipy.sparse.csc_array(mass)))


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"masters": {"left": {"rows": [0, 1, 2, 3, 4, 90], "position": ["0 m"] * 3}}}, "rows from 0 to 89"),
        ({"masters": {"left": {"rows": [0, 1, 2], "position": ["0 m"] * 3}}}, "6 different rows"),
        ({"masters": {}}, "masters"),
        (
            {
                "masters": {
                    "left": {"rows": [0, 1, 2, 3, 4, 5], "position": ["0 m"] * 3},
                    "right": {"rows": [5, 6, 7, 8, 9, 10], "position": ["0 m"] * 3},
                }
            },
            "masters.right: got row 5, which left has too",
        ),
        (
            {"sensors": {"off": {"rows": [0, 1, 200], "direction": [0, 1, 0], "position": ["0 m"] * 3}}},
            "sensors.off.rows: got 200, expected rows from 0 to 89",
        ),
        (
            {"sensors": {"off": {"rows": [0, 1, 2], "direction": [0, 0, 0], "position": ["0 m"] * 3}}},
            "three numbers, not all 0",
        ),
        ({"masters": {"left": {"grid": 7, "position": ["0 m"] * 3}}}, "does not label its rows"),
        ({"damping_ratio": 1.2}, "damping_ratio: got 1.2"),
        ({"stiffness": {"file": "none.npz"}}, "none.npz: got no such file"),
        ({"stiffness": {"file": "k.bin"}}, "one of .npz"),
    ],
)
def test_descriptions_that_do_not_fit_are_told(changes, told, tmp_path):
    if "stiffness" in changes and changes["stiffness"]["file"] == "k.bin":
        (tmp_path / "k.bin").write_bytes(b"x")
    stiffness = changes.pop("stiffness", ABOUT["stiffness"])
    path = write(tmp_path, **changes)
    path.write_text(path.read_text().replace("k.npz", stiffness["file"]))
    with pytest.raises(InputError, match=told):
        reduce(path)


def test_more_modes_than_there_can_be_are_refused(tmp_path):
    with pytest.raises(InputError, match="modes: got 90, expected at most 82"):
        reduce(write(tmp_path), modes=90)
    # As in models whose rotations have no inertia.
    half = scipy.sparse.csc_array(
        scipy.sparse.diags_array(np.where(np.arange(90) < 6, 1.0, np.arange(90) % 2))
    )
    assert reduce(write(tmp_path, mass=half), modes=40).modes == 40
    with pytest.raises(InputError, match="modes: got 41, expected at most 40"):
        reduce(write(tmp_path, mass=half), modes=41)


def test_masters_that_leave_nothing_are_refused(tmp_path):
    masters = {f"m{k}": {"rows": list(range(6 * k, 6 * k + 6)), "position": ["0 m"] * 3} for k in range(15)}
    with pytest.raises(InputError, match="masters: got 0 of 90 displacements with mass beside"):
        reduce(write(tmp_path, masters=masters), modes=0)


def test_a_band_beyond_all_modes_is_told(tmp_path):
    path = write(tmp_path)
    with pytest.raises(InputError, match=r"modes: got 10 \(valid up to .*, expected more than there are dis"):
        reduce_description(str(path), 10, (), 1e5, lambda _step, _done: None)
