"""Lines of a frequency converter: its carrier, its multiples, and groups spaced by the output frequency."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.special import jv

from gearsim_dsp.electrical import find_electrical_lines
from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_sensor
from gearsim_twin.causes.expected_lines import odds_of_lines
from gearsim_twin.causes.lines import LineSpectrum, MachineLines, line_spectrum, machine_lines
from gearsim_twin.causes.prior import LogNormal, Uniform

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context
    from gearsim_twin.view import View

__all__ = ["InverterLines", "Switching", "find_switching"]

Array = NDArray[np.float64]

_LOWEST_CARRIER_HZ = 900.0
_USUAL_CARRIER_HZ = 8000.0
_OUTPUT_HZ = (5.0, 130.0)  # what a converter gives its motor
_LINE = 18.0  # evidence of one line: e^-18 of noise, once in a thousand spectra of 1e5 lines
_FEWEST = 4  # lines of a pattern beside the carrier that are not the machine's, of eleven looked for
_MOST_PEAKS = 40
_STEP = 0.5  # lines: error of a line's place and of each multiple of carrier and output
_LARGEST_RATIO = 1.12  # 1 dB: no line of a group is higher than the carrier
_PAIR = 0.35  # natural logarithm: both lines of a pair pass the same stray capacitance
_MISFIT = 0.35  # of the heights, in the natural logarithm
_AMPLITUDE_ERROR = 0.05
_MODULATION_ERROR = 0.04  # heights within some per cent
_LEAST_SHARE = 1e-8  # of the lines in the signal's power
_MODULATIONS = np.linspace(0.05, 1.0, 96)
# (multiple of the carrier, multiple of the output), m + n odd: Holmes and Lipo (2003), chapter 3.
_PATTERN = (
    (1, 0),
    (1, -2),
    (1, 2),
    (2, -1),
    (2, 1),
    (2, -3),
    (2, 3),
    (3, 0),
    (3, -2),
    (3, 2),
    (1, -4),
    (1, 4),
)


@dataclass(frozen=True, slots=True)
class Switching:
    """What was found in a channel; `lines` are those of the pattern that show, in Hz.

    `output_hz` is 0 where only the carrier and its multiples show.
    """

    amplitude: float
    carrier_hz: float
    carrier_std_hz: float
    output_hz: float
    modulation: float
    lines_hz: tuple[float, ...]


def line_ratio(multiple: int, side: int, modulation: float) -> float:
    """Amplitude of a line over the carrier's own, of one leg coupled in by a stray capacitance."""
    argument = 0.5 * math.pi * multiple * modulation
    line, carrier = float(jv(abs(side), argument)), float(jv(0, 0.5 * math.pi * modulation))
    return abs(line) / max(abs(carrier), 1e-6)


def find_switching(
    samples: NDArray[np.floating], sample_rate_hz: float, known: MachineLines
) -> Switching | None:
    """Look for the lines of a converter.

    Parameters
    ----------
    samples : ndarray, shape (n,)
    sample_rate_hz : float
    known : MachineLines
        Lines at these places are not the converter's.

    Returns
    -------
    Switching or None
        None where no pattern shows: a carrier with four lines of its groups at least, or a carrier that
        stands alone with its double (`gearsim_dsp.electrical`).
    """
    spectrum = line_spectrum(samples, sample_rate_hz)
    if spectrum is None:
        return None
    lines = _Lines.of(spectrum, known, 0.47 * sample_rate_hz)
    fits = [
        fit
        for carrier in lines.carriers()
        for output in lines.outputs(carrier)
        if (fit := _fitted(carrier, output, lines)) is not None
    ]
    found = max(fits, key=lambda fit: fit.score).switching if fits else None
    alone = _alone(samples, sample_rate_hz, known, spectrum)
    if alone is not None and (found is None or _elsewhere(alone, found, spectrum.step_hz)):
        found = alone
    power = 0.5 * found.amplitude**2 if found else 0.0
    return found if power > _LEAST_SHARE * float(np.var(samples, dtype=np.float64)) else None


