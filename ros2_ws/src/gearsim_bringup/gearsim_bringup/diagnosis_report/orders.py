"""The order spectrum: amplitudes over multiples of the shaft's speed."""

from __future__ import annotations

import math

import numpy as np
from scipy import fft as sfft

from gearsim_bringup.diagnosis_report.lines import all_marks, drawn
from gearsim_bringup.diagnosis_report.material import LONGEST_S, Material
from gearsim_bringup.diagnosis_report.words import shaft_words
from gearsim_bringup.pages.plot import BLUE, Plot, axis, curve, strongest
from gearsim_dsp.angle.resample import to_angle
from gearsim_io.errors import InputError

__all__ = ["draw_orders"]

_POINTS = 5000
_LEAST_TOP = 12.0
_MOST_TOP = 400.0
_RATE_SHARE = 0.45


def draw_orders(material: Material) -> Plot:
    """Peak amplitudes of the signal resampled at equal angles, with shafts, meshes and faults marked."""
    phase = material.angle
    if phase is None:
        raise InputError("order spectrum", "speed", "not known", "a tacho, an encoder or a nominal speed")
    x = material.samples(material.channel, LONGEST_S)
    top = _top(material)
    per_turn = int(sfft.next_fast_len(math.ceil(2.6 * top), real=True))
    orders, amplitude = to_angle(x, phase, per_turn).spectrum()
    step = float(orders[1])
    kept = amplitude[1 : round(top / step) + 1]
    level, length = strongest(kept, _POINTS)
    high = 2 * float(level.max())
    low = max(float(np.quantile(level, 0.02)) / 2, high * 1e-6)
    data = [curve(level, step + 0.5 * (length - 1) * step, length * step, material.channel, BLUE)]
    data += drawn(all_marks(material), top, (low, high))
    reference = material.machine.reference_shaft
    layout = {
        "xaxis": axis(f"order of {shaft_words(reference)}", 0.0, top),
        "yaxis": axis(material.unit, low, high, type="log", exponentformat="power", dtick=1),
    }
    caption = (
        f"Channel {material.channel} sampled at equal angles of the shaft, {_source(material)}: lines of "
        "shafts and gears are sharp even where the speed changes. Mesh sidebands that are uneven or "
        "stronger than elsewhere speak of a gear; a strong first order of unbalance."
    )
    return Plot("Order spectrum", caption, tuple(data), layout, 400)


def _top(material: Material) -> float:
    meshes = [mesh.order for mesh in material.meshes()]
    families = [order for _, _, order in material.expected()]
    top = max([_LEAST_TOP, *(3.4 * order for order in meshes), *(2.4 * order for order in families)])
    return min(top, _MOST_TOP, _RATE_SHARE * material.rate_hz / material.speed_hz)


def _source(material: Material) -> str:
    speed = material.turning
    if speed.phase is None:
        return "which is taken to turn at a constant speed"
    if speed.source == "estimated":
        return "whose angle was found in the vibration itself"
    return f"whose angle the {speed.source} tells"
