"""Measured files of every format, made here; what is wrong with a file is told with its name and place."""

from __future__ import annotations

import gzip
import math
import warnings

import h5py
import numpy as np
import pytest
import soundfile
from ruamel.yaml import YAML
from scipy.io import savemat

from gearsim_io.bags import info, read_machine, read_record
from gearsim_io.errors import InputError
from gearsim_io.importers import READERS, Overrides, import_file, import_to_bag, machine_for
from gearsim_io.machines import load_machine

RATE = 1000.0
SIGNAL = np.sin(np.arange(3000) * 0.37) * 2.0
OTHER = np.cos(np.arange(3000) * 0.11)


def number(value, unit="1"):
    return {"value": value, "unit": unit, "source": "test"}


def machine(tmp_path, section, channels=("acc",), name="toy"):
    content = {
        "name": name,
        "nameplate": {
            "reference_shaft": "s",
            "shafts": {"s": {"nominal_speed": number(20, "Hz")}},
            "channels": {channel: {} for channel in channels},
        },
        "import": section,
    }
    path = tmp_path / f"{name}.yaml"
    with open(path, "w") as stream:
        YAML().dump(content, stream)
    return path


def write_mat(path, data):
    savemat(path, {"b": {"gs": data, "sr": RATE, "rate": 25.0}})


