"""A transfer path that the model lacks: what one site does is seen at another, by a structure between."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearsim_twin.causes.casing_resonance import local_mass_kg
from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_entry, with_parameter
from gearsim_twin.causes.prior import LogNormal
from gearsim_twin.causes.spectra_beside import Beside, CurveFit, beside, fit_curve

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

__all__ = ["TransferPath"]

Array = NDArray[np.float64]

_LEAST_DROP = 30.0
_LEAST_SHARE = 0.3
_LEAST_BANDS = 4
_OVER_DB = 2.0
_OWN_DB = 3.0
_FLOOR_DB = -60.0  # of a path's gain: nothing weaker is looked for
_CASING = "casing"


def path_db(frequency_hz: Array, gain_db: float, own_hz: float, damping: float) -> Array:
    """Motion at the far end over that at the near one, of a mass between two sites, in dB.

    A spring of m w^2 / 4 joins the sites below its frequency; the far site answers as a mass M. `gain_db` is
    that of m / (4 M).
    """
    ratio = frequency_hz / own_hz
    shape = (1 - ratio**2) ** 2 + (2 * damping * ratio) ** 2
    # Below the path's own frequency a spring's force on a mass: falls as 1 / f^2 times the resonance.
    return np.asarray(gain_db - 10 * np.log10(shape) - 20 * np.log10(ratio**2 + 1e-3))


def _path(near: Beside, data: Beside) -> CurveFit | None:
    """Gain, frequency and damping, if adding what comes from the near site mends the far one."""
    f, near_db = data.frequency_hz, near.measured_db

    def predicted(p: Array) -> Array:
        added = near_db + path_db(f, p[0], 10 ** p[1], 10 ** p[2])
        return np.asarray(10 * np.log10(10 ** (data.simulated_db / 10) + 10 ** (added / 10)))

    low, high = float(np.log10(f[0])), float(np.log10(0.7 * f[-1]))
    starts = [(gain, at, -1.3) for gain in (-30.0, -10.0) for at in np.linspace(low + 0.2, high - 0.2, 4)]
    fit = fit_curve(data, predicted, starts, ((_FLOOR_DB, low, -2.0), (20.0, high, -0.3)), gain=False)
    added = near_db + path_db(f, fit.values[0], 10 ** fit.values[1], 10 ** fit.values[2])
    lifted = added > data.simulated_db - _OVER_DB
    if np.count_nonzero(lifted) < _LEAST_BANDS or fit.drop < _LEAST_DROP or fit.share < _LEAST_SHARE:
        return None
    # What lifts the near site as well is no path between the two.
    own = float(np.median((data.ratio_db - near.ratio_db)[lifted]))
    return fit if own > _OWN_DB else None


class TransferPath:
    """A mass between two measuring sites, or the casing that joins them."""

    name = "transfer_path"
    scales = True
    parameters: tuple[Parameter, ...] = (
        Parameter("mass_kg", "kg", LogNormal(1.0, 4.0, 1e-3, 1000.0)),
        Parameter("frequency_hz", "Hz", LogNormal(800.0, 3.0, 10.0, 20000.0)),
        Parameter("damping_ratio", "1", LogNormal(0.05, 2.0, 1e-3, 0.5)),
    )
    confused_with: tuple[tuple[str, str], ...] = (
        ("casing_resonance", "a tap test at both sites: a path is seen from one at the other"),
        ("unit_or_gain_error", "one sensor moved from site to site: a sensor's own gain goes with it"),
        ("coloured_floor", "the record of a machine at rest: what comes by a path stops with it"),
    )

    def applies(self, context: Context) -> bool:
        """Where the model has two sites at least."""
        return len(context.case.modelled.sites) > 1

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """The pairs of sites between which a path mends the far one most."""
        found: list[tuple[float, str, str, CurveFit]] = []
        for view, model in zip(context.views, context.simulated_views, strict=True):
            spectra = {c: beside(view, model, c) for c in view.record.channels}
            known = {name: data for name, data in spectra.items() if data is not None}
            for far, data in known.items():
                if _in_need(data):
                    found += [
                        (fit.drop, near, far, fit)
                        for near in _nearest(known, far)
                        if (fit := _path(known[near], data)) is not None
                    ]
        found.sort(key=lambda one: -one[0])
        starts: list[dict[str, float | str]] = []
        for _, near, far, fit in found:
            if any({near, far} == {start["component"], start["to"]} for start in starts):
                continue
            gain = 10 ** (fit.values[0] / 20)
            start: dict[str, float | str] = {
                "mass_kg": float(np.clip(4 * gain * local_mass_kg(context, far), 1e-3, 1000.0)),
                "frequency_hz": float(10 ** fit.values[1]),
                "damping_ratio": float(np.clip(10 ** fit.values[2], 1e-3, 0.5)),
            }
            starts.append(start | {"component": near, "to": far})
        return starts[: 3 if _has_casing(context) else 4] + (
            [_casing_start()] if _has_casing(context) and found else []
        )

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """The content with a path, or with the casing of a planetary stage."""
        if values["component"] == _CASING:
            content = with_parameter(content, "casing.included", 1.0, "1")
            content = with_parameter(content, "casing.mass", float(values["mass_kg"]), "kg")
            stiffness = float(values["mass_kg"]) * (2 * np.pi * float(values["frequency_hz"])) ** 2
            content = with_parameter(content, "casing.stiffness", stiffness, "N/m")
            damping = 2 * float(values["damping_ratio"]) * (stiffness * float(values["mass_kg"])) ** 0.5
            return with_parameter(content, "casing.damping", damping, "N*s/m")
        entry = {
            "from": str(values["component"]),
            "to": str(values["to"]),
            "mass": f"{float(values['mass_kg']):.9g} kg",
            "frequency": f"{float(values['frequency_hz']):.9g} Hz",
            "damping_ratio": float(values["damping_ratio"]),
        }
        return with_entry(content, "structure.paths", entry)

    def signature(self, values: Values) -> str:
        """In plain words."""
        if values["component"] == _CASING:
            return (
                "what the sun and the ring do is seen at each other's sensors: they are joined by the casing"
            )
        return (
            f"{values['to']} shows what {values['component']} does, most around "
            f"{float(values['frequency_hz']):.0f} Hz: the structure between them passes it on"
        )


def _in_need(data: Beside) -> bool:
    """Whether a channel shows more than expected in some bands."""
    return int(np.count_nonzero(data.ratio_db > 1.5 * data.std_db)) >= _LEAST_BANDS


def _nearest(known: dict[str, Beside], far: str) -> list[str]:
    """The other sites that could give it: loudest first, three at most."""
    levels = {name: float(np.median(data.measured_db)) for name, data in known.items() if name != far}
    same = [n for n in levels if known[n].frequency_hz.size == known[far].frequency_hz.size]
    return sorted(same, key=lambda name: -levels[name])[:3]


def _has_casing(context: Context) -> bool:
    """Whether the model has a casing that is left out."""
    told = context.contents[0].get("parameters", {}).get("casing.included", {"value": 0.0})
    included = float(told["value"]) if isinstance(told, dict) else float(told)
    return context.case.modelled.kind == "planetary" and included == 0.0


def _casing_start() -> dict[str, float | str]:
    """The casing as the description of the planetary rig assumes it."""
    return {"mass_kg": 20.0, "frequency_hz": 356.0, "damping_ratio": 0.05, "component": _CASING}
