"""Simulated records of the rig in its casing, as chapter 5 of Deshpande's thesis measured them, kept on disk.

Every record is of one rig at 10 Hz and 50 N m, and of the accelerometer on the casing's upper edge above
bearing 3 (`top`; the lumped model has no casing, there it is the pedestal `b3_y`, as in the thesis).
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_sim.model.casing.reduced import save_reduced
from gearsim_sim.params.casing_gearbox import load_casing_gearbox_params
from gearsim_sim.scenario import parse_scenario
from gearsim_sim.simulation import to_record

__all__ = [
    "BEARING",
    "FAULTS",
    "IN_CASING",
    "MODELS",
    "RATE_HZ",
    "SLIP",
    "SPEED_HZ",
    "TOP",
    "Records",
    "Run",
    "spall",
]

Array = NDArray[np.float64]

BEARING = "bearing_3"  # at the free end of the driven shaft, where the thesis has its faults (5.4)
RATE_HZ, SPEED_HZ, LOAD_NM = 65536.0, 10.0, 50.0
IN_CASING = ("cb146", "cb182")
MODELS = ("lpm34", *IN_CASING)
TOP = "top"
FULL_MODES = 1000  # to 20 kHz
# Balls that roll without slip meet the same bumps each time; the fault would be as foretold as the gears.
SLIP: Mapping[str, Any] = {"kind": "cage_slip", "component": BEARING, "params": {"slip": 0.01}}


def spall(race: str, width_mm: float = 0.8) -> dict[str, Any]:
    """A localised fault of a race of `BEARING`; the default is the thesis's width (5.3.2, 5.3.3)."""
    return {"kind": f"{race}_race_spall", "component": BEARING, "params": {"width_m": f"{width_mm} mm"}}


def _extended(race: str, **more: Any) -> dict[str, Any]:
    params = {"race": race, "length_m": "12 mm", **more}
    return {"kind": "extended_roughness", "component": BEARING, "params": params}


# Those of the thesis (5.3.2 to 5.3.5): 0.8 mm; an eighth of the inner race, ground over both rows; the outer
# race etched, here on one row, since balls of two staggered rows would pass at twice the BPFO.
FAULTS: Mapping[str, tuple[Mapping[str, Any], ...]] = {
    "healthy": (SLIP,),
    "inner": (SLIP, spall("inner")),
    "outer": (SLIP, spall("outer")),
    "extended_inner": (SLIP, _extended("inner")),
    "extended_outer": (SLIP, _extended("outer", row=1)),
}


@dataclass(frozen=True)
class Run:
    """What is simulated.

    Attributes
    ----------
    model : str
        `lpm34`, `cb146` or `cb182`.
    faults : sequence of mapping
        As in a scenario.
    seconds, seed : float, int
    casing : str
        Path of another reduced casing than the shipped one.
    parameters : mapping
        Numbers of the machine that are replaced.
    site : str
        Of the accelerometer `top` on a casing.
    rate_hz, chain : float, str
        Sampling rate, and what the accelerometer is.
    path : str
        `frf`: from the bearings' forces through the casing's responses to 20 kHz (approach B of the thesis)
        in place of the reduction's modes (approach A).
    """

    model: str
    faults: Sequence[Mapping[str, Any]] = ()
    seconds: float = 10.0
    seed: int = 1
    casing: str = ""
    parameters: Mapping[str, Any] = field(default_factory=dict)
    site: str = "b3_top_y"
    rate_hz: float = RATE_HZ
    chain: str = "lab"
    path: str = ""

    def content(self) -> dict[str, Any]:
        """The scenario."""
        lumped = self.model == "lpm34"
        each = {TOP: {"site": "b3_y" if lumped else self.site}}
        if self.path:
            each[TOP]["path"] = self.path
        parameters = dict(self.parameters)
        if self.casing:
            parameters["casing.reduced"] = self.casing
        return {
            "machine": "unsw_parallel",
            "model": self.model,
            "seed": self.seed,
            "sample_rate": f"{self.rate_hz} Hz",
            "operating_point": {"speed": f"{SPEED_HZ} Hz", "load": f"{LOAD_NM} N*m"},
            "sensors": {
                "accelerometers": {"chain": self.chain, "channels": [TOP], "each": each},
                "tachos": {"shafts": ["input"], "pulses": 1},
                "encoders": {"shafts": []},
            },
            "parameters": parameters,
            "faults": [dict(fault) for fault in self.faults],
        }


class Records:
    """Makes records; keeps them in a folder if there is one, in which they are found again.

    Parameters
    ----------
    folder : Path, optional
        Files are named by what was simulated; another version of the product needs another folder.
    full_casing : Path, optional
        A reduction of the shipped casing with all its modes to 20 kHz, `FULL_MODES`; made, into the
        folder, when it is asked for and not given.
    tell : callable
        Called with what is done, of how much, and the step at hand, while a reduction is made.
    """

    def __init__(
        self,
        folder: Path | None = None,
        full_casing: Path | None = None,
        tell: Callable[[float, float, str], None] = lambda _done, _total, _step: None,
    ) -> None:
        self._folder = folder
        self._full_casing = full_casing
        self._tell = tell
        self._held: dict[str, Array] = {}

    @property
    def full_casing(self) -> str:
        """Path of the reduction with all modes to 20 kHz."""
        if self._full_casing is None:
            if self._folder is None:
                expected = "this file, or --records DIR, a folder in which it is made once"
                raise InputError("figures of the casing", "--full-casing", "nothing", expected)
            self._full_casing = self._reduced(self._folder / "full_casing.npz")
        return str(self._full_casing.absolute())

    def _reduced(self, path: Path) -> Path:
        if not path.is_file():
            from gearsim_sim.model.casing.reduce_file import reduce_description

            path.parent.mkdir(parents=True, exist_ok=True)
            shipped = load_casing_gearbox_params().casing.name
            tell: Any = lambda step, done: self._tell(done, 1.0, f"full casing: {step}")  # noqa: E731
            save_reduced(reduce_description(shipped, FULL_MODES, (), None, tell), path)
        return path

    def signal(self, run: Run) -> Array:
        """Acceleration at `top` [m/s^2], shape (samples,)."""
        content = run.content()
        named = json.dumps([content, run.seconds], sort_keys=True)
        key = hashlib.sha256(named.encode()).hexdigest()[:24]
        if key not in self._held:
            self._held[key] = self._kept(key, content, run.seconds)
        return self._held[key]

    def _kept(self, key: str, content: dict[str, Any], seconds: float) -> Array:
        path = None if self._folder is None else self._folder / f"{key}.npy"
        if path is not None and path.is_file():
            return np.asarray(np.load(path), dtype=np.float64)
        record = to_record(parse_scenario(content, Path("casing_results.yaml").absolute()), seconds)
        samples = np.asarray(record.data[list(record.channels).index(TOP)])
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            half = path.with_suffix(".part")
            with half.open("wb") as file:
                np.save(file, samples)
            os.replace(half, path)
        return samples.astype(np.float64)
