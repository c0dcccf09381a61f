"""Parameters of a parallel-shaft gearbox in a flexible casing: those of the gearbox, and a reduced casing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from gearsim_io.errors import InputError
from gearsim_sim.model.casing.reduced import ReducedCasing, find_reduced
from gearsim_sim.params.own_files import beside
from gearsim_sim.params.parallel import ParallelParams, load_parallel_params


@dataclass(frozen=True, eq=False)
class CasingGearboxParams:
    """What the models of 146 and 182 degrees of freedom need.

    Attributes
    ----------
    gearbox : ParallelParams
        The machine on the ground.
    casing : ReducedCasing
        What its bearings stand in.
    finite : bool
        Whether shafts are finite elements, else lumped.
    responses : str or None
        Name or path of its frequency responses.
    """

    gearbox: ParallelParams
    casing: ReducedCasing
    finite: bool = False
    responses: str | None = None

    @property
    def where(self) -> str:
        """What names the machine in errors."""
        return self.gearbox.where

    def with_physics(self, **switches: bool) -> CasingGearboxParams:
        """The same machine with some physics switched (`gravity=False`)."""
        return replace(self, gearbox=self.gearbox.with_physics(**switches))


def load_casing_gearbox_params(
    machine: str | Path = "unsw_parallel",
    overrides: Mapping[str, Any] | None = None,
    source: str = "",
    *,
    finite: bool = False,
) -> CasingGearboxParams:
    """Parameters of a parallel-shaft machine whose description names a casing.

    Parameters
    ----------
    machine, overrides, source
        As of `load_parallel_params`.
    finite : bool
        Whether shafts are to be finite elements.

    Raises
    ------
    InputError
        As `load_parallel_params`, or if there is no casing, or no usable one.
    """
    gearbox = load_parallel_params(machine, overrides, source).model_copy(update={"pedestals": False})
    named = gearbox.model.casing
    if named is None:
        raise InputError(gearbox.where, "casing", "nothing", "a section with a reduced casing")
    if finite and gearbox.model.finite_shafts is None:
        raise InputError(gearbox.where, "finite_shafts", "nothing", "a section with the shafts' dimensions")

    own = partial(beside, machine, overrides, source, "casing")
    responses = None if named.responses is None else own("responses", named.responses)
    return CasingGearboxParams(gearbox, find_reduced(own("reduced", named.reduced)), finite, responses)
