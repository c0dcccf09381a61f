"""The force elements of a plant as the flat arrays of the compiled loop."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.integrate.coefficients import padded
from gearsim_sim.model.bearing_fault_loop import CAGE_COLUMNS
from gearsim_sim.model.hertz import LINE_EXPONENT
from gearsim_sim.model.loop_data import BearingMemory, Bearings, Meshes
from gearsim_sim.model.oil_film import LINE_LOAD_POWER, POINT_LOAD_POWER
from gearsim_sim.model.periodic import PeriodicSeries
from gearsim_sim.model.plant import Plant


def bearing_data(plant: Plant, place: NDArray[np.int64]) -> Bearings:
    """All bearings; `place` is the place of each interface in the loop's order."""
    seats = plant.bearings
    balls = padded(max((seat.law.ball_count for seat in seats), default=0))
    rows = max((seat.law.rows for seat in seats), default=0)
    cosines, sines, azimuths = np.zeros((3, len(seats), balls))
    offsets = np.zeros((len(seats), rows))
    for i, seat in enumerate(seats):
        law = seat.law
        cosines[i, : law.ball_count] = np.cos(law.azimuths_rad)
        sines[i, : law.ball_count] = np.sin(law.azimuths_rad)
        azimuths[i, : law.ball_count] = law.azimuths_rad / (2 * np.pi)
        offsets[i, : law.rows] = law.azimuths_rad[:: law.balls_per_row] / (2 * np.pi)
    index = [[place[seat.x], place[seat.y], seat.cage] for seat in seats]
    numbers = [[seat.law.load_factor, seat.law.clearance_m, seat.nominal_stiffness_n_per_m] for seat in seats]
    return Bearings(
        places=np.array(index, dtype=np.int64).reshape(-1, 3),
        numbers=np.array(numbers, dtype=np.float64).reshape(-1, 3),
        cosines=cosines,
        sines=sines,
        azimuths=azimuths,
        row_offsets=offsets,
        balls_per_row=np.array([seat.law.balls_per_row for seat in seats], dtype=np.int64),
        rollers=np.array([seat.law.exponent == LINE_EXPONENT for seat in seats], dtype=np.int64),
        spins=np.array([seat.spin for seat in seats], dtype=np.int64),
    )


def bearing_memory(bearings: Bearings) -> BearingMemory:
    """Bearings that have not moved yet; films begin as under 100 N."""
    shape = bearings.cosines.shape
    missing, play, film = np.zeros((3, *shape))
    for i in range(shape[0]):
        film[i] = 100.0 ** (-1 / (LINE_LOAD_POWER if bearings.rollers[i] else POINT_LOAD_POWER))
    return BearingMemory(
        missing=missing,
        play=play,
        cosines=bearings.cosines.copy(),
        sines=bearings.sines.copy(),
        film=film,
        cage=np.zeros((shape[0], CAGE_COLUMNS)),
    )


def mesh_data(plant: Plant, place: NDArray[np.int64], step_s: float) -> Meshes:
    """All meshes; a series that several share is tabled once."""
    store = _Tables()
    index: list[list[int]] = []
    errors: list[list[int]] = []
    for mesh in plant.meshes:
        first = len(errors)
        errors += [[one.track, *store.put(one.series)] for one in mesh.errors]
        own = [place[mesh.interface], mesh.track, *store.put(mesh.stiffness), first, len(errors)]
        index.append(own)
    numbers = [
        [mesh.mean_stiffness_n_per_m, mesh.damping_ns_per_m, mesh.cycles, mesh.phase_offset, *mesh.pulse]
        for mesh in plant.meshes
    ]
    return Meshes(
        places=np.array(index, dtype=np.int64).reshape(-1, 6),
        numbers=np.array(numbers, dtype=np.float64).reshape(-1, 7),
        errors=np.array(errors, dtype=np.int64).reshape(-1, 3),
        tables=store.all(),
        step_s=step_s,
    )


class _Tables:
    """Tables of periodic functions, one behind the other."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[int, int]] = {}
        self._series: list[PeriodicSeries] = []  # keeps their ids alive
        self._tables: list[NDArray[np.float64]] = []
        self._size = 0

    def put(self, series: PeriodicSeries) -> tuple[int, int]:
        """Offset and number of intervals of the table of a series."""
        if id(series) not in self._known:
            table = series.table()
            self._known[id(series)] = (self._size, table.size // 2 - 1)
            self._series.append(series)
            self._tables.append(table)
            self._size += table.size
        return self._known[id(series)]

    def all(self) -> NDArray[np.float64]:
        """All tables."""
        return np.concatenate(self._tables) if self._tables else np.zeros(0)
