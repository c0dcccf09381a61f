"""The baseline of everyday practice: levels in third-octave bands and the crest, against the nominal model.

It says whether something differs, and nothing more. The threshold of a rig is 1.2 dB over the largest
difference that was found on ten machines without effects (four, three and three of the rigs, seeds 990100
and following).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch

from blind.rigs import Rig

Array = NDArray[np.float64]
_LOWEST_HZ = 40.0
THRESHOLD_DB = {"parallel": 5.1, "bearing": 6.3, "planetary": 14.5}


def bands_db(x: Array, rate_hz: float) -> Array:
    """Levels in third octaves, and twice the crest factor's, in dB."""
    f, density = welch(x, rate_hz, nperseg=min(x.size, 8192))
    edges = np.geomspace(_LOWEST_HZ, 0.45 * rate_hz, int(3 * np.log2(0.45 * rate_hz / _LOWEST_HZ)) + 1)
    levels = [
        10 * np.log10(density[(f >= low) & (f < high)].mean() + 1e-20)
        for low, high in itertools.pairwise(edges)
        if np.any((f >= low) & (f < high))
    ]
    crest = 20 * np.log10(np.quantile(np.abs(x), 0.9999) / (x.std() + 1e-20))
    return np.array([*levels, crest])


def largest_db(records: Sequence[Path], rig: Rig) -> float:
    """The largest difference between the first record and the nominal model, noise as of the sensors."""
    from gearsim_twin.baseline import scenario_content
    from gearsim_twin.case import load_case
    from gearsim_twin.simulated import Simulator

    case = load_case([str(records[0])], rig.machine, rig.model, holdout=[str(records[-1])])
    rng, worst = np.random.default_rng(5), 0.0
    with Simulator(case) as simulator:
        view = simulator.measured[0]
        (model,) = simulator.views({0: scenario_content(case, view)})
        for channel, density in zip(rig.channels, rig.noise, strict=True):
            own = np.asarray(model.signal(channel), dtype=np.float64)
            own = own + density * (0.5 * rig.rate_hz) ** 0.5 * rng.standard_normal(own.size)
            one = bands_db(np.asarray(view.signal(channel), dtype=np.float64), rig.rate_hz)
            worst = max(worst, float(np.max(np.abs(one - bands_db(own, rig.rate_hz)))))
    return worst
