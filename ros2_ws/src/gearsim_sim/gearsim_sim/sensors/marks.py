"""What a tacho or an encoder makes of the marks that pass it: errors of marks, pickup and clock.

In this order: the coupling swings, the marks lie off their places (a fixed pattern), some are never seen,
some are missed at random, the pulse comes late and jitters, some pulses come twice, and the time is taken
at the next edge of a clock. Random numbers belong to the passing, not to the chunk; with everything off the
passings are given as they are.
"""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from numpy.random import Philox
from numpy.typing import NDArray
from pydantic import Field

from gearsim_io.errors import InputError
from gearsim_io.quantities import Si, Strict
from gearsim_sim.sensors.coupling import Coupling, SwingingEncoder
from gearsim_sim.sensors.draws import generator, normal, uniform
from gearsim_sim.sensors.edges import EdgeFinder
from gearsim_sim.sensors.options import OrOff, SiOrOff

Array = NDArray[np.float64]
_MOST_DEVIATIONS = 4.0  # of a mark's error, so that marks keep their order
_LARGEST_DEVIATE = 8.3  # that `normal` can give


class Pickup(Strict):
    """Errors of a tacho or an encoder; all are off by default."""

    jitter: Annotated[float, Si("s", ge=0, le=1e-3)] = 0.0
    """Standard deviation of the pulses' times."""
    delay: Annotated[float, Si("s", ge=0, le=0.1)] = 0.0
    """By how much all pulses come late."""
    missing: Annotated[float, Si("", ge=0, le=0.9)] = 0.0
    """Probability that a mark is missed."""
    double: Annotated[float, Si("", ge=0, le=0.9)] = 0.0
    """Probability that a pulse comes twice."""
    double_after: Annotated[float, Si("s", gt=0, le=0.1)] = 1e-4
    """Time from a pulse to its double (assumed: 100 us)."""
    mark_error: Annotated[float, Si("", ge=0, le=0.1)] = 0.0
    """Standard deviation of the marks' places, in parts of their distance; a fixed pattern."""
    eccentricity: Annotated[float, Si("rad", ge=0, le=0.1)] = 0.0
    """Amplitude of an error of angle once per turn."""
    missing_marks: tuple[Annotated[int, Field(ge=0)], ...] = ()
    """Numbers of marks that are never seen, counted from the one at angle 0."""
    clock: Annotated[float | None, SiOrOff("Hz", ge=1e3, le=1e10)] = None
    """Rate of the clock that takes the times, at its next edge; off: exact times."""
    coupling: Annotated[Coupling | None, OrOff()] = None
    """Resonance of a soft coupling in front of the encoder."""


def mark_errors(name: str, marks: int, pickup: Pickup, seed: int) -> Array | None:
    """How far each mark lies off its place, in turns; None if none does."""
    if pickup.mark_error == 0.0 and pickup.eccentricity == 0.0:
        return None
    draws = normal(generator(seed, f"marks/{name}"), marks)
    errors = np.clip(draws, -_MOST_DEVIATIONS, _MOST_DEVIATIONS) * (pickup.mark_error / marks)
    start = uniform(generator(seed, f"eccentricity/{name}"), 1)[0]
    turn = 2 * np.pi * (np.arange(marks) / marks + start)
    return np.asarray(errors + pickup.eccentricity / (2 * np.pi) * np.sin(turn))


