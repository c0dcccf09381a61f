"""Responses of whatever `gearsim casing reduce` takes, or of a casing that it has reduced."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from gearsim_io.errors import InputError
from gearsim_sim.frf.responses import CasingResponses, responses_of
from gearsim_sim.model.casing.reduced import load_reduced

if TYPE_CHECKING:
    from gearsim_sim.model.casing.reduction import Tell


def make_responses(
    name_or_path: str, modes: int, sensors: Sequence[str], band_hz: float | None, tell: Tell
) -> CasingResponses:
    """Responses from the seats to all sites of a casing.

    Parameters
    ----------
    name_or_path : str
        A shipped casing, a description (.yaml), or a casing that has been reduced already (.npz).
    modes : int
        Kept beside the masters where it has to be reduced.
    sensors : sequence of str
        Further sites, as of `reduce_description`.
    band_hz : float or None
        They must hold up to here.
    tell : callable
        Hears the steps.
    """
    if Path(name_or_path).suffix != ".npz":
        # Here, because finite elements take long to load.
        from gearsim_sim.model.casing.reduce_file import reduce_description

        return responses_of(reduce_description(name_or_path, modes, sensors, band_hz, tell), name_or_path)
    if sensors:
        expected = "its sites to be given to `gearsim casing reduce`, which made the file"
        raise InputError("--sensor", "", sensors[0], expected)
    casing = load_reduced(Path(name_or_path))
    if band_hz is not None and casing.valid_hz < band_hz:
        expected = f"a reduction valid to {band_hz:g} Hz"
        raise InputError(name_or_path, "band", f"valid up to {casing.valid_hz:.0f} Hz", expected)
    return responses_of(casing, name_or_path)
