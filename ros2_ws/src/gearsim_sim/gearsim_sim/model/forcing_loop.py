"""The prescribed side of the compiled loop: motion of the reference shaft, torques, weight."""

from __future__ import annotations

import math

from gearsim_sim.integrate.compiled import embedded
from gearsim_sim.integrate.pieces import polynomial
from gearsim_sim.model.loop_data import Array, Data, Drive, Part


@embedded
def reference_motion(
    step: int, drive: Drive, per_step: float, per_second: float
) -> tuple[float, float, float]:
    """Of the reference shaft: turns since `drive.start_step`, speed [Hz], its change [Hz/s].

    `per_step` is 1 / length_steps, `per_second` the same for its length in seconds.
    """
    turns, slope, curvature = polynomial(float(step - drive.start_step) * per_step, drive.turns)
    return turns, slope * per_second, curvature * (per_second * per_second)


@embedded
def known_inputs(step: int, change_hz_per_s: float, drive: Drive, data: Data, inputs: Array) -> None:
    """Torques of motor and load and the weight, into `inputs`.

    The motor balances the load without its fluctuation and accelerates all inertia.
    """
    u = float(step - drive.start_step) / drive.length_steps
    load, _, _ = polynomial(u, drive.load)
    fluctuation, _, _ = polynomial(u, drive.fluctuation)
    accelerating = data.inertia * 2.0 * math.pi * change_hz_per_s
    inputs[0] = (accelerating - data.torque_ratios[1] * load) / data.torque_ratios[0]
    inputs[1] = load + fluctuation
    inputs[2] = data.gravity


@embedded
def apply_known(inputs: Array, part: Part, s: Array, sites: Array, nm: int) -> None:
    """Known inputs as modal forces of a part (in `s`) and as accelerations of its sites."""
    n2 = 2 * nm
    n = part.length & 0xFFFF
    for m in range(n):
        s[2 * n2 + m] = 0.0
    for j in range(inputs.size):
        value = inputs[j]
        for m in range(n):
            s[2 * n2 + m] += part.left_known[j, m] * value
    for i in range(sites.size):
        total = 0.0
        for j in range(inputs.size):
            total += part.site_known[i, j] * inputs[j]
        sites[i] = total
