"""Options that several commands share, and the check of a number's range."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

F = TypeVar("F", bound=Callable[..., Any])


class FiniteRange(click.FloatRange):
    """A range that holds neither NaN nor infinity."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The number, or a complaint that names the option."""
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"got {value}, expected a finite number", param, ctx)
        return number


FORMATS = ("mcap", "npz", "wav")  # that a run can be written in
POSITIVE = FiniteRange(min=0, min_open=True)
ANY_PATH = click.Path(path_type=Path)  # existence is checked where the error can say what was expected


def json_option(function: F) -> F:
    """`--json`: one JSON object on stdout and nothing else there."""
    text = "Print one JSON object and nothing else on stdout."
    return click.option("--json", "json_mode", is_flag=True, help=text)(function)


def example(text: str) -> str:
    """The epilog of a command's help page, kept as it is written."""
    return "\b\nExample:\n" + "\n".join(f"  {line}" for line in text.strip().splitlines())