def write_mat73(path, data):
    with h5py.File(path, "w", userblock_size=512) as file:
        file["b/gs"] = data[None, :]
        file["b/sr"] = np.array([[RATE]])
        file["b/rate"] = np.array([[25.0]])
        name = file.create_dataset("b/name", data=np.array([[ord(c)] for c in "rig"], dtype=np.uint16))
        name.attrs["MATLAB_class"] = np.bytes_("char")
    with open(path, "r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


def write_npz(path, data):
    np.savez(path, **{"b.gs": data, "b.sr": RATE, "b.rate": 25.0})


def write_h5(path, data):
    with h5py.File(path, "w") as file:
        file["b/gs"] = data
        file["b"].attrs["sr"] = RATE
        file["b"].attrs["rate"] = 25.0


SECTION = {
    "rate": {"variables": ["b.sr"]},
    "channels": {"acc": {"variable": "b.gs", "unit": "g"}},
    "speed": {"variable": "b.rate", "unit": "Hz"},
}


@pytest.mark.parametrize(
    ("suffix", "write"),
    [(".mat", write_mat), (".mat", write_mat73), (".npz", write_npz), (".h5", write_h5)],
    ids=["mat5", "mat7.3", "npz", "h5"],
)
def test_files_with_named_variables(tmp_path, suffix, write):
    path = tmp_path / f"run{suffix}"
    write(path, SIGNAL)
    record = import_file(path, machine(tmp_path, SECTION))
    assert record.sample_rate_hz == RATE
    assert record.channels == ("acc",)
    assert record.unit == "m/s^2"
    assert np.array_equal(record.data[0], (SIGNAL * 9.80665).astype(np.float32))
    assert record.notes["speed_hz"] == "25"
    plate = machine_for(record, load_machine(machine(tmp_path, SECTION)))
    assert plate.nominal_speed_hz == 25.0


def test_npy(tmp_path):
    path = tmp_path / "run.npy"
    np.save(path, np.stack([SIGNAL, OTHER], axis=1))
    record = import_file(path, overrides=Overrides(rate_hz=RATE, channels=("x", "y")))
    assert record.channels == ("x", "y")
    assert record.unit == "1"
    assert np.array_equal(record.data, np.stack([SIGNAL, OTHER]).astype(np.float32))


@pytest.mark.parametrize("subtype", ["PCM_16", "PCM_24", "FLOAT"])
def test_wav(tmp_path, subtype):
    path = tmp_path / "run.wav"
    soundfile.write(path, np.stack([SIGNAL, OTHER], axis=1) / 4, 1000, subtype=subtype)
    record = import_file(path)
    assert record.sample_rate_hz == 1000.0
    assert record.channels == ("1", "2")
    step = {"PCM_16": 2**-15, "PCM_24": 2**-23, "FLOAT": 1e-7}[subtype]
    assert np.abs(record.data[0] - SIGNAL / 4).max() <= step
    with pytest.raises(InputError, match="header: got 1000 Hz, expected 48000 Hz, as the rate given says"):
        import_file(path, overrides=Overrides(rate_hz=48000.0))


def write_uff(path, even):
    import pyuff

    common = {
        "type": 58,
        "func_type": 1,
        "rsp_node": 1,
        "rsp_dir": 1,
        "ref_node": 1,
        "ref_dir": 1,
        "binary": 1,
        "abscissa_spec_data_type": 17,
        "ordinate_spec_data_type": 12,
        "orddenom_spec_data_type": 0,
        "ordinate_axis_units_lab": "m/s^2",
        "abscissa_spacing": int(even),
        "abscissa_axis_units_lab": "s",
        "id2": "",
        "id3": "",
        "id4": "",
        "id5": "",
    }
    file = pyuff.UFF(str(path))
    for name, data in (("top", SIGNAL), ("side", OTHER)):
        step_s = 1 / RATE
        abscissa = {"x": np.arange(data.size) * step_s, "abscissa_inc": step_s, "abscissa_min": 0}
        one = {**common, **abscissa, "id1": name, "data": data}
        file.write_sets(one, "add")


@pytest.mark.parametrize("even", [True, False])
def test_uff(tmp_path, even):
    path = tmp_path / "run.uff"
    write_uff(path, even)
    record = import_file(path)
    assert record.channels == ("top", "side")
    assert record.sample_rate_hz == pytest.approx(RATE)
    assert record.unit == "m/s^2"
    assert np.allclose(record.data[0], SIGNAL, atol=1e-6)


def table(path, text):
    if path.suffix == ".gz":
        path.write_bytes(gzip.compress(text.encode()))
    else:
        path.write_text(text)
    return path


ROWS = [(k / RATE, SIGNAL[k], OTHER[k]) for k in range(600)]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.csv", "time,x,y\n" + "".join(f"{t:.3f},{a:.6f},{b:.6f}\n" for t, a, b in ROWS)),
        ("a.csv.gz", "time,x,y\n" + "".join(f"{t:.3f},{a:.6f},{b:.6f}\n" for t, a, b in ROWS)),
        (
            "b.txt",
            "Time (s) x y\n".replace(" (s)", "") + "".join(f"{t:.3f} {a:.6f} {b:.6f}\n" for t, a, b in ROWS),
        ),
        ("c.tsv", '"t"\t"x"\t"y"\n' + "".join(f"{t:.3f}\t{a:.6f}\t{b:.6f}\n" for t, a, b in ROWS)),
        (
            "german.csv",
            "Time [s];x;y\n" + "".join(f"{t:.3f};{a:.6f};{b:.6f}\n" for t, a, b in ROWS).replace(".", ","),
        ),
        ("bom.csv", "\ufefft,x,y\n" + "".join(f"{t:.3f},{a:.6f},{b:.6f}\n" for t, a, b in ROWS)),
    ],
)
def test_tables_with_a_time_column(tmp_path, name, text):
    record = import_file(table(tmp_path / name, text))
    assert record.channels == ("x", "y")
    assert record.sample_rate_hz == pytest.approx(RATE, rel=1e-6)
    assert np.allclose(record.data[0], SIGNAL[:600], atol=1e-6)
    assert np.allclose(record.data[1], OTHER[:600], atol=1e-6)


def test_a_table_without_names(tmp_path):
    path = table(tmp_path / "run_2000.csv", "".join(f"{a:.6f}\n" for a in SIGNAL))
    section = {"rate": {"file_name": "_([0-9]+)$"}, "channels": {"acc": {"column": 1}}}
    record = import_file(path, machine(tmp_path, section))
    assert record.sample_rate_hz == 2000.0
    assert record.unit == "1"
    assert np.allclose(record.data[0], SIGNAL, atol=1e-6)


def test_speed_and_load_from_the_name(tmp_path):
    section = {
        "rate": {"value": number(1000, "Hz")},
        "channels": {"acc": {"variable": "*"}},
        "speed": {"file_name": "_([0-9]+)rpm", "unit": "rpm"},
        "load": {"file_name": "_([0-9]+)Nm$", "unit": "N m"},
    }
    path = tmp_path / "run_1500rpm_40Nm.mat"
    savemat(path, {"anything": SIGNAL, "short": np.arange(3.0)})
    record = import_file(path, machine(tmp_path, section))
    assert record.notes["speed_hz"] == "25"
    assert record.notes["load"] == "40 N m"


