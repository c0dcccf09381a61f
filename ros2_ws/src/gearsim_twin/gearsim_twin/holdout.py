"""What a cause gains on records that it was not fitted to, with intervals."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gearsim_twin.likelihood import Noise, Yardstick
from gearsim_twin.stack import ASSUMED, TONES, Array, Levels, Stack

__all__ = ["Gain", "affected_domain", "heldout_gain"]

_DRAWS = 200
_BLOCK = 8


@dataclass(frozen=True, slots=True)
class Gain:
    """How much better one model predicts held-out records than another.

    Attributes
    ----------
    domain : str
        Where the training records show the greatest difference between the two.
    gain_db : float
        By how much the rms error falls there, dB, weighted as by `score`.
    ci95_db : tuple of float
    nats : float
        Difference of the predictive log likelihoods over all domains.
    ci95_nats : tuple of float
    """

    domain: str
    gain_db: float
    ci95_db: tuple[float, float]
    nats: float
    ci95_nats: tuple[float, float]

    def real(self, trifle_db: float) -> bool:
        """Whether it is significant and no trifle."""
        return self.ci95_nats[0] > 0.0 and self.gain_db > trifle_db


def affected_domain(stack: Stack, use: np.ndarray, before_z: Array, after_z: Array) -> str:
    """The domain in which most squared error vanishes, in standard deviations held at 10."""
    fall = np.minimum(before_z**2, 100.0) - np.minimum(after_z**2, 100.0)
    names = [k for k, name in enumerate(stack.domains) if name != ASSUMED]
    falls = [float(np.sum(fall[use & (stack.domain == k)])) for k in names]
    return stack.domains[names[int(np.argmax(falls))]]


def heldout_gain(
    yard: Yardstick, before: tuple[Levels, Noise], after: tuple[Levels, Noise], domain: str, seed: int
) -> Gain:
    """Gain of one prediction over another on the places that count in `yard`.

    Parameters
    ----------
    yard : Yardstick
        Of the held-out records.
    before, after : (Levels, Noise)
        Predictions, and the spread of the model's errors as learnt on the training records.
    domain : str
        Whose error is told.
    seed : int
        Of the intervals.

    Notes
    -----
    The intervals are a parametric block bootstrap: the measured levels are drawn anew with the spread that
    the better model leaves, equal in part over blocks of neighbouring places, all channels and records, so
    that their design effect is that of `yard.share`. Resampling blocks as they are would lose a cause that
    shows at one place.
    """
    rng = np.random.default_rng(seed)
    either = replace(before[0], clear=before[0].clear | after[0].clear)
    both = tuple((replace(levels, clear=either.clear), noise) for levels, noise in (before, after))
    mine = np.isfinite(yard.residual(either)) & (yard.stack.domain == yard.stack.domains.index(domain))
    weight = 1.0 / (1.0 + yard.variance(before[0])[mine])
    weight /= max(float(weight.sum()), 1e-12)
    nats, falls = [], []
    for draw in range(_DRAWS + 1):
        error = _errors(yard, *after, rng) if draw else np.zeros(yard.stack.size)
        total, rms = [], []
        for levels, noise in both:
            residual = yard.residual(levels) + error
            total.append(float(yard.loglike(residual, levels, noise).sum()))
            rms.append(float(np.sqrt(np.sum(weight * residual[mine] ** 2))))
        nats.append(total[1] - total[0])
        falls.append(rms[0] - rms[1])
    domain = "orders" if domain == TONES else domain
    return Gain(domain, falls[0], _interval(falls), nats[0], _interval(nats))


def _interval(values: list[float]) -> tuple[float, float]:
    """The first value with the spread of the others."""
    spread = np.quantile(np.array(values[1:]) - np.median(values[1:]), (0.025, 0.975))
    return float(values[0] + spread[0]), float(values[0] + spread[1])


def _errors(yard: Yardstick, levels: Levels, noise: Noise, rng: np.random.Generator) -> Array:
    stack = yard.stack
    spread = np.sqrt(yard.variance(levels) + yard.missed(levels, noise))
    block = stack.line // _BLOCK
    common = rng.standard_normal(int(block.max()) + 1)[block]
    own = rng.standard_normal(stack.size)
    # Blocks of m places with correlation r have the design effect 1 + (m - 1) r.
    sizes = np.bincount(block[yard.use], minlength=int(block.max()) + 1)[block]
    wanted = 1.0 / yard.share[stack.domain]
    r = np.clip((wanted - 1.0) / np.maximum(sizes - 1.0, 1.0), 0.0, 1.0)
    return np.asarray(spread * (np.sqrt(r) * common + np.sqrt(1.0 - r) * own))