@dataclass(frozen=True, slots=True, eq=False)
class _Lines:
    """The narrow lines of a spectrum by ascending frequency; `free` are those that are not the machine's."""

    spectrum: LineSpectrum
    place_hz: Array
    evidence: Array
    free: NDArray[np.bool_]
    top_hz: float

    @classmethod
    def of(cls, spectrum: LineSpectrum, known: MachineLines, top_hz: float) -> _Lines:
        places, evidence = spectrum.peaks(_LINE, _LOWEST_CARRIER_HZ)
        order = np.argsort(places)
        places, evidence = places[order], evidence[order]
        inside = places < top_hz
        places, evidence = places[inside], evidence[inside]
        free = np.array([not known.explain(float(f), spectrum.step_hz, False) for f in places], dtype=bool)
        return cls(spectrum, places, evidence, free, top_hz)

    def near(self, place_hz: float, reach_hz: float) -> int:
        """Index of the line nearest to a place, -1 if there is none within reach."""
        at = int(np.searchsorted(self.place_hz, place_hz))
        near = [k for k in (at - 1, at) if 0 <= k < self.place_hz.size]
        best = min(near, key=lambda k: abs(self.place_hz[k] - place_hz), default=-1)
        return best if best >= 0 and abs(self.place_hz[best] - place_hz) <= reach_hz else -1

    def clearest(self) -> Array:
        """Places of the free lines with most evidence."""
        free = np.flatnonzero(self.free)
        return self.place_hz[free[np.argsort(-self.evidence[free], kind="stable")[:_MOST_PEAKS]]]

    def carriers(self) -> list[float]:
        """Free lines, and lines of the machine amid two of them, as a line of it may cover the carrier."""
        clear = self.clearest()
        trials = {float(f) for f in clear}
        for k, one in enumerate(clear):
            for other in clear[k + 1 :]:
                if 4 * _OUTPUT_HZ[0] < abs(one - other) < 4 * _OUTPUT_HZ[1]:
                    at = self.near(0.5 * (one + other), self.spectrum.step_hz)
                    if at >= 0:
                        trials.add(float(self.place_hz[at]))
        return sorted(trials)

    def outputs(self, carrier_hz: float) -> list[float]:
        """Output frequencies that the distances to free lines allow; trials within a line tell the same."""
        clear, step = self.clearest(), self.spectrum.step_hz
        double = np.abs(clear - 2 * carrier_hz)
        trials = np.concatenate([np.abs(clear - carrier_hz) / 2, double, double / 3])
        inside = trials[(trials >= max(_OUTPUT_HZ[0], 3 * step)) & (trials <= _OUTPUT_HZ[1])]
        return [float(v) for v in np.unique(np.round(inside / (0.25 * step))) * (0.25 * step)]


@dataclass(frozen=True, slots=True)
class _Fit:
    score: float
    switching: Switching


def _fitted(carrier_hz: float, output_hz: float, lines: _Lines) -> _Fit | None:
    """The pattern at a carrier and an output, if heights and places are those of a converter."""
    seen = {}
    for m, n in _PATTERN:
        reach = (1 + m + abs(n)) * 0.5 * _STEP * lines.spectrum.step_hz
        if (at := lines.near(m * carrier_hz + n * output_hz, reach)) >= 0:
            seen[m, n] = at
    own = [place for place, at in seen.items() if lines.free[at]]
    if (1, 0) not in seen or len([place for place in own if place != (1, 0)]) < _FEWEST:
        return None
    height = {place: lines.spectrum.height(float(lines.place_hz[seen[place]])) for place in seen}
    ratio = {place: height[place] / height[1, 0] for place in own}
    pairs = [abs(math.log(ratio[m, n] / ratio[m, -n])) for m, n in own if n > 0 and (m, -n) in ratio]
    if not pairs or max(pairs) > _PAIR or max(ratio.values()) > _LARGEST_RATIO:
        return None
    modulation, misfit = _modulation(ratio, lines, seen, carrier_hz, output_hz, height[1, 0])
    if misfit > _MISFIT:
        return None
    table = np.array([(m, n, lines.place_hz[at]) for (m, n), at in seen.items() if (m, n) in own])
    weight = lines.evidence[[seen[place] for place in own]] ** 0.5
    rows = table[:, :2] * weight[:, None]
    frequencies = np.linalg.lstsq(rows, table[:, 2] * weight, rcond=None)[0]
    std = 0.5 * lines.spectrum.step_hz * float(np.linalg.pinv(rows.T @ rows)[0, 0]) ** 0.5
    places = tuple(float(place) for place in table[:, 2])
    found = Switching(height[1, 0], float(frequencies[0]), std, float(frequencies[1]), modulation, places)
    return _Fit(float(np.sum(weight)), found)


