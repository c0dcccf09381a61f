"""Modal tests in universal files: read as written, whatever side was struck; what is wrong is told."""

from __future__ import annotations

import dataclasses
import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import pyuff
from ruamel.yaml import YAML
from small_casing import small_params

from gearsim_io.errors import InputError
from gearsim_sim.model.casing.measured_test import modes_of, update_to_file
from gearsim_sim.model.casing.modal_test import ModalTest, TestPlan, plan_test
from gearsim_sim.model.casing.placement import load_placement, plan_of
from gearsim_sim.model.casing.structure import thicknesses_m
from gearsim_sim.model.casing.universal_export import check_export, write_modal_test
from gearsim_sim.model.casing.universal_file import read_modal_test
from gearsim_sim.model.casing.updating import free_model, hung_up

LINES = 2.0 * np.arange(40)


@cache
def mesh():
    return hung_up(small_params())


@cache
def model(ring_weld: float = 0.0, modes: int = 40):
    change = np.array([ring_weld if "/b" in name else 0.0 for name in mesh().regions])
    return free_model(
        small_params(), mesh(), thicknesses_m(small_params(), mesh().regions) * (1 + change), modes
    )


@cache
def plan() -> TestPlan:
    return plan_test(model(), 12)


@cache
def responses() -> ModalTest:
    pair = np.random.default_rng(6).standard_normal((2, 3, 12, len(LINES)))
    return ModalTest(LINES, pair[0] + 1j * pair[1])


@pytest.fixture(scope="module")
def exported(tmp_path_factory) -> list[dict]:
    path = tmp_path_factory.mktemp("uff") / "test.uff"
    write_modal_test(plan(), responses(), mesh(), "a title", path)
    return pyuff.UFF(str(path)).read_sets()


def functions(sets: list[dict]) -> list[dict]:
    return [one for one in sets if one["type"] == 58]


def copied(sets: list[dict]) -> list[dict]:
    return [{key: np.copy(v) if isinstance(v, np.ndarray) else v for key, v in one.items()} for one in sets]


def written(tmp_path: Path, sets: list[dict], name: str = "changed.uff") -> Path:
    path = tmp_path / name
    pyuff.UFF(str(path)).write_sets(sets, mode="overwrite")
    return path


def read(path: Path, placement: dict | None = None) -> tuple[TestPlan, ModalTest]:
    file = None
    if placement is not None:
        file = path.with_suffix(".yaml")
        with file.open("w") as stream:
            YAML(typ="safe").dump(placement, stream)
    told = load_placement(file)
    measured = read_modal_test(path, told.response)
    assert measured.test is not None
    return plan_of(measured, told, mesh()), measured.test


def same(found: TestPlan, test: ModalTest, digits: float = 1e-12) -> None:
    """As written, in whatever order."""
    places = zip(plan().nodes, plan().directions, strict=True)
    order = [np.flatnonzero((found.nodes == n) & (found.directions @ w > 0.5)) for n, w in places]
    columns = np.concatenate(order)
    rows = np.concatenate([np.flatnonzero(found.references == columns[k]) for k in plan().references])
    assert len(columns) == len(found.nodes) == 12
    np.testing.assert_allclose(test.frequencies_hz, LINES)
    expected = responses().accelerance
    np.testing.assert_allclose(test.accelerance[rows][:, columns], expected, rtol=digits, atol=digits)


def test_a_test_comes_back_as_it_was_written(exported, tmp_path):
    same(*read(written(tmp_path, copied(exported))))


def test_it_does_not_matter_which_side_was_struck_nor_which_way_is_positive(exported, tmp_path):
    sets = copied(exported)
    for one in functions(sets):
        one["rsp_node"], one["ref_node"] = one["ref_node"], one["rsp_node"]
        one["rsp_dir"], one["ref_dir"] = -one["ref_dir"], one["rsp_dir"]
        one["data"] = -one["data"]
    same(*read(written(tmp_path, sets[:2] + sets[:1:-1])))


def test_text_files_in_millimetres_with_other_axes_are_placed(exported, tmp_path):
    """The file's x, y, z are the casing's z, x, y; its origin lies at the height of the floor."""
    sets = copied(exported)
    floor = -small_params().box.shaft_height_m
    for one in sets:
        if one["type"] == 2411:
            x, y, z = one["x"], one["y"] - floor, one["z"]
            one.update(type=15, x=1e3 * z, y=1e3 * x, z=1e3 * y)
        if one["type"] == 58:
            one["binary"] = 0
            for end in ("rsp_dir", "ref_dir"):
                one[end] = {1: 2, 2: 3, 3: 1}[one[end]]
    path = written(tmp_path, [one for one in sets if one["type"] != 164])
    placement = {"length_unit": "mm", "axes": ["z", "x", "y"], "origin": ["0 m", f"{floor} m", "0 m"]}
    # Data sets 15 keep five digits, text of responses twelve.
    same(*read(path, placement), digits=1e-10)


