"""Data quality: what is wrong or noteworthy about a signal before anything is concluded from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_io.nameplate import Machine
from gearsim_io.record import Record

__all__ = ["QualityIssue", "check_levels", "check_samples"]

_CLIP_COUNT = 10
_CLIP_SHARE = 1e-4
_CLIP_MARGIN = 0.01
_CLIP_EXCESS = 3
_PLAUSIBLE_MS2 = (1e-5, 5e3)  # RMS between a good sensor's own noise and what breaks sensors
_ODD_LEVEL = 300.0  # over or under all other channels: no bearing is that much louder than the next
_OFFSET_RATIO = 20.0


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


def check_levels(record: Record, machine: Machine) -> list[QualityIssue]:
    """What the levels of a record's channels say of units, gains and zeros.

    Parameters
    ----------
    record : Record
    machine : Machine
        Its channels' full scales.

    Returns
    -------
    list of QualityIssue
        "beyond_full_scale", "implausible_level" (in m/s^2 only), "odd_level" (of one channel among three or
        more) and "offset"; none is fatal, as shapes can be judged all the same.
    """
    scale = {channel.name: channel.full_scale for channel in machine.channels}
    rows: dict[str, tuple[float, float]] = {}
    issues = []
    for name, row in zip(record.channels, record.data, strict=True):
        if not np.all(np.isfinite(row)) or np.ptp(row) == 0:
            continue
        mean, rms = float(np.mean(row, dtype=np.float64)), float(np.std(row, dtype=np.float64))
        rows[name] = mean, rms
        top = float(np.max(np.abs(row)))
        if top > 1.02 * scale.get(name, float("nan")):
            detail = (
                f"values up to {top:.4g} where the nameplate's range ends at {scale[name]:.4g}: unit or gain"
            )
            issues.append(QualityIssue("beyond_full_scale", name, detail))
        low, high = _PLAUSIBLE_MS2
        if record.unit == "m/s^2" and not low <= rms <= high:
            word = "less" if rms < low else "more"
            detail = f"an RMS of {rms:.3g} m/s^2 is {word} than machines give: unit or gain"
            issues.append(QualityIssue("implausible_level", name, detail))
        if abs(mean) > _OFFSET_RATIO * rms:
            issues.append(QualityIssue("offset", name, f"a mean of {mean:.3g} over an RMS of {rms:.3g}"))
    if len(rows) >= 3:
        levels = {name: rms for name, (_, rms) in rows.items()}
        for name, rms in levels.items():
            others = [value for other, value in levels.items() if other != name]
            if rms > _ODD_LEVEL * max(others) or rms * _ODD_LEVEL < min(others):
                span = f"{min(others):.3g} to {max(others):.3g}"
                detail = f"an RMS of {rms:.3g} where the other channels have {span}"
                issues.append(QualityIssue("odd_level", name, detail))
    return issues


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