def _modulation(
    ratio: dict[tuple[int, int], float],
    lines: _Lines,
    seen: dict[tuple[int, int], int],
    carrier_hz: float,
    output_hz: float,
    carrier: float,
) -> tuple[float, float]:
    """The index whose heights fit best, and the root mean square misfit of their logarithms.

    A line that should show and does not counts as the distance to what would show there.
    """
    spectrum = lines.spectrum
    unseen = {}
    for m, n in _PATTERN:
        place = m * carrier_hz + n * output_hz
        if (m, n) not in seen and _LOWEST_CARRIER_HZ < place < lines.top_hz:
            line = round(place / spectrum.step_hz)
            floor = spectrum.amplitude[line] / max(spectrum.evidence[line], 1.0) ** 0.5
            unseen[m, n] = 1.5 * floor * _LINE**0.5 / carrier
    best = (0.0, math.inf)
    for index in _MODULATIONS:
        off = [math.log(ratio[p] / max(line_ratio(*p, index), 1e-4)) for p in ratio if p != (1, 0)]
        off += [max(math.log(max(line_ratio(*p, index), 1e-4) / unseen[p]), 0.0) for p in unseen]
        misfit = math.sqrt(sum(value**2 for value in off) / len(ratio))
        if misfit < best[1]:
            best = (float(index), misfit)
    return best


def _elsewhere(alone: Switching, pattern: Switching, step_hz: float) -> bool:
    """Whether a carrier that stands alone is the higher one, and no line of the pattern."""
    apart = min(abs(line - alone.carrier_hz) for line in pattern.lines_hz)
    return apart > 2 * step_hz and alone.amplitude > pattern.amplitude


def _alone(
    samples: NDArray[np.floating], sample_rate_hz: float, known: MachineLines, spectrum: LineSpectrum
) -> Switching | None:
    """A carrier whose groups do not show beside it."""
    # Where lines of a shaft lie too dense to tell, they are no reason against a carrier.
    reach = known.error * _USUAL_CARRIER_HZ
    telling = [f for f in known.fundamentals_hz if reach < 0.25 * f]
    found = find_electrical_lines(
        np.asarray(samples, dtype=np.float64), sample_rate_hz, 0.0, telling, known.error
    )
    if not found.carriers_hz:
        return None
    carrier = max(found.carriers_hz, key=spectrum.height)
    z = float(spectrum.at(np.array([carrier]))[0])
    std = 0.5 * spectrum.step_hz / max(z, 1.0) ** 0.5
    return Switching(spectrum.height(carrier), carrier, std, 0.0, 0.05, found.carriers_hz)


