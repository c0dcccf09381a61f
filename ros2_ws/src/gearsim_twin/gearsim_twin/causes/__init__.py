"""The causes, one file each: physics that a model may lack.

A new cause costs one file and one line in `_ALL` (with its import): an instance of its class.
"""

from __future__ import annotations

from gearsim_twin.causes.antialias_rolloff import AntialiasRolloff
from gearsim_twin.causes.backlash_contact_loss import BacklashContactLoss
from gearsim_twin.causes.bearing_clearance import BearingClearance
from gearsim_twin.causes.bearing_geometry import BearingGeometry
from gearsim_twin.causes.bearing_spall_ball import BearingSpallBall
from gearsim_twin.causes.bearing_spall_inner import BEARING_SPALL_INNER
from gearsim_twin.causes.bearing_spall_outer import BEARING_SPALL_OUTER
from gearsim_twin.causes.cage_slip import CageSlip
from gearsim_twin.causes.carrier_modulation import CarrierModulation
from gearsim_twin.causes.casing_resonance import CasingResonance
from gearsim_twin.causes.cause import Cause, Content, Parameter, Values
from gearsim_twin.causes.clipping import Clipping
from gearsim_twin.causes.coloured_floor import ColouredFloor
from gearsim_twin.causes.context import Context, Difference
from gearsim_twin.causes.dropouts import Dropouts
from gearsim_twin.causes.gear_runout import GearRunout
from gearsim_twin.causes.inverter_lines import InverterLines
from gearsim_twin.causes.load_fluctuation import LoadFluctuation
from gearsim_twin.causes.looseness import Looseness
from gearsim_twin.causes.mains_interference import MainsInterference
from gearsim_twin.causes.misalignment import Misalignment
from gearsim_twin.causes.mislabelled_record import MislabelledRecord
from gearsim_twin.causes.missing_gear_stage import MissingGearStage
from gearsim_twin.causes.oil_film import OilFilm
from gearsim_twin.causes.planet_position_error import PlanetPositionError
from gearsim_twin.causes.prior import LogNormal, Normal, Prior, Uniform
from gearsim_twin.causes.sensor_resonance import SensorResonance
from gearsim_twin.causes.shaft_speed_offset import ShaftSpeedOffset
from gearsim_twin.causes.speed_fluctuation import SpeedFluctuation
from gearsim_twin.causes.tooth_crack import ToothCrack
from gearsim_twin.causes.tooth_pitch_error import ToothPitchError
from gearsim_twin.causes.tooth_spall import ToothSpall
from gearsim_twin.causes.tooth_wear import ToothWear
from gearsim_twin.causes.transfer_path import TransferPath
from gearsim_twin.causes.unbalance import Unbalance
from gearsim_twin.causes.unequal_load_sharing import UnequalLoadSharing
from gearsim_twin.causes.unit_or_gain_error import UnitOrGainError
from gearsim_twin.causes.wide_spall import WideSpall

_ALL: tuple[Cause, ...] = (
    AntialiasRolloff(),
    BEARING_SPALL_INNER,
    BEARING_SPALL_OUTER,
    BacklashContactLoss(),
    BearingClearance(),
    BearingGeometry(),
    BearingSpallBall(),
    CageSlip(),
    CarrierModulation(),
    CasingResonance(),
    Clipping(),
    ColouredFloor(),
    Dropouts(),
    GearRunout(),
    InverterLines(),
    LoadFluctuation(),
    Looseness(),
    MainsInterference(),
    Misalignment(),
    MislabelledRecord(),
    MissingGearStage(),
    OilFilm(),
    PlanetPositionError(),
    SensorResonance(),
    ShaftSpeedOffset(),
    SpeedFluctuation(),
    ToothCrack(),
    ToothPitchError(),
    ToothSpall(),
    ToothWear(),
    TransferPath(),
    Unbalance(),
    UnequalLoadSharing(),
    UnitOrGainError(),
    WideSpall(),
)

CAUSES: dict[str, Cause] = {cause.name: cause for cause in _ALL}
"""By published name."""

__all__ = [
    "CAUSES",
    "Cause",
    "Content",
    "Context",
    "Difference",
    "LogNormal",
    "Normal",
    "Parameter",
    "Prior",
    "Uniform",
    "Values",
]
