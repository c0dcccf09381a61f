"""MFPT: the true speed against the nameplate's, and slip learnt under two loads, predicted under a third."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, GREY, HEALTHY, MARK, new_figure
from gearsim_bringup.stories.views import view_at
from gearsim_twin.causes.cage_motion import cage_motion, united_std
from gearsim_twin.causes.cage_slip import load_law
from gearsim_twin.load import stated_force_n

__all__ = ["RACES", "Loaded", "Predicted", "draw", "predicted", "tell"]

RACES = {"outer": "OuterRaceFault_vload", "inner": "InnerRaceFault_vload"}
_NUMBERS = (1, 3, 5)
_COMPONENT = "test_bearing"
_N_PER_LBF = 4.4482216152605
_SURE = 1.96


@dataclass(frozen=True, slots=True)
class Loaded:
    """One record: radial force, speed of the shaft with its 95 % interval, and slip of the cage.

    `std` is the standard deviation of the slip, nearly all of it from that of the speed.
    """

    name: str
    force_n: float
    stated_hz: float
    speed_hz: float
    ci95_hz: tuple[float, float]
    slip: float
    std: float


@dataclass(frozen=True, slots=True)
class Predicted:
    """Slip of a record as others teach it: by the law of the load, if they tell one, else their mean."""

    slip: float
    std: float
    halving_force_n: float


def tell(records: Measured) -> dict[str, tuple[Loaded, ...]]:
    """The three records of each race, by rising load.

    Raises
    ------
    EnvironmentLackError
        If a record is in no data folder.
    """
    return {
        race: tuple(_loaded(records, f"mfpt/{name}_{number}.mat") for number in _NUMBERS)
        for race, name in RACES.items()
    }


def _loaded(records: Measured, relative: str) -> Loaded:
    view = view_at(records, relative)
    motion = cage_motion(view, _COMPONENT)
    assert motion is not None
    bearing = view.machine.bearing(_COMPONENT)
    rolling = 1.0 - bearing.element_diameter_m / bearing.pitch_diameter_m
    return Loaded(
        name=relative.removeprefix("mfpt/").removesuffix(".mat"),
        force_n=stated_force_n(view.record) or 0.0,
        stated_hz=view.machine.nominal_speed_hz,
        speed_hz=view.speed_hz,
        ci95_hz=view.speed.ci95_hz,
        slip=1.0 - motion.share / rolling,
        std=motion.std / rolling,
    )


def predicted(learnt: Sequence[Loaded], force_n: float) -> Predicted:
    """The slip under a force, from records under others."""
    force = np.array([each.force_n for each in learnt])
    slip = np.array([each.slip for each in learnt])
    std = np.array([each.std for each in learnt])
    halving, at_force = load_law(force, slip, std, force_n)
    return Predicted(at_force, united_std(slip, std), halving)


def draw(records: Measured) -> Figure:
    """Speeds beside the nameplate's, and slip against load with what two loads predict for the third."""
    found = tell(records)
    figure = new_figure("MFPT: 25 Hz on the nameplate, and slip under three loads", 4.2)
    left, right = figure.subplots(1, 2)
    _speeds(left, found)
    for race, colour in (("outer", FAULTY), ("inner", HEALTHY)):
        _slips(right, race, found[race], colour)
    right.axhline(0.0, color=GREY, linewidth=0.8)
    right.set_xlabel("radial load [lbf]")
    right.set_ylabel("slip of the cage [%]")
    right.set_title("slip learnt under two loads, predicted under the third", fontsize=9)
    right.set_ylim(-0.6, 1.9)
    right.legend(loc="upper left", fontsize=7.5, ncols=2)
    return figure


def _speeds(axes: Axes, found: dict[str, tuple[Loaded, ...]]) -> None:
    rows = [each for race in RACES for each in found[race]]
    for k, each in enumerate(rows):
        low, high = each.ci95_hz
        spread = [[max(each.speed_hz - low, 0.0)], [max(high - each.speed_hz, 0.0)]]
        axes.errorbar(each.speed_hz, k, xerr=spread, fmt="o", color=HEALTHY, capsize=3)
    axes.axvline(rows[0].stated_hz, color=MARK, linestyle="--", linewidth=0.9)
    axes.set_yticks(range(len(rows)), [each.name.replace("RaceFault_vload_", " ") for each in rows])
    axes.set_xlabel("speed of the shaft by its own lines, 95 % interval [Hz]; dashed: nameplate")
    axes.set_title("the true speed", fontsize=9)


def _slips(axes: Axes, race: str, rows: tuple[Loaded, ...], colour: str) -> None:
    shift = 0.0 if race == "outer" else 4.0  # so that the bars stand side by side
    load = [each.force_n / _N_PER_LBF + shift for each in rows]
    slip = [100 * each.slip for each in rows]
    axes.errorbar(
        load[:2],
        slip[:2],
        [100 * _SURE * each.std for each in rows[:2]],
        fmt="o",
        color=colour,
        capsize=3,
        label=f"{race} race, learnt",
    )
    last = rows[2]
    axes.errorbar(
        load[2],
        slip[2],
        100 * _SURE * last.std,
        fmt="s",
        mfc="white",
        color=colour,
        capsize=3,
        label=f"{race} race, held out",
    )
    told = predicted(rows[:2], last.force_n)
    half = 100 * _SURE * math.hypot(told.std, last.std)
    axes.fill_between(
        [load[2] - 1.5, load[2] + 1.5],
        100 * told.slip - half,
        100 * told.slip + half,
        color=colour,
        alpha=0.2,
        label=f"{race} race, predicted",
    )
    axes.plot([load[2] - 1.5, load[2] + 1.5], [100 * told.slip] * 2, color=colour, linewidth=1.2)
