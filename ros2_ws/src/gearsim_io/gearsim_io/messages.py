"""Between the plain classes of the rig and ROS messages, both ways and fast.

Works with rclpy's message classes (`ros_types()`) and with those of the pure `rosbags` library
(`pure_types()`, no ROS needed). The batches are converted by hand, as they carry the load;
all others by a rule: a field of a message is the attribute of the same name, or of that name with its
unit appended (`speed` is `speed_hz`), or the entry in `_OTHER_NAMES`.
"""

from __future__ import annotations

import array
import dataclasses
import json
import math
from collections.abc import Callable, Mapping
from typing import Any, TypeVar, get_args, get_origin, get_type_hints, overload

import numpy as np

from gearsim_io import nameplate
from gearsim_io.batches import EncoderBatch, SampleBatch, TachoBatch, TorqueBatch
from gearsim_io.errors import InputError
from gearsim_io.message_types import FieldType, Types, full_name, pure_types, ros_types

__all__ = ["Types", "from_msg", "full_name", "message_name", "pure_types", "ros_types", "stamp_ns", "to_msg"]

T = TypeVar("T")

_UNITS = ("_hz", "_m", "_rad", "_db", "_nm", "_s", "_ns")
_PLAIN_NAMES = {
    "Machine": "MachineInfo",
    "Shaft": "ShaftInfo",
    "GearMesh": "GearMeshInfo",
    "PlanetaryStage": "PlanetaryStageInfo",
    "Bearing": "BearingInfo",
    "Channel": "ChannelInfo",
}
_OTHER_NAMES = {("MachineInfo", "machine"): "name"}
_NANOSECONDS = 1_000_000_000


def to_msg(obj: Any, types: Types, t_ns: int | None = None) -> Any:
    """`obj` as a message.

    Parameters
    ----------
    obj : a batch, Machine or any dataclass that mirrors a message by name
    types : Types
        Which family of classes to use.
    t_ns : int, optional
        Stamp of the header where `obj` has none of its own (a machine's nameplate).

    Raises
    ------
    InputError
        If `obj` lacks what the message needs.
    """
    if isinstance(obj, (SampleBatch, TorqueBatch)):
        return types.SampleBatch(
            header=types.header(obj.t0_ns, obj.frame_id),
            sample_rate=float(obj.sample_rate_hz),
            first_sample=int(obj.first_sample),
            samples_per_channel=obj.sample_count,
            channel_names=list(obj.channels),
            unit=obj.unit,
            data=types.pack(obj.data.ravel()),
        )
    if isinstance(obj, TachoBatch):
        return types.TachoBatch(
            header=types.header(obj.t0_ns, obj.frame_id),
            sample_rate=float(obj.sample_rate_hz),
            first_sample=int(obj.first_sample),
            sample_count=int(obj.sample_count),
            shaft=obj.shaft,
            pulses_per_revolution=float(obj.pulses_per_revolution),
            first_pulse=int(obj.first_pulse),
            pulse_offsets=types.pack(obj.pulse_offsets),
        )
    if isinstance(obj, EncoderBatch):
        return types.EncoderBatch(
            header=types.header(obj.t0_ns, obj.frame_id),
            sample_rate=float(obj.sample_rate_hz),
            first_sample=int(obj.first_sample),
            sample_count=int(obj.sample_count),
            shaft=obj.shaft,
            lines_per_revolution=int(obj.lines_per_revolution),
            first_edge=int(obj.first_edge),
            edge_offsets=types.pack(obj.edge_offsets),
        )
    return _mirror(obj, message_name(obj), types, t_ns)


def message_name(obj: Any) -> str:
    """Short name of the message that a plain object becomes."""
    name = type(obj).__name__
    return _PLAIN_NAMES.get(name, name)


