"""Random cases: a machine, an operating point, sensors, and one fault, two or none.

A case follows from the name of its set, the seed and its number alone, so that a run can be resumed and a
single case be looked at again.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gearsim_bringup.evaluation.faults import FAULTS, Truth
from gearsim_bringup.evaluation.machines import parallel_machine, planetary_machine
from gearsim_io.errors import InputError

__all__ = ["SETS", "Case", "draw_case"]

Content = dict[str, Any]
_RATES_HZ = (32768, 65536)
_FAST_SHARE = 0.12  # of cases at the higher rate, which cost twice as much
_STEPS_HZ = {32768: 131072, 65536: 262144}
# Noise of the laboratory chain, 5e-4 m/s^2 per root hertz, up to one in which weak faults drown.
_NOISE_DENSITY = (5e-4, 0.3)
_SECONDS = (3.0, 4.5)
_BEARINGS = ("outer_race", "inner_race", "rolling_element")


@dataclass(frozen=True)
class Case:
    """One record to be made and judged.

    Parameters
    ----------
    set_name : str
    seed, number : int
    kind : str
        What was drawn: "healthy", a fault word, or two joined by "+".
    machine, scenario : dict
        Contents of the files that `gearsim simulate` would take.
    seconds : float
    truths : tuple of Truth
        What a right diagnosis finds.
    facts : dict
        Speed, load, noise, sizes: what tables are made over.
    """

    set_name: str
    seed: int
    number: int
    kind: str
    machine: Content
    scenario: Content
    seconds: float
    truths: tuple[Truth, ...]
    facts: dict[str, float]

    @property
    def name(self) -> str:
        """Names the case among all of all sets and seeds."""
        return f"{self.set_name}-{self.seed}-{self.number}"


def draw_case(set_name: str, seed: int, number: int) -> Case:
    """Case `number` of a set.

    Raises
    ------
    InputError
        For a set that is not known.
    """
    if set_name not in SETS:
        raise InputError("evaluation", "set", set_name, "one of " + ", ".join(SETS))
    sequence = np.random.SeedSequence([seed, zlib.crc32(set_name.encode()), number])
    return SETS[set_name](np.random.Generator(np.random.Philox(sequence)), set_name, seed, number)


def _random(rng: np.random.Generator, set_name: str, seed: int, number: int) -> Case:
    """A quarter healthy, the rest any fault at any size, one in ten with a second one on another part."""
    planetary = rng.random() < 0.25
    kinds: list[str] = []
    if rng.random() > 0.25:
        pool = [k for k, fault in FAULTS.items() if fault.planetary == planetary]
        kinds = [pool[int(rng.integers(len(pool)))]]
        if not planetary and rng.random() < 0.13:
            kinds.append(_BEARINGS[int(rng.integers(2))])
    return _case(rng, set_name, seed, number, planetary, kinds, sizes="any", noisy=True)


def _healthy(rng: np.random.Generator, set_name: str, seed: int, number: int) -> Case:
    planetary = rng.random() < 0.25
    return _case(rng, set_name, seed, number, planetary, [], sizes="any", noisy=True)


def _thesis(rng: np.random.Generator, set_name: str, seed: int, number: int) -> Case:
    """The faults seeded in the rig, at their sizes, in random machines under the laboratory's sensors."""
    kinds = ("outer_race", "inner_race", "planet_tooth_crack", "planet_tooth_spall", "gear_tooth_spall")
    kind = kinds[number % len(kinds)]
    planetary = FAULTS[kind].planetary
    return _case(rng, set_name, seed, number, planetary, [kind], sizes="thesis", noisy=False)


def _table77(rng: np.random.Generator, set_name: str, seed: int, number: int) -> Case:
    """Thesis Table 7.7 with the rig's own teeth: healthy, slot, spall to the sun, spall to the ring."""
    kind = ("", "planet_tooth_crack", "planet_tooth_spall_sun", "planet_tooth_spall_ring")[number % 4]
    return _case(rng, set_name, seed, number, True, [kind] if kind else [], sizes="thesis", noisy=False)


SETS: dict[str, Callable[[np.random.Generator, str, int, int], Case]] = {
    "random": _random,
    "healthy": _healthy,
    "thesis": _thesis,
    "table77": _table77,
}


def _case(
    rng: np.random.Generator,
    set_name: str,
    seed: int,
    number: int,
    planetary: bool,
    kinds: list[str],
    *,
    sizes: str,
    noisy: bool,
) -> Case:
    own_teeth = set_name == "table77"
    machine = planetary_machine(rng, own_teeth) if planetary else parallel_machine(rng)
    speed = float(rng.uniform(5.0, 30.0))  # of the input shaft
    load = float(np.exp(rng.uniform(np.log(20.0), np.log(120.0))))
    if planetary:
        speed = float(rng.uniform(5.0, 16.5)) * 32 / 90  # of the carrier, whose model ends at 6 Hz
        load = float(rng.uniform(30.0, 100.0))
    rate = _RATES_HZ[int(rng.random() < _FAST_SHARE)]
    low, high = np.log(_NOISE_DENSITY)
    density = float(np.exp(rng.uniform(low, high))) if noisy else _NOISE_DENSITY[0]
    seconds = float(rng.uniform(*_SECONDS))
    if planetary:
        seconds = max(seconds, 5.2 / speed)  # four turns of the carrier and what filters need
    machine["nameplate"]["shafts"]["carrier" if planetary else "input"] = {
        "nominal_speed": {"value": speed, "unit": "Hz", "source": "drawn at random for the evaluation"}
    }
    truths: list[Truth] = []
    faults: list[Content] = []
    facts = {"speed_hz": speed, "load_nm": load, "noise_density": density, "rate_hz": float(rate)}
    for kind in kinds:
        taken = {truth.component for truth in truths}
        drawn, truth, size = FAULTS[kind].draw(rng, machine, taken, sizes)
        faults += drawn
        truths.append(truth)
        facts[f"size_{kind}"] = size
    scenario: Content = {
        "machine": "machine.yaml",
        "model": "planetary18" if planetary else "lpm34",
        "seed": int(rng.integers(2**31)),
        "sample_rate": f"{rate} Hz",
        "oversampling": _STEPS_HZ[rate] // rate,
        "operating_point": {"speed": f"{speed!r} Hz", "load": f"{load!r} N*m"},
        "sensors": {"accelerometers": {"all": {"noise_density": f"{density!r} m/s^2/Hz^0.5"}}},
        "faults": faults,
    }
    name = "+".join(kinds) or "healthy"
    return Case(set_name, seed, number, name, machine, scenario, seconds, tuple(truths), facts)
