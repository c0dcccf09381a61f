"""The frequency responses that belong to a machine's casing."""

from __future__ import annotations

from typing import Any

from gearsim_io.errors import InputError
from gearsim_sim.frf.file import find_responses
from gearsim_sim.frf.responses import CasingResponses


def machine_responses(params: Any) -> CasingResponses:
    """Responses of the casing that a machine's parameters name.

    Raises
    ------
    InputError
        If there is no casing or there are no responses, or they are of another casing than the reduced one.
    """
    named: str | None = getattr(params, "responses", None)
    key = getattr(params, "responses_key", "casing.responses")
    if named is None:
        expected = f"a model in a flexible casing, such as cb146, whose machine names {key}"
        raise InputError("sensors.accelerometers", "path", "frf", expected)
    found = find_responses(named)
    if not found.belongs_to(params.casing):
        expected = f"those of the reduced casing, {params.casing.name}; `gearsim casing responses` makes them"
        raise InputError(params.where, key, named, expected)
    return found
