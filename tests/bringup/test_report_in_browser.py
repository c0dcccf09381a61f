"""The page of `diagnose --report` in Chromium: on a desk, on a telephone and on paper."""

import dataclasses
import re

import pytest

from gearsim_bringup.diagnosis_report.write import write_report
from gearsim_dsp.diagnose import diagnose_record

_NAME = "</script><img src=x onerror=console.error(1)>"  # a channel that its owner named unkindly
_LEAST_FONT_PX = 10


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """A report with a finding of a record of eight channels."""
    from gearsim_sim.scenario import load_scenario
    from gearsim_sim.simulation import to_record

    scenario = load_scenario("inner_race")
    record, machine = to_record(scenario, 2.5), scenario.machine
    record = dataclasses.replace(record, channels=(*record.channels[:-1], _NAME))
    channels = (*machine.channels[:-1], dataclasses.replace(machine.channels[-1], name=_NAME))
    machine = dataclasses.replace(machine, channels=channels)
    folder = tmp_path_factory.mktemp("report") / "new"
    return write_report(folder, record, machine, diagnose_record(record, machine))[0]


@pytest.fixture(scope="module")
def page():
    from browser import chromium

    with chromium() as page:
        yield page


@pytest.mark.parametrize("width", [1280, 390])
def test_it_reads_well(page, file, width):
    page.open(file, width)
    assert page.console == []
    assert [url for url in page.requests if not url.startswith("data:")] == [file.as_uri()]
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    # Nothing of a card or plot is cut off, no drawing is wider than its card, no text too small to read.
    assert (
        page.evaluate("""
        [...document.querySelectorAll(".card, .banner, .plot, .plot svg.main-svg, table, td, th")]
          .filter((e) => e.getBoundingClientRect().right > window.innerWidth + 0.5
                      || e.getBoundingClientRect().left < -0.5).length
    """)
        == 0
    )
    sizes = page.evaluate("""
        [...document.querySelectorAll("p, td, th, dt, dd, h1, h2, h3, footer, svg text")]
          .filter((e) => e.textContent.trim() && !e.closest(".modebar"))
          .map((e) => parseFloat(getComputedStyle(e).fontSize))
    """)
    assert len(sizes) > 200
    assert min(sizes) >= _LEAST_FONT_PX


def test_every_plot_is_drawn_and_valid(page, file):
    page.open(file, 1280)
    plots = page.evaluate("""
        [...document.querySelectorAll(".plot")].map((plot) => ({
          id: plot.id,
          drawn: plot.querySelectorAll("svg.main-svg").length > 0
            && plot.calcdata.every((trace) => trace.length > 0),
          // The check knows no packed numbers; that they arrive is what the next test looks at.
          wrong: (((spec) => Plotly.validate(spec.data, spec.layout))(gearsimReport.specs.get(plot)) || [])
            .map((problem) => problem.msg).filter((msg) => !msg.includes("array container")),
        }))
    """)
    assert len(plots) == 9
    assert [plot["id"] for plot in plots if not plot["drawn"]] == []
    assert {plot["id"]: plot["wrong"] for plot in plots if plot["wrong"]} == {}


def test_the_numbers_arrive(page, file):
    page.open(file, 1280)
    peak = page.evaluate("""(() => {
        const all = document.getElementById("finding-0-envelope").calcdata[0];
        const points = all.filter((p) => p.x > 6.9 && p.x < 7.3);
        const top = points.reduce((a, b) => (b.y > a.y ? b : a));
        return [top.x, top.y];
    })()""")
    assert peak[0] == pytest.approx(7.11, abs=0.03)  # the ball pass frequency of the inner race, as an order
    assert 20 < peak[1] < 200  # per cent
    ends = page.evaluate("""(() => {
        const z = document.getElementById("plot-3").calcdata[0][0].z;
        return [z.length, z[0].length, Math.max(...z.flat())];
    })()""")
    assert ends[0] == 14  # levels 0 to 7 of two and three
    assert ends[1] == 384
    assert 1 < ends[2] < 1000


def test_plots_answer(page, file):
    page.open(file, 1280)
    hidden = "document.getElementById('plot-4')._fullData.filter((t) => t.visible === 'legendonly').length"
    before = page.evaluate(hidden)
    page.evaluate("""(() => {
        const entry = [...document.querySelectorAll("#plot-4 .legendtoggle")][1];
        for (const kind of ["mousedown", "mouseup"])
          entry.dispatchEvent(new MouseEvent(kind, { bubbles: true }));
    })()""")
    assert page.evaluate(f"new Promise((done) => setTimeout(() => done({hidden}), 700))") == before + 1
    assert page.console == []


def test_a_window_made_narrow_is_filled_anew(page, file):
    page.open(file, 1280)
    page.call("Emulation.setDeviceMetricsOverride", width=390, height=900, deviceScaleFactor=1, mobile=True)
    told = page.evaluate("""new Promise((done) => setTimeout(() => done(
        [document.documentElement.scrollWidth <= window.innerWidth,
         document.querySelector(".plot svg.main-svg").getBoundingClientRect().width]), 3000))""")
    assert told[0]
    assert told[1] < 390


def test_it_prints_on_a_few_pages_and_comes_back(page, file):
    page.open(file, 1280)
    before = page.evaluate("document.querySelector('.plot svg.main-svg').getBoundingClientRect().width")
    paper = page.pdf()
    sheets = len(re.findall(rb"/Type\s*/Page\b", paper))
    assert 4 <= sheets <= 14
    # A4 in points.
    assert re.search(rb"/MediaBox\s*\[\s*0\s+0\s+59[45]\.\d+\s+84[12]\.\d+", paper)
    after = page.evaluate(
        "new Promise((done) => setTimeout(() => done("
        "document.querySelector('.plot svg.main-svg').getBoundingClientRect().width), 1500))"
    )
    assert after == before
    # While it is printed, the drawings are as wide as the paper's cards, not as the screen's.
    width = page.evaluate("""(() => {
        window.dispatchEvent(new Event("beforeprint"));
        return document.querySelector(".plot svg.main-svg").getBoundingClientRect().width;
    })()""")
    assert width <= 186 / 25.4 * 96  # the paper between its margins
