"""All effects that can be hidden: how to enter each, on which rigs, and between which sizes to look.

Sizes are whatever an effect counts in (metres, shares, dB). `sizes.json` holds, for each rig, the three that
stand out mildly, medium and strongly on one machine of it; `calibrate` made it. From there the size is sought
on the machine of each case (`sizing`).
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from blind import chain_effects as chain
from blind import machine_effects as machine
from blind import operation_effects as operation
from blind import outside
from blind.build import Build

SEVERITIES = ("mild", "medium", "strong")
TARGETS_DB = (6.0, 12.0, 24.0)
SIZES = Path(__file__).with_name("sizes.json")
_ALL = ("parallel", "bearing", "planetary")
_GEARS = ("parallel", "planetary")
_BEARINGS = ("parallel", "bearing")
# A pit of some tenths of a millimetre is 60 dB over the noise of good sensors; this is that of a loud hall.
_HALL = {"bearing": 1250.0, "parallel": 10.0}
# A sound bearing hardly shakes: what shapes its vibration shows with sensors of 10 ug/sqrt(Hz) only.
_QUIET = {"bearing": 0.05}


@dataclass(frozen=True)
class Effect:
    """An effect.

    Attributes
    ----------
    enter : callable
        Enters it into a build at a size.
    rigs : tuple of str
    low, high : float
        Sizes between which `calibrate` looks.
    given : tuple of float
        The three sizes, where decibels of spectra mean nothing: labels, gains (which are decibels), and what
        is seen in samples or pulses one by one.
    noise : mapping of str to float
        By rig: the sensors' noise over the ordinary one, where sizes that matter would stand out by far, or
        not at all.
    random : bool
        Whether it adds noise of its own, which is to be measured by bands and not by lines.
    shrinks : bool
        Whether it stands out the more the smaller its size is, as a filter does by its corner.
    """

    enter: Callable[[Build, float], None]
    rigs: tuple[str, ...]
    low: float = 0.0
    high: float = 0.0
    given: tuple[float, ...] = ()
    noise: Mapping[str, float] = field(default_factory=dict)
    random: bool = False
    shrinks: bool = False

    @property
    def of_machine(self) -> bool:
        """Whether a machine gets it in the course of time: what it was before can have been recorded."""
        return self.enter.__module__ == machine.__name__


CAUSES: dict[str, Effect] = {
    "shaft_speed_offset": Effect(operation.speed_offset, _GEARS, given=(0.025, 0.04, 0.07)),
    "speed_fluctuation": Effect(operation.speed_fluctuation, _ALL, given=(6e-4, 2e-3, 8e-3)),
    "load_fluctuation": Effect(operation.load_fluctuation, ("parallel",), 0.005, 0.5),
    "cage_slip": Effect(machine.cage_slip, ("bearing",), 2e-3, 0.04),
    "bearing_geometry": Effect(machine.bearing_geometry, ("bearing",), 2e-3, 0.05),
    "bearing_clearance": Effect(machine.clearance, _BEARINGS, 2e-7, 3e-5),
    "bearing_spall_outer": Effect(machine.outer, _BEARINGS, 1.2e-4, 2e-3, noise=_HALL),
    "bearing_spall_inner": Effect(machine.inner, _BEARINGS, 1.2e-4, 2e-3, noise=_HALL),
    "bearing_spall_ball": Effect(machine.ball, _BEARINGS, 1.2e-4, 2e-3, noise=_HALL),
    "wide_spall": Effect(machine.wide_spall, _BEARINGS, 1e-6, 6e-5, noise=_HALL),
    "gear_runout": Effect(machine.runout, _GEARS, 2e-6, 4e-4),
    "tooth_pitch_error": Effect(machine.tooth_pitch_error, _GEARS, 2e-7, 8e-5),
    "tooth_wear": Effect(machine.wear, _GEARS, 1e-6, 2e-4),
    # The deepest crack that leaves a tooth of the parallel rig is 7 mm; it stands out by 6 dB and no more.
    "tooth_crack": Effect(machine.crack, _GEARS, 3e-4, 6.9e-3),
    "tooth_spall": Effect(machine.spall, _GEARS, 1e-4, 2.2e-3),
    "backlash_contact_loss": Effect(machine.backlash, ("parallel",), given=(2e-5, 1e-4, 3e-4)),
    "misalignment": Effect(machine.misalignment, ("parallel",), 2e-6, 1e-3),
    "unbalance": Effect(machine.unbalance, _ALL, 1e-5, 0.3),
    "looseness": Effect(machine.looseness, _BEARINGS, 0.02, 0.9),
    "missing_gear_stage": Effect(operation.missing_stage, _GEARS, 1e-4, 0.2),
    "unequal_load_sharing": Effect(machine.sharing, ("planetary",), 0.01, 1.5),
    "planet_position_error": Effect(machine.planet_position_error, ("planetary",), 1e-7, 6e-5),
    "carrier_modulation": Effect(machine.carrier, ("planetary",), 1e-6, 4e-4),
    "transfer_path": Effect(operation.transfer_path, _GEARS, 0.01, 6.0),
    "casing_resonance": Effect(operation.casing_resonance, _ALL, 1e-3, 4.0, noise=_QUIET),
    "sensor_resonance": Effect(chain.sensor_resonance, _ALL, 1.5, 60.0, noise=_QUIET),
    "mains_interference": Effect(chain.mains, _ALL, 1e-3, 100.0),
    "inverter_lines": Effect(chain.inverter, _ALL, 1e-3, 100.0),
    "dropouts": Effect(chain.dropouts, _ALL, given=(2.5, 6.0, 20.0)),
    "clipping": Effect(chain.clipping, _ALL, given=(2.0, 6.0, 12.0)),
    "antialias_rolloff": Effect(chain.rolloff, _ALL, 0.01, 0.4, noise=_QUIET, shrinks=True),
    "coloured_floor": Effect(chain.floor, _ALL, 30.0, 4e3, random=True),
    "unit_or_gain_error": Effect(chain.gain, _ALL, given=(6.0, 12.0, 20.0), noise=_QUIET),
    "mislabelled_record": Effect(operation.mislabelled, _ALL, given=(1.5, 2.0, 3.0)),
}
OUTSIDE: dict[str, Effect] = {
    "neighbour_tones": Effect(outside.neighbour, _ALL, 1e-3, 100.0),
    "oil_whirl": Effect(outside.oil_whirl, _ALL, 0.1, 3000.0),
    "drifting_resonance": Effect(outside.drifting_resonance, _ALL, 0.002, 3.0, random=True),
    "intermittent_rub": Effect(outside.rub, _ALL, 0.02, 3000.0),
    "missing_antialias": Effect(outside.no_filter, _ALL, 1e-4, 1.0),
}
EFFECTS = {**CAUSES, **OUTSIDE}


def noise_of(names: Iterable[str], rig: str, ordinary: float = 1.0) -> float:
    """The sensors' noise, over the rig's ordinary one, with which these effects are measured.

    A loud hall drowns what quiet sensors are for; sizes are sought in it.
    """
    asked = [EFFECTS[name].noise[rig] for name in names if rig in EFFECTS[name].noise]
    loud = [one for one in asked if one > 1.0]
    return max(loud) if loud else min(asked, default=ordinary)


_UNKNOWN: list[float | None] = [None] * len(SEVERITIES)


@cache
def _sizes() -> dict[str, dict[str, list[float | None]]]:
    found: dict[str, dict[str, list[float | None]]] = json.loads(SIZES.read_text(encoding="utf-8"))["sizes"]
    return found


def size_of(name: str, rig: str, severity: str) -> float | None:
    """The size at which an effect stands out by so much; None if none within reason does on that rig."""
    effect, at = EFFECTS[name], SEVERITIES.index(severity)
    return effect.given[at] if effect.given else _sizes()[rig].get(name, _UNKNOWN)[at]
