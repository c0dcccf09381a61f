"""Physical numbers in YAML, `{value: 0.8, unit: mm, source: "thesis 5.3.2"}` or `"0.8 mm"`, as SI floats.

A pydantic model declares a field as `Annotated[float, Si("m", gt=0)]`. Units are converted by pint;
a unit of the wrong dimension is an error. Machine descriptions must name the source of each number,
scenarios need not (`load_yaml(..., require_source=True)`).
"""

from __future__ import annotations

import copy
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from types import UnionType
from typing import Any, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, ValidationError, ValidationInfo
from pydantic_core import CoreSchema, ErrorDetails, core_schema
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from gearsim_io.errors import InputError
from gearsim_io.numbers import number, written
from gearsim_io.places import place_in
from gearsim_io.yaml_errors import syntax_error

ModelT = TypeVar("ModelT", bound=BaseModel)
_TEXT = re.compile(r"\s*([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*(\S.*?)?\s*$")
# Words that people write for revolutions; pint counts "rpm" in rad/s, which is right only for angular speed.
_TURNS = {"rpm": 1 / 60, "r/min": 1 / 60, "rev/min": 1 / 60, "rev/s": 1.0}


class Strict(BaseModel):
    """Base of all models read from YAML: frozen, unknown keys are errors, NaN is not a number."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, populate_by_name=True)


@dataclass(frozen=True)
class Si:
    """Marks a float field as a physical number kept in `unit`, with the bounds of its values in that unit.

    `unit` is pint's spelling ("N/m", "rad/s", "kg*m^2"); "" means dimensionless, where a bare number is
    accepted as value. `nan` allows `value: .nan` for "not known".
    """

    unit: str
    gt: float | None = None
    ge: float | None = None
    lt: float | None = None
    le: float | None = None
    nan: bool = False

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(self._validate)

    @property
    def expected(self) -> str:
        """The accepted values in words."""
        pairs = ((">", self.gt), (">=", self.ge), ("<", self.lt), ("<=", self.le))
        bounds = " and ".join(f"{sign} {number(bound)}" for sign, bound in pairs if bound is not None)
        what = f"a number in {self.unit}" if self.unit else "a number without unit"
        return f"{what}, {bounds}" if bounds else what

    def _validate(self, raw: Any, info: ValidationInfo) -> float:
        context: Mapping[str, Any] = info.context or {}
        value, unit = self._split(raw, bool(context.get("require_source")))
        number = self._convert(value, unit)
        if math.isnan(number) and self.nan:
            return number
        low = (self.gt is None or number > self.gt) and (self.ge is None or number >= self.ge)
        high = (self.lt is None or number < self.lt) and (self.le is None or number <= self.le)
        if not (math.isfinite(number) and low and high):
            raise ValueError(self.expected)
        return number

    def _split(self, raw: Any, require_source: bool) -> tuple[float, str]:
        if isinstance(raw, Mapping):
            unknown = set(raw) - {"value", "unit", "source"}
            if unknown or "value" not in raw:
                raise ValueError("the keys value, unit and source")
            if require_source and not str(raw.get("source", "")).strip():
                raise ValueError("a source beside value and unit")
            return self._number(raw["value"]), str(raw.get("unit", "")).strip()
        if require_source:
            raise ValueError(f"{{value, unit, source}} with {self.expected}")
        if isinstance(raw, str) and (match := _TEXT.match(raw)):
            return self._number(match[1]), match[2] or ""
        return self._number(raw), ""

    def _number(self, raw: Any) -> float:
        if isinstance(raw, bool) or not isinstance(raw, (int, float, str)):
            raise ValueError(self.expected)
        try:
            return float(raw)
        except ValueError:
            raise ValueError(self.expected) from None

    def _convert(self, value: float, unit: str) -> float:
        if unit in ("", "1") and self.unit == "":
            return value
        if unit in _TURNS and self.unit == "Hz":
            return value * _TURNS[unit]
        if not unit:
            raise ValueError(f"{self.expected} (the unit is missing)")
        import pint

        try:
            return float(_registry().Quantity(value, unit).to(self.unit or "dimensionless").magnitude)
        except (pint.PintError, AttributeError, TypeError, ValueError, AssertionError):
            raise ValueError(f"{self.expected} (not {unit})") from None


@cache
def _registry() -> Any:
    import pint  # here, because it takes a quarter of a second to load

    return pint.UnitRegistry()


def read_yaml(path: Path) -> Any:
    """The plain content of a YAML 1.2 file (so that 1.5e8 is a number); InputError if it cannot be read."""
    try:
        return copy.deepcopy(_parsed(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        raise InputError(str(path), "", "no such file", "a YAML file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(str(path), "", error, "a readable YAML file") from None
    except YAMLError as error:
        raise InputError(str(path), *syntax_error(error)) from None


@lru_cache(maxsize=32)
def _parsed(text: str) -> Any:
    """Content of a text; kept, because parsing a machine takes longer than simulating a tenth of a second."""
    return YAML(typ="safe", pure=True).load(text)


def validate(model: type[ModelT], content: Any, where: str, *, require_source: bool = False) -> ModelT:
    """`content` as `model`; the first thing wrong with it as InputError."""
    try:
        return model.model_validate(content, context={"require_source": require_source})
    except ValidationError as error:
        first = _first(error)
        loc, message = first["loc"], first["msg"].removeprefix("Value error, ")
        if first["type"] == "extra_forbidden":
            section = place_in(content, loc[:-1])
            raise InputError(where, section, str(loc[-1]), _known_keys(model, loc)) from None
        place = place_in(content, loc)
        if first["type"] == "missing":
            raise InputError(where, place, "nothing", "this key") from None
        if first["type"] in ("enum", "literal_error"):
            message = "one of " + first["ctx"]["expected"].replace("'", "").replace(" or ", ", ")
        raise InputError(
            where, place, _as_written(first["input"]), message.removeprefix("Input should be ")
        ) from None


def _first(error: ValidationError) -> ErrorDetails:
    """The first thing wrong; a key that is misspelt comes before the one that is missing for it."""
    errors = error.errors(include_url=False)
    return next((one for one in errors if one["type"] == "extra_forbidden"), errors[0])


def _as_written(value: Any) -> Any:
    """A number with its unit as people write it, anything else as it is."""
    if isinstance(value, Mapping) and "value" in value:
        unit = str(value.get("unit", ""))
        return f"{_plain(value['value'])} {'' if unit == '1' else unit}".strip()
    return value


def _plain(value: Any) -> Any:
    return written(value) if isinstance(value, float) else value


def load_yaml(model: type[ModelT], path: Path, *, require_source: bool = False) -> ModelT:
    """The YAML file at `path` as `model`; InputError names file, field, value and what was expected."""
    return validate(model, read_yaml(path), str(path), require_source=require_source)


def _known_keys(model: type[BaseModel], loc: tuple[int | str, ...]) -> str:
    section: Any = model
    for part in loc[:-1]:
        section = _inside(section, part)
    if not _is_model(section):
        return "a key of this section"
    return "one of the keys " + ", ".join(sorted(f.alias or name for name, f in section.model_fields.items()))


def _inside(section: Any, part: int | str) -> Any:
    """The type at one step of an error's path: a field of a model, or the content of a list or mapping."""
    if _is_model(section):
        fields = {f.alias or name: f for name, f in section.model_fields.items()}
        inner: Any = fields[str(part)].annotation if str(part) in fields else None
    else:
        inner = next((kind for kind in get_args(section)[::-1] if kind is not Ellipsis), None)
    if get_origin(inner) in (Union, UnionType):  # "or None"
        inner = next(kind for kind in get_args(inner) if kind is not type(None))
    return inner


def _is_model(section: Any) -> bool:
    return isinstance(section, type) and issubclass(section, BaseModel)