@overload
def from_msg(msg: Any) -> Any: ...
@overload
def from_msg(msg: Any, cls: type[T]) -> T: ...
def from_msg(msg: Any, cls: type[Any] | None = None) -> Any:
    """A message as the plain object it mirrors; the arrays share the message's memory.

    Parameters
    ----------
    msg : message of rclpy or rosbags
    cls : type, optional
        Dataclass to fill, for messages whose plain class lives in another package
        (such as `gearsim_dsp.results.Alarm`). Batches and MachineInfo need none.

    Raises
    ------
    InputError
        If the message contradicts itself, or has no plain class here.
    """
    short = type(msg).__name__.rsplit("__", 1)[-1]
    if cls is None:
        reader = _READERS.get(short)
        if reader is None:
            raise InputError("message", "type", short, "one of " + ", ".join(_READERS))
        return reader(msg)
    return _unmirror(msg, short, cls)


def stamp_ns(msg: Any) -> int:
    """The header's stamp in nanoseconds."""
    stamp = msg.header.stamp
    return int(stamp.sec) * _NANOSECONDS + int(stamp.nanosec)


def _read_samples(msg: Any) -> SampleBatch:
    data = np.frombuffer(msg.data, dtype=np.float32)
    channels = len(msg.channel_names)
    count = int(msg.samples_per_channel)
    if channels * count != data.size:
        expected = f"{channels} channels x {count} samples"
        raise InputError("SampleBatch", "data", f"{data.size} values", expected)
    return SampleBatch(
        t0_ns=stamp_ns(msg),
        sample_rate_hz=msg.sample_rate,
        first_sample=msg.first_sample,
        channels=tuple(msg.channel_names),
        unit=msg.unit,
        data=data.reshape(channels, count),
        frame_id=msg.header.frame_id,
    )


def _read_tacho(msg: Any) -> TachoBatch:
    return TachoBatch(
        t0_ns=stamp_ns(msg),
        sample_rate_hz=msg.sample_rate,
        first_sample=msg.first_sample,
        sample_count=msg.sample_count,
        shaft=msg.shaft,
        pulses_per_revolution=msg.pulses_per_revolution,
        first_pulse=msg.first_pulse,
        pulse_offsets=np.frombuffer(msg.pulse_offsets, dtype=np.float64),
        frame_id=msg.header.frame_id,
    )


def _read_encoder(msg: Any) -> EncoderBatch:
    return EncoderBatch(
        t0_ns=stamp_ns(msg),
        sample_rate_hz=msg.sample_rate,
        first_sample=msg.first_sample,
        sample_count=msg.sample_count,
        shaft=msg.shaft,
        lines_per_revolution=msg.lines_per_revolution,
        first_edge=msg.first_edge,
        edge_offsets=np.frombuffer(msg.edge_offsets, dtype=np.float64),
        frame_id=msg.header.frame_id,
    )


def _read_machine(msg: Any) -> nameplate.Machine:
    machine: nameplate.Machine = _unmirror(msg, "MachineInfo", nameplate.Machine)
    known = {shaft.name for shaft in machine.shafts}
    if machine.reference_shaft not in known:
        expected = "one of the shafts " + ", ".join(sorted(known))
        raise InputError("MachineInfo", "reference_shaft", machine.reference_shaft, expected)
    return machine


_READERS: dict[str, Callable[[Any], Any]] = {
    "SampleBatch": _read_samples,
    "TachoBatch": _read_tacho,
    "EncoderBatch": _read_encoder,
    "MachineInfo": _read_machine,
}


def _mirror(obj: Any, short: str, types: Types, t_ns: int | None) -> Any:
    """Any object as the message of that name, field by field."""
    fields: dict[str, Any] = {}
    for name, kind in types.fields(short).items():
        if name == "header":
            fields[name] = types.header(_stamp_of(obj, t_ns), str(_frame_of(obj)))
            continue
        attribute = _attribute(type(obj), short, name)
        if not attribute:
            raise InputError(type(obj).__name__, name, "nothing", f"an attribute for this field of {short}")
        value = getattr(obj, attribute)
        fields[name] = _to_field(value, kind, types, t_ns)
    return types.cls(short)(**fields)


