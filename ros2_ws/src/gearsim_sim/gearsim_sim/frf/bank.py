"""Forces on the seats of a casing to accelerations of places on it, sample by sample: a bank of resonators.

Each mode is a recursion with the mode's own pole, so that nothing rings longer or shorter than it should and
no block length or frequency resolution comes in; `smooth` adds what a sampled resonator lacks. The sum is
the casing's frequency response within `error` for all signals below `PASS_BAND` of the rate, which those of
an engine are. Memory and work per sample do not depend on how long it runs, bits not on how samples are
portioned.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_sim.frf.responses import CasingResponses
from gearsim_sim.frf.smooth import HALF_LENGTH, resonators, smooth_rest
from gearsim_sim.integrate.compiled import compiled
from gearsim_sim.integrate.vectors import LANES, fma, load, splat, store

Array = NDArray[np.float64]
_OWN_ROWS = 4  # of a block of LANES modes beside its shapes: decay and gain, real and imaginary


class ResonatorBank:
    """A stream of accelerations from a stream of forces.

    An output needs the forces of `HALF_LENGTH` samples after it, so that what `push` returns comes that much
    later than what it takes. Before the first sample the forces were what they were in it, or see `start`.

    Parameters
    ----------
    responses : CasingResponses
    rate_hz : float
        Of forces and accelerations.

    Attributes
    ----------
    error : float
        Largest deviation from the responses within the band, over their largest value there.
    """

    def __init__(self, responses: CasingResponses, rate_hz: float) -> None:
        self.responses = responses
        taps, self.error = smooth_rest(responses, rate_hz)
        self._taps = np.ascontiguousarray(taps)
        own = resonators(responses, rate_hz)
        shapes = responses.input_shapes[:, own.modes], responses.site_shapes[:, own.modes]
        parts = (own.decay.real, own.decay.imag, own.gain.real, own.gain.imag)
        self._constants = _blocks(np.vstack([shapes[0], *parts, shapes[1]]))
        self._rest = (shapes[0].T, own.gain / (1 - own.decay))
        self._state = np.zeros((2 * self._constants.shape[0], LANES))
        self._constants = self._constants.reshape(-1, LANES)
        self._sums = np.zeros((max(1, len(responses.sites)), LANES))
        self._recent: Array | None = None

    @property
    def delay(self) -> int:
        """Samples by which outputs come later than forces."""
        return HALF_LENGTH

    def push(self, forces: Array) -> Array:
        """The next accelerations.

        Parameters
        ----------
        forces : ndarray, shape (inputs, n)
            [N], in the order of the responses' inputs.

        Returns
        -------
        ndarray, shape (sites, n)
            [m/s^2]; of the first call the first `delay` samples lie before the first force and are zero.
        """
        forces = np.asarray(forces, dtype=np.float64)
        inputs = self.responses.inputs
        if forces.ndim != 2 or len(forces) != len(inputs):
            expected = f"({len(inputs)}, n): {', '.join(inputs)}"
            raise InputError("responses", "forces", f"shape {forces.shape}", expected)
        if not forces.shape[1]:
            return np.zeros((len(self.responses.sites), 0))
        if self._recent is None:
            self.start(forces[:, 0])
            return self.push(forces)
        window = np.hstack([self._recent, forces])
        out = np.zeros((len(self.responses.sites), forces.shape[1]))
        run_bank(window, self._taps, self._constants, self._state, self._sums, out)
        self._recent = window[:, forces.shape[1] :].copy()
        return out

    def start(self, forces: Array) -> None:
        """Begin at rest under forces (inputs,) that have always been there, in place of the first ones."""
        shapes, settled = self._rest
        still = settled * (shapes @ forces)
        self._state[:] = _blocks(np.array([still.real, still.imag])).reshape(-1, LANES)
        self._recent = np.repeat(np.asarray(forces, dtype=np.float64)[:, None], 2 * HALF_LENGTH, axis=1)


def accelerations_of(responses: CasingResponses, forces: Mapping[str, Array], rate_hz: float) -> Array:
    """Accelerations of all sites under forces on the casing, over a whole record.

    Parameters
    ----------
    responses : CasingResponses
    forces : mapping of str to ndarray, shape (n,)
        [N] by seat and axis, as `EngineOutput.forces`; what is not named is zero.
    rate_hz : float

    Returns
    -------
    ndarray, shape (sites, n)
        [m/s^2]. It begins at rest under the first forces; after the last sample they are taken to stay.
    """
    used = responses.of_inputs(tuple(forces))
    bank = ResonatorBank(used, rate_hz)
    given = np.array([forces[name] for name in used.inputs], dtype=np.float64)
    ended = np.hstack([given, np.repeat(given[:, -1:], bank.delay, axis=1)])
    return np.ascontiguousarray(bank.push(ended)[:, bank.delay :])


def _blocks(rows: Array) -> Array:
    """Rows over modes as (blocks, rows, LANES), filled up with zeros."""
    count = -(-rows.shape[1] // LANES)
    padded = np.zeros((len(rows), count * LANES))
    padded[:, : rows.shape[1]] = rows
    return np.ascontiguousarray(padded.reshape(len(rows), count, LANES).swapaxes(0, 1))


@compiled
def run_bank(window: Array, taps: Array, constants: Array, state: Array, sums: Array, out: Array) -> None:
    """Fill `out` (sites, n) from the forces `window` (inputs, n + 2 half lengths)."""
    sites, inputs, length = taps.shape
    own_rows = inputs + _OWN_ROWS
    rows = own_rows + sites
    blocks = state.shape[0] // 2
    half = length // 2
    count = out.shape[1]
    for n in range(count):
        for s in range(sites):
            store(sums, s, splat(0.0))
        for b in range(blocks):
            c = b * rows
            force = splat(0.0)
            for i in range(inputs):
                force = fma(load(constants, c + i), splat(window[i, n + half]), force)
            c += inputs
            re, im = load(state, 2 * b), load(state, 2 * b + 1)
            decay_re, decay_im = load(constants, c), load(constants, c + 1)
            new_re = fma(decay_re, re, fma(load(constants, c + 2), force, -(decay_im * im)))
            new_im = fma(decay_re, im, fma(load(constants, c + 3), force, decay_im * re))
            store(state, 2 * b, new_re)
            store(state, 2 * b + 1, new_im)
            for s in range(sites):
                store(sums, s, fma(load(constants, c + _OWN_ROWS + s), new_re, load(sums, s)))
        for s in range(sites):
            total = 0.0
            for lane in range(LANES):
                total += sums[s, lane]
            out[s, n] = total
    add_smooth(window, taps, out)


@compiled
def add_smooth(window: Array, taps: Array, out: Array) -> None:
    """Add the taps' share to `out`."""
    length = taps.shape[2] & 0xFFFF
    for s in range(taps.shape[0]):
        for n in range(out.shape[1]):
            total = 0.0
            for i in range(taps.shape[1]):
                near = window[i, n : n + length]
                own = taps[s, i]
                part = 0.0
                for k in range(length):
                    part += own[k] * near[k]
                total += part
            out[s, n] += total
