"""Parameters of the parallel-shaft gearbox, read from the machine's YAML."""

from __future__ import annotations

from pathlib import Path

from gearsim_io.quantities import Strict


class ParallelParams(Strict):
    """Everything the 34-DOF model needs."""


def load_parallel_params(machine: str | Path) -> ParallelParams:
    """The `model` section of a machine description (with the nameplate's teeth and bearing geometry)."""
    raise NotImplementedError
