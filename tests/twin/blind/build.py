"""What a hidden effect changes of a run: everything is collected here before the machine is built."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blind.rigs import Rig

Array = NDArray[np.float64]
# data (channels, samples), sample rate, random numbers of this record -> data
ChainEffect = Callable[[Array, float, np.random.Generator], Array]
# seconds, turns of the reference shaft, random numbers of this record -> newtons along the direction
ForceEffect = Callable[[Array, Array, np.random.Generator], Array]


@dataclass
class Build:
    """Mutable while effects are entered.

    Attributes
    ----------
    rig : Rig
    parameters, resonances, paths : of the machine
    faults : list of (kind, component, parameters)
    lags : mapping of bearing's name to function
        From a random generator to what `Extras.lags` takes.
    forces : list of (direction by names, ForceEffect)
    speed_factor, swing, swing_hz : float
        Mean speed over the nominal one; rms over mean and bandwidth of its random part.
    load_rms_nm, load_hz : float
    tacho_factor : float
        Pulses that come over those that are stated; 0 for no tacho.
    machine : str
        That really runs, if it is another.
    filtered : bool
        Whether there is an anti-alias filter.
    noise : float
        Of the sensors, over the rig's ordinary one.
    analogue, digital : list of ChainEffect
        Before and after the converter.
    truths : list of dict
        Name, parameters, and frequencies [Hz] of what is hidden.
    ran_hz : list of float
        Mean speed of each record made.
    """

    rig: Rig
    rng: np.random.Generator
    parameters: dict[str, Any] = field(default_factory=dict)
    resonances: list[dict[str, Any]] = field(default_factory=list)
    paths: list[dict[str, Any]] = field(default_factory=list)
    faults: list[tuple[str, str, dict[str, Any]]] = field(default_factory=list)
    lags: dict[str, Callable[[np.random.Generator], Callable[[Array], Array]]] = field(default_factory=dict)
    forces: list[tuple[dict[str, float], ForceEffect]] = field(default_factory=list)
    speed_factor: float = 1.0
    swing: float = 0.0
    swing_hz: float = 1.0
    load_rms_nm: float = 0.0
    load_hz: float = 1.0
    tacho_factor: float = 1.0
    machine: str = ""
    filtered: bool = True
    noise: float = 1.0
    analogue: list[ChainEffect] = field(default_factory=list)
    digital: list[ChainEffect] = field(default_factory=list)
    truths: list[dict[str, Any]] = field(default_factory=list)
    ran_hz: list[float] = field(default_factory=list)

    @property
    def speed_hz(self) -> float:
        """Mean speed of the reference shaft."""
        return self.rig.speed_hz * self.speed_factor

    def pick(self, names: tuple[str, ...]) -> str:
        """One of them at random."""
        return str(names[int(self.rng.integers(len(names)))])

    def log_uniform(self, low: float, high: float) -> float:
        """A random number, every octave alike."""
        return float(np.exp(self.rng.uniform(np.log(low), np.log(high))))

    def hide(self, name: str, hz: tuple[float, ...] = (), **parameters: float) -> None:
        """Write down what has been hidden; `hz` are the frequencies that tell of it."""
        self.truths.append({"name": name, "parameters": parameters, "hz": list(hz)})
