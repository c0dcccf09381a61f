"""The gallery shows every kind of fault, each by a difference that the fault alone makes."""

from itertools import combinations
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from matplotlib.figure import Figure

from gearsim_bringup.gallery.analysis import compare
from gearsim_bringup.gallery.cases import IN_CASINGS, cases, faults_of
from gearsim_bringup.gallery.marks import mark_orders
from gearsim_bringup.gallery.page import make_gallery
from gearsim_dsp.kinematics import FaultFamily
from gearsim_io.errors import InputError
from gearsim_sim.model.faults import REGISTRY

GALLERY = Path(__file__).parents[2] / "docs" / "gallery"


@pytest.fixture(scope="module")
def outer():
    (case,) = cases(("outer_race_spall",))
    return case


def test_every_kind_has_a_scenario_that_shows_it():
    found = {case.name: case for case in cases()}
    assert list(found) == [*REGISTRY, *IN_CASINGS]
    assert {found[name].healthy.model for name in IN_CASINGS} == {"cb146", "cb182"}
    for case in found.values():
        kind = case.kind
        assert any(fault.kind == kind for fault in faults_of(case.faulty))
        assert not any(fault.kind == kind for fault in faults_of(case.healthy))
        assert REGISTRY[kind].look_for, kind


def test_healthy_and_faulty_differ_by_the_fault_alone(outer):
    faulty, healthy = outer.faulty, outer.healthy
    assert (faulty.seed, faulty.speed_hz, faulty.load_nm) == (healthy.seed, healthy.speed_hz, healthy.load_nm)
    assert faulty.sensors == healthy.sensors
    assert not faulty.events
    assert not healthy.events


def test_the_picture_shows_the_line_that_the_nameplate_predicts(outer):
    """BPFO stands out of the envelope of the faulty record, in the channel and band that were chosen."""
    comparison = compare(outer, 2.0)
    (family,) = [one for one in comparison.families if one.fault == "outer_race"]
    healthy, faulty = comparison.envelopes
    near = np.abs(comparison.orders - family.order) < 0.1
    elsewhere = (comparison.orders > 1) & ~near
    assert faulty[near].max() > 10 * np.median(faulty[elsewhere])
    assert faulty[near].max() > 10 * healthy[near].max()


def test_pictures_are_drawn_and_show_both_records(outer, tmp_path):
    seen = []
    files = make_gallery(tmp_path / "new", (outer.kind,), 0.5, lambda *progress: seen.append(progress))
    assert files == [tmp_path / "new" / "outer_race_spall.png"]
    assert seen == [(0, 1, "outer_race_spall")]
    pixels = matplotlib.image.imread(files[0])[:, :, :3]
    red = (pixels[..., 0] > 0.6) & (pixels[..., 1] < 0.4)
    grey = (np.abs(pixels - 0x8A / 255) < 0.05).all(axis=2)
    assert red.sum() > 500
    assert grey.sum() > 500


@pytest.mark.parametrize(
    "orders", [(0.408, 4.89, 5.222, 7.11), (0.398, 3.585, 4.713, 5.415), (21.7, 24.2, 24.6)]
)
def test_names_of_orders_do_not_overlap(orders):
    """Those of two shipped bearings, and some at the end of the axis."""
    axes = Figure(figsize=(11, 6.2), dpi=80).subplot_mosaic([["above", "above"], ["left", "right"]])["right"]
    axes.plot([0, 25], [0, 1])
    axes.set(xlim=(0, 25), ylim=(0, 1))
    mark_orders(axes, [FaultFamily("b", "outer_race", order, 0.0, "2xBSF", 0.01) for order in orders])
    frame = axes.get_window_extent()
    boxes = [text.get_window_extent() for text in axes.texts]
    assert len(boxes) == len(orders)
    for one, other in combinations(boxes, 2):
        assert not one.overlaps(other)
    for box in boxes:
        assert frame.x0 < box.x0 < box.x1 < frame.x1
        assert axes.transData.transform((0, 1))[1] < box.y0  # above the curves


def test_unknown_kinds_are_named():
    with pytest.raises(InputError, match="outer_race_spall"):
        cases(("crack",))


def test_the_gallery_in_docs_is_complete():
    page = (GALLERY / "README.md").read_text(encoding="utf-8")
    for name in (*REGISTRY, *IN_CASINGS):
        assert f"![{name}]({name}.png)" in page
        assert (GALLERY / f"{name}.png").is_file()
