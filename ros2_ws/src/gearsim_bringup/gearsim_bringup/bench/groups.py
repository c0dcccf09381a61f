"""The groups of figures; adding one touches its own file and one line here."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from gearsim_bringup.bench import alarms, bags, casing, dsp, monitors, setup, sim, stream
from gearsim_bringup.bench.figure import Figure
from gearsim_bringup.ui import Voice

GROUPS: dict[str, Callable[[Voice], Iterable[Figure]]] = {
    "sim": sim.measure,
    "dsp": dsp.measure,
    "bags": bags.measure,
    "alarms": alarms.measure,
    "stream": stream.measure,
    "monitors": monitors.measure,
    "casing": casing.measure,
    "setup": setup.measure,
}
# `casing` takes minutes, `setup` those and the package index; they are run when asked for.
DEFAULT = ("sim", "dsp", "bags", "alarms", "stream", "monitors")