@pytest.mark.parametrize(("kind", "power"), [(8, 2), (11, 1)])
def test_receptances_and_mobilities_become_accelerances(exported, tmp_path, kind, power):
    sets = copied(exported)
    for one in functions(sets):
        one["ordinate_spec_data_type"] = kind
        one["data"][1:] /= (2j * np.pi * LINES[1:]) ** power
    found, test = read(written(tmp_path, sets))
    test.accelerance[:, :, 0] = read(written(tmp_path, copied(exported), "whole.uff"))[1].accelerance[:, :, 0]
    same(found, test)


def test_units_of_length_and_force_are_converted(exported, tmp_path):
    sets = copied(exported)
    for one in sets:
        if one["type"] == 164:
            one.update(length=1e3, force=1e3)  # mm and mN; what to divide by
        if one["type"] == 2411:
            one.update({axis: 1e3 * one[axis] for axis in "xyz"})
        if one["type"] == 58 and one["ref_node"] % 2:
            one["ordinate_axis_units_lab"] = "g/N"
            one["data"] /= 9.80665
    same(*read(written(tmp_path, sets)))


def test_points_may_have_coordinate_systems_of_their_own(exported, tmp_path):
    """As some programs write directions. Of odd points x, y, z lie along z, x, y, from a place beside."""
    sets = copied(exported)
    beside = np.array([0.1, -0.2, 0.3])
    system = {
        "type": 18,
        "cs_num": [5],
        "ref_cs_num": [0],
        "ref_o": [beside],
        "x_point": [beside + np.array([0, 0, 2])],
        "xz_point": [beside + np.array([0, 3, 4])],
    }
    for one in sets:
        if one["type"] == 2411:
            odd = one["node_nums"] % 2 == 1
            one["def_cs"], one["disp_cs"] = 5 * odd, 5 * odd
            x, y, z = (one[axis] - start * odd for axis, start in zip("xyz", beside, strict=True))
            one.update(x=np.where(odd, z, x), y=np.where(odd, x, y), z=np.where(odd, y, z))
        for end in ("rsp", "ref"):
            if one["type"] == 58 and one[f"{end}_node"] % 2:
                one[f"{end}_dir"] = {1: 2, 2: 3, 3: 1}[one[f"{end}_dir"]]
    assert odd.any()
    assert not odd.all()
    same(*read(written(tmp_path, [system, *sets])))
    for changes, told in (
        ({"cs_type": [1]}, "coordinate system 5: got type 1, expected a Cartesian one"),
        ({"ref_cs_num": [3]}, "coordinate system 5: got one in system 3, expected system 0"),
        ({"x_point": [beside]}, "coordinate system 5: got points on one line"),
    ):
        with pytest.raises(InputError, match=told):
            read(written(tmp_path, [{**system, **changes}, *copied(sets)]))


def test_points_may_be_placed_by_hand(exported, tmp_path):
    sets = [one for one in copied(exported) if one["type"] != 2411]
    used = sorted({one["rsp_node"] for one in functions(sets)} | {one["ref_node"] for one in functions(sets)})
    hand = {int(n): [f"{v} m" for v in mesh().nodes_m[int(n) - 1].tolist()] for n in used}
    same(*read(written(tmp_path, sets), {"points": hand}))


def test_lines_that_do_not_begin_at_zero_keep_their_frequencies(exported, tmp_path):
    sets = copied(exported)
    for one in functions(sets):
        one["x"], one["data"] = one["x"][5:], one["data"][5:]
    _, test = read(written(tmp_path, sets))
    np.testing.assert_allclose(test.frequencies_hz, LINES)
    whole = read(written(tmp_path, copied(exported), "whole.uff"))[1].accelerance
    np.testing.assert_allclose(test.accelerance[:, :, 5:], whole[:, :, 5:])


def altered(change, *, only_first: bool = False):
    """The file with its functions changed."""

    def spoil(sets):
        for one in functions(sets)[: 1 if only_first else None]:
            change(one)
        return sets

    return spoil


def without(kind):
    return lambda sets: [one for one in sets if one["type"] != kind]


def geometry(change):
    def spoil(sets):
        for one in sets:
            if one["type"] == 2411:
                change(one)
        return sets

    return spoil


def farther(one):
    one["x"][2] += 0.5


def fewer(one):
    one.update({key: one[key][1:] for key in ("node_nums", "def_cs", "disp_cs", "color", "x", "y", "z")})


