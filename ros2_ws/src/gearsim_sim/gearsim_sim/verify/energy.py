"""The runs whose energy is balanced for docs/energy.md and the tests."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from gearsim_sim.events import FaultSpec
from gearsim_sim.model.faults import REGISTRY
from gearsim_sim.verify.ledger import Ledger, ledger
from gearsim_sim.verify.machines import SEED, model_names, plant_of
from gearsim_sim.verify.trajectory import Course, run

RATE_HZ = 65536.0
OVERSAMPLING = 4
SECONDS = 0.010
LIMIT = 1e-6
# Faults without corners: what they store is a smooth function of angle and displacement.
SMOOTH_KINDS = ("gear_eccentricity", "gear_tooth_crack", "race_waviness", "planet_tooth_crack")


@dataclass(frozen=True)
class EnergyCase:
    """A model, healthy or with a fault that grows over the run, at its nominal speed or on a ramp."""

    model: str
    kind: str = ""
    ramp: bool = False

    def __str__(self) -> str:
        what = f"{self.kind} growing" if self.kind else "healthy"
        return f"{self.model}, {what}{', speed and load on a ramp' if self.ramp else ''}"


def energy_cases() -> Iterator[EnergyCase]:
    """Every model healthy, on a ramp, and with each smooth fault that it can have."""
    for model in model_names():
        yield EnergyCase(model)
        yield EnergyCase(model, ramp=True)
        for kind in SMOOTH_KINDS:
            if kind in REGISTRY and REGISTRY[kind].components(plant_of(model)):
                yield EnergyCase(model, kind)


def balance(case: EnergyCase, oversampling: int = OVERSAMPLING, seconds: float = SECONDS) -> Ledger:
    """The ledger of a case.

    Parameters
    ----------
    case : EnergyCase
    oversampling : int
        Steps per sample at 65536 Hz.
    seconds : float
        Length of the run; on a ramp speed falls by a tenth and the load by a fifth within it.
    """
    plant = plant_of(case.model)
    limits = plant.limits
    course = Course(
        seconds,
        limits.speed_hz,
        limits.load_nm,
        end_speed_hz=0.9 * limits.speed_hz if case.ramp else None,
        end_load_nm=0.8 * limits.load_nm if case.ramp else None,
        growth_s=seconds,
    )
    faults = []
    if case.kind:
        kind = REGISTRY[case.kind]
        faults.append(kind.build(FaultSpec(case.kind, kind.components(plant)[0]), plant, SEED))
    return ledger(run(plant, course, RATE_HZ * oversampling, faults))
