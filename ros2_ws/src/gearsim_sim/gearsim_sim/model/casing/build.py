"""From a description to a structure, and from a structure to the reduced casing that ships."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from gearsim_io.errors import InputError
from gearsim_sim.model.casing.described import Described
from gearsim_sim.model.casing.geometry import casing_mesh
from gearsim_sim.model.casing.reduced import Foot, ReducedCasing, Site, modal_damping
from gearsim_sim.model.casing.reduction import ACCURACY, Reduction, Tell, craig_bampton
from gearsim_sim.model.casing.ring_housing import RingHousing, housing_mesh
from gearsim_sim.model.casing.sites import SitePlace, default_sites, recover_sites, site_nodes
from gearsim_sim.model.casing.structure import MeshedStructure, Structure, assemble, thicknesses_m

MODES = 100  # of the thesis's casing (4.3.2)


def build_structure(params: Described, *, free: bool = False) -> MeshedStructure:
    """Mesh a casing and assemble it; `free` leaves its pads out, as in a modal test on elastic ropes."""
    mesh = housing_mesh(params) if isinstance(params, RingHousing) else casing_mesh(params)
    if free:
        mesh = dataclasses.replace(mesh, pads=())
    return assemble(mesh, thicknesses_m(params, mesh.regions), params.material, params.name)


def reduce_casing(
    params: Described,
    modes: int = MODES,
    extra_sites: Iterable[SitePlace] = (),
    band_hz: float | None = None,
    tell: Tell = lambda _step, _done: None,
) -> ReducedCasing:
    """Build and reduce a casing with its default sites and `extra_sites`.

    Parameters
    ----------
    params : CasingParams or RingHousing
    modes : int
        Kept besides the six displacements of each master.
    extra_sites : iterable of SitePlace
    band_hz : float, optional
        The reduction must be valid up to here, else InputError.
    tell : callable
        Hears the steps, as in `craig_bampton`.
    """
    tell("mesh and matrices", 0.0)
    structure = build_structure(params)
    places = (*default_sites(params), *extra_sites)
    reach = params.mesh.plate_size_m
    site_nodes(structure, places, reach)  # a misplaced sensor is told before the work, not after
    reduction = craig_bampton(structure, modes, tell)
    sites = recover_sites(structure, reduction, places, reach)
    reduced = finish(
        structure, reduction, sites, params.damping_ratio, band_hz, {"description": params.description}
    )
    return dataclasses.replace(reduced, feet=feet_of(structure, reduction))


def feet_of(structure: MeshedStructure, reduction: Reduction) -> tuple[Foot, ...]:
    """The casing's pads, each lifted by the mean of its nodes."""
    up = np.array([0.0, 1.0, 0.0])
    return tuple(
        Foot(
            pad.name,
            pad.stiffness_n_per_m[1],
            np.mean([reduction.rows(structure.row(int(node), up))[0] for node in pad.nodes], axis=0),
        )
        for pad in structure.mesh.pads
    )


def finish(
    structure: Structure,
    reduction: Reduction,
    sites: tuple[Site, ...],
    damping_ratio: float,
    band_hz: float | None,
    about: Mapping[str, Any],
) -> ReducedCasing:
    """The reduced casing with its damping and what is known about its accuracy."""
    modes = len(reduction.mass) - len(reduction.held)
    if band_hz is not None and reduction.valid_hz < band_hz:
        # The number of modes of plates grows in proportion to frequency.
        needed = int(np.ceil(1.1 * max(modes, 1) * band_hz / max(reduction.valid_hz, 1.0)))
        enough = needed < structure.size - len(reduction.held)
        expected = f"about {needed}" if enough else "more than there are displacements"
        what = f"{modes} (valid up to {reduction.valid_hz:.0f} Hz)"
        raise InputError(structure.name, "modes", what, f"{expected} for {band_hz:g} Hz")
    return ReducedCasing(
        name=structure.name,
        masters=reduction.masters,
        positions_m=np.array([structure.positions_m[name] for name in reduction.masters]),
        mass=reduction.mass,
        stiffness=reduction.stiffness,
        damping=modal_damping(reduction.mass, reduction.stiffness, damping_ratio),
        sites=sites,
        valid_hz=reduction.valid_hz,
        provenance={
            **about,
            "displacements": structure.size,
            "modes": modes,
            "cutoff_hz": reduction.cutoff_hz,
            "residual_vectors": reduction.residuals,
            "accuracy": ACCURACY,
            "damping_ratio": damping_ratio,
        },
    )
