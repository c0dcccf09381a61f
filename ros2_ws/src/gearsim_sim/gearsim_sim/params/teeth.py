"""Geometry and material of the teeth of a spur pair, from the `teeth` section of a model."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field

from gearsim_io.quantities import Si
from gearsim_sim.model.tooth.gear import SpurGear
from gearsim_sim.model.tooth.pair import GearPair
from gearsim_sim.params.fields import Strict


class Teeth(Strict):
    """What the nameplate does not tell of two spur gears in mesh."""

    module_m: Annotated[float, Si("m", gt=0), Field(alias="module")]
    """Module of the basic rack."""
    pressure_angle_rad: Annotated[float, Si("rad", gt=0, lt=math.pi / 4), Field(alias="pressure_angle")]
    """Pressure angle of the basic rack."""
    addendum: Annotated[float, Si("", gt=0, le=1.5)]
    """Height of the teeth above the pitch circle, over the module."""
    dedendum: Annotated[float, Si("", gt=0, le=2)]
    """Depth of the spaces below the pitch circle, over the module."""
    fillet: Annotated[float, Si("", ge=0, lt=1)]
    """Radius of the root fillets, over the module."""
    face_width_m: Annotated[float, Si("m", gt=0), Field(alias="face_width")]
    """Length of the teeth along the axis."""
    pinion_bore_radius_m: Annotated[float, Si("m", gt=0), Field(alias="pinion_bore_radius")]
    """Where the pinion's body is held; root radius over bore radius 1.4 to 7."""
    gear_bore_radius_m: Annotated[float, Si("m", gt=0), Field(alias="gear_bore_radius")]
    """Where the gear's body is held; root radius over bore radius 1.4 to 7."""
    youngs_modulus_pa: Annotated[float, Si("Pa", gt=0), Field(alias="youngs_modulus")]
    """Of both gears."""
    poisson_ratio: Annotated[float, Si("", ge=0, lt=0.5)]
    """Of both gears."""
    pinion_shift: Annotated[float, Si("", ge=-1, le=1.5)] = 0.0
    """Profile shift of the pinion, over the module."""
    gear_shift: Annotated[float, Si("", ge=-1, le=1.5)] = 0.0
    """Profile shift of the gear, over the module."""

    def pair(self, pinion_teeth: int, gear_teeth: int) -> GearPair:
        """The gears in mesh; InputError if there are no such gears."""
        pinion = self._gear("pinion", pinion_teeth, self.pinion_bore_radius_m, self.pinion_shift)
        return GearPair(pinion, self._gear("gear", gear_teeth, self.gear_bore_radius_m, self.gear_shift))

    def _gear(self, name: str, teeth: int, bore_radius_m: float, shift: float) -> SpurGear:
        return SpurGear(
            teeth=teeth,
            module_m=self.module_m,
            face_width_m=self.face_width_m,
            hub_radius_m=bore_radius_m,
            pressure_angle_rad=self.pressure_angle_rad,
            addendum=self.addendum,
            dedendum=self.dedendum,
            fillet=self.fillet,
            profile_shift=shift,
            youngs_modulus_pa=self.youngs_modulus_pa,
            poisson_ratio=self.poisson_ratio,
            name=name,
        )
