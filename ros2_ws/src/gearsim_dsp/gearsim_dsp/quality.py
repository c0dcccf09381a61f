"""Data quality: what is wrong or noteworthy about a signal before anything is concluded from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["QualityIssue", "check_samples"]

_CLIP_COUNT = 10
_CLIP_SHARE = 1e-4
_CLIP_MARGIN = 0.01
_CLIP_EXCESS = 3


@dataclass(frozen=True, slots=True)
class QualityIssue:
    """One entry of the diagnosis's `quality` list.

    `issue` is a stable word (such as "clipping", "constant_channel", "electrical_lines"), `channel` is empty
    when the whole record is meant, `detail` is one sentence for people. A `fatal` issue means that the
    channel (or record) cannot be judged.
    """

    issue: str
    channel: str
    detail: str
    fatal: bool = False

    def to_json(self) -> dict[str, str]:
        """The entry as the contract of `diagnose --json` has it."""
        return {"issue": self.issue, "channel": self.channel, "detail": self.detail}


def check_samples(
    samples: NDArray[np.float32] | NDArray[np.float64], channel: str
) -> tuple[QualityIssue, ...]:
    """What can be said of the samples alone.

    Parameters
    ----------
    samples : ndarray, shape (n,)
    channel : str

    Returns
    -------
    tuple of QualityIssue
        "not_finite", "constant_channel" and "too_short" are fatal; "clipping" (far more samples at an extreme
        than just below it) and "dropout" (one value held for a long stretch) are not.
    """
    x: NDArray[np.floating] = np.asarray(samples)
    finite = np.isfinite(x)
    if not finite.all():
        bad = int(x.size - np.count_nonzero(finite))
        detail = f"{bad} of {x.size} samples are not finite, the first at {int(np.argmin(finite))}"
        return (QualityIssue("not_finite", channel, detail, True),)
    if x.size < 64:
        return (QualityIssue("too_short", channel, f"{x.size} samples; at least 64 are needed", True),)
    low, high = float(x.min()), float(x.max())
    if low == high:
        return (QualityIssue("constant_channel", channel, f"all samples are {low:g}", True),)
    issues = []
    clipped = _piled(x, high, high - low) + _piled(-x, -low, high - low)
    if clipped:
        detail = f"{clipped} of {x.size} samples sit at the extremes {low:.4g} and {high:.4g}"
        issues.append(QualityIssue("clipping", channel, detail))
    held = _longest_run(x[1:] == x[:-1]) + 1
    if held > max(64, x.size // 2000) and not clipped:
        issues.append(QualityIssue("dropout", channel, f"one value is held for {held} samples"))
    return tuple(issues)


def _piled(x: NDArray[np.floating], top: float, span: float) -> int:
    """Samples at the top value, if they are many and far more than in the hundredth of the range below it."""
    at = int(np.count_nonzero(x >= top))
    below = int(np.count_nonzero(x >= top - _CLIP_MARGIN * span)) - at
    return at if at >= max(_CLIP_COUNT, _CLIP_SHARE * x.size) and at > _CLIP_EXCESS * below else 0


def _longest_run(at: NDArray[np.bool_]) -> int:
    return int(_runs(at).max(initial=0))


def _runs(at: NDArray[np.bool_]) -> NDArray[np.intp]:
    edges = np.flatnonzero(np.diff(np.concatenate(([False], at, [False])).astype(np.int8)))
    return np.asarray(edges[1::2] - edges[::2])