def test_the_user_knows_better(tmp_path):
    path = tmp_path / "run.mat"
    savemat(path, {"one": SIGNAL, "two": OTHER})
    wanted = Overrides(rate_hz=512.0, unit="mm/s^2", variables=("two",), channels=("acc",), speed_hz=33.0)
    record = import_file(path, machine(tmp_path, SECTION), wanted)
    assert record.sample_rate_hz == 512.0
    assert np.allclose(record.data[0], OTHER * 1e-3)
    assert record.notes["speed_hz"] == "33"


@pytest.mark.parametrize(
    ("unit", "factor", "kept"),
    [
        ("g", 9.80665, "m/s^2"),
        ("m/s^2", 1.0, "m/s^2"),
        ("m/s2", 1.0, "m/s^2"),
        ("m/s²", 1.0, "m/s^2"),
        ("mm/s^2", 1e-3, "m/s^2"),
        ("ft/s^2", 0.3048, "m/s^2"),
        ("metre/second**2", 1.0, "m/s^2"),
        ("mg", 9.80665e-3, "m/s^2"),
        ("mm/s", 1.0, "mm/s"),
        ("V", 1.0, "V"),
        ("Pa", 1.0, "Pa"),
        ("1", 1.0, "1"),
        ("", 1.0, "1"),
    ],
)
def test_units(tmp_path, unit, factor, kept):
    path = tmp_path / "run.npy"
    np.save(path, SIGNAL)
    record = import_file(path, overrides=Overrides(rate_hz=RATE, unit=unit))
    assert record.unit == kept
    assert np.allclose(record.data[0], SIGNAL * factor, rtol=1e-6)


def test_clipped_channels_are_noted_not_refused(tmp_path):
    path = tmp_path / "run.npy"
    np.save(path, np.clip(SIGNAL, -1.5, 1.2))
    record = import_file(path, overrides=Overrides(rate_hz=RATE))
    note = record.notes["clipped data"]
    # Independent count: all samples beyond the limits, as each lobe is several samples wide.
    expected = int(np.count_nonzero((SIGNAL >= 1.2) | (SIGNAL <= -1.5)))
    assert note.startswith(f"{expected} samples")
    np.save(path, SIGNAL)
    assert not any("clipped" in key for key in import_file(path, overrides=Overrides(rate_hz=RATE)).notes)


def save(path, **variables):
    savemat(path, variables)


def with_bad(index, value):
    data = SIGNAL.copy()
    data[index] = value
    return data


BAD_MAT = [
    (
        {"x": SIGNAL},
        "b.gs: got not in the file, expected a variable of that name; the file has x (3000 values)",
    ),
    ({"b": {"gs": SIGNAL}}, "b.sr: got not in the file"),
    ({"b": {"gs": SIGNAL, "sr": -1.0, "rate": 25.0}}, "b.sr: got -1.0, expected a finite number above 0"),
    ({"b": {"gs": SIGNAL, "sr": "fast", "rate": 25.0}}, "b.sr: got fast, expected a number"),
    (
        {"b": {"gs": SIGNAL, "sr": RATE}},
        "b.rate: got not in the file, expected a number of that name, or --speed;",
    ),
    ({"b": {"gs": SIGNAL, "sr": RATE, "rate": 0.0}}, "speed: got 0.0, expected a speed above 0 Hz"),
    ({"b": {"gs": SIGNAL[:0], "sr": RATE, "rate": 25.0}}, "acc: got 0 samples, expected at least two"),
    (
        {"b": {"gs": with_bad(17, np.nan), "sr": RATE, "rate": 25.0}},
        "acc: got nan at sample 17 (1 such values)",
    ),
    ({"b": {"gs": with_bad(5, np.inf), "sr": RATE, "rate": 25.0}}, "acc: got inf at sample 5"),
    ({"b": {"gs": SIGNAL * 0 + 3, "sr": RATE, "rate": 25.0}}, "acc: got 29.42 in all 3000 samples"),
    ({"b": {"gs": "text", "sr": RATE, "rate": 25.0}}, "b.gs: got not in the file"),
]


@pytest.mark.parametrize(("variables", "words"), BAD_MAT)
def test_bad_mat_files_are_named(tmp_path, variables, words):
    path = tmp_path / "run.mat"
    savemat(path, variables)
    with pytest.raises(InputError) as caught:
        import_file(path, machine(tmp_path, SECTION))
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert words in message
    assert "\n" not in message


