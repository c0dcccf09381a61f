"""Forces of all gear meshes in the compiled loop; the readable twin is `gear_mesh.Mesh`."""

from __future__ import annotations

import math

from gearsim_sim.integrate.compiled import embedded
from gearsim_sim.integrate.pieces import table_value
from gearsim_sim.model.bearing_loop import severity
from gearsim_sim.model.loop_data import Array, Drive, Meshes
from gearsim_sim.model.mesh_nodes import mesh_functions
from gearsim_sim.model.tooth.contact import FREE_PLAY_M

_OWN = 4  # first column behind those of the severity
# Rows of `work` (WORK_ROWS, meshes): stiffness, transmission error, its rate per second, backlash, lead gap.
WORK_ROWS = 5


@embedded
def look_up(phases: Array, speed_hz: float, drive: Drive, meshes: Meshes, work: Array) -> None:
    """Stiffness, error and its rate of all meshes without faults and pulses, straight from the tables."""
    for i in range(meshes.places.shape[0]):
        stiffness, _, error, rate = mesh_functions(i, phases, drive, meshes)
        work[0, i] = stiffness
        work[1, i] = error
        work[2, i] = speed_hz * rate


@embedded
def mesh_forces(
    step: int, q: Array, rates: Array, phases: Array, speed_hz: float, drive: Drive, meshes: Meshes,
    work: Array, forces: Array,
) -> None:  # fmt: skip
    """Forces of the meshes beyond their linear part: variation of stiffness, and transmission error.

    The first rows of `work` hold the functions of the healthy mesh, by `look_up` or `between_nodes`.
    `rates` of the interfaces are zero unless `drive.need_rates`.
    """
    count = meshes.places.shape[0]
    for i in range(count):
        work[3, i] = 0.0
        work[4, i] = 0.0
    add_tooth_pulses(phases, speed_hz, drive, meshes, work)
    add_mods(step, phases, speed_hz, drive, work)
    add_pulses(step, phases, speed_hz, drive, meshes, work)
    add_terms(step, drive, work)
    for i in range(count):
        at = meshes.places[i, 0]
        stiffness = work[0, i]
        slack = work[3, i] + work[4, i]
        if slack == 0.0:
            damper = meshes.numbers[i, 1] * work[2, i]
            forces[at] = -((stiffness - meshes.numbers[i, 0]) * q[at] + stiffness * work[1, i] + damper)
        else:
            linear = meshes.numbers[i, 0] * q[at] + meshes.numbers[i, 1] * rates[at]
            rate = rates[at] + work[2, i]
            forces[at] = linear - tooth_force(
                q[at] + work[1, i], rate, stiffness, meshes.numbers[i, 1], work[3, i], work[4, i]
            )


@embedded
def add_tooth_pulses(phases: Array, speed_hz: float, drive: Drive, meshes: Meshes, work: Array) -> None:
    """Rectangular parts of the stiffness of meshes that have one."""
    for i in range(meshes.places.shape[0]):
        if meshes.numbers[i, 6] != 0.0:
            track = meshes.places[i, 1]
            turns = phases[track] * meshes.numbers[i, 2] + meshes.numbers[i, 3]
            length = abs(speed_hz * drive.rates[track] * meshes.numbers[i, 2]) * meshes.step_s
            mean = pulse_mean(turns - meshes.numbers[i, 4], length, meshes.numbers[i, 5])
            work[0, i] += meshes.numbers[i, 6] * mean


@embedded
def add_mods(step: int, phases: Array, speed_hz: float, drive: Drive, work: Array) -> None:
    """What faults change of stiffness and transmission error, smoothly."""
    for j in range(drive.mesh_mods.shape[0]):
        row = drive.mesh_mods[j]
        mesh, track = int(row[_OWN]), int(row[_OWN + 2])
        now = severity(row, step)
        value, slope = table_value(phases[track], drive.samples, int(row[_OWN + 3]), int(row[_OWN + 4]))
        if row[_OWN + 1] == 0.0:
            work[0, mesh] += now * value
        else:
            work[1, mesh] += now * value
            work[2, mesh] += now * speed_hz * drive.rates[track] * slope


@embedded
def pulse_area(place: float, width: float) -> float:
    """Integral from 0 to `place` of a function that is 1 from 0 to `width` in each period of 1."""
    whole = math.floor(place)
    area: float = whole * width + min(place - whole, width)
    return area


@embedded
def pulse_mean(place: float, length: float, width: float) -> float:
    """Mean of that function over `length` around `place`: its jumps become ramps of one step."""
    if length < 1e-12:
        return 1.0 if place - math.floor(place) < width else 0.0
    mean: float = (pulse_area(place + 0.5 * length, width) - pulse_area(place - 0.5 * length, width)) / length
    return mean


@embedded
def add_pulses(step: int, phases: Array, speed_hz: float, drive: Drive, meshes: Meshes, work: Array) -> None:
    """Rectangular changes by faults: their exact mean over one step, and that of their rate."""
    for j in range(drive.mesh_pulses.shape[0]):
        row = drive.mesh_pulses[j]
        mesh, track = int(row[_OWN]), int(row[_OWN + 2])
        height = severity(row, step) * row[_OWN + 5]
        place, width = phases[track] - row[_OWN + 3], row[_OWN + 4]
        length = abs(speed_hz * drive.rates[track]) * meshes.step_s
        value = height * pulse_mean(place, length, width)
        if row[_OWN + 1] == 0.0:
            work[0, mesh] += value
        else:
            work[1, mesh] += value
            if length >= 1e-12:
                after = pulse_mean(place + 0.5 * length, 0.0, width)
                before = pulse_mean(place - 0.5 * length, 0.0, width)
                work[2, mesh] += height * speed_hz * drive.rates[track] * (after - before) / length


@embedded
def add_terms(step: int, drive: Drive, work: Array) -> None:
    """What faults add to backlash and lead gap."""
    for j in range(drive.mesh_terms.shape[0]):
        row = drive.mesh_terms[j]
        work[3 + int(row[_OWN + 1]), int(row[_OWN])] += severity(row, step) * row[_OWN + 2]


@embedded
def tooth_force(
    d: float, rate: float, stiffness: float, damping: float, backlash: float, gap: float
) -> float:
    """Force of teeth that can part; the readable twin is `tooth.contact.ToothContact.force`."""
    sense = 1.0 if d > 0.0 else -1.0
    parting = min(1.0, backlash / FREE_PLAY_M)
    force = 0.0
    if parting < 1.0:
        touching, elastic = flank(abs(d), stiffness, gap)
        force = (1.0 - parting) * (sense * elastic + damping * touching * rate)
    touching, elastic = flank(d if d > 0.0 else -d - backlash, stiffness, gap)
    damper = damping * touching * sense * rate
    return force + parting * sense * (elastic + max(-elastic, min(elastic, damper)))


@embedded
def flank(depth: float, stiffness: float, gap: float) -> tuple[float, float]:
    """Touching part of the face, and elastic force, of flanks pressed `depth` beyond touch."""
    if depth <= 0.0:
        return 0.0, 0.0
    if depth < gap:
        return depth / gap, stiffness * 0.5 * depth * (depth / gap)
    return 1.0, stiffness * (depth - 0.5 * gap)
