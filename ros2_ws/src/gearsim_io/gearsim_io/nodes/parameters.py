"""ROS parameters of a node from one frozen dataclass, the only home of their defaults."""

from __future__ import annotations

import dataclasses
from typing import Any, TypeVar

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node

from gearsim_io.errors import InputError

T = TypeVar("T")


def parameter(
    default: Any, help_text: str, low: float | None = None, high: float | None = None, *, live: bool = False
) -> Any:
    """A field of a parameter dataclass: default, what it is for, and the range it must lie in.

    A `live` parameter may be changed while the node runs; the node hears of it by a callback of its own.
    """
    return dataclasses.field(
        default=default, metadata={"help": help_text, "range": (low, high), "live": live}
    )


def declare_parameters(node: Node, cls: type[T]) -> T:
    """Declare every field of `cls` as a parameter, set at start and (but for live ones) not changed after.

    rclpy itself refuses wrong types and values out of range; what it raises is turned into one clear line.

    Returns
    -------
    The dataclass with the values in force.

    Raises
    ------
    InputError
        When a value was given whose type or range does not fit.
    """
    values: dict[str, Any] = {}
    for spec in dataclasses.fields(cls):  # type: ignore[arg-type]
        low, high = spec.metadata.get("range", (None, None))
        descriptor = ParameterDescriptor(description=spec.metadata.get("help", ""))
        descriptor.read_only = not spec.metadata.get("live", False)
        if isinstance(spec.default, float) and low is not None:
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=float(low), to_value=float(high))
            ]
        elif isinstance(spec.default, int) and not isinstance(spec.default, bool) and low is not None:
            descriptor.integer_range = [IntegerRange(from_value=int(low), to_value=int(high))]
        where = f"parameter of node {node.get_name()}"
        try:
            values[spec.name] = node.declare_parameter(spec.name, spec.default, descriptor).value
        except (InvalidParameterTypeException, InvalidParameterValueException) as error:
            given = node._parameter_overrides.get(spec.name)
            got = str(error) if given is None else repr(given.value)
            raise InputError(where, spec.name, got, _expected(spec.default, low, high)) from None
    return cls(**values)


def _expected(default: Any, low: float | None, high: float | None) -> str:
    kind = {bool: "true or false", float: "a number with a point, such as 2.0", int: "a whole number"}
    words = kind.get(type(default), "a text")
    return words if low is None else f"{words}, from {low:g} to {high:g}"
