"""The layout of rosbag2: a folder with `metadata.yaml` (version 9) and `<bag>_0.mcap`."""

from __future__ import annotations

import io
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from gearsim_io import definitions
from gearsim_io.errors import InputError
from gearsim_io.qos import Qos

A_BAG = "a bag, as record, import and simulate write them"
METADATA = "metadata.yaml"
VERSION = 9
# rosbag2's words for "no message yet"
NEVER_NS = 2**63 - 1


class BagError(RuntimeError):
    """A bag could not be written or saved to the end; one line says what is left (exit code 1)."""


@dataclass(frozen=True, slots=True)
class TopicInfo:
    """A topic as a bag holds it; `qos` are the profiles that its publishers offered."""

    name: str
    type: str
    schema: str
    type_hash: str
    qos: tuple[Qos, ...]

    @staticmethod
    def of(name: str, type_name: str, qos: Sequence[Qos]) -> TopicInfo:
        """A topic whose type is known here; InputError if it is not."""
        known = definitions.definition(type_name)
        return TopicInfo(name, type_name, known.schema, known.type_hash, tuple(qos))

    def channel_metadata(self) -> dict[str, str]:
        """What the MCAP channel carries beside topic and schema."""
        profiles = [profile.to_rosbag2() for profile in self.qos]
        return {"offered_qos_profiles": dump_yaml(profiles), "topic_type_hash": self.type_hash}


@dataclass(slots=True)
class Totals:
    """What a bag holds so far: messages by topic and the span of their log times."""

    counts: dict[str, int] = field(default_factory=dict)
    first_ns: int = NEVER_NS
    last_ns: int = 0

    def add(self, topic: str, t_ns: int) -> None:
        """Count one message."""
        self.counts[topic] = self.counts.get(topic, 0) + 1
        self.first_ns = min(self.first_ns, t_ns)
        self.last_ns = max(self.last_ns, t_ns)

    @property
    def messages(self) -> int:
        """Messages of all topics."""
        return sum(self.counts.values())

    @property
    def duration_ns(self) -> int:
        """From the first to the last message."""
        return max(0, self.last_ns - self.first_ns) if self.messages else 0


def metadata(
    file_name: str, topics: Sequence[TopicInfo], totals: Totals, custom: Mapping[str, str]
) -> dict[str, Any]:
    """The content of `metadata.yaml`."""
    start = {"nanoseconds_since_epoch": totals.first_ns}
    duration = {"nanoseconds": totals.duration_ns}
    listed = [
        {
            "topic_metadata": {
                "name": topic.name,
                "type": topic.type,
                "serialization_format": "cdr",
                "offered_qos_profiles": [profile.to_rosbag2() for profile in topic.qos],
                "type_description_hash": topic.type_hash,
            },
            "message_count": totals.counts.get(topic.name, 0),
        }
        for topic in topics
    ]
    only_file = {
        "path": file_name,
        "starting_time": start,
        "duration": duration,
        "message_count": totals.messages,
    }
    return {
        "rosbag2_bagfile_information": {
            "version": VERSION,
            "storage_identifier": "mcap",
            "duration": duration,
            "starting_time": start,
            "message_count": totals.messages,
            "topics_with_message_count": listed,
            "compression_format": "",
            "compression_mode": "",
            "relative_file_paths": [file_name],
            "files": [only_file],
            "custom_data": dict(custom) or None,
            "ros_distro": os.environ.get("ROS_DISTRO") or "kilted",
        }
    }


def dump_yaml(content: Any) -> str:
    """YAML text in block style."""
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.representer.ignore_aliases = lambda _: True  # rosbag2's parser knows anchors, people do not
    yaml.width = 4096  # a hash stays on its line
    stream = io.StringIO()
    yaml.dump(content, stream)
    return stream.getvalue()


def parse_qos(text: str) -> tuple[Qos, ...]:
    """The profiles in a channel's `offered_qos_profiles`; unreadable text gives none."""
    try:
        content = YAML(typ="safe", pure=True).load(text) or []
        return tuple(Qos.from_rosbag2(entry) for entry in content)
    except (YAMLError, AttributeError, TypeError, ValueError):
        return ()


def parse_custom_data(where: str, text: str) -> dict[str, str]:
    """A JSON object as texts, as bags keep them; InputError if it is none."""
    try:
        content = json.loads(text)
    except json.JSONDecodeError as error:
        raise InputError(where, "custom_data", text, f"a JSON object ({error})") from None
    if not isinstance(content, dict):
        raise InputError(where, "custom_data", text, "a JSON object")
    return {str(key): v if isinstance(v, str) else json.dumps(v) for key, v in content.items()}


def bag_files(path: Path) -> tuple[Path, ...]:
    """The MCAP files of a bag, in order; `path` is a bag's folder or one .mcap file.

    Raises
    ------
    InputError
        If there is no such bag, or it is stored in another format.
    """
    if path.is_file():
        if path.suffix != ".mcap":
            raise InputError(
                str(path), "", f"a {path.suffix or 'nameless'} file", "a bag folder or .mcap file"
            )
        return (path,)
    if not path.is_dir():
        raise InputError(str(path), "", "nothing there", "a bag folder or .mcap file")
    listed = _listed_files(path / METADATA)
    found = tuple(path / name for name in listed if (path / name).is_file())
    files = found or tuple(sorted(path.glob("*.mcap")))
    if not files:
        others = ", ".join(sorted(entry.name for entry in path.iterdir())[:5]) or "an empty folder"
        raise InputError(str(path), "", others, "a bag folder with an .mcap file")
    return files


def _listed_files(path: Path) -> list[str]:
    """File names in metadata.yaml; none where it is missing or damaged, the .mcap files count then."""
    try:
        content = YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8"))
        names = content["rosbag2_bagfile_information"]["relative_file_paths"]
        return [name for name in names if isinstance(name, str)]
    except (OSError, UnicodeDecodeError, YAMLError, KeyError, TypeError):
        return []
