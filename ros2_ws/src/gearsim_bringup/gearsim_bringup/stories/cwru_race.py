"""CWRU: the outer race's lines are off the nameplate; what one record can tell of the reason."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, GREY, HEALTHY, new_figure
from gearsim_bringup.stories.views import learnt_and_held_out, view_at
from gearsim_dsp.kinematics import bearing_orders
from gearsim_twin.causes.bearing_geometry import spin_of
from gearsim_twin.causes.bearing_signs import signs_of
from gearsim_twin.causes.cage_motion import CageMotion, cage_motion
from gearsim_twin.view import View

__all__ = ["RECORD", "Explanation", "Race", "draw", "tell"]

RECORD = "cwru/135_0.mat"
_COMPONENT = "drive_end"
_SURE = 3.0


@dataclass(frozen=True, slots=True)
class Explanation:
    """A reason for the BPFO, the number it needs, and where it would put BPFI and BSF.

    `why_not` says what rules it out; it is empty where nothing in the record does.
    """

    name: str
    needs: str
    bpfi_order: float
    bsf_order: float
    why_not: str


@dataclass(frozen=True, slots=True)
class Race:
    """The BPFO on two thirds of the record and on the last third, and what could explain it.

    Orders are multiples of the shaft's speed; `spun` is whether a sign of the BSF is in the record.
    """

    nameplate: float
    learnt: float
    held_out: float
    std: float
    speed_hz: float
    speed_std_hz: float
    explanations: tuple[Explanation, ...]
    spun: bool

    @property
    def off(self) -> float:
        """Relative distance of the BPFO from the nameplate's."""
        return self.learnt / self.nameplate - 1.0


def tell(records: Measured) -> Race:
    """Read the BPFO off two thirds of the record, and go through what could move it.

    Raises
    ------
    EnvironmentLackError
        If the record is in no data folder.
    """
    view = view_at(records, RECORD)
    first, last = learnt_and_held_out(view)
    signs = [sign for sign in signs_of(first) if sign.component == _COMPONENT]
    outer = next(sign for sign in signs if sign.fault == "outer_race")
    motion = cage_motion(first, _COMPONENT)
    assert motion is not None
    return Race(
        nameplate=outer.expected_order,
        learnt=outer.found_order,
        held_out=next(sign.found_order for sign in signs_of(last) if sign.fault == "outer_race"),
        std=outer.std_order,
        speed_hz=view.speed_hz,
        speed_std_hz=view.speed.relative_error / 1.96 * view.speed_hz,
        explanations=_explanations(view, motion),
        spun=any(sign.fault == "rolling_element" for sign in signs),
    )


def _explanations(view: View, motion: CageMotion) -> tuple[Explanation, ...]:
    bearing = view.machine.bearing(_COMPONENT)
    count, size = bearing.rolling_elements, bearing.element_diameter_m / bearing.pitch_diameter_m
    nominal = bearing_orders(bearing, 1.0)
    rolling = 1.0 - size * math.cos(bearing.contact_angle_rad)
    off = motion.share / rolling - 1.0
    gamma = 1.0 - motion.share
    change = gamma / size - 1.0
    race = 0.5 * count * (2.0 - motion.share)
    wanted_hz = view.speed_hz * (1.0 + off)
    speed_z = abs(off) * view.speed_hz / max(view.speed.relative_error / 1.96 * view.speed_hz, 1e-9)
    no_slip = "elements would run ahead of pure rolling" if off > _SURE * motion.std else ""
    no_speed = f"the shaft's own lines tell {view.speed_hz:.4f} Hz" if speed_z > _SURE else ""
    angle = math.degrees(math.acos(min(gamma / size, 1.0)))
    return (
        Explanation("slip", f"{-100 * off:+.2f} % of slip", race, nominal.bsf * (1 + off), no_slip),
        Explanation(
            "speed", f"{wanted_hz:.3f} Hz", nominal.bpfi * (1 + off), nominal.bsf * (1 + off), no_speed
        ),
        Explanation(
            "elements",
            f"d/D {100 * change:+.2f} %",
            race,
            spin_of(size, size, change, "element_diameter"),
            "",
        ),
        Explanation(
            "contact angle", f"{angle:.1f} degrees", race, spin_of(size, size, change, "contact_angle"), ""
        ),
    )


def draw(records: Measured) -> Figure:
    """Where each explanation puts BPFO, BPFI and BSF, relative to the nameplate."""
    told = tell(records)
    bearing = records.machine(RECORD).bearing(_COMPONENT)
    nominal = bearing_orders(bearing, 1.0)
    figure = new_figure("CWRU 135: one race tells that the cage is fast, not why", 3.8)
    axes = figure.subplots()
    places = np.arange(3.0)
    for k, each in enumerate(told.explanations):
        values = 100 * np.array(
            [told.off, each.bpfi_order / nominal.bpfi - 1, each.bsf_order / nominal.bsf - 1]
        )
        colour = GREY if each.why_not else (FAULTY, HEALTHY)[k % 2]
        label = f"{each.name}: {each.needs}" + (f" (no: {each.why_not})" if each.why_not else "")
        axes.bar(places + 0.2 * (k - 1.5), values, 0.18, color=colour, alpha=0.35 + 0.18 * k, label=label)
    axes.axhline(0.0, color="black", linewidth=0.8)
    axes.set_xticks(
        places, ["BPFO: measured", "BPFI: not in this record", "BSF: not in this record; decides"]
    )
    axes.set_ylabel("off the nameplate [%]")
    axes.legend(loc="upper left", fontsize=8)
    return figure
