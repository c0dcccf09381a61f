"""What set-up has completed, and from which inputs: the reason why a second start is quick.

The stamp holds one text for each part. A part is struck out before it is worked on and written when
it is finished, by an atomic replacement of the file, so that a set-up stopped at any moment leaves
at worst a part that is done again.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path

from gearsim_setup.places import Places

# In the order in which they are built; each needs those before it.
PARTS = ("venv", "wheels", "messages", "packages")

# Counted up when set-up itself does something else than before with the same inputs.
EDITION = "1"


class Stamp:
    """The completed parts of an environment, kept in one small file.

    Parameters
    ----------
    path : Path
        The file; missing or unreadable means that nothing is known to be complete.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._parts = _read(path)

    def fits(self, expected: Mapping[str, str]) -> bool:
        """Whether every part is complete and made from the expected inputs."""
        return all(self._parts.get(part) == expected[part] for part in PARTS)

    def has(self, part: str, value: str) -> bool:
        """Whether one part is complete and made from these inputs."""
        return self._parts.get(part) == value

    def strike(self, part: str) -> None:
        """Forget `part` and all that is built on it, before work on it begins."""
        for name in PARTS[PARTS.index(part) :]:
            self._parts.pop(name, None)
        self._write()

    def complete(self, part: str, value: str) -> None:
        """Note that `part` stands."""
        if part not in PARTS:
            raise ValueError(f"part: got {part}, expected one of {', '.join(PARTS)}")
        self._parts[part] = value
        self._write()

    def _write(self) -> None:
        self._path.parent.mkdir(parents=True, exist_ok=True)
        fresh = self._path.with_name(f"{self._path.name}.{os.getpid()}.new")
        fresh.write_text(json.dumps(self._parts, indent=1) + "\n", encoding="utf-8")
        os.replace(fresh, self._path)


def _read(path: Path) -> dict[str, str]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    if not isinstance(content, dict):
        return {}
    return {part: content[part] for part in PARTS if isinstance(content.get(part), str)}


def digest(root: Path, files: Iterable[Path], names: Iterable[Path] = ()) -> str:
    """Hash the content of `files` and the bare existence of `names`, each under its place in `root`."""
    total = hashlib.sha256()
    for path in sorted(files):
        total.update(f"{path.relative_to(root)}\0".encode())
        total.update(path.read_bytes() + b"\0")
    for path in sorted(names):
        total.update(f"{path.relative_to(root)}\0".encode())
    return total.hexdigest()[:32]


def expected_parts(places: Places, route: str) -> dict[str, str]:
    """What the stamp says when the environment stands for the sources as they are now.

    Parameters
    ----------
    places : Places
        The repository.
    route : str
        Where ROS comes from: "wheels", or a name of the distribution.
    """
    config = places.venv_config()
    locks = [path for path in (places.requirements, places.ros_requirements) if path.is_file()]
    interfaces, programs = split_packages(places)
    return {
        "venv": f"{EDITION} {route} {places.root} {config.get('home', '')} {places.venv_minor()}",
        "wheels": digest(places.root, locks),
        "messages": digest(places.root, _build_inputs(interfaces)),
        "packages": digest(places.root, _build_inputs(programs), _listed(programs)),
    }


def split_packages(places: Places) -> tuple[list[Path], list[Path]]:
    """Folders of the packages that are compiled (interfaces) and of those that are plain Python."""
    packages = places.packages()
    compiled = [path for path in packages if (path / "CMakeLists.txt").is_file()]
    return compiled, [path for path in packages if path not in compiled]


def _build_inputs(packages: Iterable[Path]) -> list[Path]:
    """Files that a build reads; Python modules are not among them, they are linked."""
    patterns = ("package.xml", "CMakeLists.txt", "setup.py", "setup.cfg", "msg/*", "srv/*", "action/*")
    return [path for package in packages for pattern in patterns for path in package.glob(pattern)]


def _listed(packages: Iterable[Path]) -> list[Path]:
    """Files of which a build only makes links: their names matter, not what is in them."""
    patterns = ("resource/*", "launch/*")
    return [path for package in packages for pattern in patterns for path in package.glob(pattern)]
