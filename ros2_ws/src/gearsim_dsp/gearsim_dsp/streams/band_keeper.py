"""The kurtogram's band of every channel of a stream, renewed in turn and changed only for a reason."""

from __future__ import annotations

from gearsim_dsp.band_choice import choose_band
from gearsim_dsp.bands import Band, plan_bands
from gearsim_dsp.quality import check_samples
from gearsim_dsp.streams.assembler import Window
from gearsim_io.nameplate import Machine

__all__ = ["BandKeeper"]

_SAME_OVERLAP = 0.5


class BandKeeper:
    """Chooses a band for one channel every few windows, so that the cost is spread.

    Which channel's turn it is follows from the window's place in the stream. A channel keeps its band until
    the kurtogram names one that overlaps it by less than half: averages over windows need one band.

    Parameters
    ----------
    machine : Machine
        Says how wide a band must be to hold the fault lines.
    every : int
        Windows from one choice to the next; 0: never choose.
    hop : float
        Distance of two windows in seconds.
    """

    def __init__(self, machine: Machine, every: int, hop_s: float) -> None:
        self._machine = machine
        self._every = every
        self._hop_s = hop_s
        self._bands: dict[str, Band] = {}

    def reset(self) -> None:
        """Forget all bands: the stream began again."""
        self._bands.clear()

    def band(self, channel: str) -> Band | None:
        """The band of a channel, None until the kurtogram found one."""
        return self._bands.get(channel)

    def renew(self, window: Window, speed_hz: float) -> None:
        """Choose anew for the channel whose turn it is in this window, if it is one's turn."""
        if self._every == 0:
            return
        number = round(window.first_sample / max(round(self._hop_s * window.sample_rate_hz), 1))
        if number % self._every:
            return
        row = (number // self._every) % len(window.channels)
        samples, channel = window.data[row], window.channels[row]
        if any(issue.fatal for issue in check_samples(samples, channel)):
            return
        plan, _ = plan_bands(window.sample_count, window.sample_rate_hz, speed_hz, self._machine)
        if plan is None or samples.size < 1024:
            return
        choice = choose_band(samples, window.sample_rate_hz, plan.least_width_hz).band
        held = self._bands.get(channel)
        if choice is not None and (held is None or _overlap(held, choice) < _SAME_OVERLAP):
            self._bands[channel] = choice


def _overlap(one: Band, other: Band) -> float:
    """Common part over the narrower band."""
    common = min(one.high_hz, other.high_hz) - max(one.low_hz, other.low_hz)
    return max(common, 0.0) / min(one.high_hz - one.low_hz, other.high_hz - other.low_hz)
