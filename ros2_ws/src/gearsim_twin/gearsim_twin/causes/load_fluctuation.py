"""A load that swings at random: all lines of the teeth grow and shrink together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_section
from gearsim_twin.causes.mesh_orders import mesh_orders
from gearsim_twin.causes.prior import LogNormal

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context
    from gearsim_twin.view import View

__all__ = ["LoadFluctuation", "Surge", "surge_of"]

Array = NDArray[np.float64]

_HARMONICS = 4
_FEWEST_TURNS = 8
_LEAST = 0.01
_SIGMAS = 3.0
_QUICK_HZ = 20.0
# Of mesh lines to the load, relative: deflections of teeth grow with it, their errors do not.
_SENSITIVITY = 0.5


@dataclass(frozen=True, slots=True)
class Surge:
    """Common swing of the mesh lines: rms over mean, its standard deviation, and its bandwidth."""

    relative: float
    relative_std: float
    bandwidth_hz: float


def surge_of(view: View) -> Surge | None:
    """What all mesh lines of all channels swing by together; None without gears, angle or enough turns.

    Notes
    -----
    Amplitudes are taken turn by turn of the slowest shaft, so that what repeats with a turn (runout, errors
    of teeth) is the same in each. Noise differs from line to line: the mean covariance of different lines is
    the common part's variance without bias.
    """
    rows = _amplitudes(view)
    if rows is None:
        return None
    amplitude, turn_s = rows
    mean = amplitude.mean(axis=1)
    swing = amplitude / mean[:, None] - 1
    steady = np.std(swing, axis=1) < 0.5  # lines that noise alone makes swing by half their height
    swing = swing[steady]
    if swing.shape[0] < 2:
        return None
    count = swing.shape[1]
    covariance = swing @ swing.T / count
    off = ~np.eye(swing.shape[0], dtype=bool)
    common = float(np.median(covariance[off]))
    spread = float(np.median(np.diag(covariance))) / (count * max(swing.shape[0] - 1, 1)) ** 0.5
    shared = np.median(swing, axis=0)
    lag = float(np.sum(shared[1:] * shared[:-1]) / max(np.sum(shared**2), 1e-300))
    # Power alike up to B gives neighbours the correlation sinc(2 B turn).
    trial = np.linspace(0.02, 0.5, 97)
    bandwidth = float(trial[int(np.argmin(np.abs(np.sinc(2 * trial) - np.clip(lag, 0.0, 1.0))))]) / turn_s
    rms = max(common, 0.0) ** 0.5
    return Surge(rms, 0.5 * spread / max(rms, spread**0.5), bandwidth)


def _amplitudes(view: View) -> tuple[Array, float] | None:
    """Amplitudes of mesh lines, (lines, turns), and the time of a turn."""
    slowest = min((abs(s.ratio) for s in view.machine.shafts if s.ratio), default=0.0)
    orders = sorted(mesh_orders(view.machine).values())
    if view.phase is None or not orders or slowest == 0:
        return None
    turns = int(view.turns * slowest)
    top = _HARMONICS * max(orders)
    if turns < _FEWEST_TURNS or top > 0.4 * view.record.sample_rate_hz / view.speed_hz:
        return None
    per_turn = int(np.ceil(3 * top))
    wanted = [order * k / slowest for order in orders for k in range(1, _HARMONICS + 1)]
    lines = [round(one) for one in wanted if abs(one - round(one)) < 1e-6 * one]
    rows = []
    for channel in view.record.channels:
        signal = view.angle(channel, per_turn)
        assert signal is not None
        length = int(per_turn / slowest)
        count = signal.values.size // length
        block = np.asarray(signal.values[: count * length], dtype=np.float64).reshape(count, length)
        spectrum = np.abs(np.fft.rfft(block, axis=1)) * 2 / length
        rows += [spectrum[:, line] for line in lines if line < spectrum.shape[1]]
    kept = [row for row in rows if row.mean() > 0]
    seconds = 1.0 / (slowest * view.speed_hz)
    return (np.stack(kept), seconds) if kept and kept[0].size >= _FEWEST_TURNS else None


class LoadFluctuation:
    """Random swings of the load about its mean."""

    name = "load_fluctuation"
    parameters: tuple[Parameter, ...] = (
        Parameter("rms_nm", "N*m", LogNormal(3.0, 5.0, 1e-3, 1e4)),
        Parameter("bandwidth_hz", "Hz", LogNormal(3.0, 4.0, 0.05, 200.0)),
    )
    confused_with: tuple[tuple[str, str], ...] = (
        (
            "speed_fluctuation",
            "a torque transducer, or a tacho: the load swings the speed less than the teeth",
        ),
        ("unit_or_gain_error", "a record of another load: a gain is the same at all loads"),
    )

    def applies(self, context: Context) -> bool:
        """Where the model has gears that carry a load."""
        return context.case.modelled.kind in ("parallel_shaft", "planetary") and self._load(context) > 0

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """From a torque transducer if there is one, else from what all mesh lines do together."""
        measured = [found for view in context.views if (found := _torque(view)) is not None]
        models = [found for view in context.simulated_views if (found := _torque(view)) is not None]
        if measured and measured[0][0] > 1.5 * (models[0][0] if models else 0.0):
            rms, bandwidth = measured[0]
            return [{"rms_nm": rms, "bandwidth_hz": bandwidth}]
        load, best = self._load(context), None
        for view, model in zip(context.views, context.simulated_views, strict=True):
            surge, own = surge_of(view), surge_of(model)
            if surge is None:
                continue
            beside = own.relative if own is not None else 0.0
            excess = max(surge.relative**2 - beside**2, 0.0) ** 0.5
            if excess > max(_LEAST, 0.5 * beside, _SIGMAS * surge.relative_std) and (
                best is None or excess > best[0]
            ):
                best = (excess, surge)
        if best is None:
            return []
        guess = {"rms_nm": best[0] * load / _SENSITIVITY}
        slow: dict[str, float | str] = {
            **guess,
            "bandwidth_hz": float(np.clip(best[1].bandwidth_hz, 0.05, 200)),
        }
        quick: dict[str, float | str] = {**guess, "bandwidth_hz": _QUICK_HZ}
        return [slow, quick]

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """The content with a random load."""
        noise = {
            "rms": f"{float(values['rms_nm']):.9g} N*m",
            "low": "0 Hz",
            "high": f"{float(values['bandwidth_hz']):.9g} Hz",
        }
        return with_section(content, "profile.load_noise", noise)

    def signature(self, values: Values) -> str:
        """In plain words."""
        return (
            "all lines of the teeth grow and shrink together: the load swings by "
            f"{float(values['rms_nm']):.2g} N m (rms) at up to {float(values['bandwidth_hz']):.2g} Hz"
        )

    @staticmethod
    def _load(context: Context) -> float:
        loads = [view.load_nm for view in context.views if view.load_nm is not None]
        return float(np.mean(loads)) if loads else context.case.modelled.load_nm


def _torque(view: View) -> tuple[float, float] | None:
    """Rms and bandwidth of the slow part of a measured torque."""
    torques = view.record.torques
    if torques is None or torques.data_nm.shape[0] == 0:
        return None
    length = max(1, int(view.record.sample_rate_hz / max(view.speed_hz, 1.0)))
    row = np.asarray(torques.data_nm[-1], dtype=np.float64)
    count = row.size // length
    if count < _FEWEST_TURNS:
        return None
    slow = row[: count * length].reshape(count, length).mean(axis=1)
    slow = slow - slow.mean()
    power = np.abs(np.fft.rfft(slow)) ** 2
    share = np.cumsum(power) / max(float(power.sum()), 1e-300)
    frequency = np.fft.rfftfreq(count, length / view.record.sample_rate_hz)
    return float(np.std(slow)), float(np.clip(frequency[int(np.searchsorted(share, 0.9))], 0.05, 200.0))