def one_reference(sets):
    first = functions(sets)[0]["rsp_node"]
    return [one for one in sets if one["type"] != 58 or one["rsp_node"] == first]


def uneven(one):
    one["abscissa_spacing"] = 0
    one["x"] = np.concatenate([one["x"][:-1], one["x"][-1:] + 1.0])


def shorter(one):
    one["x"], one["data"] = one["x"][:-3], one["data"][:-3]


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (without(2411), r"geometry: got none, expected coordinates of the points \(data set 15 or 2411"),
        (geometry(fewer), "point [0-9]+: got no coordinates, expected those of every point"),
        (geometry(farther), r"points: got 1 of 12 off the casing \(point [0-9]+ at .* mm by .* mm\)"),
        (
            geometry(lambda one: one["def_cs"].__setitem__(0, 7)),
            "coordinates: got points in system 7, expected one system for all",
        ),
        (without(164), "unit of length: got none, expected a data set 164, or `length_unit`"),
        (
            without(58),
            "frequency responses: got none, expected data sets 58 of function type 4, or mode shapes",
        ),
        (altered(lambda one: one.update(func_type=6)), r"got functions of type \[6\] alone"),
        (
            altered(lambda one: one.update(ordinate_spec_data_type=15)),
            "type 15 over one of type 13, expected acc",
        ),
        (altered(lambda one: one.update(orddenom_spec_data_type=12)), "type 12 over one of type 12"),
        (altered(lambda one: one.update(ordinate_spec_data_type=0)), "`response` in --placement says"),
        (one_reference, r"references: got 1 \(point [0-9]+ along .\), expected at least 2"),
        (lambda sets: sets[:-1], r"1 of 3 x 12 missing \(first point [0-9]+ along . to point"),
        (lambda sets: [*sets, sets[-1]], "got two of point [0-9]+ along . to point .*each of them once"),
        (altered(lambda one: one.update(rsp_dir=5)), "got a rotation, expected a translation"),
        (altered(lambda one: one.update(rsp_dir=0)), "got no direction"),
        (altered(lambda one: one.update(abscissa_spec_data_type=17)), "an abscissa of type 17"),
        (altered(uneven), "lines at uneven distances"),
        (altered(shorter, only_first=True), "responses of different frequencies"),
        (altered(lambda one: one.update(data=one["data"].real)), "real numbers, or some missing"),
        (lambda sets: sets, "frequencies: got responses up to 78 Hz, expected a band within them"),
    ],
)
def test_files_that_do_not_serve_are_told_in_one_line(spoil, told, exported, tmp_path):
    path = written(tmp_path, spoil(copied(exported)))
    with pytest.raises(InputError, match=told) as error:
        update_to_file(small_params(), path, None, None, 1, lambda _step: None)
    assert "\n" not in str(error.value)
    assert str(path) in str(error.value)


