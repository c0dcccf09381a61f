"""Evidence that turns with a wheel: the synchronous average, the folded residual, velocities by order."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft

from gearsim_bringup.diagnosis_report.material import Material
from gearsim_bringup.diagnosis_report.words import shaft_words
from gearsim_bringup.pages.plot import BLUE, FOUND, GREY, SERIES, Plot, axis, curve, extremes
from gearsim_dsp.angle.encoder import encoder_phase, transmission_error
from gearsim_dsp.angle.resample import full_rate
from gearsim_dsp.gear_kinematics import GearWheel, gear_wheels
from gearsim_dsp.judges.finding import Finding
from gearsim_dsp.judges.measured import Measured
from gearsim_dsp.judges.planet import FoldedResidual, fold_stage
from gearsim_dsp.synchronous.signals import difference_signal
from gearsim_dsp.synchronous.tsa import shaft_average
from gearsim_io.errors import InputError
from gearsim_io.nameplate import PlanetaryStage

__all__ = ["draw_turn"]

_SAMPLES_PER_TOOTH = 32
_MOST_SAMPLES = 6000
_SIDEBANDS = 2
_MOST_LINES = 256
_TURNS_SHOWN = 6


def draw_turn(material: Material, number: int, finding: Finding) -> Plot | None:
    """What the judge of a gear, a planet or a shaft saw; None where a finding has no such picture."""
    colour = FOUND[number % len(FOUND)]
    if finding.fault.startswith("planet_tooth"):
        return _planet(material, finding, colour)
    if finding.fault in ("gear_tooth_crack", "gear_tooth_spall", "gear_wear"):
        return _wheel(material, finding, colour)
    if finding.fault == "gear_eccentricity":
        return _runout(material, finding, colour)
    if isinstance(finding.evidence.get("order_velocities_mm_s"), dict):
        return _velocities(finding, colour)
    return None


def _wheel(material: Material, finding: Finding, colour: str) -> Plot | None:
    wheel = _wheel_of(material, finding)
    if wheel is None or material.turning.phase is None:
        return None
    dense = min(full_rate(material.turning.phase, ratio=wheel.turn_order), _SAMPLES_PER_TOOTH * wheel.teeth)
    samples = int(sfft.next_fast_len(min(max(dense, 8 * wheel.teeth), _MOST_SAMPLES), real=True))
    average = shaft_average(
        material.samples(finding.channel),
        material.turning.phase,
        ratio=wheel.turn_order,
        samples_per_turn=samples,
    )
    others = {one.teeth for one in gear_wheels(material.machine) if one.shaft == wheel.shaft}
    orders = [float(teeth) for teeth in sorted(others) if 2 * teeth < samples]
    difference = difference_signal(average, orders, _SIDEBANDS)
    step = wheel.teeth / samples
    bounds = [1.1 * float(np.max(np.abs(values))) for values in (average.values, difference)]
    data = [
        curve(average.values, 0.0, step, "synchronous average", GREY, width=1.0),
        curve(difference, 0.0, step, "difference signal", BLUE, yaxis="y2"),
    ]
    layout: dict[str, Any] = {
        "xaxis": axis(f"turn of {wheel.component}, teeth", 0.0, float(wheel.teeth), anchor="y2"),
        "yaxis": axis(material.unit, -bounds[0], bounds[0], domain=[0.56, 1.0]),
        "yaxis2": axis(material.unit, -bounds[1], bounds[1], domain=[0.0, 0.46]),
    }
    place = finding.evidence.get("tooth_angle_turns")
    if isinstance(place, float):
        at = place * wheel.teeth
        layout["shapes"] = [_stripe(at - 1.0, at + 1.0, colour)]
    caption = (
        f"{average.count} turns of the wheel averaged on channel {finding.channel}: what does not turn with "
        "it cancels. Below, the same without the regular mesh and its sidebands: sound teeth leave a level "
        "line, one bad tooth a burst, worn flanks unrest all round."
    )
    return Plot("One turn of the wheel", caption, tuple(data), layout, 400)


def _wheel_of(material: Material, finding: Finding) -> GearWheel | None:
    wheels = gear_wheels(material.machine)
    own = [one for one in wheels if one.component == finding.component]
    return next(iter(own or [one for one in wheels if one.mesh == finding.component]), None)


def _runout(material: Material, finding: Finding, colour: str) -> Plot | None:
    name = finding.component.split(".")[0]
    mesh = next((one for one in material.machine.gear_meshes if one.name == name), None)
    edges = {train.shaft: train for train in material.record.encoders}
    if mesh is None or not {mesh.driving_shaft, mesh.driven_shaft} <= edges.keys():
        return None
    count = material.record.sample_count
    driving, driven = (
        encoder_phase(edges[shaft], count) for shaft in (mesh.driving_shaft, mesh.driven_shaft)
    )
    lines = min(_MOST_LINES, edges[mesh.driving_shaft].lines_per_revolution)
    error = transmission_error(
        driving, driven, mesh.driving_teeth, mesh.driven_teeth, samples_per_turn=lines
    ).signal
    # The turn of the slower wheel, some times over.
    turns = math.ceil(_TURNS_SHOWN * max(1.0, mesh.driven_teeth / mesh.driving_teeth))
    share = error.values[: turns * lines] * (100 * mesh.driving_teeth / (2 * math.pi))
    values, stride = extremes(share, _MOST_SAMPLES // 2)
    bound = 1.15 * float(np.max(np.abs(values)))
    layout = {
        "xaxis": axis(f"turns of {shaft_words(mesh.driving_shaft)}", 0.0, turns),
        "yaxis": axis("% of the tooth pitch", -bound, bound),
        "showlegend": False,
    }
    shaft = shaft_words(mesh.driven_shaft)
    caption = (
        f"How far {shaft} lags behind what the teeth demand, by the two encoders. The quick swing is the "
        "mesh; the slow one, once a turn, comes from a wheel that does not turn about its centre."
    )
    data = (curve(values, 0.0, stride / lines, "transmission error", colour),)
    return Plot("Transmission error", caption, data, layout)


def _planet(material: Material, finding: Finding, colour: str) -> Plot:
    stage, folded = _folded(material, finding)
    clearest = next((one for one in folded if one.channel == finding.channel), folded[0])
    # The tooth is put at a quarter of the turn, so that it and its opposite lie within the picture.
    size = clearest.profile.size
    shift = size // 4 - int(np.argmax(clearest.profile))
    step = stage.planet_teeth / size
    top = 1.15 * max(float(one.profile.max()) for one in folded)
    data = tuple(
        curve(np.roll(one.profile, shift), 0.0, step, one.channel, SERIES[row % len(SERIES)], width=1.6)
        for row, one in enumerate(folded)
    )
    places = (0.25 * stage.planet_teeth, 0.75 * stage.planet_teeth)
    layout = {
        "xaxis": axis("turn of the planet against the carrier, teeth", 0.0, float(stage.planet_teeth)),
        "yaxis": axis("energy over its median", 0.0, top),
        "shapes": [_stripe(place - 0.8, place + 0.8, colour) for place in places],
        "showlegend": len(folded) > 1,
    }
    turns = clearest.energy.shape[0]
    caption = (
        f"What a linear prediction leaves of the channels, folded over {turns} turns of the planet. Shaded: "
        "the tooth that stands out and the place half a turn from it. One peak is a spall, which only one "
        "mesh feels; two, on one channel or several, are a crack, which both meshes feel."
    )
    return Plot("One turn of the planet", caption, data, layout)


def _folded(material: Material, finding: Finding) -> tuple[PlanetaryStage, list[FoldedResidual]]:
    measured = Measured.of_record(material.record, material.machine, material.turning)
    stages = material.machine.planetary_stages
    own = [stage for stage in stages if finding.component.startswith(f"{stage.name}.")]
    for stage in own or stages:
        folded = fold_stage(measured, stage)
        if folded:
            return stage, folded
    raise InputError("one turn of the planet", "channel", finding.channel, "a channel with enough turns")


def _velocities(finding: Finding, colour: str) -> Plot:
    table: dict[str, float] = dict(finding.evidence["order_velocities_mm_s"])  # type: ignore[call-overload]
    orders: NDArray[np.float64] = np.array([float(key) for key in table])
    bars = {
        "type": "bar",
        "x": orders.tolist(),
        "y": [float(value) for value in table.values()],
        "marker": {"color": colour},
        "width": 0.3,
        "hovertemplate": "order %{x}: %{y:.3g} mm/s<extra></extra>",
    }
    limit = finding.evidence.get("limit_mm_s")
    shapes = []
    if isinstance(limit, float):
        line = {"color": GREY, "width": 1.2, "dash": "dash"}
        shapes.append(
            {"type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": limit, "y1": limit, "line": line}
        )
    layout = {
        "xaxis": axis("order of the shaft", 0.0, 8.5, dtick=1),
        "yaxis": axis("velocity, mm/s RMS", rangemode="tozero"),
        "shapes": shapes,
        "showlegend": False,
    }
    caption = (
        f"Vibration velocity of channel {finding.channel} at multiples of the shaft's speed; dashed, the "
        "level from which there is a finding. Unbalance is order 1, misalignment orders 2 and above, a "
        "loose foot many orders and halves."
    )
    return Plot("Velocities by order", caption, (bars,), layout)


def _stripe(low: float, high: float, colour: str) -> dict[str, Any]:
    return {
        "type": "rect",
        "xref": "x",
        "yref": "paper",
        "x0": low,
        "x1": high,
        "y0": 0,
        "y1": 1,
        "fillcolor": colour,
        "opacity": 0.2,
        "line": {"width": 0},
        "layer": "below",
    }
