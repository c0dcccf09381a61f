"""Data quality: what is wrong or noteworthy about a signal before anything is concluded from it."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["QualityIssue"]


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