class MarkReader:
    """Reads the marks on one shaft.

    Parameters
    ----------
    name : str
        Kind and shaft, such as "tacho input".
    marks : int
        Per turn.
    phase_turns : float
        Angle of mark 0.
    pickup : Pickup
    sample_rate_hz : float
    seed : int

    Raises
    ------
    InputError
        A missing mark that does not exist, or none left; a resonance that the rate cannot follow.
    """

    def __init__(
        self,
        name: str,
        marks: int,
        phase_turns: float,
        pickup: Pickup,
        sample_rate_hz: float,
        seed: int,
    ) -> None:
        _check_missing(name, marks, pickup)
        self._finder = EdgeFinder(marks, phase_turns, mark_errors(name, marks, pickup, seed))
        self._marks = marks
        self._rate_hz = sample_rate_hz
        self._pickup = pickup
        self._swing = SwingingEncoder(name, pickup.coupling, sample_rate_hz) if pickup.coupling else None
        self._jitter = _stream(seed, f"jitter/{name}", pickup.jitter)
        self._missing = _stream(seed, f"missing/{name}", pickup.missing)
        self._double = _stream(seed, f"double/{name}", pickup.double)
        timed = pickup.jitter or pickup.delay or pickup.missing or pickup.double or pickup.clock
        self._faulty = bool(timed or pickup.missing_marks)
        self.ahead = math.ceil(_LARGEST_DEVIATE * pickup.jitter * sample_rate_hz)
        self._scanned = 0  # samples of the next batch that have been looked at already
        self._first = 0  # stream index of the next batch
        self._held = np.empty(0)
        self._number: int | None = None

    def stretch(self, count: int) -> tuple[int, int]:
        """Samples of a batch of that size whose angle it wants next: from, and up to and including."""
        return self._scanned, count + self.ahead

    def read(
        self, turns: NDArray[np.int64], fraction: Array, turns_per_sample: Array, count: int
    ) -> tuple[int, Array]:
        """The pulses within the next `count` samples.

        Parameters
        ----------
        turns, fraction, turns_per_sample : ndarray
            Angle (whole turns and the rest) and speed of the shaft at the samples of `stretch(count)`.
        count : int
            Samples of the batch.

        Returns
        -------
        number : int
            Of the first pulse, as a counter counts them: a missed mark is not counted, a double one twice.
        offsets : ndarray of float64
            Fractional samples from the batch's start, ascending, below `count`.
        """
        if self._swing is not None:
            fraction, turns_per_sample = self._swing.swing(fraction, turns_per_sample)
        edge, offsets = self._finder.find(turns, fraction, turns_per_sample)
        if not self._faulty:
            return edge, offsets
        if self._number is None:
            self._number = edge
        pulses = self._pulses(edge, offsets + self._scanned)
        waiting = np.sort(np.concatenate([self._held, pulses]))
        sent = waiting[waiting < count]
        sent = sent[sent >= 0.0]
        if sent.size:  # two within one tick of the clock are one
            sent = sent[np.concatenate([[True], np.diff(sent) > 0.0])]
        self._held = waiting[waiting >= count] - count
        self._scanned = self.ahead
        self._first += count
        number = self._number
        self._number += sent.size
        return number, sent

    def _pulses(self, edge: int, offsets: Array) -> Array:
        """The passings as the electronics give them."""
        pickup, size = self._pickup, offsets.size
        seen = np.ones(size, dtype=bool)
        if pickup.missing_marks:
            seen &= ~np.isin((edge + np.arange(size)) % self._marks, pickup.missing_marks)
        if self._missing is not None:
            seen &= uniform(self._missing, size) >= pickup.missing
        times = offsets + pickup.delay * self._rate_hz
        if self._jitter is not None:
            times += pickup.jitter * self._rate_hz * normal(self._jitter, size)
        if self._double is not None:
            twice = seen & (uniform(self._double, size) < pickup.double)
            times = np.concatenate([times[seen], times[twice] + pickup.double_after * self._rate_hz])
        else:
            times = times[seen]
        if pickup.clock is not None:
            samples_per_tick = self._rate_hz / pickup.clock
            ticks = np.ceil((self._first + times) / samples_per_tick)
            times = ticks * samples_per_tick - self._first
        return times


def _stream(seed: int, name: str, amount: float) -> Philox | None:
    return generator(seed, name) if amount > 0.0 else None


def _check_missing(name: str, marks: int, pickup: Pickup) -> None:
    wrong = [mark for mark in pickup.missing_marks if mark >= marks]
    if wrong:
        raise InputError(f"sensor {name}", "missing_marks", wrong[0], f"a mark from 0 to {marks - 1}")
    if len(set(pickup.missing_marks)) >= marks:
        raise InputError(f"sensor {name}", "missing_marks", "all of them", "at least one mark that is seen")
