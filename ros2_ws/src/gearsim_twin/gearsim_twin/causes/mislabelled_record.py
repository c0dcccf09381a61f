"""A record that is not what its label says: of another speed, another machine, or with another tacho."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_io.machines import load_machine, machine_names, read_machine_file
from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.mesh_orders import at_order, mesh_orders, order_amplitudes
from gearsim_twin.causes.prior import LogNormal
from gearsim_twin.causes.shaft_speed_offset import CLEAR, LARGEST, model_speed_hz, stretch_between
from gearsim_twin.modelled import describe

if TYPE_CHECKING:
    from gearsim_io.nameplate import Machine
    from gearsim_twin.causes.context import Context
    from gearsim_twin.view import View

__all__ = ["MislabelledRecord", "Other", "another_machine"]

Array = NDArray[np.float64]

_FAR = 0.7  # natural logarithm of a factor of two in speed
_SIMPLE = (2.0, 3.0, 4.0, 1 / 2, 1 / 3, 1 / 4)
_SIMPLE_ERROR = 0.03  # tolerance of speeds on nameplates
_RATIO_ERROR = 2e-3
_TOP_ORDER = 420.0
_SIDE = (-5, -4, -3, -2, 2, 3, 4, 5)
_CLEARER_DB = 10.0
_MISSING_DB = -14.0  # of the machine's own mesh lines against the model's
_MODELS = {"parallel_shaft": "lpm34", "planetary": "planetary18", "bearing_rig": "bearing5"}


@dataclass(frozen=True, slots=True)
class Other:
    """A machine that fits better, and by how much its mesh lines stand out more than those expected."""

    machine: str
    order: float
    gain_db: float


def another_machine(view: View, model: View) -> Other | None:
    """A shipped machine whose tooth meshes show where those of the described one do not.

    Parameters
    ----------
    view, model : View
        Measured and simulated, both with an angle.

    Returns
    -------
    Other or None
        None unless the expected mesh lines are lacking (14 dB below the model's) and another's stand out.
    """
    spectra = [found for c in view.record.channels if (found := order_amplitudes(view, c, _TOP_ORDER))]
    beside = [found for c in model.record.channels if (found := order_amplitudes(model, c, _TOP_ORDER))]
    own = _clearness(spectra, view.machine)
    expected = _clearness(beside, view.machine)
    if not spectra or own is None or expected is None or own - expected > _MISSING_DB:
        return None
    best: Other | None = None
    for name in machine_names():
        machine = load_machine(name)
        if name == view.machine.name or not mesh_orders(machine):
            continue
        clear = _clearness(spectra, machine)
        if clear is not None and clear - own > _CLEARER_DB and (best is None or clear - own > best.gain_db):
            best = Other(name, max(mesh_orders(machine).values()), clear - own)
    return best


def _clearness(spectra: list[tuple[Array, float]], machine: Machine) -> float | None:
    """Mean height of a machine's mesh lines over orders beside them, in dB; of the clearest channel."""
    orders = [order * k for order in mesh_orders(machine).values() for k in (1, 2, 3)]
    heights = []
    for spectrum, step in spectra:
        rows = []
        for order in orders:
            sides = [at_order(spectrum, step, order + k + 0.5) for k in _SIDE]
            at = at_order(spectrum, step, order)
            if at > 0 and min(sides) > 0:
                rows.append(20 * math.log10(at / float(np.median(sides))))
        if rows:
            heights.append(float(np.mean(rows)))
    return max(heights, default=None)


class MislabelledRecord:
    """Another speed, another machine, another number of pulses in a turn."""

    name = "mislabelled_record"
    parameters: tuple[Parameter, ...] = (Parameter("speed_ratio", "1", LogNormal(1.0, 2.0, 1e-3, 1e3)),)
    confused_with: tuple[tuple[str, str], ...] = (
        ("shaft_speed_offset", "a look at the machine's tacho while it runs"),
        ("missing_gear_stage", "the teeth counted on the machine itself"),
    )

    def applies(self, context: Context) -> bool:
        """Wherever there are records."""
        return bool(context.views)

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """What contradicts the label: the angle signal, the speed stated, or the teeth that mesh."""
        starts: list[dict[str, float | str]] = []
        sure = {"std:speed_ratio": _RATIO_ERROR}
        for view, model in zip(context.views, context.simulated_views, strict=True):
            nominal, speed = view.machine.nominal_speed_hz, view.speed_hz
            contradicted = any(issue.issue == "angle_contradicted" for issue in view.issues)
            known = math.isfinite(nominal) and math.isfinite(speed) and view.source != "nameplate"
            if contradicted and view.record.tachos:
                ratio = speed / _counted_hz(view)
                starts.append({"speed_ratio": ratio, "component": "tacho", "speed_hz": speed, **sure})
            elif known and (simple := _simple(view, speed / nominal)):
                # Nothing in the vibration decides: other pulses in a turn are likelier than such a speed.
                true_hz = speed / simple
                starts.append({"speed_ratio": 1 / simple, "speed_hz": true_hz, "component": "tacho", **sure})
            elif known and abs(speed / nominal - 1) > LARGEST:
                ratio = speed / nominal
                starts.append({"speed_ratio": ratio, "component": "speed", "speed_hz": speed, **sure})
            elif view.source in ("estimated", "nameplate"):
                found = stretch_between(view, model, _FAR)
                if found is not None and found.clear >= CLEAR and abs(found.ratio - 1) > LARGEST:
                    true_hz = model_speed_hz(context, view) * found.ratio
                    ratio = true_hz / (nominal if math.isfinite(nominal) else speed)
                    starts.append({"speed_ratio": ratio, "component": "speed", "speed_hz": true_hz, **sure})
            if view.phase is not None and model.phase is not None:
                other = another_machine(view, model)
                if other is not None:
                    starts.append({"speed_ratio": 1.0, "component": other.machine, "speed_hz": speed, **sure})
        # The clearest contradiction of each kind.
        kinds = {str(start["component"]): start for start in reversed(starts)}
        return list(kinds.values())[:4]

    def extend(self, content: Content, values: Values, context: Context) -> Content:
        """The content at the true speed, or of the machine that fits, seen at its sites one by one."""
        speed = {"value": float(f"{float(values['speed_hz']):.12g}"), "unit": "Hz"}
        changed = copy.deepcopy(content)
        component = str(values["component"])
        if component in ("tacho", "speed"):
            if "columns" not in changed.get("profile", {}).get("trace", {}):
                changed.setdefault("operating_point", {})["speed"] = speed
            return changed
        section = read_machine_file(component)[1].get("model", {})
        model = _MODELS.get(str(section.get("kind")))
        if model is None:
            return changed
        other = describe(component, model)
        channels = context.views[0].record.channels
        sites = {name: {"site": other.sites[k % len(other.sites)]} for k, name in enumerate(channels)}
        load = {"value": other.load_nm, "unit": "N*m"}
        shaft = [load_machine(component).reference_shaft]
        kept: Content = {
            key: changed[key] for key in ("description", "seed", "sample_rate") if key in changed
        }
        return {
            **kept,
            "machine": component,
            "model": model,
            "operating_point": {"speed": speed, "load": load},
            "sensors": {
                "accelerometers": {"chain": "ideal", "channels": list(channels), "each": sites},
                "tachos": {"shafts": [one for one in shaft if one in other.tacho_shafts]},
                "encoders": {"shafts": []},
            },
        }

    def signature(self, values: Values) -> str:
        """In plain words."""
        component, speed = str(values["component"]), float(values["speed_hz"])
        if component == "tacho":
            return (
                f"the lines fit {speed:.4g} Hz, {float(values['speed_ratio']):.4g} times what the tacho "
                "gives: another number of pulses in a turn, or another shaft"
            )
        if component == "speed":
            return (
                f"the machine ran at {speed:.4g} Hz, {float(values['speed_ratio']):.4g} times the speed "
                "stated: the record is of another run"
            )
        return f"the tooth meshes are those of {component}: the record is of another machine"


def _simple(view: View, ratio: float) -> float:
    """The whole number (or one over it) that a doubtful angle signal is off by; 0 if it is none."""
    if not any(issue.issue == "angle_doubtful" for issue in view.issues):
        return 0.0
    fits = [simple for simple in _SIMPLE if abs(ratio / simple - 1) < _SIMPLE_ERROR]
    return fits[0] if fits else 0.0


def _counted_hz(view: View) -> float:
    """What the tacho gives as it stands."""
    try:
        train = next(t for t in view.record.tachos if t.samples.size > 1)
        ratio = abs(view.machine.shaft(train.shaft).ratio)
    except (StopIteration, KeyError) as error:
        raise InputError("record", "tachos", "none with two pulses", "one of a listed shaft") from error
    seconds = float(train.samples[-1] - train.samples[0]) / view.record.sample_rate_hz
    return (train.samples.size - 1) / (train.pulses_per_revolution * ratio * seconds)
