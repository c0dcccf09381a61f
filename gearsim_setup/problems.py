"""How set-up fails: each with one line and its exit code."""

from __future__ import annotations


class SetupProblem(Exception):
    """Set-up cannot go on. Shown as one line on stderr.

    Attributes
    ----------
    exit_code : int
        What the process ends with.
    """

    exit_code = 1


class UsageProblem(SetupProblem):
    """The person asked for something that does not exist."""

    exit_code = 2


class LackProblem(SetupProblem):
    """The environment lacks something that set-up may not or cannot put there itself.

    Parameters
    ----------
    lack : str
        What is missing.
    remedy : str
        The command, or the deed, that mends it.
    """

    exit_code = 3

    def __init__(self, lack: str, remedy: str) -> None:
        self.lack = lack
        self.remedy = remedy
        super().__init__(f"{lack}; mend it with: {remedy}")