def test_what_is_no_universal_file_is_told(exported, tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_modal_test(tmp_path / "none.uff")
    (tmp_path / "text.uff").write_text("hello\n")
    with pytest.raises(InputError, match="got no data sets"):
        read_modal_test(tmp_path / "text.uff")
    sets = copied(exported)
    for one in functions(sets):
        one["binary"] = 0
    lines = written(tmp_path, sets).read_text().splitlines()
    start = next(k for k, line in enumerate(lines) if line.strip() == "58")
    # Its writer turns what is not a number into 0.
    broken = [*lines[: start + 12], lines[start + 12][:40] + f"{'NaN':>20}" * 2, *lines[start + 13 :]]
    (tmp_path / "nan.uff").write_text("\n".join(broken) + "\n")
    with pytest.raises(InputError, match=r"numbers that are not finite \(point [0-9]+ along . to point"):
        read_modal_test(tmp_path / "nan.uff")
    lines[start + 7] = "not a record of numbers"
    (tmp_path / "spoilt.uff").write_text("\n".join(lines) + "\n")
    with pytest.raises(InputError, match=r"58: got one that cannot be read \(number 3 in the file\)"):
        read_modal_test(tmp_path / "spoilt.uff")


@pytest.mark.parametrize(
    ("placement", "told"),
    [
        ({"axes": ["x", "y", "y"]}, "axes: got x, y, y, expected three directions at right angles"),
        ({"axes": ["x", "z", "y"]}, "right-handed"),
        ({"length_unit": "furlong"}, "length_unit"),
        ({"reach": "0 mm"}, "reach"),
        ({"turn": 3}, "one of the keys axes, length_unit"),
    ],
)
def test_placements_that_make_no_sense_are_told(placement, told, exported, tmp_path):
    with pytest.raises(InputError, match=told):
        read(written(tmp_path, copied(exported)), placement)


def test_files_to_export_to_are_checked_before_the_work(tmp_path):
    with pytest.raises(InputError, match=r"ends in \.uff"):
        check_export(tmp_path / "test.txt")
    with pytest.raises(InputError, match="folder that exists"):
        check_export(tmp_path / "none" / "test.uff")


def shape_sets(of, kind: int) -> list[dict]:
    """Mode shapes at the points of a plan, in all three directions, by data sets 55."""
    base = np.eye(3)
    nodes = np.unique(plan_test(of, 40).nodes)
    found = []
    for k, hz in enumerate(of.frequencies_hz[:14]):
        rows = [[(of.structure.row(int(n), way) @ of.shapes[:, k])[0] for n in nodes] for way in base]
        speed = 2 * np.pi * hz
        found.append(
            {
                "type": 55,
                "analysis_type": kind,
                "data_ch": 2,
                "spec_data_type": 8,
                "load_case": 1,
                "mode_n": k + 1,
                "freq": hz,
                "modal_damp_vis": 0.004,
                "eig": complex(-0.004 * speed, speed * np.sqrt(1 - 0.004**2)),
                "node_nums": nodes + 1,
                **{f"r{axis + 1}": np.array(row) * (1j if kind != 2 else 1) for axis, row in enumerate(rows)},
            }
        )
    none = np.zeros(len(nodes), dtype=int)
    numbers = {"node_nums": nodes + 1, "def_cs": none, "disp_cs": none, "color": none}
    x, y, z = mesh().nodes_m[nodes].T
    units = {"type": 164, "units_code": 1, "length": 1.0, "force": 1.0, "temp": 1.0, "temp_offset": 0.0}
    return [units, {"type": 2411, **numbers, "x": x, "y": y, "z": z}, *found]


@pytest.mark.parametrize("kind", [2, 3])
def test_mode_shapes_are_read(kind, tmp_path):
    of = model(-0.3)
    measured = read_modal_test(written(tmp_path, shape_sets(of, kind)))
    modes = modes_of(measured, None)
    # Files keep six digits.
    np.testing.assert_allclose(modes.frequencies_hz, of.frequencies_hz[:14], rtol=1e-5)
    np.testing.assert_allclose(modes.damping, 0.004, rtol=1e-4)
    rows = plan_of(measured, load_placement(None), mesh()).rows(of)[:, :14]
    alike = np.abs(np.sum(modes.shapes.conj() * rows / np.linalg.norm(rows, axis=0), axis=0))
    np.testing.assert_allclose(alike, 1.0, atol=1e-6)
    assert len(modes_of(measured, (100.0, 500.0)).frequencies_hz) == np.sum(of.frequencies_hz[:14] < 500)
    with pytest.raises(InputError, match=r"mode shapes: got modes up to .* Hz, expected some in 3000 to"):
        modes_of(measured, (3000.0, 4000.0))
    with pytest.raises(InputError, match="--band"):
        modes_of(measured, (500.0, 100.0))


def test_a_casing_is_updated_to_mode_shapes_from_a_file(tmp_path):
    of = model(-0.3)
    path = written(tmp_path, shape_sets(of, 2))
    found = update_to_file(small_params(), path, None, None, 4, lambda _step: None)
    assert found.test is None
    update = found.tested.update
    rings = np.array(["/b" in name for name in update.regions])
    assert np.abs(update.deviations(after=False)).mean() > 0.01
    assert np.abs(update.deviations(after=True)).mean() < 0.001
    np.testing.assert_allclose(update.change[rings], -0.3, atol=0.04)
    assert np.abs(update.change[~rings]).max() < 0.1
    assert json.dumps(update.steps)


def test_modes_at_other_points_each_time_are_refused(tmp_path):
    sets = shape_sets(model(-0.3), 2)
    sets[3] = {**sets[3], "node_nums": sets[3]["node_nums"][::-1]}
    with pytest.raises(InputError, match="shapes at different points"):
        read_modal_test(written(tmp_path, sets))


def test_references_need_not_be_points(exported, tmp_path):
    """Nobody strikes where an accelerometer sits."""
    sets = copied(exported)
    seats = {(one["rsp_node"], one["rsp_dir"]) for one in functions(sets)}
    kept = [one for one in sets if one["type"] != 58 or (one["ref_node"], one["ref_dir"]) not in seats]
    found, test = read(written(tmp_path, kept))
    assert (found.references == -1).all()
    assert test.accelerance.shape == (3, 9, len(LINES))
    assert dataclasses.replace(found).reference_rows(model()).shape == (3, 40)