class InverterLines:
    """Lines of a frequency converter coupled into the measuring chain."""

    name = "inverter_lines"
    superposes = True
    proven = True  # its finder has a false alarm rate of its own
    parameters: tuple[Parameter, ...] = (
        Parameter("amplitude_m_s2", "m/s^2", LogNormal(0.1, 6.0, 1e-6, 1e4)),
        Parameter("carrier_hz", "Hz", LogNormal(4000.0, 2.0, 900.0, 20000.0)),
        Parameter("modulation", "1", Uniform(0.02, 1.0)),
    )
    confused_with: tuple[tuple[str, str], ...] = (
        ("mains_interference", "the frequencies themselves: hum is at multiples of 50 or 60 Hz"),
        ("missing_gear_stage", "a record at another speed: gear lines move, a carrier does not"),
    )

    def applies(self, context: Context) -> bool:
        """Where the records reach beyond the lowest carriers."""
        return any(view.record.sample_rate_hz > 2.2 * _LOWEST_CARRIER_HZ for view in context.views)

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """The pattern of the clearest channel; the other channels by their shares of it."""
        best: Switching | None = None
        shares: dict[str, float] = {}
        for view, model in zip(context.views, context.simulated_views, strict=True):
            found = _in_view(view)
            known = _in_view(model) if found else {}
            found = {n: one for n, one in found.items() if n not in known or not _same(one, known[n])}
            if not found:
                continue
            top = max(found, key=lambda name: found[name].amplitude)
            if best is None or found[top].carrier_std_hz < best.carrier_std_hz:
                best = found[top]
                shares = {name: one.amplitude / best.amplitude for name, one in found.items()}
        if best is None:
            return []
        start: dict[str, float | str] = {
            "amplitude_m_s2": best.amplitude,
            "std:amplitude_m_s2": _AMPLITUDE_ERROR * best.amplitude,
            "carrier_hz": best.carrier_hz,
            "std:carrier_hz": best.carrier_std_hz,
            "modulation": best.modulation,
            "std:modulation": _MODULATION_ERROR,
            "output_hz": best.output_hz,
        }
        return [start | {f"share:{name}": share for name, share in shares.items()}]

    def seen_again(self, values: Values, heldout: Context) -> float:
        """Log odds of those lines in other records; 0 where only a carrier without its groups was read."""
        carrier, output = float(values["carrier_hz"]), float(values["output_hz"])
        amplitude, modulation = float(values["amplitude_m_s2"]), float(values["modulation"])
        total = 0.0
        for view in heldout.views if output > 0.0 else ():
            known, rate = machine_lines(view), view.record.sample_rate_hz
            lines = []
            for name in view.record.channels:
                share = float(values.get(f"share:{name}", 0.0))
                samples = view.signal(name)
                spectrum = line_spectrum(samples, rate) if share > 0.0 else None
                if spectrum is None:
                    continue
                for m, n in _PATTERN:
                    at = m * carrier + n * output
                    if _LOWEST_CARRIER_HZ < at < 0.47 * rate and not known.explain(
                        at, spectrum.step_hz, False
                    ):
                        height = amplitude * share * line_ratio(m, n, modulation)
                        lines.append((height, *spectrum.sine(samples, at)))
            total += odds_of_lines(lines)
        return total

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """The content with the converter's lines on the channels that show them."""
        output = float(values["output_hz"])
        for key, share in values.items():
            if key.startswith("share:"):
                inverter = {
                    "amplitude": f"{float(values['amplitude_m_s2']) * float(share):.9g} m/s^2",
                    "carrier": f"{float(values['carrier_hz']):.9g} Hz",
                    "output": f"{output if output > 0 else 50.0:.9g} Hz",
                    "modulation": float(values["modulation"]),
                }
                content = with_sensor(content, key.removeprefix("share:"), "inverter", inverter)
        return content

    def signature(self, values: Values) -> str:
        """In plain words."""
        output = float(values["output_hz"])
        sides = f" with groups {output:.1f} Hz apart around its multiples" if output > 0 else ""
        return (
            f"a carrier at {float(values['carrier_hz']):.1f} Hz{sides} that does not move with the speed: a "
            f"frequency converter, {float(values['amplitude_m_s2']):.3g} m/s^2"
        )


def _same(one: Switching, other: Switching) -> bool:
    """Whether the model has that already."""
    return abs(one.carrier_hz - other.carrier_hz) < 1.0 and one.amplitude < 2 * other.amplitude


def _in_view(view: View) -> dict[str, Switching]:
    """What is found by channel; only those that agree with the clearest."""
    known, rate = machine_lines(view), view.record.sample_rate_hz
    found = {}
    for name in view.record.channels:
        one = find_switching(view.signal(name), rate, known)
        if one is not None:
            found[name] = one
    if not found:
        return {}
    clearest = min(found.values(), key=lambda one: (-len(one.lines_hz), one.carrier_std_hz))
    reach = 2.0 / view.record.seconds
    return {name: one for name, one in found.items() if abs(one.carrier_hz - clearest.carrier_hz) < reach}
