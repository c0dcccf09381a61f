"""Pages of methods and pictures of methods belong together, and pictures come from measured records."""

import re
from pathlib import Path

import matplotlib.image
import pytest
from matplotlib.figure import Figure

from gearsim_bringup.method_figures import FIGURES
from gearsim_bringup.method_figures.draw import drawer, make_figures
from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import LARGEST_BYTES, mark
from gearsim_io.errors import EnvironmentLackError, InputError

DOCS = Path(__file__).parents[2] / "docs"
PAGES = sorted(page for page in (DOCS / "methods").glob("*.md") if page.name != "README.md")
PICTURE = re.compile(r"!\[[^\]]+\]\(([^)]+)\)")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_page_shows_pictures_that_exist_and_are_registered(page):
    shown = [(page.parent / link).resolve() for link in PICTURE.findall(page.read_text(encoding="utf-8"))]
    assert shown, "a page of a method shows it at work"
    for picture in shown:
        assert picture.is_file(), picture
        assert picture.parent == DOCS / "images" / "methods"
        assert picture.stem in FIGURES, f"{picture.name} is made by no registered figure"


def test_the_index_leads_to_every_page():
    text = (DOCS / "methods" / "README.md").read_text(encoding="utf-8")
    linked = set(re.findall(r"\]\(([\w.]+\.md)\)", text))
    assert linked == {page.name for page in PAGES}


@pytest.mark.parametrize("name", FIGURES)
def test_every_figure_has_its_page_and_a_small_picture(name):
    page = DOCS / "methods" / f"{name}.md"
    assert f"](../images/methods/{name}.png)" in page.read_text(encoding="utf-8")
    assert (DOCS / "images" / "methods" / f"{name}.png").stat().st_size <= LARGEST_BYTES
    assert callable(drawer(name))


def test_names_are_registered_once():
    assert len(set(FIGURES)) == len(FIGURES)


@pytest.mark.records
def test_a_picture_is_drawn_from_a_measured_record(record_file, tmp_path):
    record_file("mfpt/OuterRaceFault_vload_3.mat")
    record_file("mfpt/baseline_1.mat")
    seen = []
    files = make_figures(
        tmp_path / "new", ("squared_envelope_spectrum",), lambda *progress: seen.append(progress)
    )
    assert files == [tmp_path / "new" / "squared_envelope_spectrum.png"]
    assert seen == [(0, 1, "squared_envelope_spectrum")]
    pixels = matplotlib.image.imread(files[0])[:, :, :3]
    red = (pixels[..., 0] > 0.6) & (pixels[..., 1] < 0.4)
    assert red.sum() > 500
    assert [file.name for file in (tmp_path / "new").iterdir()] == [files[0].name]


def test_an_absent_record_is_told_with_its_remedy(monkeypatch, tmp_path):
    monkeypatch.setenv("GEARSIM_DATA", str(tmp_path))
    monkeypatch.setattr("gearsim_bringup.method_figures.measured.find_record", lambda _relative: None)
    with pytest.raises(EnvironmentLackError, match=r"data get mfpt"):
        Measured().record("mfpt/baseline_1.mat")
    with pytest.raises(EnvironmentLackError, match=r"GEARSIM_DATA=DIR, with DIR/cwru/135_0\.mat"):
        Measured().record("cwru/135_0.mat")


def test_wrong_names_are_told():
    with pytest.raises(InputError, match="squared_envelope_spectrum"):
        drawer("kurtosissogram")
    with pytest.raises(InputError, match="a path below cwru"):
        Measured().record("elsewhere/record.mat")


def test_marks_carry_their_names():
    axes = Figure().subplots()
    mark(axes, 3.0, "BPFO")
    assert [text.get_text() for text in axes.texts] == ["BPFO"]
    assert axes.lines[0].get_xdata()[0] == 3.0
