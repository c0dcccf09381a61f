"""From a bag to a rerun recording (.rrd) and to a picture (.png), without a screen."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearsim_io.bags import BagError, BagMessage, decode, read_bag
from gearsim_io.errors import EnvironmentLackError, InputError
from gearsim_io.messages import stamp_ns
from gearsim_io.new_paths import refuse_existing

if TYPE_CHECKING:
    from gearsim_io.scene import Overview

APPLICATION = "gearsim"
WINDOW = (1600, 1000)
_POINTS = 20_000
_PICTURE_POINTS = 3_000
_PICTURE_SPECTRA_S = 3.0
# The viewer draws some MB within seconds, and may take long where all cores are busy.
_DRAWS_S, _DRAWS_S_PER_MB = 300.0, 30.0
_SWITCH_S = 120.0
_TELL_EVERY = 256  # messages

Progress = Callable[[float], None]


def _silent(_share: float) -> None:
    pass


def export(
    bag: Path | str,
    out: Path | str,
    full: bool = False,
    overwrite: bool = False,
    progress: Progress = _silent,
) -> Overview:
    """Write a bag as a rerun recording with its own arrangement of views.

    Parameters
    ----------
    bag : Path or str
        Bag with signals and, if recorded, features, spectra, alarms and the simulator's truth.
    out : Path or str
        The .rrd file.
    full : bool
        Keep every sample of every waveform (about 12 bytes each). By default each waveform is reduced to
        lowest and highest values, 20,000 of them, and only the stretches at the fault and at the alarm
        are kept in full.
    overwrite : bool
        Replace the file if it exists.
    progress : callable
        Told the share that is done, from 0 to 1.

    Returns
    -------
    Overview
        What is in it.

    Raises
    ------
    InputError
        If the bag cannot be read or holds no samples, or the file exists.
    BagError
        If the disk does not take it all.
    EnvironmentLackError
        If rerun is not installed.
    """
    target = _target(out, ".rrd", overwrite)
    overview = _look_through(bag)
    points_per_s = float("inf") if full else max(20.0, _POINTS / max(overview.end_s, 1e-3))
    _write(bag, target, overview, points_per_s, picture=False, progress=progress)
    return overview


def png(
    bag: Path | str,
    out: Path | str,
    overwrite: bool = False,
    window: tuple[int, int] = WINDOW,
    progress: Progress = _silent,
) -> Overview:
    """A picture of a bag, drawn by rerun's viewer without a screen (by software, so it takes seconds).

    The viewer listens on the local host only, for as long as it draws, and sends no usage data.

    Raises
    ------
    InputError, BagError
        As `export`.
    EnvironmentLackError
        If rerun or a Vulkan driver is not installed.
    """
    target = _target(out, ".png", overwrite)
    overview = _look_through(bag)
    with tempfile.TemporaryDirectory(prefix="gearsim-view-") as folder:
        small = Path(folder) / "picture.rrd"
        points_per_s = _PICTURE_POINTS / max(overview.end_s, 1e-3)
        _write(bag, small, overview, points_per_s, picture=True, progress=progress)
        screenshot(small, target, window)
    return overview


def screenshot(recording: Path, out: Path, window: tuple[int, int] = WINDOW) -> None:
    """Let the viewer draw a small recording into a picture.

    Raises
    ------
    EnvironmentLackError
        If the viewer is not installed, or finds no Vulkan driver.
    BagError
        If it draws nothing for another reason.
    """
    viewer, patience_s = viewer_path(), _DRAWS_S + _DRAWS_S_PER_MB * recording.stat().st_size / 1e6
    with tempfile.TemporaryDirectory(prefix="gearsim-rerun-") as home:
        environment = quiet_environment(viewer, Path(home))
        command = [str(viewer), "--headless", "--bind", "127.0.0.1", "--port", "auto"]
        command += ["--window-size", f"{window[0]}x{window[1]}", "--screenshot-to", str(out), "-"]
        try:
            # A file named on the command line is loaded bit by bit, and the picture taken before it is there;
            # from standard input the viewer takes it whole.
            with open(recording, "rb") as data:
                done = subprocess.run(
                    command, env=environment, stdin=data, capture_output=True, timeout=patience_s, check=False
                )
        except subprocess.TimeoutExpired:
            way = f"rerun may open it in a window: ./gearsim view BAG --out {out.stem}.rrd"
            raise BagError(f"{out}: the viewer drew nothing within {patience_s:.0f} s; {way}") from None
    if out.is_file() and out.stat().st_size > 0:
        return
    said = (done.stderr + done.stdout).decode("utf-8", "replace")
    if any(word in said for word in ("render context", "adapter", "Vulkan", "wgpu")):
        raise EnvironmentLackError(
            "no Vulkan driver for pictures", "sudo apt-get install -y mesa-vulkan-drivers"
        )
    lines = [line for line in said.splitlines() if line.strip()] or ["no word"]
    reason = next((line for line in lines if "panicked" in line or "ERROR" in line), lines[-1])
    raise BagError(f"{out}: the viewer ended with {done.returncode}: {reason}")


def start_viewer(home: Path, port: int) -> subprocess.Popen[bytes]:
    """Open the viewer's window, listening on the local host only; the caller ends it.

    Parameters
    ----------
    home : Path
        Empty folder for the viewer's settings, to be removed afterwards.
    port : int
        Where it listens for recordings.

    Raises
    ------
    EnvironmentLackError
        If rerun is not installed or there is no screen.
    """
    if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise EnvironmentLackError(
            "there is no screen to open the viewer on", "set its parameter out instead"
        )
    viewer = viewer_path()
    command = [str(viewer), "--bind", "127.0.0.1", "--port", str(port), "--expect-data-soon"]
    return subprocess.Popen(command, env=quiet_environment(viewer, home), stdin=subprocess.DEVNULL)


def viewer_path() -> Path:
    """The viewer that belongs to the installed rerun; EnvironmentLackError if there is none."""
    try:
        import rerun_cli  # type: ignore[import-untyped]
    except ImportError:
        raise EnvironmentLackError("rerun is not installed", "pip install rerun-sdk") from None
    return Path(rerun_cli.__file__).parent / ("rerun.exe" if sys.platform == "win32" else "rerun")


def quiet_environment(viewer: Path, home: Path) -> Mapping[str, str]:
    """An environment in which the viewer sends no usage data and leaves the user's settings alone."""
    moved = ("XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_CACHE_HOME", "XDG_STATE_HOME")
    environment = {key: value for key, value in os.environ.items() if key not in moved}
    environment.update(HOME=str(home), RUST_LOG="error")
    off = [str(viewer), "analytics", "disable"]
    subprocess.run(off, env=environment, capture_output=True, timeout=_SWITCH_S, check=False)
    return environment


