"""The page of `diagnose --report`: what it says and draws, and what becomes of an impossible folder."""

import base64
import dataclasses
import hashlib
import html
import json
import os
import re
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from gearsim_bringup.diagnosis_report.material import Material
from gearsim_bringup.diagnosis_report.page import make_page
from gearsim_bringup.diagnosis_report.trend import fault_level
from gearsim_bringup.diagnosis_report.write import PAGE, VERDICT, write_report
from gearsim_bringup.pages.assembled import PLOTLY, script_safe
from gearsim_bringup.pages.folder import check_folder, placed
from gearsim_bringup.pages.plot import axis, extremes, packed, strongest
from gearsim_dsp.diagnose import Diagnosis, diagnose_record
from gearsim_io.errors import InputError
from gearsim_io.importers import import_file
from gearsim_io.machines import load_machine

_TITLES = (
    "Squared envelope spectrum", "Vibration over time", "Power spectrum",
    "Power spectrum with the expected lines",
    "Kurtogram", "Order spectrum", "Cyclic coherence", "Trend over the record", "Data quality",
)  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Report:
    """A page, what is drawn in it by title, and the diagnosis behind it."""

    file: Path
    page: str
    plots: dict[str, dict]
    diagnosis: Diagnosis


def _report(folder: Path, record, machine) -> Report:
    diagnosis = diagnose_record(record, machine)
    file, _ = write_report(folder, record, machine, diagnosis)
    page = file.read_text()
    return Report(file, page, _plots(page), diagnosis)


def _plots(page: str) -> dict[str, dict]:
    """The plots' specifications by title."""
    found = re.findall(
        r'<h3>([^<]*)</h3>.*?<script type="application/json" id="[^"]*">(.*?)</script>', page, re.DOTALL
    )
    return {title: json.loads(spec) for title, spec in found}


def _unpacked(numbers: dict) -> np.ndarray:
    values = np.frombuffer(base64.b64decode(numbers["bdata"]), "<f4")
    return values.reshape([int(n) for n in numbers["shape"].split(",")]) if "shape" in numbers else values


def _named(plot: dict, name: str) -> dict:
    return next(trace for trace in plot["data"] if name in trace.get("name", ""))


@pytest.fixture(scope="module")
def simulated():
    """A record of eight channels with a spall on an inner race, and its machine."""
    from gearsim_sim.scenario import load_scenario
    from gearsim_sim.simulation import to_record

    scenario = load_scenario("inner_race")
    return to_record(scenario, 2.5), scenario.machine


@pytest.fixture(scope="module")
def report(simulated, tmp_path_factory):
    return _report(tmp_path_factory.mktemp("report") / "new" / "folder", *simulated)


def test_every_plot_is_there(report):
    titles = re.findall(r"<h[23]>([^<]*)</h[23]>", report.page)
    assert set(_TITLES) <= set(titles)
    assert "Not shown" not in report.page
    assert "The blows one by one" in report.plots


def test_the_verdict_is_told_in_words_and_numbers(report):
    finding = report.diagnosis.findings[0]
    assert (finding.component, finding.fault) == ("bearing_2", "inner_race")
    assert "One fault found: damaged inner race, bearing_2" in report.page
    assert f"{finding.found_hz:.2f} times a second" in report.page
    assert f"order {finding.expected_order:.4f}" in report.page
    assert f"{100 * finding.confidence:.0f} %" in report.page
    assert json.loads((report.file.parent / VERDICT).read_text()) == json.loads(
        json.dumps(report.diagnosis.to_json())
    )


def test_plots_are_drawn_over_the_angle_that_the_diagnosis_has(report, simulated):
    material = Material.of(*simulated, report.diagnosis)
    assert material.turning.source == "tacho"
    assert material.phase is material.turning.phase is report.diagnosis.angle.speed.phase is not None
    assert "angle" not in json.dumps(report.diagnosis.to_json())


def test_the_fault_stands_at_its_line_in_the_envelope(report):
    plot = report.plots["Squared envelope spectrum"]
    curve, marks = plot["data"][0], _named(plot, "inner race")
    values = _unpacked(curve["y"])
    axis = curve["x0"] + curve["dx"] * np.arange(values.size)
    near = (axis > 6.9) & (axis < 7.3)
    order = report.diagnosis.findings[0].found_order
    # Windows of 20 turns have lines 1/20 of an order apart.
    assert axis[near][np.argmax(values[near])] == pytest.approx(order, abs=0.5 / 20)
    assert values[near].max() > 10 * np.median(values)
    places = [x for x in marks["x"] if x is not None][::2]
    assert np.array(places) == pytest.approx(order * np.arange(1, len(places) + 1), rel=1e-6)


