"""Ensembles in YAML: a base scenario, and what differs from variant to variant.

Every mistake in the file is an InputError that names the file, the key, what was found and what is expected.
"""

from __future__ import annotations

import dataclasses
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from gearsim_io.errors import InputError
from gearsim_io.quantities import Si, Strict, read_yaml, validate
from gearsim_sim.ensemble import Ensemble, Variant
from gearsim_sim.models import parameters
from gearsim_sim.operation import Operation
from gearsim_sim.params.overrides import split_quantity
from gearsim_sim.scenario import FaultModel, Load, Scenario, Speed, load_scenario, scenario_file

MOST_VARIANTS = 100_000
Severity = Annotated[float, Si("", ge=0, le=2)]


class SpeedRange(Strict):
    """Speeds of the reference shaft."""

    low: Annotated[Speed, Field(alias="from")]
    high: Annotated[Speed, Field(alias="to")]


class LoadRange(Strict):
    """Load torques."""

    low: Annotated[Load, Field(alias="from")]
    high: Annotated[Load, Field(alias="to")]


class SeverityRange(Strict):
    """Severities of a fault of the base scenario."""

    low: Annotated[Severity, Field(alias="from")]
    high: Annotated[Severity, Field(alias="to")]


class ParameterRange(Strict):
    """Values of a parameter of the model, with the same unit at both ends."""

    low: Annotated[Any, Field(alias="from")]
    high: Annotated[Any, Field(alias="to")]


class RandomModel(Strict):
    """What is drawn for each variant, evenly between both ends."""

    speed: SpeedRange | None = None
    load: LoadRange | None = None
    severity: dict[str, SeverityRange] = Field(default_factory=dict)
    parameters: dict[str, ParameterRange] = Field(default_factory=dict)


class VariantModel(Strict):
    """A variant given by hand; what is left out is as in the base scenario."""

    name: str = ""
    seed: Annotated[int, Field(ge=0, lt=2**63)] | None = None
    speed: Speed | None = None
    load: Load | None = None
    parameters: dict[str, Any] = Field(default_factory=dict)
    faults: tuple[FaultModel, ...] | None = None


class EnsembleModel(Strict):
    """The file: `variants` by hand, or `count` of them with `random` ranges, or both one after the other."""

    description: str = ""
    base: str
    seed: Annotated[int, Field(ge=0, lt=2**62)] = 1
    count: Annotated[int, Field(ge=0, le=MOST_VARIANTS)] = 0
    random: RandomModel = RandomModel()
    variants: tuple[VariantModel, ...] = ()


@dataclass(frozen=True)
class NamedVariant:
    """A variant as a scenario of its own, and what was chosen for it (for tables)."""

    name: str
    scenario: Scenario
    chosen: Mapping[str, float | str]


@dataclass(frozen=True)
class EnsembleSpec:
    """A checked file; build one by `load_ensemble_spec`."""

    name: str
    base: Scenario
    variants: tuple[NamedVariant, ...]

    def ensemble(self, workers: int = 1) -> Ensemble:
        """The ensemble, with the events of the base scenario asked for in every variant."""
        scenarios = [one.scenario for one in self.variants]
        built = [
            Variant(parameters(one), one.seed, one.faults, one.speed_hz, one.load_nm) for one in scenarios
        ]
        ensemble = Ensemble(built, self.base.sample_rate_hz, self.base.oversampling, workers=workers)
        for number in range(len(scenarios)):
            for event in self.base.events:
                ensemble.schedule(number, event)
        return ensemble


def load_ensemble_spec(path: str | Path) -> EnsembleSpec:
    """The ensemble that a YAML file describes.

    Raises
    ------
    InputError
        Naming file, key, what was found and what is expected.
    """
    path = Path(path)
    where = str(path)
    content = read_yaml(path)
    if not isinstance(content, dict):
        raise InputError(where, "", content, "a mapping with base, and count or variants")
    model = validate(EnsembleModel, content, where)
    beside = path.parent / model.base
    base = load_scenario(beside if beside.is_file() else scenario_file(model.base))
    if not (model.count or model.variants):
        raise InputError(where, "count", 0, "a count of random variants, or variants by hand")
    plain = Operation()
    if (base.operation.profile, base.operation.structure) != (plain.profile, plain.structure):
        expected = "a scenario without profile and structure, which need simulate"
        raise InputError(where, "base", model.base, expected)
    _check(base, model, where)
    variants = [_drawn(base, model, number, where) for number in range(model.count)]
    variants += [_given(base, one, model.count + k, model.seed) for k, one in enumerate(model.variants)]
    names = [one.name for one in variants]
    for name in names:
        if names.count(name) > 1:
            raise InputError(where, "variants.name", name, "a name of its own for each variant")
    return EnsembleSpec(path.stem, base, tuple(variants))


