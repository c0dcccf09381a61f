"""Dimensions of finite-element shafts: the section `finite_shafts` of a parallel-shaft gearbox."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from gearsim_io.quantities import Si
from gearsim_sim.params.fields import Count, Strict
from gearsim_sim.params.parts import TorsionalEnd


class FiniteShaft(Strict):
    """One shaft, from its coupling to its encoder; what it carries at the coupling's end is lumped there."""

    coupling_overhang_m: Annotated[float, Si("m", gt=0), Field(alias="coupling_overhang")]
    """From the coupling to the near bearing."""
    near_span_m: Annotated[float, Si("m", gt=0), Field(alias="near_span")]
    """From the near bearing to the wheel."""
    far_span_m: Annotated[float, Si("m", gt=0), Field(alias="far_span")]
    """From the wheel to the far bearing."""
    encoder_overhang_m: Annotated[float, Si("m", gt=0), Field(alias="encoder_overhang")]
    """From the far bearing to the encoder."""
    coupling_mass_kg: Annotated[float, Si("kg", ge=0), Field(alias="coupling_mass")]
    """Lumped at the coupling's end."""
    coupling_inertia_kg_m2: Annotated[float, Si("kg*m^2", gt=0), Field(alias="coupling_inertia")]
    """About the axis, lumped at the coupling's end."""
    flywheel: TorsionalEnd
    encoder: TorsionalEnd


class FiniteShafts(Strict):
    """Both shafts, of steel, as beams of Timoshenko; their wheels are rigid discs as wide as the teeth."""

    diameter_m: Annotated[float, Si("m", gt=0), Field(alias="diameter")]
    """Of both shafts."""
    youngs_modulus_pa: Annotated[float, Si("Pa", gt=0), Field(alias="youngs_modulus")]
    """Of shafts and wheels."""
    poissons_ratio: Annotated[float, Si("", gt=-1, lt=0.5)]
    """Of the shafts."""
    density_kg_per_m3: Annotated[float, Si("kg/m^3", gt=0), Field(alias="density")]
    """Of shafts and wheels."""
    ring_mass_kg: Annotated[float, Si("kg", ge=0), Field(alias="ring_mass")]
    """Of the inner ring of a bearing with its balls, on the shaft."""
    element_length_m: Annotated[float, Si("m", gt=0), Field(alias="element_length")]
    """Longest element."""
    modes: Count
    """With the masters held, of both shafts together."""
    damping_ratio: Annotated[float, Si("", ge=0, lt=1)]
    """Of each elastic mode of a free shaft, over the critical one."""
    input: FiniteShaft
    output: FiniteShaft