def test_gear_mesh_and_its_sidebands_are_marked(report):
    plot = report.plots["Order spectrum"]
    assert [x for x in _named(plot, "mesh gears")["x"] if x][::2] == [32.0, 64.0, 96.0]
    sidebands = [x for x in _named(plot, "gears ±")["x"] if x][::2]
    assert sidebands[:6] == [29.0, 30.0, 31.0, 33.0, 34.0, 35.0]
    values = _unpacked(plot["data"][0]["y"])
    axis = plot["data"][0]["x0"] + plot["data"][0]["dx"] * np.arange(values.size)
    assert axis[np.argmax(values)] == pytest.approx(32.0, abs=0.1)


def test_the_coherence_rises_at_the_fault(report):
    plot = report.plots["Cyclic coherence"]
    curve = _named(plot, "mean over carriers")
    values = _unpacked(curve["y"])
    axis = curve["x0"] + curve["dx"] * np.arange(values.size)
    order = report.diagnosis.findings[0].found_order
    near = np.abs(axis - order) < 0.2
    assert axis[near][np.argmax(values[near])] == pytest.approx(order, abs=0.05)
    assert values[near].max() > 3 * np.median(values)
    heat = plot["data"][0]
    columns = heat["x0"] + heat["dx"] * np.arange(_unpacked(heat["z"]).shape[1])
    strength = _unpacked(heat["z"]).sum(axis=0)
    assert strength[np.argmin(np.abs(columns - order))] > 3 * np.median(strength)


def test_all_channels_are_drawn_with_their_peaks(report, simulated):
    record = simulated[0]
    traces = report.plots["Vibration over time"]["data"]
    assert [trace["name"] for trace in traces] == list(record.channels)
    for trace, row in zip(traces, record.data, strict=True):
        values = _unpacked(trace["y"])
        assert values.size <= 2000
        assert (values.max(), values.min()) == (row.max(), row.min())
        assert trace["dx"] * values.size == pytest.approx(record.seconds, rel=2e-3)


def test_the_page_is_of_bounded_size(report):
    largest = 1_000_000  # of all plots together, eight channels included; plotly.js is 1.5 MB on top
    bundle = resources.files("gearsim_bringup.pages").joinpath("files", PLOTLY).read_text()
    assert len(report.page) - len(bundle) < largest


def test_a_record_of_real_measurement(record_file, tmp_path):
    path = record_file("mfpt/OuterRaceFault_1.mat")
    made = _report(tmp_path / "new", import_file(path, "mfpt"), load_machine("mfpt"))
    assert "Not shown" not in made.page
    curve = made.plots["Squared envelope spectrum"]["data"][0]
    values = _unpacked(curve["y"])
    axis = curve["x0"] + curve["dx"] * np.arange(values.size)
    # The README of the record's source gives 81.1 Hz without slip; found by an independent zoom: 80.5 Hz.
    assert axis[np.argmax(np.where(axis > 20, values, 0))] == pytest.approx(80.5, abs=0.5)


def test_nothing_found_is_told_with_what_was_looked_at(record_file, tmp_path):
    path = record_file("mfpt/baseline_1.mat")
    made = _report(tmp_path / "new", import_file(path, "mfpt"), load_machine("mfpt"))
    assert "No fault found" in made.page
    assert "Looked at: bearings" in made.page
    marked = [trace["name"] for trace in made.plots["Squared envelope spectrum"]["data"]]
    assert {"BPFO test_bearing", "BPFI test_bearing"} <= set(marked)


@pytest.mark.parametrize("damage", ["silent", "not finite"])
def test_a_record_that_cannot_be_judged_has_its_page_too(simulated, tmp_path, damage):
    record, machine = simulated
    data = np.zeros_like(record.data) if damage == "silent" else np.full_like(record.data, np.nan)
    made = _report(tmp_path / "new", dataclasses.replace(record, data=data), machine)
    assert "No fault found" not in made.page
    assert "Nothing could be judged" in made.page
    assert made.page.count("Not shown") >= 6
    assert "(not judged)" in made.page


def test_a_short_record_without_speed_says_what_is_missing(simulated, tmp_path):
    record, machine = simulated
    short = dataclasses.replace(record, data=record.data[:, :6000].copy(), tachos=(), encoders=())
    shafts = tuple(dataclasses.replace(shaft, nominal_speed_hz=float("nan")) for shaft in machine.shafts)
    unknown = dataclasses.replace(machine, shafts=shafts, bearings=())
    made = _report(tmp_path / "new", short, unknown)
    assert "Not shown: order spectrum" in made.page
    assert "Vibration over time" in made.plots


def test_names_cannot_break_out(simulated):
    record, machine = simulated
    bad = "</script><img src=x onerror=alert(1)>"
    channels = (bad, *record.channels[1:])
    named = dataclasses.replace(
        machine,
        name=bad,
        channels=(dataclasses.replace(machine.channels[0], name=bad), *machine.channels[1:]),
    )
    odd = dataclasses.replace(record, channels=channels, source=bad, notes={bad: bad})
    from gearsim_bringup.diagnosis_report.material import Material

    page = make_page(Material.of(odd, named, diagnose_record(odd, named)))
    assert bad not in page
    assert html.escape(bad) in page
    assert _plots(page)["Vibration over time"]["data"][0]["name"] == html.escape(bad)


