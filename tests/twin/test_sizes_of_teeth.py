"""How large faults of teeth are thought to be beforehand: as large as flanks let them be."""

from __future__ import annotations

import pytest
from gear_cases import BASES

from gearsim_twin.causes import CAUSES
from gearsim_twin.causes.tooth_faults import most_of, toothed


@pytest.mark.parametrize("model", sorted(BASES))
def test_pits_may_have_any_size_from_the_least_to_the_whole_flank(model: str) -> None:
    (width,) = CAUSES["tooth_spall"].parameters
    # Ends of a range in which every octave is alike lie sqrt(3) standard deviations off its middle.
    assert width.prior.coordinate(width.prior.low) == pytest.approx(-(3**0.5), abs=0.1)
    for part in toothed(BASES[model], "gear_tooth_spall"):
        most = most_of(BASES[model], "gear_tooth_spall", part.name)
        assert 1.3 < width.prior.coordinate(most) < 2.1