def _check(base: Scenario, model: EnsembleModel, where: str) -> None:
    """Ranges are the right way round and name what there is."""
    random = model.random
    ranges: dict[str, SpeedRange | LoadRange | SeverityRange | None] = {
        "speed": random.speed,
        "load": random.load,
    }
    ranges |= {f"severity.{name}": one for name, one in random.severity.items()}
    for name, one in ranges.items():
        if one is not None and one.low > one.high:
            raise InputError(where, f"random.{name}", f"{one.low} to {one.high}", "from below to")
    known = [fault.name for fault in base.faults]
    for name in random.severity:
        if name not in known:
            expected = "the id of a fault of the base scenario: " + (", ".join(known) or "it has none")
            raise InputError(where, f"random.severity.{name}", name, expected)


def _fraction(seed: int, number: int, name: str) -> float:
    """An even random number in [0, 1), a function of its arguments only."""
    sequence = np.random.SeedSequence([seed, number, zlib.crc32(name.encode())])
    return float(np.random.Generator(np.random.Philox(sequence)).random())


def _drawn(base: Scenario, model: EnsembleModel, number: int, where: str) -> NamedVariant:
    """Variant `number` of the random ones."""
    random = model.random

    def between(name: str, low: float, high: float) -> float:
        return low + (high - low) * _fraction(model.seed, number, name)

    changes: dict[str, Any] = {"seed": model.seed + number}
    if random.speed is not None:
        changes["speed_hz"] = between("speed", random.speed.low, random.speed.high)
    if random.load is not None:
        changes["load_nm"] = between("load", random.load.low, random.load.high)
    chosen = _numbers(changes)
    severity = {name: between(f"severity {name}", one.low, one.high) for name, one in random.severity.items()}
    changes["faults"] = tuple(
        dataclasses.replace(fault, severity=severity.get(fault.name, fault.severity)) for fault in base.faults
    )
    chosen |= {f"severity.{name}": value for name, value in severity.items()}
    own = {}
    for name, one in random.parameters.items():
        low, high, unit = _ends(one, f"{where}: random.parameters", name)
        value = between(name, low, high)
        own[name] = {"value": value, "unit": unit}
        chosen[f"{name} [{unit}]" if unit else name] = value
    changes["parameters"] = {**base.parameters, **own}
    width = len(str(model.count - 1))
    return NamedVariant(f"v{number:0{width}d}", dataclasses.replace(base, **changes), chosen)


def _ends(one: ParameterRange, where: str, name: str) -> tuple[float, float, str]:
    """Both ends of a range and their unit."""
    try:
        (low, unit), (high, other) = split_quantity(one.low), split_quantity(one.high)
    except ValueError:
        unit, other, low, high = "", "?", 0.0, 0.0
    if unit != other or not low <= high:
        expected = "numbers from and to in the same unit, from below to"
        raise InputError(where, name, f"{one.low} to {one.high}", expected)
    return low, high, unit


def _given(base: Scenario, model: VariantModel, number: int, seed: int) -> NamedVariant:
    """A variant given by hand."""
    changes: dict[str, Any] = {"seed": seed + number if model.seed is None else model.seed}
    if model.speed is not None:
        changes["speed_hz"] = model.speed
    if model.load is not None:
        changes["load_nm"] = model.load
    if model.faults is not None:
        changes["faults"] = tuple(fault.spec() for fault in model.faults)
    changes["parameters"] = {**base.parameters, **model.parameters}
    chosen = _numbers(changes)
    chosen |= {name: str(value) for name, value in model.parameters.items()}
    return NamedVariant(model.name or f"variant_{number}", dataclasses.replace(base, **changes), chosen)


def _numbers(changes: Mapping[str, Any]) -> dict[str, float | str]:
    """Seed and operating point, as far as they were chosen."""
    return {key: changes[key] for key in ("seed", "speed_hz", "load_nm") if key in changes}


def table(variants: Sequence[NamedVariant]) -> str:
    """What was chosen for each variant, as CSV."""
    columns = list(dict.fromkeys(name for one in variants for name in one.chosen))
    lines = [",".join(["name", *columns])]
    lines += [",".join([one.name, *(f"{one.chosen.get(name, '')}" for name in columns)]) for one in variants]
    return "\n".join(lines) + "\n"
