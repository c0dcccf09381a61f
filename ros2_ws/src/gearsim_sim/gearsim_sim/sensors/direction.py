"""Where a sensor looks: a site of the model, any direction as a sum of sites, and cross-axis errors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError

if TYPE_CHECKING:
    from gearsim_sim.sensors.rows import Row


class Directions:
    """Gathers what each sensor sees.

    Raises
    ------
    InputError
        A row names a site that the model does not have.
    """

    def __init__(self, rows: Sequence[Row], sites: Sequence[str]) -> None:
        known = {name: place for place, name in enumerate(sites)}
        self._parts: list[list[tuple[int, float]]] = []
        for row in rows:
            for name, _ in row.looks_at:
                if name not in known:
                    where = f"sensor {row.channel}"
                    raise InputError(where, "site", name, "one of " + ", ".join(sites))
            self._parts.append([(known[name], weight) for name, weight in row.looks_at])

    def read(self, window: NDArray[np.float64]) -> NDArray[np.float64]:
        """What the channels see, (channels, samples), out of a window (sites, samples)."""
        out = np.empty((len(self._parts), window.shape[1]))
        for channel, parts in enumerate(self._parts):
            place, weight = parts[0]
            out[channel] = window[place] if weight == 1.0 else weight * window[place]
            for place, weight in parts[1:]:
                out[channel] += weight * window[place]
        return out
