"""Every parameter that a scenario or a machine description may have: unit, range, default, meaning.

Read from the pydantic models themselves, so that it cannot say anything else than what is checked.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
import typing
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from functools import cache
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from gearsim_io.quantities import Si


@dataclass(frozen=True)
class Parameter:
    """One row of the reference.

    Attributes
    ----------
    name : str
        Dotted, as in YAML; `<name>` stands for a key of one's own, `[]` for an entry of a list.
    unit, allowed, default, meaning : str
        Texts; empty where there is nothing to say.
    """

    name: str
    unit: str
    allowed: str
    default: str
    meaning: str


def parameters(model: type[BaseModel], prefix: str = "") -> Iterator[Parameter]:
    """All parameters of a model, nested ones with dots."""
    meanings = _meanings(model)
    for name, field in model.model_fields.items():
        key = f"{prefix}{field.alias or name}"
        inner, suffix = _nested(field.annotation)
        if inner is not None:
            yield from parameters(inner, f"{key}{suffix}.")
        else:
            yield _parameter(key, field, meanings.get(name, field.description or ""))


@cache
def _meanings(model: type[BaseModel]) -> dict[str, str]:
    """The texts that stand as strings below the fields of a model, those of its bases included."""
    found: dict[str, str] = {}
    for owner in reversed(model.__mro__):
        if not issubclass(owner, BaseModel) or owner is BaseModel:
            continue
        try:
            source = inspect.getsource(owner)
        except OSError:  # a model that the program put together; its fields may carry descriptions
            continue
        body = ast.parse(textwrap.dedent(source)).body[0]
        assert isinstance(body, ast.ClassDef)
        for field, text in zip(body.body, body.body[1:], strict=False):
            if not isinstance(field, ast.AnnAssign) or not isinstance(field.target, ast.Name):
                continue
            if isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant):
                found[field.target.id] = str(text.value.value)
    return found


def _parameter(key: str, field: FieldInfo, meaning: str) -> Parameter:
    si = si_of(field)
    return Parameter(
        name=key,
        unit="" if si is None else si.unit or "1",
        allowed=_allowed(field, si),
        default=_default(field),
        meaning=" ".join(meaning.split()),
    )


def si_of(field: FieldInfo) -> Si | None:
    """Unit and bounds of a field that is a physical number."""
    return next((mark for mark in _marks(field) if isinstance(mark, Si)), None)


def _marks(field: FieldInfo) -> list[Any]:
    """Annotations of the field, also those inside `X | None`."""
    marks = list(field.metadata)
    for part in get_args(field.annotation):
        if get_origin(part) is Annotated:
            marks += get_args(part)[1:]
    return marks


def _allowed(field: FieldInfo, si: Si | None) -> str:
    if si is not None:
        pairs = ((">", si.gt), (">=", si.ge), ("<", si.lt), ("<=", si.le))
        bounds = " and ".join(f"{sign} {bound:.6g}" for sign, bound in pairs if bound is not None)
        return bounds or "any number"
    bounds = " and ".join(
        f"{sign} {getattr(mark, name):g}"
        for mark in field.metadata
        for name, sign in (("gt", ">"), ("ge", ">="), ("lt", "<"), ("le", "<="))
        if hasattr(mark, name)
    )
    kind = field.annotation
    choices = [part for part in (kind, *get_args(kind)) if get_origin(part) is Literal]
    if choices:
        return ", ".join(str(choice) for choice in get_args(choices[0]))
    if inspect.isclass(kind) and issubclass(kind, Enum):
        return ", ".join(str(choice.value) for choice in kind)
    words = {bool: "true, false", int: "whole number", float: "number", str: "text"}
    known = [words[part] for part in (kind, *get_args(kind)) if part in words]
    return " ".join(part for part in (known[0] if known else "", bounds) if part)


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "required"
    value = field.default if field.default is not PydanticUndefined else None
    if value is None:
        return "" if field.default is PydanticUndefined else "none"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _nested(annotation: Any) -> tuple[type[BaseModel] | None, str]:
    """The model inside a field's type, and how its place is written."""
    origin = get_origin(annotation)
    if origin in (Union, UnionType):
        parts = [part for part in get_args(annotation) if part is not NoneType]
        return _nested(parts[0]) if len(parts) == 1 else (None, "")
    if origin is Annotated:
        return _nested(get_args(annotation)[0])
    if origin is dict:
        inner, suffix = _nested(get_args(annotation)[1])
        return inner, f".<name>{suffix}"
    if origin in (tuple, list):
        inner, suffix = _nested(get_args(annotation)[0])
        return inner, f"[]{suffix}"
    if inspect.isclass(annotation) and issubclass(annotation, BaseModel):
        return annotation, ""
    return None, ""


def table(rows: typing.Iterable[Parameter]) -> str:
    """Rows as a Markdown table."""
    lines = ["| parameter | unit | allowed | default | meaning |", "|---|---|---|---|---|"]
    for row in rows:
        cells = (f"`{row.name}`", row.unit, row.allowed, row.default, row.meaning)
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines)
