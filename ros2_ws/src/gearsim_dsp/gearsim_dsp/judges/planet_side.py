"""Which flank of a planet's tooth is spalled: that to the sun or that to the ring.

A blow in the mesh with the sun and one in the mesh with the ring send sun, ring and carrier off in different
ways. What depends neither on the size of the spall nor on its shape are ratios of the answers: at some
thousand hertz the sun's centre runs round with the carrier after a blow at its own mesh and against it after
one at the ring, by 3 to 10 dB; higher up what was struck is the louder one. So, for the coherent averages of
`synchronous.whirl` over the turn of the planet, in six bands:

    forward over backward whirl of the sun, of the ring;  ring over sun;  carrier over sun   (ln of energies)

Each is known with a variance V, from what the other teeth show. To stages with the same fault they differ as
their masses and springs do: by Gaussians about means m_sun and m_ring with one covariance S, fitted to
simulated stages up to 40 % off the UNSW insert, as V is taken out. Then the likelihood ratio is

    ln L = (m_sun - m_ring)^T (S + V)^-1 (x - (m_sun + m_ring) / 2)

What is not measured (V without limit) says nothing: ring or carrier may lack a sensor. ln L is cut where the
number of stages cannot back more, and a factor, fitted to stages that were left out, makes a logistic
probability of it. Below 0.9 the side is told to be open. Stages of quite another size were not fitted.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearsim_dsp.judges.planet_turns import TURN_BANDS_HZ
from gearsim_dsp.synchronous.whirl import ToothBlow, blow_of_tooth

__all__ = [
    "SIDE_BANDS_HZ",
    "SURE",
    "UNKNOWN_VARIANCE",
    "log_likelihood_ratio",
    "side_of",
    "side_words",
    "spall_side",
]

Array = NDArray[np.float64]

_SKIPPED = 2  # bands in which both sides sound alike
SIDE_BANDS_HZ = TURN_BANDS_HZ[_SKIPPED:]
SURE = 0.9
UNKNOWN_VARIANCE = 1e6
_HEARD = 3.0  # the louder of two energies stands this many standard deviations over the other teeth
_SENSORS = ("sun", "ring", "carrier")


def spall_side(turns: Mapping[str, NDArray[np.complex128]], teeth: int, place: float) -> dict[str, object]:
    """Side of a spall for the evidence of its finding.

    Parameters
    ----------
    turns : mapping of str to ndarray of complex, shape (2, bands, parts, bins)
        Averaged turns of the planet by channel (`planet_turns.averaged_turns`).
    teeth : int
        Of the planet.
    place : float
        Where the tooth strikes, in turns of the planet.

    Returns
    -------
    dict
        `side`: "sun", "ring", "undecided", or "not told" where the sensors cannot tell; `side_reason` in
        words; unless not told, `side_confidence` of the more probable side, and what it follows from.
    """
    means = {name: turns[name].mean(axis=0)[_SKIPPED:] for name in _SENSORS if name in turns}
    blows = {name: blow_of_tooth(mean, teeth, place) for name, mean in means.items()}
    if "sun" not in blows or means["sun"].shape[1] < 3 or not means["sun"].size:
        return {"side": "not told", "side_reason": "it takes a sensor at the sun, and a carrier that turns"}
    # Rounded first, so that what is written decides as what was measured did.
    values, variances = ([float(f"{one:.4g}") for one in numbers] for numbers in _ratios(blows))
    told = side_words(values, variances)
    return {**told, "side_features": values, "side_variances": variances}


def side_words(values: Sequence[float], variances: Sequence[float]) -> dict[str, object]:
    """What is said of these numbers: `side`, `side_reason`, `side_confidence`."""
    side, sure = side_of(values, variances)
    if sure >= SURE:
        said = f"the flank that meets the {side} (probability {sure:.2f})"
        return {"side": side, "side_reason": said, "side_confidence": sure}
    said = f"undecided which flank: that to the {side} is more probable, at {sure:.2f} too little to say so"
    return {"side": "undecided", "side_reason": said, "side_confidence": sure}


def side_of(values: Sequence[float], variances: Sequence[float]) -> tuple[str, float]:
    """The more probable side and its probability.

    Parameters
    ----------
    values, variances : sequence of float
        Of the logarithms of energy ratios, four for each of `SIDE_BANDS_HZ`; `UNKNOWN_VARIANCE` and above:
        not measured.
    """
    model = _model()
    ratio = log_likelihood_ratio(model, np.asarray(values), np.asarray(variances))
    sure = 1.0 / (1.0 + math.exp(-model["factor"] * min(abs(ratio), model["most"])))
    return ("sun" if ratio >= 0.0 else "ring"), sure


def log_likelihood_ratio(model: dict[str, Any], values: Array, variances: Array) -> float:
    """Of a spall to the sun against one to the ring."""
    known = variances < UNKNOWN_VARIANCE
    if not known.any():
        return 0.0
    sun, ring = np.asarray(model["mean_sun"])[known], np.asarray(model["mean_ring"])[known]
    spread = np.asarray(model["covariance"])[np.ix_(known, known)] + np.diag(variances[known])
    return float((sun - ring) @ np.linalg.solve(spread, values[known] - 0.5 * (sun + ring)))


def _ratios(blows: dict[str, ToothBlow]) -> tuple[Array, Array]:
    """Logarithms of the four energy ratios in each band, and their variances."""
    values = np.zeros((len(SIDE_BANDS_HZ), 4))
    variances = np.full_like(values, UNKNOWN_VARIANCE)
    energies: dict[str, Array] = {}
    for name, blow in blows.items():
        net, variance = blow.net, blow.variance
        if name != "carrier" and net.shape[1] == 3:
            column = 0 if name == "sun" else 1
            for row, (one, its) in enumerate(zip(net, variance, strict=True)):
                values[row, column], variances[row, column] = _ratio(one[0], its[0], one[1], its[1])
            net, variance = net[:, :2], variance[:, :2]
        energies[name] = np.stack([net.sum(axis=1), variance.sum(axis=1)])
    for column, name in ((2, "ring"), (3, "carrier")):
        if name in energies:
            for row, (one, sun) in enumerate(zip(energies[name].T, energies["sun"].T, strict=True)):
                values[row, column], variances[row, column] = _ratio(one[0], one[1], sun[0], sun[1])
    return values.ravel(), variances.ravel()


def _ratio(one: float, one_variance: float, other: float, other_variance: float) -> tuple[float, float]:
    """Logarithm of the ratio of two energies and its variance; unknown where neither is heard."""
    relative = one_variance / one**2, other_variance / other**2
    if min(relative) > 1.0 / _HEARD**2:
        return 0.0, UNKNOWN_VARIANCE
    return math.log(one / other), min(relative[0] + relative[1], UNKNOWN_VARIANCE)


@cache
def _model() -> dict[str, Any]:
    text = files("gearsim_dsp.judges").joinpath("planet_side.json").read_text()
    model: dict[str, Any] = json.loads(text)
    return model
