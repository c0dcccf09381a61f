"""A page put together: template, style, script and plots in one file that needs nothing besides itself."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from importlib import resources
from typing import Any

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

import gearsim_bringup
from gearsim_bringup.pages.plot import Plot
from gearsim_io.errors import InputError

__all__ = ["PLOTLY", "Shown", "assembled", "script_safe", "shown"]

PLOTLY = "plotly-cartesian-4.1.1.min.js"
"""The bundle with the chart types of two axes, of the npm package plotly.js-cartesian-dist-min."""
_FILES = "gearsim_bringup.pages"


@dataclass(frozen=True, slots=True)
class Shown:
    """A plot with its place on the page, or the reason why there is none."""

    key: str
    title: str
    caption: str
    height: int = 0
    spec: str = ""


def shown(key: str, title: str, draw: Callable[[], Plot | None]) -> Shown:
    """A plot for the page; one that the data do not allow gives its place to the reason."""
    try:
        plot = draw()
    except InputError as error:
        return Shown(key, title, f"Not shown: {error}")
    if plot is None:
        return Shown(key, title, "")
    spec: dict[str, Any] = {"data": plot.data, "layout": plot.layout}
    return Shown(key, plot.title, plot.caption, plot.height, script_safe(spec))


def assembled(package: str, template: str, **content: object) -> str:
    """The whole page as HTML.

    Parameters
    ----------
    package, template : str
        Package that has the template among its `files`, and its name there.
    **content : object
        What the template wants; style, scripts and version come by themselves.
    """
    environment = Environment(
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.from_string(_file(package, template)).render(
        version=gearsim_bringup.__version__,
        style=Markup(_file(_FILES, "page.css")),
        script=Markup(_file(_FILES, "page.js")),
        plotly=Markup(_file(_FILES, PLOTLY)),
        **content,
    )


def script_safe(content: object) -> Markup:
    """JSON that cannot end the element it stands in."""
    whole = json.dumps(content, allow_nan=False, separators=(",", ":"))
    return Markup(whole.replace("<", "\\u003c"))


def _file(package: str, name: str) -> str:
    return resources.files(package).joinpath("files", name).read_text("utf-8")
