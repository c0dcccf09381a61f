"""Fitted parameters of a cause with their intervals."""

from __future__ import annotations

import numpy as np

from gearsim_twin.fit import Fitted
from gearsim_twin.stack import Array
from gearsim_twin.verdict import Number

__all__ = ["numbers_of"]

_Z95 = 1.959964


def numbers_of(fitted: Fitted, number: int) -> tuple[Number, ...]:
    """Parameters of one of a model's causes with their 95 % intervals.

    The posterior is normal in the coordinates of the priors; an interval is mapped to values end by end.
    """
    extension = fitted.trial.model.extensions[number]
    own = fitted.trial.model.own[number]
    coordinates: Array = fitted.posterior.coordinates[own]
    spread = np.sqrt(np.diag(fitted.posterior.covariance)[own])
    found = []
    for parameter, u, std in zip(extension.cause.parameters, coordinates, spread, strict=True):
        low, high = (parameter.prior.value(float(u + side * _Z95 * std)) for side in (-1.0, 1.0))
        value = parameter.prior.value(float(u))
        found.append(Number(parameter.name, parameter.unit, value, (low, high)))
    return tuple(found)
