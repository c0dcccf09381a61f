"""The page of `twin --report`: what it says, its map, ladder and overlays, and how it looks in a browser."""

from __future__ import annotations

import base64
import dataclasses
import json
import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import welch

from gearsim_bringup.twin_report.numbers import quantity
from gearsim_bringup.twin_report.page import make_twin_page
from gearsim_bringup.twin_report.tiles import tile_rows
from gearsim_dsp.speed import ShaftSpeed
from gearsim_io.errors import InputError
from gearsim_io.machines import load_machine, machine_file
from gearsim_io.record import Record
from gearsim_sim.scenario import parse_scenario
from gearsim_sim.simulation import to_record
from gearsim_twin.case import make_case
from gearsim_twin.causes import CAUSES
from gearsim_twin.compare.chains import ChannelNuisance, Nuisance
from gearsim_twin.exhibit import through_chain
from gearsim_twin.judge import judge
from gearsim_twin.settings import Settings
from gearsim_twin.verdict import Number
from gearsim_twin.view import View

_BPFO = 3.245  # order of the rig's outer race
_SPALL = {"kind": "outer_race_spall", "component": "test_bearing", "params": {"width_m": "0.6 mm"}}
_HOSTILE = "</script><img src=x onerror=console.error(1)>"


def _record(seed: int, source: str) -> Record:
    content = {
        "sample_rate": "12000 Hz",
        "machine": "mfpt",
        "model": "bearing2",
        "seed": seed,
        "operating_point": {"speed": "25 Hz", "load": "0 N*m"},
        "faults": [_SPALL],
        "sensors": {
            "accelerometers": {
                "chain": "ideal",
                "channels": ["accel"],
                "all": {"noise_density": "0.02 m/s^2/Hz^0.5"},
            }
        },
    }
    return dataclasses.replace(to_record(parse_scenario(content, Path("x")), 2.0), source=source)


@pytest.fixture(scope="module")
def verdict():
    """One spall, found; judged with one cause alone, which is all that the page needs."""
    first, second = _record(5, "monday.mcap"), _record(6, "tuesday.mcap")
    case = make_case(load_machine("mfpt"), machine_file("mfpt"), "bearing2", [first], holdout=[second])
    settings = Settings(fits=1, most_guesses=2, seeds=2, most_causes=1)
    found = judge(case, settings, causes=[CAUSES["bearing_spall_outer"]], show=True)
    return dataclasses.replace(found, remarks=(f"speed of {_HOSTILE} is doubtful",))


@pytest.fixture(scope="module")
def html(verdict) -> str:
    return make_twin_page(verdict)


def _text(html: str) -> str:
    body = html[html.index("<body>") : html.index("<footer>")]
    plain = re.sub(r"<script.*?</script>|<[^>]+>", " ", body, flags=re.DOTALL)
    return re.sub(r"\s+", " ", plain)


def _plots(html: str) -> dict[str, dict]:
    pattern = r'<h3>([^<]*)</h3>(?:(?!<h3>).)*?<script type="application/json" id="[^"]*">(.*?)</script>'
    return {title: json.loads(spec) for title, spec in re.findall(pattern, html, re.DOTALL)}


def _curve(plot: dict, name: str) -> tuple[np.ndarray, np.ndarray]:
    trace = next(each for each in plot["data"] if each["name"] == name)
    values = np.frombuffer(base64.b64decode(trace["y"]["bdata"]), dtype="<f4")
    return trace["x0"] + trace["dx"] * np.arange(values.size), values


def test_the_finding_comes_first_in_plain_words(verdict, html):
    told = _text(html)
    cause = verdict.causes[0]
    assert cause.name == "bearing_spall_outer"
    assert told.index("The model misses: bearing spall outer, test_bearing") < 200
    score = verdict.scores.overall
    before, after = score.models["tuned_only"].value, score.models["extended"].value
    assert (
        f"falls from {before:.1f} to {after:.1f} dB; chance alone leaves {score.noise_floor:.1f} dB" in told
    )
    assert f"width {quantity(cause.parameters[0])}, 95 %" in told
    assert "lines at 81.12 Hz and multiples (BPFO of test_bearing) in the envelope" in told
    assert "time from entry to impact at another speed" in told  # what would decide against a wide spall
    assert "monday.mcap" in told
    assert "tuesday.mcap" in told


def test_the_map_shows_what_the_cause_mended(verdict):
    rows = tile_rows(verdict.exhibit)
    outer = next(row for row in rows if row.domain == "envelope" and row.what.startswith("BPFO"))
    assert outer.before[0].sure
    assert float(outer.before[0].label.replace("−", "-")) > 15  # of the modulation a spall makes, none
    assert not outer.after[0].sure
    # The share that chance may call sure is 1 %; a good model may err a little in a few more.
    sure = [sum(tile.sure for row in rows for tile in getattr(row, side)) for side in ("before", "after")]
    assert sure[1] <= 0.25 * sure[0]


def test_the_ladder_is_that_of_the_verdict(verdict, html):
    exhibit = verdict.exhibit
    assert [step.name for step in exhibit.steps] == ["baseline", "tuned_only", "bearing_spall_outer"]
    for key, name in zip(exhibit.keys, ("baseline", "tuned_only", "extended"), strict=True):
        assert exhibit.scores.overall.models[key].value == pytest.approx(
            verdict.scores.overall.models[name].value
        )
    bars = _plots(html)["How far each model is from the records"]["data"]
    assert bars[2]["x"][0] == pytest.approx(verdict.scores.overall.models["extended"].value, abs=1e-3)
    assert bars[3]["x"][0] == pytest.approx(verdict.scores.overall.noise_floor, abs=1e-3)
    widths = [band.band_hz for band in exhibit.bands]
    assert widths[0][0] == 0.0
    assert all(a[1] == b[0] for a, b in pairwise(widths))


