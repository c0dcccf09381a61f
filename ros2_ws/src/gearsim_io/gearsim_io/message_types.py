"""The two families of message classes: rclpy's, and the pure ones of the `rosbags` library."""

from __future__ import annotations

import array
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

from numpy.typing import NDArray

from gearsim_io import definitions

_PACKAGES = {"Header": "std_msgs", "Time": "builtin_interfaces", "Clock": "rosgraph_msgs"}
_DTYPES = {"float": "f", "double": "d", "float32": "f", "float64": "d"}
_NANOSECONDS = 1_000_000_000
_SEQUENCE = re.compile(r"sequence<(.*)>")


@dataclass(frozen=True, slots=True)
class FieldType:
    """Type of one field: `base` is "float", "int", "bool", "string" or a message's short name."""

    base: str
    is_array: bool
    typecode: str = ""


class Types:
    """A family of message classes: rclpy's or rosbags'.

    Parameters
    ----------
    family : str
        For error messages.
    load : callable
        Gives the class of a full type name.
    describe : callable
        Gives the fields of a class by name.
    pack : callable
        Turns a numpy array into what an array field wants.
    """

    def __init__(
        self,
        family: str,
        load: Callable[[str], Any],
        describe: Callable[[str, Any], dict[str, FieldType]],
        pack: Callable[[NDArray[Any]], Any],
    ) -> None:
        self.family = family
        self._load = load
        self._describe = describe
        self.pack = pack
        self._classes: dict[str, Any] = {}
        self._fields: dict[str, dict[str, FieldType]] = {}

    def __getattr__(self, short: str) -> Any:
        """The class of that short name, such as `types.SampleBatch` or `types.Header`."""
        if short.startswith("_"):
            raise AttributeError(short)
        return self.cls(short)

    def cls(self, short: str) -> Any:
        """The class of that short name."""
        if short not in self._classes:
            self._classes[short] = self._load(full_name(short))
        return self._classes[short]

    def fields(self, short: str) -> dict[str, FieldType]:
        """The fields of the class of that short name."""
        if short not in self._fields:
            self._fields[short] = self._describe(full_name(short), self.cls(short))
        return self._fields[short]

    def header(self, t_ns: int, frame_id: str) -> Any:
        """A std_msgs/Header."""
        seconds, rest = divmod(int(t_ns), _NANOSECONDS)
        return self.Header(stamp=self.Time(sec=seconds, nanosec=rest), frame_id=frame_id)


def full_name(short: str) -> str:
    """`SampleBatch` as `gearsim_msgs/msg/SampleBatch`, `Header` as `std_msgs/msg/Header`."""
    return f"{_PACKAGES.get(short, definitions.PACKAGE)}/msg/{short}"


@cache
def ros_types() -> Types:
    """The classes of rclpy; needs ROS and the built gearsim_msgs."""
    from gearsim_io.qos import message_class

    return Types("rclpy", message_class, lambda _, cls: _ros_fields(cls), _pack_array)


@cache
def pure_types() -> Types:
    """The classes of the `rosbags` library; needs no ROS."""
    store = definitions.typestore()
    return Types("rosbags", lambda name: store.types[name], lambda name, _: _pure_fields(name), lambda a: a)


def _pack_array(values: NDArray[Any]) -> array.array[Any]:
    packed: array.array[Any] = array.array(values.dtype.char)
    packed.frombytes(values.tobytes())
    return packed


def _ros_fields(cls: Any) -> dict[str, FieldType]:
    found: dict[str, FieldType] = {}
    for name, text in cls.get_fields_and_field_types().items():
        match = _SEQUENCE.fullmatch(text)
        found[name] = _field_type(match[1] if match else text, is_array=match is not None)
    return found


def _pure_fields(full: str) -> dict[str, FieldType]:
    from rosbags.interfaces import Nodetype

    found: dict[str, FieldType] = {}
    for name, (kind, detail) in definitions.typestore().fielddefs[full][1]:
        is_array = kind in (Nodetype.SEQUENCE, Nodetype.ARRAY)
        inner: Any = detail[0] if is_array else (kind, detail)
        text = inner[1][0] if inner[0] == Nodetype.BASE else inner[1]
        found[name] = _field_type(text, is_array=is_array)
    return found


def _field_type(text: str, *, is_array: bool) -> FieldType:
    if text in _DTYPES:
        return FieldType("float", is_array, _DTYPES[text] if is_array else "")
    if text in ("boolean", "bool"):
        return FieldType("bool", is_array)
    if text == "string":
        return FieldType("string", is_array)
    if re.fullmatch(r"u?int\d+", text):
        return FieldType("int", is_array)
    return FieldType(text.rsplit("/", 1)[-1], is_array)
