"""Impacts that belong to nothing on the nameplate are told as unknown; noise and shaft lines are not."""

import numpy as np
import pytest
import rig_stream

from gearsim_dsp.diagnose import diagnose_record
from gearsim_dsp.quality import check_levels


@pytest.mark.parametrize("order", [3.37, 8.61])
def test_impacts_at_an_order_of_no_part_are_unknown(order):
    record = rig_stream.record(seconds=6.0, fault_at_s=0.0, fault_order=order, jitter=0.0)
    (finding,) = diagnose_record(record, rig_stream.machine()).findings
    assert (finding.component, finding.fault) == ("", "unknown")
    assert finding.found_order == pytest.approx(order, rel=3e-3)


@pytest.mark.parametrize("seed", range(4))
def test_nothing_strange_in_noise_with_gear_tones(seed):
    record = rig_stream.record(seconds=6.0, seed=seed)
    assert diagnose_record(record, rig_stream.machine()).findings == ()


def test_levels_tell_units_gains_and_zeros():
    record = rig_stream.record(seconds=1.0, channels=("b1", "b2", "b3"))
    machine = rig_stream.machine(("b1", "b2", "b3"))
    assert check_levels(record, machine) == []
    data = record.data.copy()
    data[0] *= 1e-9
    data[1] += 100.0
    data[2] *= 1e6
    changed = type(record)(record.sample_rate_hz, record.channels, "m/s^2", data)
    told = {(issue.issue, issue.channel) for issue in check_levels(changed, machine)}
    expected = {
        ("implausible_level", "b1"),
        ("implausible_level", "b3"),
        ("offset", "b2"),
        ("odd_level", "b1"),
    }
    assert told == expected | {("odd_level", "b3")}
    assert np.isfinite(data).all()
