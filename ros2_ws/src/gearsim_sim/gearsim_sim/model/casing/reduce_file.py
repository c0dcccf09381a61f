"""Reduces whatever a description describes: a casing of plates and rings, or a user's own matrices."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gearsim_io.errors import InputError
from gearsim_io.quantities import read_yaml
from gearsim_sim.model.casing.build import finish, reduce_casing
from gearsim_sim.model.casing.described import load_described
from gearsim_sim.model.casing.reduced import ReducedCasing
from gearsim_sim.model.casing.reduction import Tell, craig_bampton
from gearsim_sim.model.casing.sites import parse_site
from gearsim_sim.model.casing.user_casing import load_user_casing


def check_target(path: Path) -> None:
    """InputError unless a file of that name can be written: told before minutes of work."""
    if path.suffix != ".npz":
        raise InputError("--out", "", str(path), "a file name that ends in .npz")
    if not path.parent.is_dir():
        raise InputError("--out", "", str(path), "a file in a folder that exists")


def reduce_description(
    name_or_path: str, modes: int, sensors: Sequence[str], band_hz: float | None, tell: Tell
) -> ReducedCasing:
    """Reduce a shipped casing, or one described by a file.

    Parameters
    ----------
    name_or_path : str
    modes : int
    sensors : sequence of str
        Sites besides the default ones, as `parse_site` reads them; not for a user's own matrices, whose
        description names the rows of its sensors.
    band_hz : float or None
        See `reduce_casing`.
    tell : callable
    """
    path = Path(name_or_path)
    if path.suffix in (".yaml", ".yml") and "stiffness" in _keys(path):
        if sensors:
            raise InputError("--sensor", "", sensors[0], f"`sensors` in {path}: matrices do not tell places")
        about, structure = load_user_casing(path)
        reduction = craig_bampton(structure, modes, tell)
        sites = structure.sites(reduction)
        return finish(
            structure, reduction, sites, about.damping_ratio, band_hz, {"description": about.description}
        )
    extra = [parse_site(text) for text in sensors]
    return reduce_casing(load_described(name_or_path), modes, extra, band_hz, tell)


def _keys(path: Path) -> set[str]:
    content = read_yaml(path)
    return set(content) if isinstance(content, dict) else set()
