"""Tells when the diagnostic nodes of a graph have judged everything that they received."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

__all__ = ["Quiet"]

_ALIKE = 2
_STUCK = 10
_TASK = ": stream"


class Quiet:
    """Follows what the nodes say of their streams on /diagnostics, about once a second each.

    A node's one thread receives messages between two such reports, if any wait for it. So two reports with
    the same number of batches and none under analysis mean that the node is done; and all nodes must be so
    at one time, as some take what others tell.

    Parameters
    ----------
    nodes : iterable of str
    """

    def __init__(self, nodes: Iterable[str]) -> None:
        self._alike = dict.fromkeys(nodes, 0)
        self._last: dict[str, tuple[str, str]] = {}
        self._unchanged = 0

    def restart(self) -> None:
        """The source has ended: only what is said from now on counts."""
        self._alike = dict.fromkeys(self._alike, 0)
        self._unchanged = 0

    def status(self, name: str, values: Mapping[str, str]) -> None:
        """A status of /diagnostics, "node: task", with its key-values."""
        node = name.removesuffix(_TASK)
        if node == name or node not in self._alike:
            return
        now = values.get("batches", ""), values.get("batches not analysed yet", "")
        if self._last.get(node, now) != now:
            self.restart()
        self._last[node] = now
        self._unchanged += 1
        self._alike[node] += now[1] == "0"

    @property
    def reached(self) -> bool:
        """True when nothing is left to be judged."""
        return all(count >= _ALIKE for count in self._alike.values())

    @property
    def stuck(self) -> bool:
        """True when a node has something to judge and has not done so for about ten seconds."""
        return not self.reached and self._unchanged > _STUCK * len(self._alike)

    @property
    def words(self) -> str:
        """Which nodes are not done, and what they last said; empty when all are."""
        if self.reached:
            return ""
        late = []
        for node, count in self._alike.items():
            batches, unfinished = self._last.get(node, ("", ""))
            if count < _ALIKE:
                late.append(f"{node} ({unfinished} batches left)" if batches else f"{node} (not heard of)")
        return ", ".join(late)
