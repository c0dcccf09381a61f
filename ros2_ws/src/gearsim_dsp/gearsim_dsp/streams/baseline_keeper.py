"""The baseline of one monitor: given, being learnt, or missing, and what to say of it."""

from __future__ import annotations

import math

from gearsim_dsp.streams.baseline import Baseline, BaselineLearner, Key, Standing
from gearsim_io.errors import InputError

__all__ = ["BaselineKeeper"]


class BaselineKeeper:
    """Learns when told, and judges by what was learnt. All times are those of the stream.

    Parameters
    ----------
    machine : str
        Name of the machine.
    learn_s : float
        How long to learn where nobody says otherwise.
    baseline : Baseline, optional
        What is known already.
    learn_at_start : bool
        Whether learning begins at once where nothing is known.

    Attributes
    ----------
    learnt : Baseline or None
        The baseline that was learnt here, once it is; whoever stores it compares it with the one before.
    """

    def __init__(
        self, machine: str, learn_s: float, baseline: Baseline | None = None, learn_at_start: bool = True
    ) -> None:
        self.machine = machine
        self.baseline = baseline
        self.learnt: Baseline | None = None
        self._learner: BaselineLearner | None = None
        self._default_s = self._wanted_s = learn_s
        self._extend = False
        self._began_ns: int | None = None
        self._t_ns = 0
        self._why_none = "none"
        if baseline is None and learn_at_start:
            self.learn()

    @property
    def learning(self) -> bool:
        """True while a baseline is being learnt."""
        return self._learner is not None

    @property
    def tests(self) -> int:
        """Indicators that alarms depend on, 1 at least."""
        return max(self.baseline.tests, 1) if self.baseline is not None else 1

    @property
    def words(self) -> str:
        """State of the baseline."""
        if self._learner is not None:
            done = 0.0 if self._began_ns is None else (self._t_ns - self._began_ns) / 1e9
            return f"learning {done:.0f} of {self._wanted_s:g} s"
        if self.baseline is not None:
            return f"learnt from {self.baseline.seconds:.0f} s"
        return self._why_none

    def learn(self, seconds: float = 0.0, *, extend: bool = False) -> None:
        """Learn from now on, beside what is known or in its place; 0 s: as long as usual.

        Raises
        ------
        InputError
            When the time is not positive and finite.
        """
        wanted = seconds or self._default_s
        if not (math.isfinite(wanted) and wanted > 0):
            raise InputError("learn_baseline", "seconds", seconds, "a finite time above 0 s, or 0")
        self._wanted_s, self._extend = wanted, extend
        self._learner = BaselineLearner(self.machine)
        self._began_ns = None

    def disturb(self, why: str) -> bool:
        """Something speaks against the machine's being healthy: give up learning; True if it was going on."""
        if self._learner is None:
            return False
        self._learner = None
        self._why_none = f"none: learning was given up, {why}"
        return True

    def recall(self, baseline: Baseline) -> None:
        """Judge by a baseline that was learnt before; nothing is learnt any more."""
        self.baseline, self._learner = baseline, None

    def refuse(self, why: str) -> None:
        """There is a baseline that cannot be used: learn nothing unasked, lest it is overwritten."""
        self._learner = None
        self._why_none = f"none: {why}"

    def restart(self) -> None:
        """The stream began again: what was being learnt is learnt anew."""
        if self._learner is not None:
            self.learn(self._wanted_s, extend=self._extend)

    def take(self, key: Key, step: int, value: float, t_ns: int) -> None:
        """A value of an indicator, for learning if that is going on."""
        if self._learner is None:
            return
        if self._began_ns is None:
            self._began_ns = t_ns
        self._learner.add(key, step, value)

    def advance(self, t_ns: int) -> None:
        """The stream has come to this time; learning ends when it is over."""
        self._t_ns = t_ns
        if self._learner is None or self._began_ns is None:
            return
        seconds = (t_ns - self._began_ns) / 1e9
        if seconds < self._wanted_s:
            return
        learner, self._learner = self._learner, None
        try:
            found = learner.finish(seconds)
        except InputError as error:
            self._why_none = f"none: {error}"
            return
        keep = self.baseline if self._extend else None
        self.baseline = self.learnt = found if keep is None else keep.extended(found)

    def standing(self, key: Key, step: int, value: float) -> Standing | None:
        """Where a value stands; None where nothing was learnt of it."""
        return None if self.baseline is None else self.baseline.standing(key, step, value)

    def limit(self, key: Key, step: int, significance: float) -> float:
        """Where an alarm of that significance would be raised; NaN where none can be."""
        return math.nan if self.baseline is None else self.baseline.limit(key, step, significance)

    def why_not(self, speed_hz: float, source: str) -> str:
        """Why nothing of a node's can be judged at this speed."""
        if self.baseline is None:
            # Without the progress: this is part of a state that is published whenever it changes.
            what = f"it is being learnt from {self._wanted_s:g} s" if self.learning else self.words
            return f"no baseline to judge by: {what}"
        if not any(key[0] == source for key, _ in self.baseline.cells):
            return f"the baseline was learnt without indicators of {source}: learn it anew or extend it"
        speeds = ", ".join(f"{speed:.3g}" for speed in self.baseline.speeds_hz())
        at = f"{speed_hz:.3g} Hz" if math.isfinite(speed_hz) else "an unknown speed"
        return f"no baseline at {at}: it was learnt near {speeds} Hz"
