"""The two kinds of error that a person caused and can mend; everything else is a defect of ours."""

from __future__ import annotations

from numbers import Real

from gearsim_io.numbers import written
from gearsim_io.same_unit import in_unit_of
from gearsim_io.suggest import did_you_mean


class InputError(ValueError):
    """Bad input, told in one line: where, which field, what was found, what was expected.

    Parameters
    ----------
    where : str
        File, topic, command-line option or message that holds the input.
    field : str
        Field inside it (dotted path, channel, column); empty when the whole of it is meant.
    value : object
        What was found, shown shortened.
    expected : str
        What would have been accepted. Of a misspelt name among those listed here (`one of a, b, c`) the
        message asks whether it was meant.
    """

    def __init__(self, where: str, field: str, value: object, expected: str) -> None:
        self.where = str(where)
        self.field = field
        self.value = value
        self.expected = expected
        super().__init__(str(self))

    def __str__(self) -> str:
        place = f"{self.where}: {self.field}" if self.field else self.where
        value = _short(self._value_text())
        if not isinstance(self.value, str):
            return f"{place}: got {value}, expected {self.expected}"
        return f"{place}: got {value}, expected {self.expected}{did_you_mean(self.value, self.expected)}"

    def _value_text(self) -> str:
        if isinstance(self.value, str):
            return self.value
        if isinstance(self.value, Real) and not isinstance(self.value, bool):
            return in_unit_of(self.expected, self.value, self.field)
        return written(self.value)


class EnvironmentLackError(RuntimeError):
    """The environment lacks something; `remedy` is the command that mends it (exit code 3)."""

    def __init__(self, lack: str, remedy: str) -> None:
        self.lack = lack
        self.remedy = remedy
        super().__init__(f"{lack}; mend it with: {remedy}")


def _short(text: str, limit: int = 120) -> str:
    text = " ".join(text.split())
    return text if len(text) <= limit else text[: limit - 3] + "..."
