"""The lattice filter that gives the residuals of all lengths of linear prediction in one pass."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearsim_dsp.compiled import compiled

__all__ = ["lattice_moments"]

# Three vectors of this many samples stay in the first cache while all stages pass over them.
_BLOCK = 1024


def lattice_moments(
    x: NDArray[np.float64], reflection: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sums of the squares and of the fourth powers of the residual after each stage.

    With f and b the errors of forward and of backward prediction,

        f_m[n] = f_m-1[n] - k_m b_m-1[n-1],      b_m[n] = b_m-1[n-1] - k_m f_m-1[n]

    (Itakura and Saito; Makhoul, Proc. IEEE 63 (1975) 561-580). The samples before the number of stages, whose
    past is not complete, are left out.

    Returns
    -------
    second, fourth : ndarray of float64, shape (stages,)
    """
    second, fourth = np.zeros(reflection.size), np.zeros(reflection.size)
    _passed(np.ascontiguousarray(x), reflection, np.zeros((3, _BLOCK)), second, fourth)
    return second, fourth


@compiled
def _passed(
    x: NDArray[np.float64],
    reflection: NDArray[np.float64],
    work: NDArray[np.float64],
    second: NDArray[np.float64],
    fourth: NDArray[np.float64],
) -> None:
    stages = reflection.size
    block = work.shape[1]
    held = np.zeros(stages)  # last backward error of the block before, for each stage
    f = work[0]
    for start in range(0, x.size, block):
        size = min(block, x.size - start)
        first = min(max(stages - start, 0), size)
        now, then = work[1], work[2]
        for i in range(size):
            f[i] = now[i] = x[start + i]
        for m in range(stages):
            k = reflection[m]
            before = held[m]
            held[m] = now[size - 1]
            then[0] = before - k * f[0]
            f[0] -= k * before
            for i in range(1, size):
                forward = f[i]
                then[i] = now[i - 1] - k * forward
                f[i] = forward - k * now[i - 1]
            two = 0.0
            four = 0.0
            for i in range(first, size):
                square = f[i] * f[i]
                two += square
                four += square * square
            second[m] += two
            fourth[m] += four
            now, then = then, now
