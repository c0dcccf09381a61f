"""A resonance of the casing that the model lacks: lines and noise around one frequency are lifted."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from gearsim_io.machines import read_machine_file
from gearsim_io.quantities import Si
from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_entry
from gearsim_twin.causes.prior import LogNormal
from gearsim_twin.causes.spectra_beside import Beside, CurveFit, by_channel, fit_change, peaks_hz

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

__all__ = ["CasingResonance", "absorber_db"]

Array = NDArray[np.float64]

_LEAST_DROP = 15.0
_LEAST_SHARE = 0.08
_LEAST_PEAK_DB = 4.0
_SAME = 0.1
_MOST_STARTS = 4
# A light mass that swings in step with a resonance which the model has takes of its height (Den Hartog, 3.3):
# usual ones weigh a tenth of what they hang on and are damped by some per cent.
_LEAST_DIP_DB, _LIGHT, _LIGHTLY = 5.0, 0.1, 0.05
_FINE = 48  # bands in an octave
_MASS = TypeAdapter(Annotated[float, Si("kg", gt=0)])
_LOCAL_MASS_KG = 5.0  # where a model does not tell: pedestals and casings are of that size


def absorber_db(frequency_hz: Array, own_hz: float, ratio: float, damping: float) -> Array:
    """Change of a site's motion by a mass hung on it, in dB.

    Above its own lowest resonance a site answers as a mass M. With m = ratio M on a spring of frequency
    `own_hz` it stands still there, and both swing at own_hz sqrt(1 + ratio) (Den Hartog, *Mechanical
    Vibrations*, 3.2).
    """
    s = 1j * frequency_hz / own_hz
    top = 1 + 2 * damping * s + s**2
    bottom = (1 + ratio) * (1 + 2 * damping * s) + s**2
    return np.asarray(20 * np.log10(np.abs(top / bottom) * (1 + ratio)))


def _resonance(data: Beside, sample_rate_hz: float) -> CurveFit | None:
    """Own frequency, mass ratio and damping of a mass that makes the peak."""
    f = data.frequency_hz

    def change(p: Array) -> Array:
        return absorber_db(f, 10 ** p[0], 10 ** p[1], 10 ** p[2])

    low, high = float(np.log10(f[3])), float(np.log10(0.42 * sample_rate_hz))
    places = np.clip(np.log10(peaks_hz(data)), low, high)
    # The peak lies above the frequency of the mass alone by the root of 1 + ratio.
    starts = [(at - 0.5 * np.log10(1 + 10**ratio), ratio, -1.5) for at in places for ratio in (-1.3, -0.4)]
    fit = fit_change(data, change, starts, ((low, -2.5, -3.0), (high, 1.0, -0.3)))
    own, ratio, damping = 10**fit.values
    peak = float(absorber_db(f, own, ratio, damping).max())
    if fit.drop < _LEAST_DROP or fit.share < _LEAST_SHARE or peak < _LEAST_PEAK_DB:
        return None
    values = np.array([own, ratio, damping])
    return CurveFit(values, 2.3026 * np.minimum(fit.std, 2.0) * values, fit.gain_db, fit.drop, fit.share)


def _dip(data: Beside, sample_rate_hz: float) -> CurveFit | None:  # noqa: ARG001
    """Frequency, ratio and damping of a mass that takes away a resonance of the model."""
    under = -data.ratio_db
    under = np.convolve(under - float(np.median(under)), [0.25, 0.5, 0.25], mode="same")[1:-1]
    k = int(np.argmax(under)) + 1
    if under[k - 1] < _LEAST_DIP_DB:
        return None
    values = np.array([data.frequency_hz[k], _LIGHT, _LIGHTLY])
    depth = float(under[k - 1])
    return CurveFit(values, values, 0.0, (depth / float(data.std_db[k])) ** 2, 1.0)


def _clearest(context: Context, noisy: bool) -> list[tuple[str, CurveFit]]:
    """Sites and resonances, the clearest first."""
    # A light mass moves a site within a few per cent of one frequency, a heavy one over an octave.
    coarse = by_channel(context, _resonance, noisy=noisy)
    fine = by_channel(context, _resonance, per_octave=_FINE, noisy=noisy)
    trials = [(fit.drop, name, fit) for name, fit in coarse.items()]
    # Four times the bands, half of them alike: twice the drop for the same.
    trials += [(0.5 * fit.drop, name, fit) for name, fit in fine.items()]
    return [(name, fit) for _, name, fit in sorted(trials, key=lambda trial: -trial[0])]


def _near(one: CurveFit, other: CurveFit) -> bool:
    """Whether two fits tell of one resonance."""
    return abs(float(one.values[0] / other.values[0]) - 1) < _SAME


class CasingResonance:
    """A mass that swings on one measuring site."""

    name = "casing_resonance"
    scales = True
    size = "mass_kg"  # goes to nothing with it
    parameters: tuple[Parameter, ...] = (
        Parameter("frequency_hz", "Hz", LogNormal(2000.0, 2.5, 20.0, 20000.0)),
        Parameter("damping_ratio", "1", LogNormal(0.03, 2.5, 1e-3, 0.5)),
        Parameter("mass_kg", "kg", LogNormal(1.0, 4.0, 1e-3, 1000.0)),
    )
    confused_with: tuple[tuple[str, str], ...] = (
        (
            "sensor_resonance",
            "the sensor moved or screwed on: a casing's resonance stays, and sensors beside see it",
        ),
        ("transfer_path", "a tap test at both sites: a path is seen from one at the other"),
    )

    def applies(self, context: Context) -> bool:
        """Wherever there are accelerometers."""
        return bool(context.views)

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """On the sites at which the peak is clearest."""
        kept: list[tuple[str, CurveFit]] = []
        # Beside the sensors' noise first: without it all that lies between the lines is lifted.
        for noisy in (True, False) if context.noisy_views else (False,):
            for name, fit in _clearest(context, noisy):
                if not any(name == site and _near(fit, other) for site, other in kept):
                    kept.append((name, fit))
        dips = by_channel(context, _dip, noisy=True) if context.noisy_views else {}
        kept = [*sorted(dips.items(), key=lambda one: -one[1].drop)[:1], *kept]
        return [
            {
                "frequency_hz": float(fit.values[0]),
                "damping_ratio": float(np.clip(fit.values[2], 1e-3, 0.5)),
                "mass_kg": float(fit.values[1]) * local_mass_kg(context, name),
                "component": name,
            }
            for name, fit in kept[:_MOST_STARTS]
        ]

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """The content with one more resonance in its structure."""
        entry = {
            "site": str(values["component"]),
            "mass": f"{float(values['mass_kg']):.9g} kg",
            "frequency": f"{float(values['frequency_hz']):.9g} Hz",
            "damping_ratio": float(values["damping_ratio"]),
        }
        return with_entry(content, "structure.resonances", entry)

    def signature(self, values: Values) -> str:
        """In plain words."""
        return (
            f"lines and noise around {float(values['frequency_hz']):.0f} Hz are lifted at "
            f"{values['component']}: a resonance of the structure, damped "
            f"{100 * float(values['damping_ratio']):.1f} %"
        )


def local_mass_kg(context: Context, site: str) -> float:
    """What a site weighs: the mass of that name in the machine's model, or of its pedestals."""
    section = read_machine_file(context.case.machine_path)[1].get("model", {})
    for part in (site, "pedestal"):
        told = section.get(part, {})
        mass = told.get("mass") if isinstance(told, dict) else None
        if isinstance(mass, dict):
            return float(_MASS.validate_python(mass))
    return _LOCAL_MASS_KG
