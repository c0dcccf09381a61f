"""How a rig's files are to be read: the `import` section of a machine description, and what overrides it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import Field, field_validator

from gearsim_io.errors import InputError
from gearsim_io.machines import read_machine_file
from gearsim_io.quantities import Si, Strict, validate


def _pattern(text: str | None) -> str | None:
    if text is not None:
        try:
            groups = re.compile(text).groups
        except re.error as error:
            raise ValueError(f"a regular expression ({error})") from None
        if groups != 1:
            raise ValueError("a regular expression with one group in parentheses")
    return text


class RateSettings(Strict):
    """Where the sampling rate stands; all places given are compared.

    `variables` hold it in Hz, `intervals` its inverse in s, `time` a column of times in s; `file_name` is
    a regular expression whose group is the rate in Hz, tried on the name without its suffix.
    """

    value: Annotated[float, Si("Hz", gt=0)] | None = None
    variables: tuple[str, ...] = ()
    intervals: tuple[str, ...] = ()
    time: str | None = None
    file_name: str | None = None

    _check = field_validator("file_name")(_pattern)


class ChannelSettings(Strict):
    """Where one channel stands and in which unit; `column` is the same as `variable`, for tables."""

    variable: str | None = None
    column: str | int | None = None
    unit: str | None = None
    unit_source: str = ""
    optional: bool = False

    @property
    def pattern(self) -> str:
        """Name or pattern of the variable."""
        return str(self.column if self.variable is None else self.variable)


class ValueSettings(Strict):
    """Where a single number stands: in a variable or in the file's name."""

    variable: str | None = None
    file_name: str | None = None
    unit: str
    optional: bool = False

    _check = field_validator("file_name")(_pattern)


class ImportSettings(Strict):
    """The `import` section. Channels are keyed by their names on the nameplate."""

    rate: RateSettings = RateSettings()
    channels: dict[str, ChannelSettings] = Field(default_factory=dict)
    speed: ValueSettings | None = None
    load: ValueSettings | None = None


@dataclass(frozen=True, slots=True)
class Overrides:
    """What the user says of a file, against what the machine's description says.

    Parameters
    ----------
    rate_hz : float, optional
        Must still agree with a rate that the file itself states.
    unit : str, optional
        Of all channels.
    variables : tuple of str
        Which variables or columns are channels.
    channels : tuple of str
        Names of those channels, one each; by default the variables' own names, or the nameplate's.
    speed_hz : float, optional
        Nominal speed of the reference shaft.
    """

    rate_hz: float | None = None
    unit: str | None = None
    variables: tuple[str, ...] = ()
    channels: tuple[str, ...] = ()
    speed_hz: float | None = None

    def __post_init__(self) -> None:
        for name in ("rate_hz", "speed_hz"):
            value = getattr(self, name)
            if value is not None and not (0 < value < float("inf")):
                raise InputError("import", name.removesuffix("_hz"), value, "a number above 0 Hz")
        if self.variables and self.channels and len(self.variables) != len(self.channels):
            expected = f"one for each of {len(self.variables)} variables"
            raise InputError("import", "channels", ", ".join(self.channels), expected)


def load_settings(machine: str | Path | None) -> ImportSettings:
    """The `import` section of a machine's description; empty settings where there is none."""
    if machine is None:
        return ImportSettings()
    path, content = read_machine_file(machine)
    section = content.get("import")
    if section is None:
        return ImportSettings()
    return validate(ImportSettings, section, f"{path}: import", require_source=True)
