"""How many independent differences there are among many that look alike.

A model that is a little wrong is wrong in the same direction at neighbouring places, in neighbouring
channels and in every record. Counted as independent, such differences would prove anything. The share of
a domain is the number of independent differences over the number of places; log likelihoods are multiplied
by it (a power likelihood with the design effect of cluster sampling as its temperature). How far what chance
draws anew for each machine is independent is told by simulated machines of the kind (`realisations`).
"""

from __future__ import annotations

import numpy as np

from gearsim_twin.stack import ASSUMED, Array, Codes, Stack

__all__ = ["independent_share"]

# Differences beyond are what the causes are about; they say no more on dependence than these.
_MOST_Z = 3.0
_LAGS = 8
# Pairs that weigh as much as the assumption that neighbours share a tenth of their variance.
_PRIOR_PAIRS, _PRIOR_CORRELATION = 20.0, 0.1
# However alike they all are, a domain says as much as three independent differences.
_LEAST_DIFFERENCES = 3.0


def independent_share(stack: Stack, z: Array, systematic: Array) -> Array:
    """Independent differences per place.

    Parameters
    ----------
    stack : Stack
    z : ndarray, shape (n,)
        Differences in standard deviations; 0 where a place does not count.
    systematic : ndarray, shape (number of domains,)
        Part of their variance that is the model's, not of sampling: only that part is shared.

    Returns
    -------
    ndarray, shape (number of domains,)
        Between 0 and 1.

    Notes
    -----
    The variance of a mean over a cluster of m equally correlated values is 1 + (m - 1) r times that of
    independent ones (Kish, Survey Sampling, 1965, 8.2); along a run the sum over the autocorrelation takes
    its place. The kinds of neighbourhood (along a run, channels, carrier bands, records) are taken as
    separable, so for the systematic part their factors multiply. The rest of the variance is of sampling,
    which is independent, and of chance, with the design effect that machines of the kind show.
    """
    held = np.clip(z, -_MOST_Z, _MOST_Z)
    shares = np.ones(len(stack.domains))
    groups = (
        _pairs(stack.line, stack.band, stack.record),
        _pairs(stack.line, stack.channel, stack.record),
        _pairs(stack.line, stack.channel, stack.band),
    )
    for number, name in enumerate(stack.domains):
        mine = (stack.domain == number) & (z != 0.0)
        count = int(mine.sum())
        if name == ASSUMED or not count:
            continue
        part = float(np.clip(systematic[number], 0.05, 1.0))
        power = max(float(np.mean(held[mine] ** 2)), 1e-12) * part
        alike = _along(stack, mine, held, power)
        for group in groups:
            alike *= _among(group, mine, held, power)
        drawn = (1.0 - part) * _drawn(stack, mine)
        effect = (1.0 - part - drawn) + drawn * float(stack.chance_effect[number]) + part * alike
        shares[number] = max(min(1.0, _LEAST_DIFFERENCES / count), 1.0 / effect)
    return shares


def _drawn(stack: Stack, mine: np.ndarray) -> float:
    """Part of what is not the model's that chance draws for each machine; sampling has both sides."""
    chance2 = stack.chance_db[mine] ** 2
    return float(np.mean(chance2 / np.maximum(chance2 + 2.0 * stack.measured.std_db[mine] ** 2, 1e-12)))


def _pairs(*codes: Codes) -> Codes:
    """Groups of places that agree in all of some codes."""
    found = codes[0]
    for other in codes[1:]:
        found = np.unique(found * (int(other.max(initial=0)) + 2) + other, return_inverse=True)[1]
    return np.asarray(found)


def _correlation(products: float, pairs: float, power: float) -> float:
    found = products / power + _PRIOR_PAIRS * _PRIOR_CORRELATION
    return float(np.clip(found / (pairs + _PRIOR_PAIRS), 0.0, 1.0))


def _along(stack: Stack, mine: np.ndarray, z: Array, power: float) -> float:
    """1 + 2 sum of the autocorrelation along runs, up to where it is lost."""
    order = stack.order[mine[stack.order]]
    factor = 1.0
    for lag in range(1, _LAGS + 1):
        first, second = order[:-lag], order[lag:]
        same = stack.run[first] == stack.run[second]
        pairs = float(same.sum())
        if not pairs:
            break
        r = _correlation(float(np.sum((z[first] * z[second])[same])), pairs, power)
        factor += 2.0 * r
        if r < 1.5 * _PRIOR_CORRELATION:
            break
    return factor


def _among(group: Codes, mine: np.ndarray, z: Array, power: float) -> float:
    """1 + (m - 1) r over groups of m places."""
    groups = int(group.max(initial=0)) + 1
    number = np.bincount(group[mine], minlength=groups).astype(np.float64)
    total = np.bincount(group[mine], weights=z[mine], minlength=groups)
    squares = np.bincount(group[mine], weights=z[mine] ** 2, minlength=groups)
    pairs = float(np.sum(number * (number - 1.0))) / 2.0
    if not pairs:
        return 1.0
    r = _correlation(float(np.sum(total**2 - squares)) / 2.0, pairs, power)
    size = float(np.sum(number**2) / np.sum(number))
    return 1.0 + (size - 1.0) * r
