"""How pairs of teeth share the load, and what an error of their flanks does to the mesh.

Pairs are springs k_j that each carry an error e_j (positive presses the teeth together; material that is
missing is negative). Under a force F the compression d obeys F = sum k_j max(0, d + e_j). With all pairs in
contact that is F = k (d + e) with k = sum k_j and the transmission error e = sum k_j e_j / k; where a pair
has lost contact, it drops out of both sums. `shares` is the first, linear rule, `loaded_mesh` the second.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.periodic import PeriodicSeries
from gearsim_sim.model.tooth.pair import GearPair
from gearsim_sim.model.tooth.stiffness import mesh_stiffness, neighbours, pair_stiffness
from gearsim_sim.model.tooth.windows import Nodes, window_nodes, window_series

Array = NDArray[np.float64]
Profile = Callable[[Array], Array]  # error of a pair [m] over its phase
# Panels of the cycle for forces that switch pairs on and off at places not known before.
_FINE = 1 / 64


def handovers(pair: GearPair) -> list[float]:
    """Phases of a pair at which another one comes into contact or leaves it."""
    half = pair.contact_ratio / 2
    steps = [int(step) for step in neighbours(pair) if step != 0]
    return [sign * half + step for step in steps for sign in (-1, 1)]


def shares(pair: GearPair, phase: Array) -> Array:
    """Part of the load that a pair carries at these phases of its own, all pairs in contact."""
    own = pair_stiffness(pair, phase)
    total = sum(pair_stiffness(pair, phase + step) for step in neighbours(pair))
    return np.asarray(own / total)


def share_nodes(pair: GearPair, harmonics: int, breaks: list[float] | None = None) -> Nodes:
    """Quadrature nodes over a pair's path that respect the hand-overs."""
    return window_nodes(pair.contact_ratio, harmonics, [*handovers(pair), *(breaks or [])])


def tooth_error_series(
    pair: GearPair,
    profile: Profile,
    tooth_factors: Array,
    *,
    teeth: int,
    harmonics: int,
    breaks: list[float] | None = None,
) -> PeriodicSeries:
    """Transmission error [m] over a gear's turn from errors of its flanks, by the linear rule.

    Parameters
    ----------
    pair : GearPair
        The mesh.
    profile : callable
        Error of a flank over the phase of its pair.
    tooth_factors : array, shape (teeth,)
        Factor on the profile for each tooth.
    teeth : int
        Teeth of the gear that the flanks belong to.
    harmonics : int
        Mesh orders kept.
    breaks : list of float, optional
        Phases at which the profile has kinks or jumps.
    """
    nodes = share_nodes(pair, harmonics, breaks)
    values = shares(pair, nodes.phase) * profile(nodes.phase)
    one = window_series(nodes, values, teeth, 0, harmonics)
    turned = np.fft.fft(tooth_factors)[one.orders % teeth]
    spectrum = (one.cosine - 1j * one.sine) * turned
    mean = one.mean * float(np.sum(tooth_factors))
    return PeriodicSeries(mean, one.orders, spectrum.real, -spectrum.imag)


def loaded_mesh(pair: GearPair, profile: Profile, force_n: float, mesh_phase: Array) -> tuple[Array, Array]:
    """Stiffness [N/m] and transmission error [m] under a steady force, every pair with this profile.

    They obey force = stiffness (d + error) at the compression d of this force; stiffness is also the slope
    of the force there.
    """
    start = np.mod(np.atleast_1d(mesh_phase), 1.0) - 0.5
    phases = np.stack([start + step for step in neighbours(pair)], axis=1)
    stiffness = pair_stiffness(pair, phases.ravel()).reshape(phases.shape)
    error = np.where(stiffness > 0, profile(phases.ravel()).reshape(phases.shape), -np.inf)
    order = np.argsort(-error, axis=1)
    k = np.take_along_axis(stiffness, order, axis=1)
    e = np.take_along_axis(error, order, axis=1)
    moment = np.cumsum(k * np.where(np.isfinite(e), e, 0.0), axis=1)
    total = np.cumsum(k, axis=1)
    # Pairs join in the order of their errors; the first n carry the force if the next one does not touch.
    compression = (force_n - moment) / total
    following = np.concatenate([e[:, 1:], np.full((e.shape[0], 1), -np.inf)], axis=1)
    count = np.argmax(compression + following <= 0, axis=1)
    rows = np.arange(count.size)
    return total[rows, count], moment[rows, count] / total[rows, count]


def loaded_error_series(pair: GearPair, profile: Profile, force_n: float, harmonics: int) -> PeriodicSeries:
    """Transmission error [m] over a pitch with which the mesh has the compression of this force.

    The mesh keeps its stiffness k0, all pairs in contact; where pairs have lost contact, the compression that
    is more for want of their stiffness is taken into the error: e = force / k0 - d. At this force that is
    exact, also where the profile parts the teeth.
    """
    nodes = window_nodes(1.0, harmonics, list(np.arange(-0.5, 0.5, _FINE)))
    phase = nodes.phase + 0.5
    stiffness, error = loaded_mesh(pair, profile, force_n, phase)
    compression = force_n / stiffness - error
    return window_series(nodes, force_n / mesh_stiffness(pair, phase) - compression, 1, 0, harmonics)