def _to_field(value: Any, kind: FieldType, types: Types, t_ns: int | None) -> Any:
    if kind.is_array and kind.typecode:
        return types.pack(np.ascontiguousarray(value, dtype=kind.typecode))
    if kind.is_array:
        inner = FieldType(kind.base, is_array=False)
        return [_to_field(item, inner, types, t_ns) for item in value]
    if kind.base == "string":
        return json.dumps(dict(value), sort_keys=True) if isinstance(value, Mapping) else str(value)
    plain: dict[str, Callable[[Any], Any]] = {"float": float, "int": int, "bool": bool}
    if kind.base in plain:
        return plain[kind.base](value)
    return _mirror(value, kind.base, types, t_ns)


def _unmirror(msg: Any, short: str, cls: type[Any]) -> Any:
    """A message as a dataclass that mirrors it by name."""
    hints = _hints(cls)
    values: dict[str, Any] = {}
    for field in _field_names(msg):
        attribute = _attribute(cls, short, field)
        if attribute:
            values[attribute] = _from_field(getattr(msg, field), hints[attribute])
    for name in ("t0_ns", "t_ns"):
        if name in hints:
            values[name] = stamp_ns(msg)
    if "frame_id" in hints:
        values["frame_id"] = msg.header.frame_id
    return cls(**values)


def _from_field(value: Any, hint: Any) -> Any:
    origin_args = get_args(hint)
    if hint is float:
        return (
            value if value == value else math.nan
        )  # one NaN for all, so that equal nameplates compare equal
    if hint in (int, str, bool) or isinstance(value, str):
        return hint(value) if callable(hint) else value
    if isinstance(value, (array.array, np.ndarray)):
        if get_origin(hint) is tuple:
            return tuple(value.tolist())
        return np.frombuffer(value, dtype=value.dtype if isinstance(value, np.ndarray) else value.typecode)
    if isinstance(value, (list, tuple)):
        inner = origin_args[0] if origin_args else str
        return tuple(_from_field(item, inner) for item in value)
    if dataclasses.is_dataclass(hint) and isinstance(hint, type):
        return _unmirror(value, type(value).__name__.rsplit("__", 1)[-1], hint)
    return hint(value)


def _hints(cls: type[Any]) -> dict[str, Any]:
    if cls not in _hint_cache:
        _hint_cache[cls] = get_type_hints(cls)
    return _hint_cache[cls]


def _attribute(cls: type[Any], short: str, field: str) -> str:
    """Name of the attribute of `cls` that holds the message's field; empty if it has none."""
    key = (cls, short, field)
    if key not in _attribute_cache:
        names = {spec.name for spec in dataclasses.fields(cls)}
        stem = _OTHER_NAMES.get((short, field), field)
        choices = (stem, *(stem + unit for unit in _UNITS))
        _attribute_cache[key] = next((name for name in choices if name in names), "")
    return _attribute_cache[key]


def _field_names(msg: Any) -> tuple[str, ...]:
    if dataclasses.is_dataclass(msg):
        return tuple(spec.name for spec in dataclasses.fields(msg))
    return tuple(msg.get_fields_and_field_types())


_hint_cache: dict[type[Any], dict[str, Any]] = {}
_attribute_cache: dict[tuple[type[Any], str, str], str] = {}


def _stamp_of(obj: Any, t_ns: int | None) -> int:
    for name in ("t0_ns", "t_ns"):
        if hasattr(obj, name):
            return int(getattr(obj, name))
    if t_ns is None:
        raise InputError(type(obj).__name__, "t_ns", "nothing", "a time stamp for the header")
    return t_ns


def _frame_of(obj: Any) -> str:
    frame = getattr(obj, "frame_id", None)
    return getattr(obj, "name", "") if frame is None else frame
