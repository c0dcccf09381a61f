"""What a bag becomes in rerun: verified by rerun's own tools, and its picture looked at in numbers."""

from __future__ import annotations

import subprocess
from itertools import pairwise

import numpy as np
import pytest
from example_results import alarm, features, spectrum
from recordings import make_record, write_bag

from gearsim_dsp import results
from gearsim_io import rerun_export
from gearsim_io.bags import BagError, BagWriter, StreamWriter
from gearsim_io.errors import EnvironmentLackError, InputError
from gearsim_io.health import Level
from gearsim_io.machines import load_machine
from gearsim_io.messages import pure_types, to_msg
from gearsim_io.scene import Scene, look_through
from gearsim_io.scene.waves import Outliner, cut

SECOND = 1_000_000_000


def window(record, k):
    return {
        "t0_ns": record.t0_ns + k * SECOND // 2,
        "frame_id": "unsw_parallel",
        "first_sample": 2048 * k,
        "sample_count": 4096,
        "sample_rate_hz": 4096.0,
        "band_high_hz": 2048.0,
    }


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """Six seconds with all that the nodes would add; the alarm comes at 4 s."""
    record = make_record(seconds=6.0)
    path = tmp_path_factory.mktemp("scene") / "bag"
    rng = np.random.default_rng(3)
    with BagWriter(path) as writer:
        stream = StreamWriter(writer)
        stream.write(load_machine("unsw_parallel"), record.t0_ns)
        for batch in record.batches(512):
            stream.write(batch)
        for k in range(10):
            common = window(record, k)
            snr = 6.0 if k < 6 else 30.0
            values = (
                results.FeatureValue("bpfo_snr", "bearing_3", snr, "dB"),
                results.FeatureValue("kurtosis", "", 3.0 + k, "1"),
            )
            t_ns = common["t0_ns"] + SECOND
            stream.write(features(**common, source="envelope", values=values), t_ns)
            power = rng.random(400).astype(np.float32)
            power[98] = 20.0
            marker = results.SpectrumMarker("BPFO", "bearing_3", 4.9, 3, 0.0, snr)
            stream.write(spectrum(**common, axis_step=0.05, values=power, markers=(marker,)), t_ns)
        start = results.AlarmState(record.t0_ns + SECOND, "unsw_parallel", "envelope", Level.OK, False, "", 0)
        raised = alarm(t_ns=record.t0_ns + 4 * SECOND, frame_id="unsw_parallel", found_frequency_hz=48.9)
        state = results.AlarmState(
            raised.t_ns, "unsw_parallel", "envelope", Level.ERROR, False, "", 1, (raised,)
        )
        for obj in (start, raised, state):
            stream.write(obj)
    return path


