"""Pictures of an updating show each thing where it belongs."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

from gearsim_bringup.casing_pictures.modal_test import draw_macs, draw_responses
from gearsim_bringup.casing_pictures.updating import draw_deviations
from gearsim_sim.model.casing.from_test import TestedUpdate
from gearsim_sim.model.casing.identify import IdentifiedModes
from gearsim_sim.model.casing.modal_test import ModalTest, TestPlan, plan_test
from gearsim_sim.model.casing.params import load_casing
from gearsim_sim.model.casing.structure import thicknesses_m
from gearsim_sim.model.casing.updating import Match, free_model, hung_up


@pytest.fixture
def drawn(monkeypatch) -> list[Figure]:
    """Figures in place of files."""
    figures: list[Figure] = []
    monkeypatch.setattr(Figure, "savefig", lambda self, *_args, **_more: figures.append(self))
    return figures


def pairs(measured, modes, model_hz):
    return Match(np.array(measured), np.array(modes), np.full(len(modes), 0.9)), np.array(model_hz)


def update_of(before, after):
    sides = {False: before, True: after}

    def deviations(*, after):
        match, model_hz = sides[after]
        return model_hz / match.measured_hz - 1

    return SimpleNamespace(first_pairs=before[0], last_pairs=after[0], deviations=deviations)


def test_bars_stand_at_the_frequencies_they_are_of(drawn, tmp_path):
    """Also where a mode has a pair on one side only."""
    before = pairs([200.0, 400.0], [0, 3], [206.0, 404.0])
    after = pairs([300.0, 400.0], [1, 3], [306.0, 400.4])
    draw_deviations(update_of(before, after), tmp_path / "x.png")
    axes = drawn[0].axes[0]
    labels = [tick.get_text() for tick in axes.get_xticklabels()]
    assert labels == ["200", "300", "400"]
    found = [
        {labels[round(bar.get_center()[0])]: bar.get_height() for bar in container}
        for container in axes.containers
    ]
    assert found[0] == pytest.approx({"200": 3.0, "400": 1.0})
    assert found[1] == pytest.approx({"300": 2.0, "400": 0.1})


@pytest.fixture
def tested(coarse) -> TestedUpdate:
    """The casing's own first modes as a test of it, with an accelerometer where nobody strikes."""
    params = load_casing(coarse)
    mesh = hung_up(params)
    model = free_model(params, mesh, thicknesses_m(params, mesh.regions), 12)
    plan = plan_test(model, 20)
    plan = TestPlan(plan.nodes[1:], plan.directions[1:], plan.nodes[:1], plan.directions[:1])
    own = plan.rows(model)
    shapes = (own / np.linalg.norm(own, axis=0)).astype(complex)
    modes = IdentifiedModes(model.frequencies_hz, np.full(12, 0.01), shapes, np.ones(12))
    match = Match(model.frequencies_hz, np.arange(12), np.ones(12))
    update = SimpleNamespace(before=model, after=model, first_pairs=match, last_pairs=match)
    return TestedUpdate(modes, update, plan)


def test_marks_of_pairs_stand_on_their_squares(tested, drawn, tmp_path):
    draw_macs(tested, tmp_path / "x.png")
    for axes in drawn[0].axes[:2]:
        image, marks = axes.images[0], axes.lines[0]
        left, right, bottom, top = image.get_extent()
        values = np.asarray(image.get_array())
        columns = ((marks.get_xdata() - left) / (right - left) * values.shape[1]).astype(int)
        rows = ((marks.get_ydata() - bottom) / (top - bottom) * values.shape[0]).astype(int)
        np.testing.assert_allclose(values[rows, columns], 1.0)
        np.testing.assert_array_equal(marks.get_xdata(), np.arange(1, 13))


def test_responses_of_the_model_lie_on_those_of_a_test_that_it_is_true_to(tested, drawn, tmp_path):
    """At the loudest point, as none lies where the accelerometer is."""
    plan, model = tested.plan, tested.update.after
    assert (plan.references == -1).all()
    lines = np.arange(1.0, 900.0, 1.0)
    speeds = 2 * np.pi * lines
    squares = model.squares[:, None]
    filters = -(speeds**2) / (squares - speeds**2 + 0.02j * np.sqrt(squares) * speeds)
    motion = model.structure.rigid_motion()
    inertia = np.linalg.inv(motion.T @ (model.structure.mass @ motion))
    ends = [
        np.array([(model.structure.row(int(n), w) @ motion)[0] for n, w in zip(nodes, ways, strict=True)])
        for nodes, ways in (
            (plan.reference_nodes, plan.reference_directions),
            (plan.nodes, plan.directions),
        )
    ]
    rigid = ends[0] @ inertia @ ends[1].T
    elastic = np.einsum("rm,pm,mf->rpf", plan.reference_rows(model), plan.rows(model), filters)
    draw_responses(tested, ModalTest(lines, elastic + rigid[:, :, None]), tmp_path / "x.png")
    test, before, after = (line.get_ydata() for line in drawn[0].axes[0].lines)
    np.testing.assert_allclose(before, test, rtol=1e-9)
    np.testing.assert_allclose(after, test, rtol=1e-9)
