"""Transmission error of one gear as a smooth function of its angle, (4.14) to (4.17) with the errata.

Run-out and tooth profile are the sinusoids of (4.15) and (4.16). The thesis's error term (4.17), a
random number for each sample, has no meaning for a differential equation; here each tooth has its own
random pitch error, taken over from tooth to tooth smoothly, and the flanks have a band-limited random
surface. Both are periodic in the gear's turn and the same at any step size.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.periodic import PeriodicSeries, merged, sinusoid
from gearsim_sim.params.parallel import GearErrors, Physics

# Streams of the counter-based generator, so that no two uses share their numbers.
_PITCH_STREAM = 1
_SURFACE_STREAM = 2


def gear_error(
    errors: GearErrors, physics: Physics, teeth: int, phase_rad: float, seed: int, wheel: int
) -> PeriodicSeries:
    """Transmission error of a gear along the line of action [m] over its angle in turns.

    Parameters
    ----------
    errors : GearErrors
        Amplitudes.
    physics : Physics
        Which of them are switched on.
    teeth : int
        Number of teeth of this gear.
    phase_rad : float
        phi_k of (4.15) and (4.16).
    seed : int
        Of the random errors.
    wheel : int
        0 for the pinion, 1 for the gear; gives each its own random errors.
    """
    parts = [
        sinusoid(1, errors.runout_m * physics.runout, phase_rad),
        sinusoid(teeth, errors.profile_m * physics.tooth_profile, phase_rad),
    ]
    top = int(errors.harmonics) * teeth
    if physics.tooth_pitch and errors.pitch_rms_m > 0:
        draws = normal_draws(seed, _PITCH_STREAM, wheel, teeth)
        parts.append(pitch_series(errors.pitch_rms_m * draws, top))
    if physics.tooth_surface and errors.surface_rms_m > 0:
        draws = normal_draws(seed, _SURFACE_STREAM, wheel, 2 * top)
        parts.append(surface_series(errors.surface_rms_m, draws, top))
    return merged(*parts)


def pitch_series(pitch_errors_m: NDArray[np.float64], highest_order: int) -> PeriodicSeries:
    """Errors of single teeth, shape (teeth,), as a series up to `highest_order`.

    Tooth k holds its error at u = k / teeth turns and gives it over to its neighbours along
    cos^2(pi s / 2), s in teeth: the sum of these weights is one everywhere.
    """
    teeth = pitch_errors_m.size
    orders = np.arange(1, highest_order + 1)
    s = orders / teeth
    # Fourier transform of cos^2(pi t / 2) on |t| < 1, which is 1/2 at its removable singularity s = 1/2.
    singular = np.isclose(s, 0.5)
    safe = np.where(singular, 0.25, s)
    weight = np.where(singular, 0.5, np.sinc(2 * safe) / (1 - 4 * safe**2))
    spectrum = np.fft.fft(pitch_errors_m)[orders % teeth] * weight / teeth
    return PeriodicSeries(
        mean=float(np.mean(pitch_errors_m)),
        orders=orders,
        cosine=2 * spectrum.real,
        sine=-2 * spectrum.imag,
    )


def surface_series(rms_m: float, draws: NDArray[np.float64], highest_order: int) -> PeriodicSeries:
    """Random orders 1..highest with equal expected power and this expected rms."""
    scale = rms_m / np.sqrt(highest_order)
    return PeriodicSeries(
        mean=0.0,
        orders=np.arange(1, highest_order + 1),
        cosine=scale * draws[:highest_order],
        sine=scale * draws[highest_order:],
    )


def normal_draws(seed: int, stream: int, wheel: int, count: int) -> NDArray[np.float64]:
    """Standard normal numbers of a counter-based generator: a function of its arguments only."""
    sequence = np.random.SeedSequence([seed, stream, wheel])
    return np.random.Generator(np.random.Philox(sequence)).standard_normal(count)
