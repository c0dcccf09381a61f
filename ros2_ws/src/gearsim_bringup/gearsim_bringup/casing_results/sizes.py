"""Entry and impact of the balls in a spall through the casing: how wide the product's sizing says it is.

Figures 5.74 to 5.81 of the thesis, with a number: `gearsim_dsp.sizing` on the sensor above the bearing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from gearsim_bringup.casing_results.envelopes import BANDS_HZ, envelope_of, expected_hz
from gearsim_bringup.casing_results.records import (
    BEARING,
    IN_CASING,
    RATE_HZ,
    SLIP,
    SPEED_HZ,
    Records,
    Run,
    spall,
)
from gearsim_bringup.method_figures.style import FAULTY, mark, new_figure
from gearsim_dsp.judges.finding import Finding
from gearsim_dsp.sizing.crossing import RacePass
from gearsim_dsp.sizing.impacts import mean_impact
from gearsim_dsp.sizing.spall_width import Sizing, size_defect
from gearsim_dsp.sizing.whitening import whitened
from gearsim_dsp.speed import ShaftSpeed
from gearsim_io.machines import load_machine

__all__ = ["RACES", "SEEDS", "WIDTHS_MM", "Sized", "draw", "found_hz", "sizing_of", "table", "tell"]

Array = NDArray[np.float64]

RACES = ("inner", "outer")
WIDTHS_MM = (0.8, 1.2, 1.6, 2.4)
SEEDS = (11, 12)
GOOD = 0.15
_SHOWN_MM = 1.6
_SECONDS = 6.0
_SPEED_ERROR = 3e-5  # of one pulse per turn over ten seconds
_SLIP = 0.02


@dataclass(frozen=True)
class Sized:
    """One record.

    Attributes
    ----------
    width_m : float
        True.
    sizing : Sizing
        What was told of it.
    """

    width_m: float
    sizing: Sizing

    @property
    def error(self) -> float | None:
        """Relative, None if no width was told."""
        told = self.sizing.width
        return None if told is None else told.value_m / self.width_m - 1

    @property
    def held(self) -> bool:
        """Whether the interval told holds the true width."""
        told = self.sizing.width
        return told is not None and told.ci95_m[0] <= self.width_m <= told.ci95_m[1]


def found_hz(samples: Array, race: str) -> float:
    """Ball passes of a race, as the envelope shows them."""
    spectrum = envelope_of(samples, BANDS_HZ[1])
    return spectrum.comb(expected_hz(race), _SLIP, shafts=(SPEED_HZ,)).found


def sizing_of(samples: Array, race: str) -> Sizing:
    """What the product says of a spall of a race; nothing of the simulation goes in but the record."""
    passes = found_hz(samples, race)
    order = passes / SPEED_HZ
    finding = Finding(BEARING, f"{race}_race", order, order, passes, 30.0, 0.9, "moderate", "top")
    speed = ShaftSpeed(
        SPEED_HZ, (SPEED_HZ * (1 - _SPEED_ERROR), SPEED_HZ * (1 + _SPEED_ERROR)), "tacho", None
    )
    return size_defect(samples, RATE_HZ, finding, load_machine("unsw_parallel"), speed)


def run_of(model: str, race: str, width_mm: float, seed: int) -> Run:
    """A record with a spall of that width and slip."""
    return Run(model, (SLIP, spall(race, width_mm)), _SECONDS, seed)


def tell(records: Records) -> dict[tuple[str, str, float], list[Sized]]:
    """Over model, race and width [mm]: one for each seed."""
    return {
        (model, race, width): [
            Sized(width * 1e-3, sizing_of(records.signal(run_of(model, race, width, seed)), race))
            for seed in SEEDS
        ]
        for model in IN_CASING
        for race in RACES
        for width in WIDTHS_MM
    }


def table(told: dict[tuple[str, str, float], list[Sized]]) -> list[str]:
    """One row for each width, then the rates."""
    lines = ["| spall | " + " | ".join(f"`{m}`, {r} race" for m in IN_CASING for r in RACES) + " |"]
    lines.append("|---|" + "---|" * (len(IN_CASING) * len(RACES)))
    for width in WIDTHS_MM:
        cells = [_cell(told[m, r, width]) for m in IN_CASING for r in RACES]
        lines.append(f"| {width:g} mm | " + " | ".join(cells) + " |")
    for name, chosen in (("all", WIDTHS_MM), ("1.2 mm and wider", [w for w in WIDTHS_MM if w >= 1.2])):
        cells = [_rates([one for w in chosen for one in told[m, r, w]]) for m in IN_CASING for r in RACES]
        lines.append(f"| {name}: sized; within 15 %; interval holds | " + " | ".join(cells) + " |")
    return lines


def _cell(each: Sequence[Sized]) -> str:
    return ", ".join(
        "refused" if one.sizing.width is None else f"{one.sizing.width.value_m * 1e3:.2f}" for one in each
    )


def _rates(each: Sequence[Sized]) -> str:
    sized = [one for one in each if one.error is not None]
    good = sum(abs(one.error or 0.0) <= GOOD for one in sized)
    return f"{len(sized)} of {len(each)}; {good}; {sum(one.held for one in sized)}"


def draw(records: Records, told: dict[tuple[str, str, float], list[Sized]]) -> Figure:
    """The mean whitened impact of one width, both races and both models, with entry and impact."""
    figure = new_figure(f"spall of {_SHOWN_MM} mm: mean of the whitened impacts above bearing 3", 5.0)
    axes = figure.subplots(2, 2, sharex=True)
    bearing = load_machine("unsw_parallel").bearing(BEARING)
    for row, race in enumerate(RACES):
        for column, model in enumerate(IN_CASING):
            panel = axes[row, column]
            samples = records.signal(run_of(model, race, _SHOWN_MM, SEEDS[0]))
            passes = found_hz(samples, race)
            white, _ = whitened(samples, RATE_HZ, passes, SPEED_HZ if race == "inner" else 0.0, [SPEED_HZ])
            mean = mean_impact(white, RATE_HZ, passes, None)
            assert mean is not None
            way = RacePass.of(bearing, f"{race}_race", passes)
            place = (np.arange(mean.values.size) - mean.values.size // 2) / RATE_HZ * way.speed_m_s * 1e3
            panel.plot(place, mean.values, color=FAULTY, linewidth=0.8)
            one = told[model, race, _SHOWN_MM][0].sizing
            sized = "refused" if one.width is None else f"{one.width.value_m * 1e3:.2f} mm told"
            if one.width is not None:
                impact = float(place[int(np.argmax(np.abs(mean.values)))])
                mark(panel, impact, "impact")
                mark(
                    panel,
                    impact - one.width.value_m * 1e3 + 2 * way.release_m * 1e3,
                    "entry, by the width told",
                )
            panel.set_title(f"{model}, {race} race: {sized}", fontsize=9, pad=14)
    axes[0, 0].set_xlim(-3, 2)
    for one_axes in axes[1]:
        one_axes.set_xlabel("along the race [mm]")
    return figure
