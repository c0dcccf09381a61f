"""Frequency responses of a casing from its bearing seats to places on it, as the modes that make them up.

The thesis's approach B (5.5): what the bearings do to the casing, taken from the model of the gearbox, goes
through frequency responses of the casing alone. These hold many more modes (900 to 20 kHz) than the model in
the loop has to carry. With forces F at the seats and the own modes of the casing on its mounts,

    a(w) = -w^2 [ sum_m s_m f_m' / (w_m^2 - w^2 + 2j zeta_m w_m w) + R ] F(w)

f_m and s_m: motion of seats and sites in mode m, of unit modal mass. R [m/N]: what all modes beyond add
without delay, so that statics are exact, too.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_sim.model.casing.reduced import ReducedCasing
from gearsim_sim.model.on_casing import own_modes

Array = NDArray[np.float64]
AXES = {"x": "ux", "y": "uy", "rz": "rz"}
# A bearing passes no torque about its shaft on to its seat; a ring gear does. Names are those of the masters.
_TURNED = ("ring",)
# The same finite elements, however reduced, give the same static compliance of the bores to 1e-9 of the
# largest; a hundredth in the thickness of one plate changes it by more than this.
_SAME = 1e-6


@dataclass(frozen=True, eq=False)
class CasingResponses:
    """Accelerations of sites [m/s^2] over forces on the seats [N], and torques [N m].

    Attributes
    ----------
    name : str
        Of the casing.
    inputs : tuple of str
        Seat and axis of each force, such as `b3_y`, or torque, `ring_rz`.
    sites : tuple of str
        Places on the casing, each in one direction.
    omega, ratios : ndarray, shape (modes,)
        Angular frequencies [rad/s], ascending, and damping over the critical one.
    input_shapes, site_shapes : ndarray, shape (inputs, modes), (sites, modes)
        Motion in each mode of unit modal mass.
    residual : ndarray, shape (sites, inputs)
        Displacement per force [m/N] (torque [1/N]) that follows without delay.
    compliance : ndarray, shape (inputs, inputs)
        Static displacement of the seats per force [m/N] (turns, torques): tells one casing from another.
    valid_hz : float
        Up to here the modes are those of the full model.
    """

    name: str
    inputs: tuple[str, ...]
    sites: tuple[str, ...]
    omega: Array
    ratios: Array
    input_shapes: Array
    site_shapes: Array
    residual: Array
    compliance: Array
    valid_hz: float
    provenance: Mapping[str, Any] = field(default_factory=dict)

    def accelerances(self, frequencies_hz: Array) -> Array:
        """Complex accelerations per force, shape (sites, inputs, frequencies)."""
        w = 2 * np.pi * np.asarray(frequencies_hz)
        own = self.omega[:, None]
        each = 1 / (own**2 - w**2 + 2j * self.ratios[:, None] * own * w)
        pairs = self.site_shapes[:, None, :] * self.input_shapes  # (sites, inputs, modes)
        return np.asarray(-(w**2) * (pairs @ each + self.residual[..., None]))

    def of_sites(self, names: Sequence[str]) -> CasingResponses:
        """Those of some sites, in that order; InputError for one that is not there."""
        for name in names:
            if name not in self.sites:
                raise InputError(f"responses of {self.name}", "site", name, "one of " + ", ".join(self.sites))
        rows = [self.sites.index(name) for name in names]
        return replace(
            self, sites=tuple(names), site_shapes=self.site_shapes[rows], residual=self.residual[rows]
        )

    def of_inputs(self, names: Sequence[str]) -> CasingResponses:
        """Those to some forces, in that order; InputError for one that is not there."""
        for name in names:
            if name not in self.inputs:
                expected = "one of " + ", ".join(self.inputs)
                raise InputError(f"responses of {self.name}", "force", name, expected)
        rows = [self.inputs.index(name) for name in names]
        return replace(
            self,
            inputs=tuple(names),
            input_shapes=self.input_shapes[rows],
            residual=self.residual[:, rows],
            compliance=self.compliance[np.ix_(rows, rows)],
        )

    def belongs_to(self, casing: ReducedCasing) -> bool:
        """Whether this is the same casing, reduced to however many modes."""
        if not set(self.inputs) <= set(seats(casing)):
            return False
        own = static_compliance(casing, self.inputs)
        size = np.sqrt(np.abs(np.diag(self.compliance)))  # turns and displacements each by their own size
        return bool(np.all(np.abs(own - self.compliance) <= _SAME * np.outer(size, size)))


def seats(casing: ReducedCasing) -> tuple[str, ...]:
    """Names of what the masters of a casing can take: a force in x and in y, a ring gear's a torque, too."""
    return tuple(
        f"{master}_{axis}" for master in casing.masters for axis in AXES if axis != "rz" or master in _TURNED
    )


def _rows(casing: ReducedCasing, inputs: Sequence[str]) -> list[int]:
    pieces = (name.rsplit("_", 1) for name in inputs)
    return [casing.dof(master, AXES[axis]) for master, axis in pieces]


def static_compliance(casing: ReducedCasing, inputs: Sequence[str]) -> Array:
    """Displacement (turn) of the seats per static force (torque) on them, shape (inputs, inputs)."""
    omega, shapes = casing.own_modes
    moved = shapes[_rows(casing, inputs)] / omega
    return np.asarray(moved @ moved.T)


def responses_of(casing: ReducedCasing, where: str) -> CasingResponses:
    """Responses that a reduced casing holds, over its own modes below its first one left out.

    What lies above, and what the reduction left out for sites (`Site.correction`), is in the residual: at
    each frequency the responses are those of the reduced casing.

    Raises
    ------
    InputError
        If mounts do not hold the casing, or its damping is not modal.
    """
    omega, ratios, shapes = own_modes(casing, where)
    inputs = seats(casing)
    top_hz = float(casing.provenance.get("cutoff_hz", casing.valid_hz))
    inside = omega <= 2 * math.pi * top_hz
    seat_shapes = shapes[_rows(casing, inputs)]
    masters = shapes[: 6 * len(casing.masters)]
    rows = np.array([site.rows for site in casing.sites]).reshape(-1, casing.size) @ shapes
    follow = np.array([site.correction for site in casing.sites]).reshape(-1, len(masters)) @ masters
    # -w^2 correction u_m / (w_m^2 - w^2) = correction u_m (1 - w_m^2 / (w_m^2 - w^2))
    residual = (follow * inside) @ seat_shapes.T + (rows * ~inside / omega**2) @ seat_shapes.T
    site_shapes = (rows - follow * omega**2)[:, inside]
    return CasingResponses(
        name=casing.name,
        inputs=inputs,
        sites=tuple(site.name for site in casing.sites),
        omega=omega[inside],
        ratios=ratios[inside],
        input_shapes=seat_shapes[:, inside],
        site_shapes=site_shapes,
        residual=residual,
        compliance=static_compliance(casing, inputs),
        valid_hz=casing.valid_hz,
        provenance=dict(casing.provenance),
    )
