"""Mesh stiffness and transmission errors between nodes in time, in the compiled loop.

They are functions of prescribed angles, smooth and with no more than so many periods per turn. Looking them
up in tables as long as a turn has details takes more time than all forces together; so they are looked up
every `stride` steps, with their slopes, and follow a cubic in between. Of a sine whose phase goes on by x
from node to node that cubic misses x^4 / 384. The stride is the longest with which that is at most 1e-5 of
what each function varies (root mean square), far below the error of the integration itself.
"""

from __future__ import annotations

import numpy as np

from gearsim_sim.integrate.compiled import embedded
from gearsim_sim.integrate.pieces import table_value
from gearsim_sim.model.loop_data import Array, Drive, Meshes
from gearsim_sim.model.periodic import PeriodicSeries
from gearsim_sim.model.plant import Plant
from gearsim_sim.profile.profile import Segment

# Rows of nodes (NODE_ROWS, meshes): stiffness and its change per step, error and its change per step, at the
# node before and at the one behind.
NODE_ROWS = 8
# What a cubic misses of a line at f shows at the frequency of the nodes minus f too: with four steps that is
# beyond the output's band at the usual oversampling.
LONGEST_STRIDE = 4
_TOLERANCE = 1e-5
_NODES_PER_SEGMENT = 8  # so that the polynomial of a segment may be followed by a node beyond its ends
_PLACES = np.linspace(0.0, 1.0, 17)
_SPEED_MARGIN = 1.2  # on the highest speed found at these places


def node_order(plant: Plant) -> float:
    """Nodes per turn of the reference shaft that the functions of all meshes need."""
    rates = np.abs(plant.rates)
    series = [(mesh.stiffness, float(rates[mesh.track]) * abs(mesh.cycles)) for mesh in plant.meshes]
    series += [(one.series, float(rates[one.track])) for mesh in plant.meshes for one in mesh.errors]
    return max((factor * _nodes_per_turn(one) for one, factor in series), default=0.0)


def _nodes_per_turn(series: PeriodicSeries) -> float:
    """x^4 / 384 of all lines is _TOLERANCE of the whole with as many nodes."""
    power = series.cosine**2 + series.sine**2
    if not np.any(power):
        return 0.0
    bend = np.sqrt(np.sum(power * (2 * np.pi * series.orders) ** 8) / np.sum(power))
    return float((bend / 384 / _TOLERANCE) ** 0.25)


def node_stride(order: float, segment: Segment) -> int:
    """Steps between nodes over a segment: 1, 2 or 4."""
    if segment.steady:
        speed_hz = abs(segment.speed_hz(segment.start_step))
    else:
        places = segment.start_step + _PLACES * segment.length_steps
        speed_hz = _SPEED_MARGIN * max(abs(segment.speed_hz(float(one))) for one in places)
    stride = LONGEST_STRIDE
    while stride > 1 and (
        stride * order * speed_hz * segment.step_s > 1 or stride * _NODES_PER_SEGMENT > segment.length_steps
    ):
        stride //= 2
    return stride


@embedded
def mesh_functions(i: int, phases: Array, drive: Drive, meshes: Meshes) -> tuple[float, float, float, float]:
    """Stiffness and error of a mesh, each with its slope per turn of the reference shaft; without faults."""
    track = meshes.places[i, 1]
    turns = phases[track] * meshes.numbers[i, 2] + meshes.numbers[i, 3]
    stiffness, slope = table_value(turns, meshes.tables, meshes.places[i, 2], meshes.places[i, 3])
    rising = drive.rates[track] * meshes.numbers[i, 2] * slope
    error = 0.0
    rate = 0.0
    for j in range(meshes.places[i, 4], meshes.places[i, 5]):
        track = meshes.errors[j, 0]
        value, slope = table_value(phases[track], meshes.tables, meshes.errors[j, 1], meshes.errors[j, 2])
        error += value
        rate += drive.rates[track] * slope
    return stiffness, rising, error, rate


@embedded
def next_node(phases: Array, turns_per_step: float, drive: Drive, meshes: Meshes, nodes: Array) -> None:
    """The node behind becomes the one before; `phases` are those of the new one."""
    for i in range(nodes.shape[1]):
        for row in range(4):
            nodes[row, i] = nodes[4 + row, i]
        stiffness, rising, error, rate = mesh_functions(i, phases, drive, meshes)
        nodes[4, i] = stiffness
        nodes[5, i] = rising * turns_per_step
        nodes[6, i] = error
        nodes[7, i] = rate * turns_per_step


@embedded
def between_nodes(place: int, stride: int, step_s: float, nodes: Array, work: Array) -> None:
    """Stiffness, error and its rate per second into the first rows of `work`, `place` steps behind a node."""
    t = float(place) / float(stride)
    u = 1.0 - t
    v0, v1 = u * u * (1.0 + 2.0 * t), t * t * (3.0 - 2.0 * t)
    d0, d1 = t * u * u * stride, -t * t * u * stride
    rise = 6.0 * t * u / (stride * step_s)
    r0, r1 = u * (1.0 - 3.0 * t) / step_s, t * (3.0 * t - 2.0) / step_s
    for i in range(nodes.shape[1] & 0xFFFF):
        work[0, i] = v0 * nodes[0, i] + d0 * nodes[1, i] + (v1 * nodes[4, i] + d1 * nodes[5, i])
        work[1, i] = v0 * nodes[2, i] + d0 * nodes[3, i] + (v1 * nodes[6, i] + d1 * nodes[7, i])
        work[2, i] = rise * (nodes[6, i] - nodes[2, i]) + r0 * nodes[3, i] + r1 * nodes[7, i]
