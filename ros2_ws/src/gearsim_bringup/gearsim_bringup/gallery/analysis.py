"""The numbers behind a picture of the gallery: which channel, which band, which spectra."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch

from gearsim_bringup.gallery.cases import IN_CASINGS, Case
from gearsim_dsp.envelope import order_spectrum, squared_envelopes, window_spectrum
from gearsim_dsp.kinematics import FaultFamily, fault_families
from gearsim_dsp.speed import Phase, window_speed
from gearsim_io.record import Record
from gearsim_sim.simulation import to_record

Array = NDArray[np.float64]
_TURNS_SHOWN = 2.0
_ORDERS_SHOWN = 25.0
_BANDS = 24  # of which the one with the greatest change is shown
_REDUCED_HZ = 4000.0  # up to here the shipped reductions of casings are valid


@dataclass(frozen=True, eq=False)
class Comparison:
    """Healthy and faulty signals of one channel; each pair is (healthy, faulty)."""

    channel: str
    unit: str
    speed_hz: float
    time_s: Array
    waveforms: tuple[Array, Array]
    frequency_hz: Array
    densities: tuple[Array, Array]  # one-sided PSD
    band_hz: tuple[float, float]
    orders: Array
    envelopes: tuple[Array, Array]  # squared envelope spectra, power of the envelope over its mean
    families: tuple[FaultFamily, ...]  # expected orders of the component
    rms: tuple[float, float]


def compare(case: Case, seconds: float) -> Comparison:
    """Simulate both sides of a case and look at the channel where they differ most."""
    healthy, faulty = to_record(case.healthy, seconds), to_record(case.faulty, seconds)
    data = healthy.data.astype(np.float64), faulty.data.astype(np.float64)
    rate = healthy.sample_rate_hz
    change = np.std(data[1] - data[0], axis=1) / np.std(data[0], axis=1)
    row = int(np.argmax(change))
    pair = data[0][row], data[1][row]
    machine = case.healthy.machine
    speed = window_speed(faulty.tachos, faulty.sample_count, rate, machine)
    phase = speed.phase or _steady(faulty, case.healthy.speed_hz)
    band = _band(pair, rate, _REDUCED_HZ if case.name in IN_CASINGS else 0.5 * rate)
    orders, envelopes = _envelopes(pair, rate, band, phase)
    first, count = _stretch(pair, rate, case.healthy.speed_hz)
    frequency, _ = welch(pair[0], rate, nperseg=_segment(pair[0].size))
    densities = tuple(welch(one, rate, nperseg=_segment(one.size))[1] for one in pair)
    return Comparison(
        channel=healthy.channels[row],
        unit=healthy.unit,
        speed_hz=case.healthy.speed_hz,
        time_s=np.arange(first, first + count) / rate,
        waveforms=(pair[0][first : first + count], pair[1][first : first + count]),
        frequency_hz=frequency,
        densities=(densities[0], densities[1]),
        band_hz=band,
        orders=orders,
        envelopes=envelopes,
        families=tuple(one for one in fault_families(machine) if one.component == case.component),
        rms=(float(np.std(pair[0])), float(np.std(pair[1]))),
    )


def _segment(samples: int) -> int:
    return min(samples, 1 << 15)


def _steady(record: Record, speed_hz: float) -> Phase:
    """The angle of a shaft of constant speed, where no tacho tells."""
    samples = np.array([0.0, float(record.sample_count)])
    return Phase(samples, samples * speed_hz / record.sample_rate_hz)


def _stretch(pair: tuple[Array, Array], rate_hz: float, speed_hz: float) -> tuple[int, int]:
    """First sample and length of the two turns around the greatest difference."""
    turns = _TURNS_SHOWN / speed_hz if speed_hz > 0 else 0.2
    count = min(pair[0].size, round(turns * rate_hz))
    centre = int(np.argmax(np.abs(pair[1] - pair[0])))
    return int(np.clip(centre - count // 2, 0, pair[0].size - count)), count


def _band(pair: tuple[Array, Array], rate_hz: float, limit_hz: float) -> tuple[float, float]:
    """The band up to a limit in which the fault adds most, relative to what is there without it."""
    top = 0.45 * rate_hz
    edges = np.linspace(0, top, _BANDS + 1)
    width = edges[1] - edges[0]
    frequency, added = welch(pair[1] - pair[0], rate_hz, nperseg=4096)
    _, before = welch(pair[0], rate_hz, nperseg=4096)
    index = np.clip((frequency / width).astype(int), 0, _BANDS)
    gain = [
        np.sum(added[index == k]) / np.sum(before[index == k])
        for k in range(1, _BANDS)
        if edges[k + 1] <= limit_hz
    ]
    low = float(edges[1 + int(np.argmax(gain))])
    return low, low + float(width)


def _envelopes(
    pair: tuple[Array, Array], rate_hz: float, band_hz: tuple[float, float], phase: Phase
) -> tuple[Array, tuple[Array, Array]]:
    """Orders, and the squared envelope spectra over them."""
    turns = float(phase.turns[-1] - phase.turns[0])
    step = 1.0 / int(np.ceil(2 * turns + 1))
    spectra = []
    for one in pair:
        envelopes = squared_envelopes(
            window_spectrum(one, rate_hz), np.array([band_hz[0]]), band_hz[1] - band_hz[0]
        )
        spectra.append(order_spectrum(envelopes, phase, _ORDERS_SHOWN, step)[0])
    return np.arange(spectra[0].size) * step, (spectra[0], spectra[1])
