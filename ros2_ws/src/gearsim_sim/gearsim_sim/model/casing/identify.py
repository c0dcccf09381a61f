"""Poles and shapes from a modal test: LSCF and LSFD by sdypy-EMA, and which of its poles are to be believed.

A pole is taken if it is stable over many orders of the polynomial, and if at least two references find it at
the same frequency with the same shape. Nothing known of the structure chooses among poles.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import EnvironmentLackError
from gearsim_sim.model.casing.material import Array
from gearsim_sim.model.casing.modal_test import ModalTest
from gearsim_sim.model.casing.pairing import mac

ORDER = 70  # of the polynomials at most, in pairs of poles
FIRST_ORDER = 30
SAME_HZ = 0.003  # relative; poles of two orders or references
LARGEST_DAMPING = 0.05
STABLE = 0.6  # share of the orders in which a pole is to be found
LEAST_MAC = 0.9  # between the shapes of two references


@dataclass(frozen=True)
class IdentifiedModes:
    """What a modal test tells."""

    frequencies_hz: Array
    damping: Array
    """Of critical."""
    shapes: NDArray[np.complex128]
    """At the points, shape (points, modes), each of unit length."""
    agreement: Array
    """MAC between the two references that saw each mode best; NaN where others identified them."""

    def within(self, low_hz: float, high_hz: float) -> IdentifiedModes:
        """Those between two frequencies."""
        kept = (self.frequencies_hz >= low_hz) & (self.frequencies_hz <= high_hz)
        return IdentifiedModes(
            self.frequencies_hz[kept], self.damping[kept], self.shapes[:, kept], self.agreement[kept]
        )


@dataclass(frozen=True)
class _Seen:
    """Modes as one reference sees them."""

    poles: NDArray[np.complex128]
    residues: NDArray[np.complex128]
    """Shape (points, modes)."""


def identify(test: ModalTest, low_hz: float, high_hz: float) -> IdentifiedModes:
    """Modes between two frequencies, on which at least two references agree.

    Raises
    ------
    EnvironmentLackError
        If sdypy-EMA is not installed.
    """
    seen = [_one_reference(test, k, low_hz, high_hz) for k in range(len(test.accelerance))]
    found = []
    for poles, residues in _groups(seen):
        strengths = np.linalg.norm(residues, axis=0)
        best, second = np.argsort(-strengths)[:2]
        agreement = float(mac(residues[:, [best]], residues[:, [second]])[0, 0])
        if agreement >= LEAST_MAC:
            pole = np.average(poles, weights=strengths)
            found.append((pole, residues[:, best] / strengths[best], agreement))
    found.sort(key=lambda one: abs(one[0]))
    values = np.array([one[0] for one in found])
    shapes = (
        np.stack([one[1] for one in found], axis=1) if found else np.zeros((test.accelerance.shape[1], 0))
    )
    return IdentifiedModes(
        np.abs(values) / (2 * np.pi),
        -values.real / np.abs(values) if found else np.zeros(0),
        shapes.astype(complex),
        np.array([one[2] for one in found]),
    )


def require_ema() -> None:
    """EnvironmentLackError unless sdypy-EMA is installed: told before the work."""
    _ema()


def _ema() -> Any:
    from importlib import import_module

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return import_module("sdypy.EMA")
    except ImportError:
        lack = "sdypy-EMA is not installed, which finds poles and shapes of modal tests"
        raise EnvironmentLackError(lack, "pip install sdypy-EMA") from None


def _one_reference(test: ModalTest, reference: int, low_hz: float, high_hz: float) -> _Seen:
    model = _ema().Model(
        test.accelerance[reference],
        test.frequencies_hz,
        lower=low_hz,
        upper=high_hz,
        pol_order_high=ORDER,
        frf_form="accelerance",
    )
    model.get_poles(method="lscf", show_progress=False)
    places = _stable(model.all_poles, low_hz, high_hz)
    model.pole_ind = places
    poles = np.array([model.all_poles[order][k] for order, k in places])
    if len(poles) == 0:
        return _Seen(poles.astype(complex), np.zeros((test.accelerance.shape[1], 0), complex))
    _, residues = model.get_constants(f_upper=float(model.freq[-1]))
    return _Seen(poles, np.asarray(residues, dtype=complex))


def _stable(by_order: list[NDArray[np.complex128]], low_hz: float, high_hz: float) -> list[tuple[int, int]]:
    """Order and number of one pole for each that stays where it is from order to order."""
    orders = list(range(FIRST_ORDER, len(by_order)))
    kept = {order: _physical(by_order[order], low_hz, high_hz) for order in orders}
    last = orders[-1]
    chosen = []
    for k in kept[last]:
        pole = by_order[last][k]
        hits = [_nearest(by_order[order][kept[order]], pole) for order in orders]
        if np.mean([hit < SAME_HZ for hit in hits]) >= STABLE:
            chosen.append((last, int(k)))
    return chosen


def _nearest(poles: NDArray[np.complex128], pole: complex) -> float:
    return float((np.abs(poles - pole) / abs(pole)).min(initial=np.inf))


def _physical(poles: NDArray[np.complex128], low_hz: float, high_hz: float) -> NDArray[np.int64]:
    """Numbers of poles in the band that oscillate and decay."""
    speeds = np.abs(poles)
    damping = -poles.real / np.maximum(speeds, 1e-30)
    inside = (speeds > 2 * np.pi * low_hz) & (speeds < 2 * np.pi * high_hz)
    return np.flatnonzero(inside & (poles.imag > 0) & (damping > 0) & (damping < LARGEST_DAMPING))


def _groups(seen: list[_Seen]) -> list[tuple[NDArray[np.complex128], NDArray[np.complex128]]]:
    """Poles and residues of those modes that more than one reference sees, each pole used once."""
    free = [np.ones(len(one.poles), dtype=bool) for one in seen]
    groups = []
    for first, one in enumerate(seen):
        for k, pole in enumerate(one.poles):
            if not free[first][k]:
                continue
            members = [(first, k)]
            for other in range(first + 1, len(seen)):
                j = _partner(one.residues[:, k], pole, seen[other], free[other])
                if j is not None:
                    members.append((other, j))
            if len(members) > 1:
                for reference, j in members:
                    free[reference][j] = False
                columns = np.stack([seen[reference].residues[:, j] for reference, j in members], axis=1)
                groups.append((np.array([seen[reference].poles[j] for reference, j in members]), columns))
    return groups


def _partner(
    shape: NDArray[np.complex128], pole: complex, other: _Seen, free: NDArray[np.bool_]
) -> int | None:
    """The pole of another reference with the same frequency whose shape is most alike."""
    near = np.flatnonzero(free & (np.abs(other.poles - pole) < SAME_HZ * abs(pole)))
    if not len(near):
        return None
    alike = mac(shape[:, None], other.residues[:, near])[0]
    return int(near[np.argmax(alike)]) if alike.max() >= LEAST_MAC else None
