"""What a cause is: physics that the model may lack, its parameters, and what it would show.

A cause changes the *content* of a scenario (the mapping that a scenario file holds), so that whatever the
simulator can do is within reach and the extended model is a file that `simulate` and the live rig accept.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from gearsim_twin.causes.prior import Prior

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

REPEATED_NATS = 7.0
"""What finding again adds: a finder that is wrong once in a thousand records is so twice in a row by chance
this much more seldom."""

Content = dict[str, Any]
"""What a scenario file holds."""
Values = Mapping[str, float | str]
"""Numbers of the parameters (SI units) and words of what is chosen, such as `component`."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """A number of a cause.

    Attributes
    ----------
    name : str
        With its unit, as in `width_m`.
    unit : str
        As people read it: `m`, `Hz`, `1`.
    prior : Prior
        What is known of it beforehand, with bounds.
    step : float
        Change for differences between simulations, in the unit of the parameter: large enough to be seen in
        the features, small enough that they change in proportion. 0 takes a quarter of the prior's
        standard deviation.
    """

    name: str
    unit: str
    prior: Prior
    step: float = 0.0


class Cause(Protocol):
    """Physics that the model may lack.

    Attributes
    ----------
    name : str
        One of the published names.
    parameters : tuple of Parameter
        What is fitted.
    confused_with : tuple of (str, str)
        Causes that leave much the same traces in one record, and the measurement that would decide.

    Notes
    -----
    A cause with an attribute `proven` that is true has a finder with a false alarm rate of its own, and reads
    all its numbers off the records: it counts as proven when it is found again in held-out records. With a
    method `seen_again(values, heldout)` it also tells the log odds of what was read in those records: who
    looks everywhere must ask for more than one who knows where to look.
    A cause that is read off where lines lie has a method `told_again(values, context, heldout)` instead: nats
    by which these positions, in records for training and again in those held out, speak for it.
    What the measuring chain of a model can make up for (gains, floors, bandwidths) has `of_chain` true.
    Beside records of the healthy machine (`familiar`) it matters how a cause changes what these show. One
    with `superposes` true adds an oscillation to those there; one with `scales` true makes all that is there
    more or less, whatever it is. The others add power where they add, and scale where they take away.
    A cause whose first guesses may be far off in strength names the parameter that goes to nothing with it in
    an attribute `size`: a guess that shows too much is tried again with less of it.
    """

    name: str
    parameters: tuple[Parameter, ...]
    confused_with: tuple[tuple[str, str], ...]

    def applies(self, context: Context) -> bool:
        """Whether machine and model can have it at all, and the data do not rule it out."""

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """First guesses read off the data, best first, at most four; empty where nothing speaks for it.

        A start gives every parameter a number, and beyond them the words of choices, such as `component`.
        A parameter read off the records better than simulations could tell has its standard deviation under
        `std:` and its name; it is then not fitted.
        Each start costs a simulation.
        """

    def extend(self, content: Content, values: Values, context: Context) -> Content:
        """A new content with the cause in it; `content` is not changed, and nothing but arguments counts."""

    def signature(self, values: Values) -> str:
        """What it shows, in plain words with frequencies, orders and times."""