def test_numbers_and_labels_cannot_break_out():
    whole = {"name": "</script><!--"}
    assert "<" not in script_safe(whole)
    assert json.loads(script_safe(whole)) == whole
    assert axis("order of <b>")["title"]["text"] == "order of &lt;b&gt;"


def test_the_bundle_is_the_one_released():
    files = resources.files("gearsim_bringup.pages").joinpath("files")
    told = hashlib.sha256(files.joinpath(PLOTLY).read_bytes()).hexdigest()
    assert told == "79542150855a52c567260e3137095dbe2b744e6d702a5cabe67da246942fba7a"
    assert "MIT" in files.joinpath("plotly-LICENSE.txt").read_text()


def test_what_is_drawn_keeps_what_stands_out():
    values = np.zeros(100_003, dtype=np.float32)
    values[[5, 70_000, 100_002]] = [1.0, -2.0, 3.0]
    drawn, stride = extremes(values, 500)
    assert drawn.size <= 1001
    assert sorted(drawn[drawn != 0]) == [-2.0, 1.0, 3.0]
    assert np.argmin(drawn) * stride == pytest.approx(70_000, abs=2 * stride)
    peaks, length = strongest(np.abs(values), 500)
    assert peaks.size <= 500
    assert np.flatnonzero(peaks).tolist() == [0, 70_000 // length, 100_002 // length]


def test_numbers_are_packed_as_they_are():
    table = np.array([[1.5, -2.0, 3.25], [0.0, 1e-6, 7.0]])
    assert np.array_equal(_unpacked(packed(table)), table.astype(np.float32))


def test_the_fault_level_is_the_depth_of_modulation():
    rate, fault = 20_000.0, 80.0
    t = np.arange(20_000) / rate
    noise = np.random.default_rng(1).normal(size=t.size)
    deep = noise * np.sqrt(1 + 0.8 * np.cos(2 * np.pi * fault * t))
    # 1 + 0.8 cos(.) has the amplitude 0.8; noise of the band adds a few per cent either way.
    assert fault_level(deep, rate, (2000.0, 8000.0), fault) == pytest.approx(80.0, abs=8.0)
    assert fault_level(noise, rate, (2000.0, 8000.0), fault) < 10.0


@pytest.mark.parametrize("what", ["folder", "file", "below a file", "dead link"])
def test_a_folder_that_cannot_be_made_is_refused(tmp_path, what):
    target = tmp_path / "new"
    if what == "folder":
        target.mkdir()
    elif what == "dead link":
        target.symlink_to(tmp_path / "nowhere")
    else:
        target.write_text("mine")
    with pytest.raises(InputError, match="the name of a new folder"):
        check_folder(target / "below" if what == "below a file" else target)
    if what == "file":
        assert target.read_text() == "mine"


def test_a_bad_folder_is_refused_before_anything_is_read(tmp_path, capsys):
    from gearsim_bringup.cli import main

    assert (
        main(["diagnose", str(tmp_path / "no_such.mat"), "--machine", "mfpt", "--report", str(tmp_path)]) != 0
    )
    told = capsys.readouterr().err
    assert f"{tmp_path}: got a folder that exists already" in told
    assert "no_such" not in told


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_where_nothing_may_be_written_is_refused(tmp_path):
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(InputError, match="may not be written to"):
            check_folder(tmp_path / "new")
    finally:
        tmp_path.chmod(0o700)


def test_nothing_half_written_remains(tmp_path, monkeypatch):
    def full(self, *_args, **_kwargs):
        if self.name == VERDICT:
            raise OSError(28, "No space left on device")
        return written(self, *_args, **_kwargs)

    written = Path.write_text
    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(InputError, match="No space left"):
        placed(tmp_path / "new", {PAGE: "page", VERDICT: "verdict"})
    assert list(tmp_path.iterdir()) == []


def test_the_command_writes_the_page(record_file, tmp_path, capsys):
    from gearsim_bringup.cli import main

    path = record_file("hit_sm/SQ_OR2_1200.mat")
    arguments = ["diagnose", str(path), "--machine", "hit_sq", "--report", str(tmp_path / "new"), "--json"]
    assert main(arguments) == 0
    told = capsys.readouterr()
    assert json.loads(told.out)["findings"][0]["fault"] == "outer_race"
    assert str(tmp_path / "new" / PAGE) in told.err
    assert sorted(file.name for file in (tmp_path / "new").iterdir()) == [VERDICT, PAGE]
    assert main(arguments) != 0
    assert "a folder that exists already" in capsys.readouterr().err
