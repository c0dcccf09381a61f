"""Data quality: what is wrong or noteworthy about a signal before anything is concluded from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["QualityIssue", "check_samples"]

_CLIP_RUN = 3
_CLIP_SHARE = 1e-4


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
        "not_finite", "constant_channel" and "too_short" are fatal; "clipping" (the extreme value held for
        three samples or more, again and again) and "dropout" (one value held for long stretches) are not.
    """
    x = np.asarray(samples)
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
    clipped = _held(x == high) + _held(x == low)
    if clipped > max(_CLIP_SHARE * x.size, 2 * _CLIP_RUN):
        detail = f"{clipped} of {x.size} samples sit at the extremes {low:.4g} and {high:.4g} in runs"
        issues.append(QualityIssue("clipping", channel, detail))
    held = _longest_run(x[1:] == x[:-1]) + 1
    if held > max(64, x.size // 2000) and not clipped:
        issues.append(QualityIssue("dropout", channel, f"one value is held for {held} samples"))
    return tuple(issues)


def _held(at: NDArray[np.bool_]) -> int:
    """Number of samples in runs of at least _CLIP_RUN."""
    if np.count_nonzero(at) < _CLIP_RUN:
        return 0
    lengths = _runs(at)
    return int(lengths[lengths >= _CLIP_RUN].sum())


def _longest_run(at: NDArray[np.bool_]) -> int:
    return int(_runs(at).max(initial=0))


def _runs(at: NDArray[np.bool_]) -> NDArray[np.intp]:
    edges = np.flatnonzero(np.diff(np.concatenate(([False], at, [False])).astype(np.int8)))
    return np.asarray(edges[1::2] - edges[::2])
