"""Message definitions without ROS: the .msg texts of gearsim_msgs, their schemas, type hashes and CDR code.

The texts are looked for beside this package in the source tree, then inside it (where its build copied
them), then in the ament prefixes of a ROS installation. Types of other packages come from the `rosbags`
library's store of the ROS 2 interfaces, then from the ament prefixes.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from gearsim_io.errors import EnvironmentLackError, InputError

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

PACKAGE = "gearsim_msgs"
_HERE = Path(__file__).resolve()
_SEPARATOR = "=" * 80
_FIELD = re.compile(r"^\s*([A-Za-z][A-Za-z0-9_/]*)(?:<=\d+)?(?:\[[^\]]*\])?\s+[A-Za-z]")
_PRIMITIVE = re.compile(r"bool|byte|char|float(32|64)|u?int(8|16|32|64)|w?string")


@dataclass(frozen=True, slots=True)
class Definition:
    """What a bag must know of a message type.

    `schema` is the text of the type followed by those of the types it uses (encoding `ros2msg`);
    `type_hash` is `RIHS01_` and 64 hexadecimal digits.
    """

    name: str
    schema: str
    type_hash: str


@cache
def typestore() -> Typestore:
    """The store that serialises and reads CDR: the common ROS 2 interfaces and gearsim_msgs.

    Raises
    ------
    EnvironmentLackError
        If the .msg texts of gearsim_msgs are nowhere to be found.
    """
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_KILTED)
    texts = gearsim_texts()
    fields = {}
    for name, text in texts.items():
        fields.update(get_types_from_msg(text, name))
    store.register(fields)
    return store


@cache
def gearsim_texts() -> dict[str, str]:
    """The .msg texts of gearsim_msgs by full type name, such as `gearsim_msgs/msg/SampleBatch`."""
    for folder in _folders():
        paths = sorted(folder.glob("*.msg"))
        if paths:
            return {f"{PACKAGE}/msg/{path.stem}": path.read_text(encoding="utf-8") for path in paths}
    raise EnvironmentLackError(
        "the message definitions of gearsim_msgs are not installed",
        "pip install ./ros2_ws/src/gearsim_io (from the repository), or source the built workspace",
    )


@cache
def definition(name: str) -> Definition:
    """Schema and hash of a message type, `pkg/msg/Type`.

    Raises
    ------
    InputError
        If the type, or one that it uses, is not known here.
    """
    store = typestore()
    _learn(name)
    parts = [_text(name).rstrip("\n")]
    for used in _closure(name):
        package, _, short = used.split("/")
        parts.append(f"{_SEPARATOR}\nMSG: {package}/{short}\n{_text(used).rstrip()}")
    return Definition(name, "\n".join(parts) + "\n", store.hash_rihs01(name))


def _folders() -> list[Path]:
    source_tree = _HERE.parents[2] / PACKAGE / "msg"
    packaged = _HERE.parent / "message_definitions"
    return [source_tree, packaged, *(prefix / "share" / PACKAGE / "msg" for prefix in _prefixes())]


def _prefixes() -> list[Path]:
    return [Path(prefix) for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if prefix]


@cache
def _text(name: str) -> str:
    """The text of one type alone."""
    own = gearsim_texts().get(name)
    if own is not None:
        return own
    store = typestore()
    if name in store.fielddefs and name not in _learnt:
        whole, _ = store.generate_msgdef(name, ros_version=2)
        return whole.split(_SEPARATOR)[0]
    return _installed_text(name)


def _installed_text(name: str) -> str:
    package, _, short = name.split("/") if name.count("/") == 2 else ("", "", "")
    for prefix in _prefixes():
        path = prefix / "share" / package / "msg" / f"{short}.msg"
        if package and path.is_file():
            return path.read_text(encoding="utf-8")
    raise InputError(
        "message type", "", name, "a type of gearsim_msgs, of ROS 2's common interfaces, or installed"
    )


_learnt: set[str] = set()


def _learn(name: str) -> None:
    """Teach the store a type that neither it nor gearsim_msgs has, and what that type uses."""
    store = typestore()
    if name in store.fielddefs:
        return
    from rosbags.typesys import get_types_from_msg

    text = _installed_text(name)
    _learnt.add(name)
    for used in _uses(name, text):
        _learn(used)
    store.register(get_types_from_msg(text, name))


def _uses(name: str, text: str) -> list[str]:
    """Types that the fields of a .msg text name, in order."""
    package = name.split("/")[0]
    found: list[str] = []
    for line in text.splitlines():
        match = _FIELD.match(line.split("#")[0])
        if match is None or _PRIMITIVE.fullmatch(match[1]):
            continue
        parts = match[1].split("/")
        full = f"{package}/msg/{parts[0]}" if len(parts) == 1 else f"{parts[0]}/msg/{parts[-1]}"
        if full not in found:
            found.append(full)
    return found


def _closure(name: str) -> list[str]:
    """All types used by `name`, each once, nearest first."""
    order: list[str] = []
    queue = _uses(name, _text(name))
    while queue:
        used = queue.pop(0)
        if used not in order:
            order.append(used)
            queue += _uses(used, _text(used))
    return order