def test_a_file_without_its_load_is_read_all_the_same(tmp_path):
    section = {**SECTION, "load": {"variable": "b.load", "unit": "N*m"}}
    path = tmp_path / "run.mat"
    savemat(path, {"b": {"gs": SIGNAL, "sr": RATE, "rate": 25.0}})
    assert "load" not in import_file(path, machine(tmp_path, section)).notes


TWO = {"rate": {"value": number(1000, "Hz")}, "channels": {"acc": {"column": "x"}, "acc2": {"column": "y"}}}


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("run.csv", "x,y\n1,2\n3\n", "line 3: got 1 columns, expected 2 as before"),
        ("run.csv", "x,y\n1,2\n3,four\n", "line 3: got four, expected a number"),
        ("run.csv", "x,y\n1,2\n3,\n5,6\n", "acc2: got nan at sample 1"),
        ("run.csv", "x,x\n1,2\n3,4\n", "no name twice"),
        ("run.csv", "x,y,z\n1,2\n3,4\n", "3 names"),
        ("run.csv", "x,z\n1,2\n3,4\n", "y: got not in the file"),
        ("run.csv", "x,y\n", "no lines of numbers"),
        ("run.csv", "", "an empty file"),
        ("run.csv", b"\xff\xfe\x00\x01", "a readable .csv file"),
        ("run.csv", b"\xff\xfe\x00\x01", "got bytes that are no text, from byte 0 on"),
        ("run.csv.gz", b"not gzip", "a readable .csv.gz file"),
        ("run.mat", b"not matlab at all, but long enough to look at" * 20, "a readable .mat file"),
        ("run.wav", b"RIFFxxxxWAVE", "a readable .wav file"),
        ("run.npz", b"PK\x03\x04 broken", "a readable .npz file"),
        ("run.npy", b"\x93NUMPY broken", "a readable .npy file"),
        ("run.h5", b"\x89HDF\r\n\x1a\n broken", "a readable .h5 file"),
        ("run.uff", b"    -1\n    15\n    -1\n", "data set 58: got none over time"),
        ("run.xyz", b"?", "one of .csv"),
    ],
)
def test_bad_files_are_named(tmp_path, name, content, words):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with pytest.raises(InputError) as caught:
            import_file(path, machine(tmp_path, TWO, channels=("acc", "acc2")))
    message = str(caught.value)
    assert message.startswith(str(path))
    assert words in message
    assert "\n" not in message


def test_missing_files_and_pickles(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        import_file(tmp_path / "none.csv")
    np.save(tmp_path / "run.npy", np.array([object()]), allow_pickle=True)
    with pytest.raises(InputError, match=r"a readable \.npy file"):
        import_file(tmp_path / "run.npy")


@pytest.mark.parametrize(
    ("variables", "section", "words"),
    [
        ({"a": SIGNAL, "c": OTHER[:10]}, {"x": {"variable": "a"}, "y": {"variable": "c"}}, "x 3000, y 10"),
        ({"a1": SIGNAL, "a2": OTHER}, {"x": {"variable": "a*"}}, "a1, a2, expected a pattern that fits one"),
        (
            {"a": SIGNAL, "c": OTHER},
            {"x": {"variable": "a", "unit": "g"}, "y": {"variable": "c", "unit": "V"}},
            "x in m/s^2, y in V",
        ),
        ({"a": SIGNAL}, {"x": {"variable": "a", "unit": "parsnips"}}, "unit: got parsnips"),
        (
            {"a": SIGNAL},
            {"x": {"variable": "a", "unit": "furlong"}},
            "got furlong, expected one of g, mg",
        ),
    ],
)
def test_channels_that_do_not_go_together(tmp_path, variables, section, words):
    path = tmp_path / "run.mat"
    savemat(path, variables)
    whole = {"rate": {"value": number(1000, "Hz")}, "channels": section}
    with pytest.raises(InputError) as caught:
        import_file(path, machine(tmp_path, whole, channels=tuple(section)))
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("section", "words"),
    [
        ({"rates": {}}, "got rates, expected one of the keys channels, load, rate, speed"),
        ({"rate": {"value": 1000}}, "rate.value: got 1000"),
        ({"rate": {"value": number(1000, "kg")}}, "not kg"),
        ({"rate": {"file_name": "no group"}}, "one group in parentheses"),
        ({"rate": {"file_name": "(broken"}}, "a regular expression"),
        ({"speed": {"variable": "x"}}, "speed.unit"),
        ({"speed": {"variable": "b.rate", "unit": "furlong"}}, "expected Hz or rpm"),
    ],
)
def test_bad_import_sections_are_named(tmp_path, section, words):
    path = tmp_path / "run.mat"
    write_mat(path, SIGNAL)
    with pytest.raises(InputError) as caught:
        import_file(path, machine(tmp_path, {**SECTION, **section}))
    assert words in str(caught.value)


