"""Measured records that cannot be judged as asked: what is refused, and what can still be done."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import scipy.io

from gearsim_io.errors import InputError
from gearsim_io.importers import Overrides, import_file
from gearsim_io.machines import load_machine, machine_file
from gearsim_twin.baseline import scenario_content
from gearsim_twin.case import load_case, make_case
from gearsim_twin.causes import CAUSES
from gearsim_twin.causes.context import Context
from gearsim_twin.labels import speed_label
from gearsim_twin.simulated import Simulator

pytestmark = pytest.mark.records


@pytest.fixture
def outer(record_file):
    return record_file("mfpt/OuterRaceFault_vload_1.mat")


@pytest.fixture
def rewritten(outer, tmp_path):
    """A stretch of that record, in a file of its own."""

    def write(first, end, gain=1.0):
        bearing = scipy.io.loadmat(outer)["bearing"]
        content = {name: bearing[name][0, 0] for name in ("sr", "load", "rate")}
        content["gs"] = gain * bearing["gs"][0, 0].ravel()[first:end]
        scipy.io.savemat(tmp_path / "again.mat", {"bearing": content})
        return tmp_path / "again.mat"

    return write


@pytest.mark.parametrize(("first", "end", "gain"), [(0, None, 1.0), (20000, 100000, 1.0), (0, None, 9.80665)])
def test_a_record_to_train_on_is_not_held_out(outer, rewritten, first, end, gain):
    """Nor a copy of it, an excerpt, or one in another unit."""
    with pytest.raises(InputError, match=r"--holdout.*once more.*nothing is fitted to"):
        load_case([outer], "mfpt", "bearing5", holdout=[rewritten(first, end, gain)])


def test_a_record_too_short_tells_what_would_do(rewritten):
    with pytest.raises(
        InputError, match=r"length: got 0\.184 s, expected at least 1\.19 s.*or 0\.395 s with"
    ):
        load_case([rewritten(0, 9000)], "mfpt", "bearing5")


def test_a_model_of_another_kind_of_machine_tells_which_would_do(outer):
    with pytest.raises(InputError, match="describes mfpt: one of bearing2, bearing4, bearing5"):
        load_case([outer], "mfpt", "lpm34")


def test_a_speed_that_the_drive_cannot_do_is_another_machine(outer):
    case = load_case([outer], "mfpt", "bearing5", overrides=Overrides(speed_hz=90.0))
    with pytest.raises(InputError, match=r"90 Hz.*at most 60 Hz.*it is another machine"):
        scenario_content(case, case.views()[0])


def test_a_file_of_another_rig_is_no_file_of_this_one(outer):
    with pytest.raises(InputError, match=r"X\*_DE_time: got not in the file.*the file has bearing\.gs"):
        load_case([outer], "cwru_drive_end", "bearing5")


def test_without_any_speed_it_says_what_can_still_be_done(tmp_path):
    """The turbine's nameplate has no speed, and noise has no lines."""
    file = tmp_path / "noise_25600.csv"
    np.savetxt(file, np.random.default_rng(1).standard_normal(82000))
    case = load_case([file], "wt_hss", "lpm34")
    words = r"speed: got none.*--speed; without one `gearsim diagnose` still tells impulses"
    with pytest.raises(InputError, match=words):
        scenario_content(case, case.views()[0])
    told = load_case([file], "wt_hss", "lpm34", overrides=Overrides(speed_hz=20.0))
    assert scenario_content(told, told.views()[0])["operating_point"]["speed"]["value"] == 20.0


def test_an_unknown_unit_leaves_shapes(record_file):
    case = load_case([record_file("hit_sm/SQ_OR2_1200.mat")], "hit_sq", "bearing5")
    assert not case.levels_known
    assert any("works on shapes and ratios" in remark for remark in case.remarks)
    stated = load_case(
        [record_file("hit_sm/SQ_OR2_1200.mat")], "hit_sq", "bearing5", overrides=Overrides(unit="g")
    )
    assert stated.levels_known


def test_a_record_of_another_machine_is_called_so(record_file):
    """The bench gearbox of 32 teeth at 30 Hz, said to be the wind turbine's stage of 22."""
    bench = import_file(record_file("sq_gearbox/h30hz0.csv.gz"), "sq_gearbox")
    said = dataclasses.replace(
        bench, data=bench.data[:1], channels=("accel",), unit="1", notes={}, machine=""
    )
    case = make_case(load_machine("wt_hss"), machine_file("wt_hss"), "lpm34", [said])
    views = case.views()[:1]
    content = scenario_content(case, views[0])
    with Simulator(case, 1, case.views()) as simulator:
        shown = tuple(simulator.views({0: content}, 4.0))
    seen = Context(case, views, (), (), (), (content,), shown)
    (start,) = CAUSES["mislabelled_record"].starts(seen)
    # Both machines that it could be have 32 teeth on the reference shaft.
    assert start["component"] in ("unsw_parallel", "sq_gearbox")
    assert "the record is of another machine" in CAUSES["mislabelled_record"].signature(start)


@pytest.mark.parametrize(
    ("name", "source", "machine", "channel"),
    [
        ("cwru/135_0.mat", "cwru_drive_end", "mfpt", "accel"),
        ("hit_sm/SQ_OR2_1200.mat", "hit_sq", "cwru_drive_end", "drive_end"),
    ],
)
def test_a_record_of_another_rig_is_no_offset_of_this_one(record_file, name, source, machine, channel):
    """Near the speed of the wrong rig lines are found, every fourth or so of the right one."""
    record = import_file(record_file(name), machine_file(source))
    other = dataclasses.replace(record, channels=(channel,), data=record.data[:1], notes={}, machine="")
    case = make_case(load_machine(machine), machine_file(machine), "bearing5", [other])
    views = case.views()
    label = speed_label(views[:1], views[1:], tuple(CAUSES.values()), 60.0)
    assert label is not None
    assert label.found.name == "mislabelled_record"
    assert label.contradicted


@pytest.mark.parametrize("factor", [0.97, 1.03])
def test_a_speed_stated_wrongly_by_three_percent_is_told_with_the_right_one(record_file, factor):
    record = import_file(record_file("cwru/135_0.mat"), machine_file("cwru_drive_end"))
    stated = dataclasses.replace(record, notes={**record.notes, "speed_hz": f"{29.933 * factor:.6g}"})
    case = make_case(load_machine("cwru_drive_end"), machine_file("cwru_drive_end"), "bearing5", [stated])
    views = case.views()
    label = speed_label(views[:1], views[1:], tuple(CAUSES.values()), 60.0)
    assert label is not None
    assert label.found.name == "shaft_speed_offset"
    (speed,) = label.found.parameters
    assert speed.value == pytest.approx(29.937, abs=0.01)
