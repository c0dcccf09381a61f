"""Writes the rig's plain objects into a bag, for offline runs and imports."""

from __future__ import annotations

from typing import Any

from gearsim_io import definitions, qos
from gearsim_io.bags.writer import BagWriter
from gearsim_io.batches import EncoderBatch, SampleBatch, TachoBatch, TorqueBatch
from gearsim_io.errors import InputError
from gearsim_io.messages import message_name, pure_types, to_msg
from gearsim_io.nameplate import Machine

_TOPICS = {
    "SampleBatch": qos.ACCEL,
    "TachoBatch": qos.TACHO,
    "EncoderBatch": qos.ENCODER,
    "TorqueBatch": qos.TORQUE,
    "MachineInfo": qos.MACHINE_INFO,
    "GroundTruth": qos.GROUND_TRUTH,
    "Features": qos.FEATURES,
    "Spectrum": qos.SPECTRUM,
    "Alarm": qos.ALARM,
    "AlarmState": qos.ALARM_STATE,
}


class StreamWriter:
    """Puts batches, nameplates, truths and results on the topics where nodes would publish them.

    Parameters
    ----------
    writer : BagWriter
        Stays the caller's to close.
    """

    def __init__(self, writer: BagWriter) -> None:
        self._writer = writer
        self._types = pure_types()
        self._store = definitions.typestore()
        self._last_ns = 0

    def write(self, obj: Any, t_ns: int | None = None) -> None:
        """Add one object.

        Parameters
        ----------
        obj : batch, Machine, or a dataclass that mirrors a message
        t_ns : int, optional
            Log time. By default a batch's last sample plus one (when a live batch would be complete), the
            object's own stamp, or else that of the object before.

        Raises
        ------
        InputError
            If there is no topic for such an object.
        """
        name = message_name(obj)
        topic = _TOPICS.get(name)
        if topic is None:
            raise InputError("bag", "object", name, "one of " + ", ".join(_TOPICS))
        if name == "AlarmState":
            topic = topic.of(obj.source)
        if t_ns is None:
            t_ns = self._time_of(obj)
        self._last_ns = max(t_ns, self._last_ns)
        message = to_msg(obj, self._types, t_ns)
        self._writer.add(topic)
        data = bytes(self._store.serialize_cdr(message, topic.type))
        self._writer.write(topic.full_name, t_ns, data)

    def _time_of(self, obj: Any) -> int:
        if isinstance(obj, (SampleBatch, TorqueBatch, TachoBatch, EncoderBatch)):
            return obj.t0_ns + round(obj.sample_count * 1e9 / obj.sample_rate_hz)
        if isinstance(obj, Machine):
            return self._last_ns
        own = getattr(obj, "t_ns", None)
        return self._last_ns if own is None else max(int(own), self._last_ns)
