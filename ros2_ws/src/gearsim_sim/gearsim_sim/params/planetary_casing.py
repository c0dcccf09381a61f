"""Parameters of a planetary stage in a flexible casing: those of the stage, and a reduced casing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from gearsim_io.errors import InputError
from gearsim_sim.model.casing.reduced import ReducedCasing, find_reduced
from gearsim_sim.params.own_files import beside
from gearsim_sim.params.planetary import FlexibleCasing, PlanetaryParams, load_planetary_params

_SECTION = "flexible_casing"


@dataclass(frozen=True, eq=False)
class PlanetaryCasingParams:
    """What the planetary model in a flexible casing needs.

    Attributes
    ----------
    gearbox : PlanetaryParams
        The stage on the ground.
    casing : ReducedCasing
        What holds its ring and the bearings of sun and carrier.
    responses : str or None
        Name or path of its frequency responses.
    """

    gearbox: PlanetaryParams
    casing: ReducedCasing
    responses: str | None = None

    responses_key: ClassVar[str] = f"{_SECTION}.responses"
    """Where a machine's description names its responses."""

    @property
    def where(self) -> str:
        """What names the machine in errors."""
        return self.gearbox.where

    @property
    def joints(self) -> FlexibleCasing:
        """How the stage stands in the casing."""
        found = self.gearbox.model.flexible_casing
        assert found is not None
        return found

    def with_physics(self, **switches: bool) -> PlanetaryCasingParams:
        """The same machine with some physics switched (`runout=False`)."""
        return replace(self, gearbox=self.gearbox.with_physics(**switches))


def load_planetary_casing_params(
    machine: str | Path = "unsw_planetary", overrides: Mapping[str, Any] | None = None, source: str = ""
) -> PlanetaryCasingParams:
    """Parameters of a planetary machine whose description names a flexible casing.

    Parameters
    ----------
    machine, overrides, source
        As of `load_planetary_params`.

    Raises
    ------
    InputError
        As `load_planetary_params`, or if there is no casing, no usable one, or the lumped one besides.
    """
    gearbox = load_planetary_params(machine, overrides, source)
    named = gearbox.model.flexible_casing
    if named is None:
        raise InputError(gearbox.where, "flexible_casing", "nothing", "a section with a reduced casing")
    if gearbox.model.casing.included:
        raise InputError(gearbox.where, "casing.included", 1, "0: the flexible casing stands in its place")
    own = partial(beside, machine, overrides, source, _SECTION)
    responses = None if named.responses is None else own("responses", named.responses)
    return PlanetaryCasingParams(gearbox, find_reduced(own("reduced", named.reduced)), responses)
