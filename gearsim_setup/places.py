"""Where the parts of the environment stand, all relative to the repository."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Places:
    """The folders and files that set-up reads and writes.

    Parameters
    ----------
    root : Path
        The repository: the folder of the entry script.
    """

    root: Path

    @property
    def venv(self) -> Path:
        """The virtual environment."""
        return self.root / ".venv"

    @property
    def python(self) -> Path:
        """The interpreter inside the virtual environment."""
        return self.venv / "bin" / "python"

    @property
    def state(self) -> Path:
        """What set-up remembers between two starts."""
        return self.root / ".gearsim"

    @property
    def logs(self) -> Path:
        """The long outputs of the tools that set-up calls."""
        return self.state / "log"

    @property
    def stamp(self) -> Path:
        """What has been completed, and from which inputs."""
        return self.state / "stamp.json"

    @property
    def lock(self) -> Path:
        """Held while set-up runs, so that two starts do not work on one environment."""
        return self.state / "lock"

    @property
    def requirements(self) -> Path:
        """The pinned wheels that are needed with or without a ROS distribution."""
        return self.root / "requirements.lock"

    @property
    def ros_requirements(self) -> Path:
        """The pinned ROS wheels, needed where no ROS distribution is sourced."""
        return self.root / "requirements-ros.lock"

    @property
    def workspace(self) -> Path:
        """The colcon workspace."""
        return self.root / "ros2_ws"

    @property
    def source(self) -> Path:
        """The packages of the workspace."""
        return self.workspace / "src"

    @property
    def install(self) -> Path:
        """Where colcon installs to."""
        return self.workspace / "install"

    def packages(self) -> tuple[Path, ...]:
        """Folders of the workspace's packages, by name."""
        if not self.source.is_dir():
            return ()
        return tuple(sorted(path.parent for path in self.source.glob("*/package.xml")))

    def venv_config(self) -> dict[str, str]:
        """Read `pyvenv.cfg`: keys and values, empty when there is none."""
        try:
            text = (self.venv / "pyvenv.cfg").read_text(encoding="utf-8")
        except OSError:
            return {}
        pairs = (line.split("=", 1) for line in text.splitlines() if "=" in line)
        return {key.strip(): value.strip() for key, value in pairs}

    def venv_minor(self) -> str:
        """Python of the virtual environment as in "3.12"; empty when there is none that starts."""
        if not os.access(self.python, os.X_OK):
            return ""
        return ".".join(self.venv_config().get("version", "").split(".")[:2])

    def site_packages(self) -> Path:
        """Where the virtual environment's wheels are."""
        return self.venv / "lib" / f"python{self.venv_minor()}" / "site-packages"

    def short(self, path: Path) -> str:
        """`path` as a person in the repository would type it."""
        try:
            return str(path.relative_to(self.root))
        except ValueError:
            return str(path)