def test_the_extended_model_has_the_lines_that_were_measured(html):
    plot = _plots(html)["Envelope spectra"]
    peaks = {}
    for name in ("baseline", "measured", "extended"):
        order, depth = _curve(plot, name)
        near = np.abs(order / _BPFO - 1) < 0.01
        peaks[name] = float(depth[near].max())
        if name != "baseline":
            assert order[near][np.argmax(depth[near])] == pytest.approx(_BPFO, rel=0.005)
    assert peaks["extended"] == pytest.approx(peaks["measured"], rel=0.25)
    assert peaks["baseline"] < 0.5 * peaks["measured"]  # noise: a record of 2 s is one window
    marks = next(trace for trace in plot["data"] if trace["name"] == "BPFO of test_bearing")
    assert marks["x"][0] == pytest.approx(_BPFO, rel=0.005)


def test_a_simulated_view_passes_through_the_chain():
    rate, n = 8192.0, 1 << 17
    rng = np.random.default_rng(3)
    data = rng.standard_normal((1, n))
    record = Record(rate, ("a",), "m/s^2", data)
    speed = ShaftSpeed(10.0, (10.0, 10.0), "nameplate")
    view = View(record, load_machine("mfpt"), speed)
    chain = Nuisance((ChannelNuisance("a", 6.0, (100.0, 4000.0), (-30.0, -10.0), 1500.0),))
    hz, density = welch(through_chain(view, chain, 1).record.data[0], rate, nperseg=1024)
    own = chain.of("a")
    expected = own.gain(hz) * 2 / rate + own.floor(hz)
    inside = slice(8, -8)
    # 255 half-overlapping windows: 10 log10 of a mean of some 140 exponentials, 0.37 dB each; 4.5 of these.
    assert np.max(np.abs(10 * np.log10(density / expected)[inside])) < 1.7
    untouched = through_chain(view, Nuisance(), 1).record.data
    assert np.allclose(untouched, data)


@pytest.mark.parametrize(
    ("number", "told"),
    [
        (Number("width_m", "m", 8.0e-4, (7.92e-4, 8.08e-4)), "0.800 ± 0.008 mm"),
        (Number("frequency_hz", "Hz", 50.01, (49.91, 50.11)), "50.01 ± 0.10 Hz"),
        (Number("slip", "1", 0.008, (0.0072, 0.0088)), "0.0080 ± 0.0008"),
        (Number("length_m", "m", 2e-5, (1e-5, 6e-5)), "20 (10 to 60) µm"),
        (Number("exact", "V", 3.0, (3.0, 3.0)), "3 V"),
    ],
)
def test_quantities_read_well(number, told):
    assert quantity(number) == told


def test_what_was_not_found_is_said_so(verdict):
    exhibit = verdict.exhibit
    plain = dataclasses.replace(exhibit, steps=exhibit.steps[:2])
    unknown = dataclasses.replace(
        verdict, word="unknown", causes=(), remaining=verdict.discrepancies, exhibit=plain
    )
    told = _text(make_twin_page(unknown))
    assert "The model misses something that no known cause explains" in told
    assert verdict.discrepancies[0].words() in told
    sound = dataclasses.replace(
        verdict, word="consistent", causes=(), remaining=(), discrepancies=(), exhibit=plain
    )
    told = _text(make_twin_page(sound))
    assert "The model agrees with the records" in told
    assert "Nothing differs for sure between the records and the tuned model" in told


def test_names_cannot_break_out_and_a_page_needs_an_exhibit(verdict, html):
    assert _HOSTILE not in html
    assert "&lt;img src=x" in html
    with pytest.raises(InputError, match="show=True"):
        make_twin_page(dataclasses.replace(verdict, exhibit=None))


@pytest.fixture(scope="module")
def page():
    from browser import chromium

    with chromium() as page:
        yield page


@pytest.mark.parametrize("width", [1280, 390])
def test_it_reads_well_in_a_browser(page, html, tmp_path, width):
    file = tmp_path / "report.html"
    file.write_text(html, encoding="utf-8")
    page.open(file, width)
    assert page.console == []
    assert [url for url in page.requests if not url.startswith("data:")] == [file.as_uri()]
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    outside = """[...document.querySelectorAll(".card, .banner, .plot, .plot svg.main-svg, .tile, td, th")]
        .filter((e) => e.getBoundingClientRect().right > window.innerWidth + 0.5
                    || e.getBoundingClientRect().left < -0.5).length"""
    assert page.evaluate(outside) == 0
    sizes = page.evaluate("""
        [...document.querySelectorAll("p, td, th, dt, dd, h1, h2, h3, li, .tile, footer, svg text")]
          .filter((e) => e.textContent.trim() && !e.closest(".modebar"))
          .map((e) => parseFloat(getComputedStyle(e).fontSize))
    """)
    assert len(sizes) > 150
    assert min(sizes) >= 10
    plots = page.evaluate("""[...document.querySelectorAll(".plot")].map((plot) => ({
        id: plot.id, points: plot.calcdata.map((trace) => trace.length),
        wrong: (((spec) => Plotly.validate(spec.data, spec.layout))(gearsimReport.specs.get(plot)) || [])
          .map((problem) => problem.msg).filter((msg) => !msg.includes("array container")) }))""")
    assert [plot["id"] for plot in plots] == ["ladder", "bands", "plot-0", "plot-1", "plot-2", "plot-3"]
    assert {plot["id"]: plot["wrong"] for plot in plots if plot["wrong"]} == {}
    assert all(min(plot["points"]) > 0 for plot in plots)
