"""One turn of a planet as each sensor hears it, averaged over all turns with the carrier's place known.

The averages are those of `synchronous.whirl`: noise, and what does not turn with this stage, falls with the
number of turns, and the mesh that all teeth share is taken away. A profile of them shows one tooth by its
energy over that of the others, tens of decibels where the energy of single turns shows a few.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from gearsim_dsp.judges.measured import Measured
from gearsim_dsp.planet_kinematics import planetary_orders
from gearsim_dsp.synchronous.whirl import BINS_PER_TOOTH, unlike_the_rest, whirl_parts
from gearsim_io.nameplate import PlanetaryStage

__all__ = ["TURN_BANDS_HZ", "averaged_profile", "averaged_turns"]

TURN_BANDS_HZ = (
    (1000.0, 1400.0),
    (1400.0, 2000.0),
    (2000.0, 2700.0),
    (2700.0, 3500.0),
    (3500.0, 4500.0),
    (4500.0, 6000.0),
    (6000.0, 8000.0),
    (8000.0, 10500.0),
)
"""Above the strong mesh harmonics, about half an octave wide; those beyond the sampling rate are left out."""

_BELOW_NYQUIST = 0.46
_LEAST_TEETH = 12
_ON_CARRIER = "carrier"


def averaged_turns(measured: Measured, stage: PlanetaryStage) -> dict[str, NDArray[np.complex128]]:
    """Coherent averages over the planet's turn by channel, each of shape (2, bands, 3 or 1, teeth * 16).

    Parts: forward whirl, backward whirl, unturned; of the channel "carrier", and where the carrier stands,
    only the last. Channels that cannot be averaged are left out, all of them without an angle.
    """
    phase, orders = measured.phase, planetary_orders(measured.machine, stage)
    bands = [band for band in TURN_BANDS_HZ if band[1] <= _BELOW_NYQUIST * measured.sample_rate_hz]
    if phase is None or not bands or stage.planet_teeth < _LEAST_TEETH:
        return {}
    turns = {}
    for name, signal in measured.channels.items():
        parts = whirl_parts(
            signal,
            measured.sample_rate_hz,
            phase,
            planet_ratio=orders.planet_spin,
            carrier_ratio=0.0 if name == _ON_CARRIER else orders.carrier,
            teeth=stage.planet_teeth,
            bands_hz=bands,
        )
        if parts is not None:
            turns[name] = parts
    return turns


def averaged_profile(parts: NDArray[np.complex128], teeth: int, bins_per_tooth: int) -> NDArray[np.float64]:
    """Energy of what a tooth does alone over the turn, smoothed over a pitch; median 1 in each band and part.

    Parameters
    ----------
    parts : ndarray of complex, shape (2, bands, parts, teeth * 16)
    teeth, bins_per_tooth : int

    Returns
    -------
    ndarray, shape (teeth * bins_per_tooth,)
        Mean over the bands, and over the whirls or of the unturned part, whichever one tooth dominates more;
        of both halves of the record the smaller, for one knock is in one of them.
    """
    energy = np.abs(np.stack([unlike_the_rest(half, teeth) for half in parts])) ** 2
    energy = uniform_filter1d(energy, BINS_PER_TOOTH, axis=-1, mode="wrap")
    energy /= np.maximum(np.median(energy, axis=-1, keepdims=True), np.finfo(np.float64).tiny)
    groups = [energy] if parts.shape[2] == 1 else [energy[:, :, :2], energy[:, :, 2:]]
    profiles = [group.mean(axis=(1, 2)).min(axis=0) for group in groups]
    best = max(profiles, key=lambda profile: float(profile.max() / np.median(profile)))
    coarse = best.reshape(teeth * bins_per_tooth, -1).mean(axis=1)
    return np.asarray(coarse / np.median(coarse))