def _look_through(bag: Path | str) -> Overview:
    os.environ.setdefault("RUST_LOG", "off")  # what goes wrong in rerun comes as an exception
    try:
        from gearsim_io.scene import look_through
    except ImportError:
        raise EnvironmentLackError("rerun is not installed", "pip install rerun-sdk") from None
    return look_through(bag)


def _target(out: Path | str, suffix: str, overwrite: bool) -> Path:
    path = Path(out)
    if path.suffix != suffix:
        raise InputError(str(path), "", path.suffix or "no suffix", f"a name that ends in {suffix}")
    if not overwrite:
        refuse_existing(path, "the name of a new file")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(str(path), "", error.strerror, "a place for a new file") from None
    return path


def _write(
    bag: Path | str,
    out: Path,
    overview: Overview,
    points_per_s: float,
    picture: bool,
    progress: Progress = _silent,
) -> None:
    try:
        _fill(bag, out, overview, points_per_s, picture, progress)
    except BaseException as error:
        out.unlink(missing_ok=True)  # half a recording would open and mislead
        if isinstance(error, (OSError, RuntimeError)) and not isinstance(error, BagError):
            raise BagError(f"{out}: not written to the end ({error})") from None
        raise


def _fill(
    bag: Path | str,
    out: Path,
    overview: Overview,
    points_per_s: float,
    picture: bool,
    progress: Progress,
) -> None:
    import rerun as rr

    from gearsim_io.scene import Canvas, Scene, blueprint

    focus = overview.focus()
    stream = rr.RecordingStream(APPLICATION, recording_id=Path(bag).name)
    stream.save(str(out))
    stream.log("summary", rr.TextDocument(overview.summary(), media_type="text/markdown"), static=True)
    scene = Scene(Canvas(stream), points_per_s, focus.zooms, focus.channel, picture, overview.zero_ns)
    for number, message in enumerate(read_bag(bag)):
        if number % _TELL_EVERY == 0:
            progress(overview.share(message.t_ns))
        if message.type.rsplit("/", 1)[-1] in scene.types:
            decoded = decode(message)
            if not (picture and _is_early(message, decoded, overview)):
                scene.add(decoded)
    for name, t_s, colour in overview.marks():
        scene.mark(name, t_s, colour)
    limit = _round_up(max(scene.peaks["zoom"], scene.peaks["accel"]))
    final = replace(focus, limit=limit, speed_span_hz=scene.speed_span_hz)
    rr.send_blueprint(blueprint(final, picture), recording=stream)
    scene.flush()
    stream.disconnect()


def _round_up(peak: float) -> float:
    """A little more than the next of 1, 2, 5, 10 ..., so that the axis has a number near its end."""
    if peak <= 0:
        return 0.0
    decade = 10.0 ** math.floor(math.log10(peak))
    return 1.08 * next(decade * step for step in (1.0, 2.0, 5.0, 10.0, 20.0) if decade * step >= peak)


def _is_early(message: BagMessage, decoded: Any, overview: Overview) -> bool:
    """A picture shows the last spectrum only; the others would make its recording large."""
    if not message.type.endswith("/Spectrum"):
        return False
    end_s = overview.time_s(stamp_ns(decoded)) + decoded.sample_count / decoded.sample_rate
    return bool(end_s < overview.end_s - _PICTURE_SPECTRA_S)
