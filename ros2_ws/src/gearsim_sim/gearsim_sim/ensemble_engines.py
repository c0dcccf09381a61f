"""Variants of a machine in a flexible casing: each by an engine of its own, several at once by threads.

A casing's modes fill the vector registers that other machines share among variants, so nothing is gained by
laying variants side by side; the compiled loop runs without the interpreter's lock.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import numpy as np

from gearsim_io.errors import InputError
from gearsim_sim.engine import Engine, EngineOutput, Sites
from gearsim_sim.ensemble_parts import EnsembleOutput, Variant
from gearsim_sim.events import Event

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


class EngineRuns:
    """One engine for each variant; arguments as of `Ensemble`.

    Raises
    ------
    InputError
        As `Engine`, or if variants have not the same sites.
    """

    def __init__(
        self,
        variants: Sequence[Variant],
        sample_rate_hz: float,
        oversampling: int,
        sites: Sites | None,
        workers: int,
    ) -> None:
        self._workers = workers

        def engine(one: Variant) -> Engine:
            return Engine(
                one.params,
                one.seed,
                sample_rate_hz,
                oversampling,
                one.faults,
                speed_hz=one.speed_hz,
                load_nm=one.load_nm,
                sites=sites,
            )

        first = engine(variants[0])  # which compiles what the others find compiled
        self._engines = (first, *self._each(engine, variants[1:]))
        for number, other in enumerate(self._engines):
            if other.site_names != first.site_names:
                expected = "the same casing in all variants: sites " + ", ".join(first.site_names)
                raise InputError("ensemble", f"variants.{number}", ", ".join(other.site_names), expected)

    def _each(self, work: Callable[[_Item], _Result], items: Sequence[_Item]) -> list[_Result]:
        if self._workers == 1 or len(items) < 2:
            return [work(item) for item in items]
        with ThreadPoolExecutor(self._workers) as pool:
            return list(pool.map(work, items))

    @property
    def site_names(self) -> tuple[str, ...]:
        """As of all engines."""
        return self._engines[0].site_names

    @property
    def shaft_names(self) -> tuple[str, ...]:
        """As of all engines."""
        return self._engines[0].shaft_names

    @property
    def next_sample(self) -> int:
        """As of all engines."""
        return self._engines[0].next_sample

    @property
    def earliest_event_sample(self) -> int:
        """As of all engines."""
        return self._engines[0].earliest_event_sample

    def advance(self, n: int) -> EnsembleOutput:
        """The next `n` samples of all."""

        def step(engine: Engine) -> EngineOutput:
            return engine.advance(n)

        found = self._each(step, self._engines)
        first = found[0]
        return EnsembleOutput(
            first_sample=first.first_sample,
            site_names=first.site_names,
            accel=np.array([one.accel for one in found]),
            shaft_names=first.shaft_names,
            turns=np.array([one.turns for one in found]),
            fraction=np.array([one.fraction for one in found]),
            speed_hz=np.array([one.speed_hz for one in found]),
            signal_names=tuple(first.signals),
            signals=np.array([list(one.signals.values()) for one in found]).reshape(len(found), -1, n),
        )

    def schedule(self, variant: int, event: Event) -> int:
        """An event of one variant; returns its sample."""
        return self._engines[variant].schedule(event)
