"""What a model needs of the measuring chain that no sensor does: differences that a chain would hide.

A gain that brings all levels together explains nothing where it is forty decibels of a sensor known to one.
"""

from __future__ import annotations

from dataclasses import replace

from gearsim_twin.compare.merged import Discrepancy
from gearsim_twin.compare.places import Place
from gearsim_twin.workbench import Trial, Workbench

__all__ = ["chain_doubts"]

# Of the gain alone: a loss at the top of the band and a coloured floor show in the spectra themselves.
_KIND = "gain"
_LEAST_DB, _LEAST_Z, _MOST_Z = 3.0, 4.0, 99.0
# A gain that is free to this many decibels is not known beforehand: the unit of the record is not.
_FREE_DB = 5.0


def chain_doubts(bench: Workbench, trial: Trial) -> tuple[Discrepancy, ...]:
    """Channels whose levels all differ by more than a sensor may be off, the most first.

    Parameters
    ----------
    bench : Workbench
    trial : Trial
        With the chain that fits it best.
    """
    if trial.nuisance is None:
        return ()
    needs = zip(bench.nuisances.assumed, bench.nuisances.corrections_db(trial.nuisance), strict=True)
    found = []
    for assumed, need in needs:
        z = need / assumed.std_db
        known = assumed.kind == _KIND and assumed.std_db < _FREE_DB
        if known and abs(need) >= _LEAST_DB and abs(z) >= _LEAST_Z:
            where = f"level of all that {assumed.channel} shows"
            place = Place("statistics", assumed.channel, "rms", 0.0, "1", 1.0)
            z = max(-_MOST_Z, min(_MOST_Z, z))
            found.append(Discrepancy("", "statistics", where, need, z, (place,)))
    found.sort(key=lambda one: -abs(one.z))
    return tuple(replace(one, id=f"g{number}") for number, one in enumerate(found, start=1))
