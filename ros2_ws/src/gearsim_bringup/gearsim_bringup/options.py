"""Options that several commands share, and the check of a number's range."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import click

from gearsim_io.stated_speed import parse_speed

F = TypeVar("F", bound=Callable[..., Any])


class FiniteRange(click.FloatRange):
    """A range that holds neither NaN nor infinity."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The number, or a complaint that names the option."""
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"got {value}, expected a finite number", param, ctx)
        return number


class SpeedInHz(click.types.FloatParamType):
    """A speed in Hz, or with its unit: `29.9`, `29.9Hz`, `1796rpm`."""

    name = "speed"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The speed in Hz, or a complaint that names the option and the units."""
        if isinstance(value, float):
            return value
        try:
            return parse_speed(str(value))
        except ValueError as error:
            self.fail(str(error), param, ctx)


SPEED = SpeedInHz()
SPEED_HELP = "Nominal speed of the reference shaft in Hz, or with its unit, such as 1796rpm."
FORMATS = ("mcap", "npz", "wav")  # that a run can be written in
POSITIVE = FiniteRange(min=0, min_open=True)
ANY_PATH = click.Path(path_type=Path)  # existence is checked where the error can say what was expected


class SeveralValues(click.Command):
    """A command whose options named in `several` take any number of values: `--holdout a.mat b.mat`."""

    several: tuple[str, ...] = ()

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """As click does, with the options written before each of their values."""
        return super().parse_args(ctx, spread(args, self.several))


def spread(words: Sequence[str], options: Sequence[str]) -> list[str]:
    """Words of a command line with each of `options` written before every value that follows it.

    Values end at the next option; after `--` nothing is changed.
    """
    result: list[str] = []
    option, values = "", 0
    for number, word in enumerate(words):
        if word == "--":
            return [*result, *words[number:]]
        if word.startswith("-") and len(word) > 1:
            name, told, _ = word.partition("=")
            option, values = name if name in options else "", len(told)
        else:
            if option and values:
                result.append(option)
            values += 1
        result.append(word)
    return result


def json_option(function: F) -> F:
    """`--json`: one JSON object on stdout and nothing else there."""
    text = "Print one JSON object and nothing else on stdout."
    return click.option("--json", "json_mode", is_flag=True, help=text)(function)


def example(text: str) -> str:
    """The epilog of a command's help page, kept as it is written."""
    return "\b\nExample:\n" + "\n".join(f"  {line}" for line in text.strip().splitlines())
