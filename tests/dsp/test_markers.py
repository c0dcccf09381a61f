"""Lines marked in a published spectrum lie on the lines of the signal, also where the speed was estimated."""

from __future__ import annotations

import numpy as np
import pytest

from gearsim_dsp.streams.envelope_monitor import EnvelopeMonitor
from gearsim_io.importers import import_file, machine_for
from gearsim_io.machines import load_machine


@pytest.mark.records
def test_marked_harmonics_lie_on_the_peaks_of_a_record_off_its_nameplate_speed(record_file):
    record = import_file(record_file("mfpt/OuterRaceFault_1.mat"), "mfpt")
    monitor = EnvelopeMonitor(machine_for(record, load_machine("mfpt")))
    reports = [report for batch in record.batches() for report in monitor.push(batch)]
    spectrum = reports[-1].spectra[0]
    (marker,) = [m for m in spectrum.markers if m.label == "BPFO"]
    turns_off = marker.position * spectrum.speed_hz  # 80.5 Hz by an independent zoom, nameplate 81.1 Hz
    assert turns_off == pytest.approx(80.47, rel=3e-3)
    for harmonic in (1, 2):
        line = round(harmonic * marker.position / spectrum.axis_step)
        beside = spectrum.values[line - 40 : line + 41]
        assert np.max(spectrum.values[line - 2 : line + 3]) == np.max(beside)
        assert np.max(beside) > 10 * np.median(beside)
