"""The linear systems and the states of an ensemble's lanes as the arrays of `lane_kernel`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.integrate.coefficients import Propagator
from gearsim_sim.integrate.lane_kernel import (
    BLOCK,
    BLOCKS,
    COLUMNS,
    COMPLIANCE,
    FIRST_BLOCK,
    FIRST_INTERFACE,
    FIRST_SITE,
    FIRST_SUM,
    INTERFACES,
    KNOWN,
    KNOWN_ROWS,
    MOTIONS,
    OUT_COMPLIANCE,
    OUT_ROWS,
    OUTPUTS,
    PAIRS,
    SITES,
    STEP,
    LaneState,
    LaneSystem,
)
from gearsim_sim.stepper import PartSetup, Rest

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
_ALIGNMENT = 64  # bytes: a register of 512 bits never crosses a line of the cache then


def aligned(values: Array) -> Array:
    """A contiguous copy that begins at a line of the cache."""
    room = np.empty(values.nbytes + _ALIGNMENT, dtype=np.uint8)
    start = -room.ctypes.data % _ALIGNMENT
    result = room[start : start + values.nbytes].view(np.float64).reshape(values.shape)
    result[...] = values
    return result


@dataclass(frozen=True, eq=False)
class LanePart:
    """Numbers of one lane and one part, flat, in the order of `LaneSystem` and `LaneState`."""

    counts: tuple[int, int, int, int, int]  # blocks, interfaces, their motions, sites, outputs
    step: Array
    compliance: Array
    out_rows: Array
    out_compliance: Array
    known: Array
    known_rows: Array
    modes: Array
    forces: Array
    sums: Array

    def same_system(self, other: LanePart) -> bool:
        """Whether the linear system is the same, to the last bit."""
        return self.counts == other.counts and all(
            np.array_equal(getattr(self, name), getattr(other, name)) for name in _CONSTANTS
        )


_CONSTANTS = ("step", "compliance", "out_rows", "out_compliance", "known", "known_rows")


def pack_part(setup: PartSetup, rest: Rest, blocks: int, *, rates: bool) -> LanePart:
    """Scale the modes of a part so that c0 is one, and order its numbers by blocks of modes.

    Parameters
    ----------
    setup : PartSetup
        Of the single stepper.
    rest : Rest
        Where it starts.
    blocks : int
        Blocks of modes, the most that a lane needs.
    rates : bool
        Whether the rates of the interfaces are wanted.
    """
    at_rest, forces, inputs = rest.x[setup.dofs], rest.forces[setup.interfaces], rest.inputs
    propagator = _propagator(setup)
    size = propagator.modes
    c0, *c = _complex(propagator.weights, size)
    count = propagator.linear.eigenvalues.size
    c0[count:] = 1.0
    decay, weights = _complex(propagator.decay, size)[0], np.array(c) / c0
    left, known = _complex(propagator.left, size) * c0, _complex(propagator.left_known, size) * c0
    rows = np.conj(_complex(propagator.rows, size))  # stored with the sign of the imaginary part turned
    motions = propagator.motions if rates else propagator.interfaces
    kept = [i for i in range(propagator.row_count) if i < motions or i >= propagator.motions]
    rows = rows[kept]
    compliance = propagator.compliance.reshape(propagator.row_count, -1)[kept]
    outs = np.conj(_complex(setup.part.state_rows, size))
    known_rows = (np.concatenate([rows, outs]) @ known.T).real
    known_rows[motions : len(rows)] += propagator.site_known
    z = _complex(propagator.modal(at_rest, np.zeros_like(at_rest)), size)[0]
    force = left.T @ forces + known.T @ inputs
    u2 = weights[2] * force
    u1 = weights[1] * force + u2
    predicted = decay * z + weights[0] * force + u1
    per_block = [_blocks(one, blocks) for one in (left, np.array([decay, *weights]), np.conj(rows))]
    history = np.array([predicted, u1, u2, known.T @ inputs])
    return LanePart(
        counts=(blocks, propagator.interfaces, motions, propagator.sites, len(outs)),
        step=np.concatenate(per_block, axis=1).ravel(),
        compliance=compliance.ravel(),
        out_rows=_blocks(np.conj(outs), blocks).transpose(1, 0, 2).ravel(),
        out_compliance=(outs @ left.T).real.ravel(),
        known=_blocks(known, blocks).ravel(),
        known_rows=known_rows.ravel(),
        modes=_blocks(history, blocks).ravel(),
        forces=forces,
        sums=(rows @ predicted).real,
    )


def _complex(flat: Array, modes: int) -> Complex:
    """Rows of complex numbers out of [real parts, imaginary parts] of `modes` each."""
    parts = flat.reshape(-1, 2, modes)
    return np.asarray(parts[:, 0] + 1j * parts[:, 1])


def _blocks(rows: Complex, blocks: int) -> Array:
    """Rows of complex numbers by blocks of modes, shape (blocks, rows, PAIRS)."""
    result = np.zeros((rows.shape[0], blocks * BLOCK), dtype=np.complex128)
    count = min(rows.shape[1], blocks * BLOCK)
    result[:, :count] = rows[:, :count]
    pairs = np.stack([result.real, result.imag], axis=-1)
    return np.asarray(pairs.reshape(rows.shape[0], blocks, PAIRS).transpose(1, 0, 2))


def blocks_of(setup: PartSetup) -> int:
    """Blocks that the modes of a part fill."""
    return -(-_propagator(setup).linear.eigenvalues.size // BLOCK)


def _propagator(setup: PartSetup) -> Propagator:
    assert setup.propagator is not None  # `Stepper.parts` are those that have one
    return setup.propagator


def pack_system(
    lanes: Sequence[Sequence[LanePart]], setups: Sequence[PartSetup]
) -> tuple[LaneSystem, LaneState]:
    """Constants and state at the start; `lanes` are the parts of each lane, `setups` those of any lane."""
    parts = [[lane[p] for lane in lanes] for p in range(len(setups))]
    shared = all(part.same_system(own[0]) for own in parts for part in own[1:])

    def joined(name: str) -> Array:
        return np.concatenate([np.array([getattr(part, name) for part in own]).T for own in parts])

    def constant(name: str) -> Array:
        rows = joined(name)
        return aligned(rows[:, 0] if shared else rows)

    forces = joined("forces")
    known = np.zeros((sum(sum(part.counts[2:]) for part in lanes[0]), len(lanes)))
    motions = sum(part.counts[2] for part in lanes[0])
    system = LaneSystem(
        layout=_layout([own[0] for own in parts]),
        site_index=np.concatenate([setup.part.site_index for setup in setups]),
        **{name: constant(name) for name in _CONSTANTS},
    )
    state = LaneState(
        modes=aligned(joined("modes")),
        forces=aligned(np.concatenate([forces, forces, forces])),
        sums=aligned(joined("sums")),
        known=aligned(known),
        motion=aligned(np.zeros((motions, len(lanes)))),
    )
    return system, state


def _layout(parts: Sequence[LanePart]) -> NDArray[np.int64]:
    """`LaneSystem.layout`."""
    layout = np.zeros((len(parts), COLUMNS), dtype=np.int64)
    at = np.zeros(COLUMNS, dtype=np.int64)
    for row, part in zip(layout, parts, strict=True):
        row[:] = at
        row[[BLOCKS, INTERFACES, MOTIONS, SITES, OUTPUTS]] = part.counts
        blocks, interfaces, motions, sites, outputs = part.counts
        at[FIRST_BLOCK] += blocks
        at[FIRST_INTERFACE] += interfaces
        at[FIRST_SITE] += sites
        at[FIRST_SUM] += motions + sites
        at[STEP] += part.step.size
        at[COMPLIANCE] += part.compliance.size
        at[OUT_ROWS] += part.out_rows.size
        at[OUT_COMPLIANCE] += part.out_compliance.size
        at[KNOWN] += part.known.size
        at[KNOWN_ROWS] += motions + sites + outputs
    return layout