def test_rates_that_contradict_each_other(tmp_path):
    path = tmp_path / "run.mat"
    write_mat(path, SIGNAL)
    wrong = Overrides(rate_hz=10_000.0)
    with pytest.raises(InputError, match=r"b\.sr: got 1000 Hz, expected 10000 Hz, as the rate given says"):
        import_file(path, machine(tmp_path, SECTION), wrong)
    given = {**SECTION, "rate": {"variables": ["b.sr"], "value": number(1200, "Hz")}}
    with pytest.raises(InputError, match="1200 Hz, as the machine's description says"):
        import_file(path, machine(tmp_path, given))
    with pytest.raises(InputError, match="sampling rate: got stated nowhere"):
        import_file(path, overrides=Overrides(variables=("b.gs",)))
    rows = "".join(f"{k / RATE + (0.01 if k > 50 else 0):.3f},{SIGNAL[k]:.5f}\n" for k in range(100))
    with pytest.raises(InputError, match=r"a step of 0\.011 s behind sample 50.*0\.001 s"):
        import_file(table(tmp_path / "jump.csv", "t,x\n" + rows))


def test_overrides_are_checked():
    for wrong in ({"rate_hz": 0.0}, {"rate_hz": math.nan}, {"speed_hz": -1.0}):
        with pytest.raises(InputError, match="a number above 0 Hz"):
            Overrides(**wrong)
    with pytest.raises(InputError, match="one for each of 2 variables"):
        Overrides(variables=("a", "b"), channels=("x",))


def test_one_file_becomes_one_bag(tmp_path):
    path = tmp_path / "run.mat"
    write_mat(path, SIGNAL)
    ((bag, record),) = import_to_bag([path], machine(tmp_path, SECTION), tmp_path / "bag")
    assert bag == tmp_path / "bag"
    back = read_record(bag)
    assert back.data.tobytes() == record.data.tobytes()
    assert (back.sample_rate_hz, back.unit, back.machine) == (RATE, "m/s^2", "toy")
    assert read_machine(bag).nominal_speed_hz == 25.0, "the file's own speed, not the nameplate's 20 Hz"
    custom = info(bag).custom_data
    assert custom["source_file"] == "run.mat"
    assert len(custom["source_sha256"]) == 64
    assert custom["speed_hz"] == "25"


def test_several_files_become_a_bag_each(tmp_path):
    for name in ("one", "two"):
        write_mat(tmp_path / f"{name}.mat", SIGNAL)
    files = [tmp_path / "one.mat", tmp_path / "two.mat"]
    made = import_to_bag(files, machine(tmp_path, SECTION), tmp_path / "bags")
    assert [bag for bag, _ in made] == [tmp_path / "bags" / "one", tmp_path / "bags" / "two"]
    with pytest.raises(InputError, match="a folder that exists already"):
        import_to_bag(files, machine(tmp_path, SECTION), tmp_path / "bags")
    with pytest.raises(InputError, match="wanted by several files"):
        import_to_bag([files[0], files[0]], machine(tmp_path, SECTION), tmp_path / "new")
    write_mat(tmp_path / "bad.mat", SIGNAL * np.nan)
    with pytest.raises(InputError, match=r"bad\.mat"):
        import_to_bag([files[0], tmp_path / "bad.mat"], machine(tmp_path, SECTION), tmp_path / "new")
    assert not (tmp_path / "new").exists(), "nothing is written before all files are read"


def test_every_suffix_is_tried_here():
    tried = {".mat", ".npz", ".npy", ".h5", ".wav", ".uff", ".csv", ".csv.gz", ".txt", ".tsv"}
    same_reader = {".hdf5", ".flac", ".unv", ".u58", ".txt.gz"}
    assert set(READERS) == tried | same_reader
