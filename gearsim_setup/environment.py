"""The environment variables that the program runs with."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping

from gearsim_setup.places import Places
from gearsim_setup.route import WHEELS

# What a sourced distribution puts there and the wheels must not meet.
PREFIX_VARIABLES = ("AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH", "COLCON_PREFIX_PATH")


def program_environment(places: Places, route: str, base: Mapping[str, str]) -> dict[str, str]:
    """Everything that sourcing the virtual environment and the workspace would set, and a few defaults.

    Parameters
    ----------
    places : Places
        The repository.
    route : str
        Where ROS comes from, as `find_route` tells it.
    base : mapping
        The environment that we were started with.

    Returns
    -------
    dict
        The whole environment of the program.
    """
    env = {key: value for key, value in base.items() if key != "PYTHONHOME"}
    if route == WHEELS:
        env = _without_distribution(env)
        prefixes = [str(places.install), str(places.venv)]
        libraries = [str(places.install / "lib"), *wheel_libraries(places)]
        # The wheels' own re-start of Python for the library path becomes needless.
        env["_ROS_WHEELS_BOOTSTRAP_COMPLETE"] = "1"
        # The only middleware among the wheels.
        env["RMW_IMPLEMENTATION"] = "rmw_fastrtps_cpp"
    else:
        prefixes = [str(places.install)]
        libraries = [str(places.install / "lib")]
    env["VIRTUAL_ENV"] = str(places.venv)
    env["PATH"] = _join([str(places.venv / "bin")], env.get("PATH"))
    env["AMENT_PREFIX_PATH"] = _join(prefixes, env.get("AMENT_PREFIX_PATH"))
    env["LD_LIBRARY_PATH"] = _join(libraries, env.get("LD_LIBRARY_PATH"))
    env["PYTHONPATH"] = _join(python_folders(places), env.get("PYTHONPATH"))
    env["GEARSIM_ROOT"] = str(places.root)
    env["GEARSIM_STATE"] = str(places.state)
    env.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    # One file for each process of ROS; not in the user's home.
    env.setdefault("ROS_LOG_DIR", str(places.state / "log" / "ros"))
    # Several nodes share few cores: more threads of the linear algebra would only wait for each other.
    env.setdefault("OPENBLAS_NUM_THREADS", "1")
    return env


def python_folders(places: Places) -> list[str]:
    """The Python path: the sources as they are, the compiled messages, the packages' metadata."""
    minor = places.venv_minor()
    sources = [str(path) for path in places.packages() if (path / "setup.py").is_file()]
    # Which of the three colcon uses depends on the system's Python.
    compiled = [f"lib/python{minor}/site-packages", f"lib/python{minor}/dist-packages"]
    compiled += [f"local/lib/python{minor}/dist-packages"]
    built = [str(places.install / name) for name in compiled if (places.install / name).is_dir()]
    metadata = [str(places.workspace / "build" / os.path.basename(path)) for path in sources]
    return [*sources, *built, *(path for path in metadata if os.path.isdir(path))]


def wheel_libraries(places: Places) -> list[str]:
    """Folders of shared libraries in the virtual environment, as ros_wheels_bootstrapper finds them."""
    site = places.site_packages()
    try:
        names = sorted(entry.name for entry in os.scandir(site))
    except OSError:
        names = []
    vendored = [str(site / name) for name in names if name.startswith("ros_") and name.endswith(".libs")]
    return [str(places.venv / "lib"), *vendored]


def build_environment(places: Places, route: str, base: Mapping[str, str]) -> dict[str, str]:
    """The environment for colcon: on the wheels nothing but the virtual environment is an underlay."""
    if route != WHEELS:
        return {key: value for key, value in base.items() if key != "VIRTUAL_ENV"}
    stray = {"PYTHONHOME", "PYTHONPATH"}
    env = {key: value for key, value in _without_distribution(base).items() if key not in stray}
    env["PATH"] = _join([str(places.venv / "bin")], env.get("PATH"))
    env["AMENT_PREFIX_PATH"] = env["CMAKE_PREFIX_PATH"] = str(places.venv)
    env["LD_LIBRARY_PATH"] = _join(wheel_libraries(places), env.get("LD_LIBRARY_PATH"))
    env["_ROS_WHEELS_BOOTSTRAP_COMPLETE"] = "1"
    return env


def _without_distribution(base: Mapping[str, str]) -> dict[str, str]:
    """`base` less what belongs to the prefixes of a distribution that does not fit our Python."""
    prefixes = [path for name in PREFIX_VARIABLES for path in base.get(name, "").split(":") if path]
    env = {key: value for key, value in base.items() if key not in PREFIX_VARIABLES}
    for name in ("PATH", "LD_LIBRARY_PATH", "PYTHONPATH"):
        if name not in env:
            continue
        kept = [path for path in env[name].split(":") if path and not _inside(path, prefixes)]
        env[name] = ":".join(kept)
        if not kept:
            del env[name]
    return env


def _inside(path: str, prefixes: Iterable[str]) -> bool:
    return any(path == prefix or path.startswith(prefix.rstrip("/") + "/") for prefix in prefixes)


def _join(first: Iterable[str], rest: str | None) -> str:
    """Join search paths, each folder once, in the order given."""
    parts = [*first, *(rest or "").split(":")]
    return ":".join(dict.fromkeys(part for part in parts if part))
