"""The updating of a casing to a modal test from a universal file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from gearsim_io.errors import InputError
from gearsim_sim.model.casing.from_test import BAND_HZ, TestedUpdate, update_to_modes
from gearsim_sim.model.casing.identify import IdentifiedModes, identify, require_ema
from gearsim_sim.model.casing.modal_test import ModalTest
from gearsim_sim.model.casing.params import CasingParams
from gearsim_sim.model.casing.placement import load_placement, plan_of
from gearsim_sim.model.casing.universal_file import Measured, read_modal_test
from gearsim_sim.model.casing.updating import Tell, hung_up

# A mode counts that two references agree on.
REFERENCES = 2


@dataclass(frozen=True)
class MeasuredUpdate:
    """What was measured, and what was found."""

    test: ModalTest | None
    """None where the file holds modes, not responses."""
    tested: TestedUpdate


def update_to_file(
    params: CasingParams,
    path: Path,
    placement_path: Path | None,
    band_hz: tuple[float, float] | None,
    most_steps: int,
    tell: Tell,
) -> MeasuredUpdate:
    """Read a test, place its points on the mesh, identify its modes and update plate thickness to them.

    Parameters
    ----------
    params : CasingParams
    path : Path
        A universal file, see `universal_file`.
    placement_path : Path, optional
        A YAML file, see `placement.Placement`.
    band_hz : (float, float), optional
        Modes between these frequencies count; by default those of the thesis's test, as far as measured.
    most_steps : int
    tell : callable

    Raises
    ------
    InputError
        If the file does not serve, see `read_modal_test`, `plan_of` and `modes_of`.
    """
    tell("reading the test")
    placement = load_placement(placement_path)
    measured = read_modal_test(path, placement.response)
    if measured.test is not None:
        require_ema()
    plan = plan_of(measured, placement, hung_up(params))
    tell("poles and shapes")
    modes = modes_of(measured, band_hz)
    return MeasuredUpdate(measured.test, update_to_modes(params, plan, modes, most_steps, tell))


def modes_of(measured: Measured, band_hz: tuple[float, float] | None) -> IdentifiedModes:
    """The modes of a test in a band, identified or as its file has them."""
    low, high = band_hz or BAND_HZ
    if band_hz is not None and not 0 < low < high:
        raise InputError("--band", "", f"{low:g} {high:g}", "a lower and a higher frequency in Hz")
    if measured.test is None:
        assert measured.modes is not None
        found = measured.modes.within(low, high)
        if not len(found.frequencies_hz):
            highest = measured.modes.frequencies_hz.max(initial=0.0)
            raise InputError(
                measured.where,
                "mode shapes",
                f"modes up to {highest:g} Hz",
                f"some in {low:g} to {high:g} Hz",
            )
        return found
    if len(measured.references) < REFERENCES:
        what = f"{len(measured.references)} ({measured.references[0]})"
        raise InputError(
            measured.where, "references", what, f"at least {REFERENCES}, which must agree on a mode"
        )
    last = float(measured.test.frequencies_hz[-1])
    if band_hz is None:
        high = min(high, last)
    if not low < high <= last:
        what = f"responses up to {last:g} Hz"
        raise InputError(
            measured.where, "frequencies", what, f"a band within them (now {low:g} to {high:g} Hz, --band)"
        )
    return identify(measured.test, low, high)
