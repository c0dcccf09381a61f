"""Forces of all gear meshes in the compiled loop; the readable twin is `gear_mesh.Mesh`."""

from __future__ import annotations

from gearsim_sim.integrate.compiled import inlined
from gearsim_sim.integrate.pieces import table_value
from gearsim_sim.model.bearing_loop import severity
from gearsim_sim.model.loop_data import Array, Drive, Meshes

_OWN = 4  # first column behind those of the severity


@inlined
def mesh_forces(
    step: int, q: Array, rates: Array, phases: Array, speed_hz: float, drive: Drive, meshes: Meshes,  # noqa: ARG001
    work: Array, forces: Array,
) -> None:  # fmt: skip
    """Forces of the meshes beyond their linear part: variation of stiffness, and transmission error.

    `rates` of the interfaces are zero unless `drive.need_rates`; `work` (meshes, 3) takes
    stiffness, error and rate of the error.
    """
    count = meshes.index.shape[0]
    for i in range(count):
        track = meshes.index[i, 1]
        turns = phases[track] * meshes.numbers[i, 2] + meshes.numbers[i, 3]
        work[i, 0], _ = table_value(turns, meshes.tables, meshes.index[i, 2], meshes.index[i, 3])
        error = 0.0
        rate = 0.0
        for j in range(meshes.index[i, 4], meshes.index[i, 5]):
            track = meshes.errors[j, 0]
            value, slope = table_value(phases[track], meshes.tables, meshes.errors[j, 1], meshes.errors[j, 2])
            error += value
            rate += drive.rates[track] * slope
        work[i, 1] = error
        work[i, 2] = rate
    add_mods(step, phases, drive, work)
    for i in range(count):
        at = meshes.index[i, 0]
        stiffness = work[i, 0]
        damper = meshes.numbers[i, 1] * (speed_hz * work[i, 2])
        forces[at] = -((stiffness - meshes.numbers[i, 0]) * q[at] + stiffness * work[i, 1] + damper)


@inlined
def add_mods(step: int, phases: Array, drive: Drive, work: Array) -> None:
    """What faults change of stiffness and transmission error."""
    for j in range(drive.mesh_mods.shape[0]):
        row = drive.mesh_mods[j]
        mesh, track = int(row[_OWN]), int(row[_OWN + 2])
        now = severity(row, step)
        value, slope = table_value(phases[track], drive.samples, int(row[_OWN + 3]), int(row[_OWN + 4]))
        if row[_OWN + 1] == 0.0:
            work[mesh, 0] += now * value
        else:
            work[mesh, 1] += now * value
            work[mesh, 2] += now * drive.rates[track] * slope