def rerun_says(*arguments):
    viewer = rerun_export.viewer_path()
    done = subprocess.run(
        [str(viewer), "rrd", *map(str, arguments)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_recording_is_sound_and_complete(bag, tmp_path):
    overview = rerun_export.export(bag, tmp_path / "out.rrd")
    assert overview.alarms
    rerun_says("verify", tmp_path / "out.rrd")
    listed = rerun_says("stats", tmp_path / "out.rrd")
    for entity in (
        "/accel/b3_x",
        "/accel/b3_y",
        "/zoom/At_the_alarm",
        "/spectrum/b3_y/BPFO",
        "/spectrum/b3_y/other_lines",
        "/faults/BPFO",
        "/faults_by_part/bearing_3/BPFO",
        "/kurtosis/b3_y",
        "/speed/input",
        "/state/node_envelope",
        "/alarms",
        "/summary",
        "/marks/accel/alarm",
    ):
        assert f"{entity}:" in listed, entity


def test_full_detail_is_larger_than_the_outline(bag, tmp_path):
    rerun_export.export(bag, tmp_path / "thin.rrd")
    rerun_export.export(bag, tmp_path / "full.rrd", full=True)
    rerun_says("verify", tmp_path / "full.rrd")
    samples = 2 * 6 * 4096
    assert (tmp_path / "full.rrd").stat().st_size > 8 * samples


def test_an_existing_file_is_kept_unless_told(bag, tmp_path):
    out = tmp_path / "out.rrd"
    out.write_text("mine")
    with pytest.raises(InputError, match="a file that exists already"):
        rerun_export.export(bag, out)
    assert out.read_text() == "mine"
    rerun_export.export(bag, out, overwrite=True)
    rerun_says("verify", out)


def test_a_full_disk_is_told(bag, tmp_path):
    place = tmp_path / "small"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(place)]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("this user may not mount a small file system")
    try:
        with pytest.raises(BagError, match=r"out\.rrd: not written to the end"):
            rerun_export.export(bag, place / "out.rrd", full=True)
        assert list(place.iterdir()) == []
    finally:
        subprocess.run(["umount", str(place)], check=True)


@pytest.mark.parametrize(
    ("make", "name", "words"),
    [
        (rerun_export.export, "out.png", "a name that ends in .rrd"),
        (rerun_export.png, "out.rrd", "a name that ends in .png"),
    ],
)
def test_names_are_checked(bag, tmp_path, make, name, words):
    with pytest.raises(InputError, match=words):
        make(bag, tmp_path / name)


def test_what_interrupts_leaves_no_half_recording_and_progress_is_told(bag, tmp_path, monkeypatch):
    told = []
    monkeypatch.setattr(rerun_export, "_TELL_EVERY", 8)

    def stop_late(share):
        told.append(share)
        if share > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        rerun_export.export(bag, tmp_path / "out.rrd", progress=stop_late)
    assert list(tmp_path.iterdir()) == []
    assert told[0] == 0.0
    assert told == sorted(told)


def test_a_viewer_that_never_ends_is_left_and_told(tmp_path, monkeypatch):
    viewer = tmp_path / "viewer"
    viewer.write_text("#!/bin/sh\n[ $1 = analytics ] || exec sleep 60\n")
    viewer.chmod(0o755)
    small = tmp_path / "small.rrd"
    small.write_bytes(b"x" * 10_000)
    monkeypatch.setattr(rerun_export, "viewer_path", lambda: viewer)
    monkeypatch.setattr(rerun_export, "_DRAWS_S", 0.7)
    with pytest.raises(BagError, match=r"drew nothing within 1 s; .*view BAG --out out\.rrd"):
        rerun_export.screenshot(small, tmp_path / "out.png")


def test_a_bag_without_samples_is_told(tmp_path):
    with BagWriter(tmp_path / "bag") as writer:
        StreamWriter(writer).write(load_machine("mfpt"), 1)
    with pytest.raises(InputError, match="no samples"):
        rerun_export.export(tmp_path / "bag", tmp_path / "out.rrd")


def test_the_overview_finds_the_story(bag):
    overview = look_through(bag)
    assert overview.end_s == pytest.approx(6.0)
    assert overview.worst.component == "bearing_3"
    focus = overview.focus()
    assert focus.channel == "b3_y"
    assert focus.ordered[0] == "b3_y"
    assert focus.parts == "bearing_3"
    (zoom,) = focus.zooms
    assert (zoom.name, zoom.end_s) == ("At the alarm", pytest.approx(4.0))
    assert "4.00 s: **Alarm**: outer race of bearing_3" in overview.summary()


def test_a_bag_without_diagnosis_still_shows(tmp_path):
    path = write_bag(tmp_path / "bag", make_record())
    overview = rerun_export.export(path, tmp_path / "out.rrd")
    assert "No diagnosis was recorded" in overview.summary()
    assert overview.focus().zooms[0].name == "In detail"
    rerun_says("verify", tmp_path / "out.rrd")


@pytest.mark.parametrize(("block", "cuts"), [(7, (100, 133, 500)), (64, (64, 128)), (1, (10,)), (50, ())])
def test_an_outline_keeps_every_peak_for_any_cutting(block, cuts):
    data = np.random.default_rng(1).standard_normal((3, 1000)).astype(np.float32)
    outliner = Outliner(block)
    places, values = [], []
    edges = [0, *cuts, 1000]
    for start, stop in pairwise(edges):
        where, what = outliner.push(start, data[:, start:stop])
        places.append(where)
        values.append(what)
    outline, where = np.concatenate(values, axis=1), np.concatenate(places)
    used = 1000 // block * block
    assert np.array_equal(outline.max(axis=1), data[:, :used].max(axis=1))
    assert np.array_equal(outline.min(axis=1), data[:, :used].min(axis=1))
    assert np.all(np.diff(where) > 0)
    if block > 1:
        blocks = data[:, :used].reshape(3, -1, block)
        assert np.array_equal(outline[:, 0::2], blocks.min(axis=2))
        assert np.array_equal(outline[:, 1::2], blocks.max(axis=2))


def test_an_outline_does_not_span_a_gap():
    outliner = Outliner(10)
    ones = np.ones((1, 15), np.float32)
    outliner.push(0, ones)
    places, values = outliner.push(1000, 5 * ones)
    assert places[0] == 1000
    assert values.min() == 5.0


def test_a_cut_has_exactly_the_samples_in_its_span():
    data = np.arange(100, dtype=np.float32)[None, :]
    times, values = cut(200, data, 10.0, 150.0, (6.0, 8.0))
    assert np.allclose(times, np.arange(6.0, 8.01, 0.1))
    assert np.array_equal(values[0], np.arange(10, 31))
    assert cut(200, data, 10.0, 150.0, (50.0, 60.0))[0].size == 0


def test_the_picture_shows_something(bag, tmp_path):
    try:
        rerun_export.png(bag, tmp_path / "out.png", window=(1000, 700))
    except EnvironmentLackError as lack:
        pytest.skip(str(lack))
    from PIL import Image

    pixels = np.asarray(Image.open(tmp_path / "out.png").convert("RGB")).astype(int)
    assert pixels.shape[0] >= 700
    assert pixels.shape[1] >= 1000

    def count(rgb, tolerance=45):
        return int(np.count_nonzero(np.abs(pixels - np.array(rgb)).max(axis=2) < tolerance))

    whole = pixels.shape[0] * pixels.shape[1]
    assert count((110, 170, 230)) > 0.01 * whole, "waveforms in blue"
    assert count((215, 60, 55)) > 0.002 * whole, "the alarm in red"
    assert count((60, 130, 80)) > 0.001 * whole, "the time before it in green"


def test_no_driver_is_a_lack_with_its_remedy(bag, tmp_path, monkeypatch):
    monkeypatch.setenv("VK_ICD_FILENAMES", "/nonexistent.json")
    monkeypatch.setenv("VK_DRIVER_FILES", "/nonexistent.json")
    with pytest.raises(EnvironmentLackError, match="mesa-vulkan-drivers"):
        rerun_export.png(bag, tmp_path / "out.png", window=(600, 400))
    assert not (tmp_path / "out.png").exists()


def test_the_viewer_is_bound_to_this_computer_and_sends_nothing(bag, tmp_path, monkeypatch):
    seen = []
    real = subprocess.run

    def watch(command, **options):
        seen.append((command, options))
        return real(command, **options)

    monkeypatch.setattr(rerun_export.subprocess, "run", watch)
    try:
        rerun_export.png(bag, tmp_path / "out.png", window=(600, 400))
    except EnvironmentLackError as lack:
        pytest.skip(str(lack))
    (off, _), (draw, options) = seen
    assert off[1:] == ["analytics", "disable"]
    assert draw[draw.index("--bind") + 1] == "127.0.0.1"
    assert options["env"]["HOME"] != "", "settings of its own"
    assert "gearsim-rerun-" in options["env"]["HOME"]


class Paper:
    """A canvas that only notes the values of lines."""

    def __init__(self):
        self.values = {}

    def line(self, *_):
        pass

    def lines_below(self, _root):
        return 0

    def value(self, path, t_s, value):
        self.values.setdefault(path, []).append((t_s, value))

    def flush(self):
        pass


def test_a_window_gives_one_value_of_a_family_though_nodes_speak_in_between():
    record, paper = make_record(seconds=1.0), Paper()
    scene = Scene(paper, zero_ns=record.t0_ns)
    for k in range(3):
        for channel, snr in (("b3_x", 4.0), ("b3_y", 26.0 + k), ("b4_x", 11.0)):
            values = (results.FeatureValue("bpfo_snr", "bearing_3", snr, "dB"),)
            judged = features(**window(record, k), source="envelope", channel=channel, values=values)
            level = (results.FeatureValue("kurtosis", "", 3.0, "1"),)
            other = features(**window(record, k), source="kurtosis", channel=channel, values=level)
            for one in (judged, other):
                scene.add(to_msg(one, pure_types()))
    scene.flush()
    expected = [(1.0 + 0.5 * k, 26.0 + k) for k in range(3)]
    assert paper.values["faults/BPFO"] == expected
    assert paper.values["faults_by_part/bearing_3/BPFO"] == expected
