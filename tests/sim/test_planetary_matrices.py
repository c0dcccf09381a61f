"""The planetary model against the flat oracle, Table 7.6, and closed forms."""

import math

import numpy as np
import pytest
from oracles import plain_planetary as plain
from oracles.plain_planetary import PRINTED, READING, TABLE_7_6, eigenvalues
from scipy.linalg import eigh

from gearsim_io.errors import InputError
from gearsim_io.machines import load_machine
from gearsim_sim.model.planet_geometry import RING, SUN, make_geometry
from gearsim_sim.model.planetary import assemble, mean_stiffness, mesh_name, rigid_vector
from gearsim_sim.params.planetary import load_planetary_params


def machine(**overrides):
    params = load_planetary_params(overrides=overrides or None, source="test")
    geometry = make_geometry(params)
    return params, geometry, assemble(params, geometry)


@pytest.fixture(scope="module")
def ours():
    return machine()


@pytest.fixture(scope="module")
def system(ours):
    return ours[2]


@pytest.mark.parametrize("reading", [READING, PRINTED], ids=["reading", "printed"])
def test_matrices_equal_the_flat_oracle(reading):
    names = ("ring.inertia", "ring_support.damping", "ring_support.torsional_damping")
    units = ("kg*m^2", "N*s/m", "N*m*s/rad")
    values = {n: f"{v} {u}" for n, v, u in zip(names, reading.values(), units, strict=True)}
    _, _, system = machine(**values)
    mass, damping, stiffness = plain.matrices(**reading)
    for left, right in ((system.mass, mass), (system.damping, damping), (system.stiffness, stiffness)):
        assert np.abs(left - right).max() <= 1e-13 * np.abs(right).max()
    got = eigh(system.stiffness, system.mass, eigvals_only=True)
    assert np.sqrt(got[1:]) == pytest.approx(np.sqrt(eigh(stiffness, mass, eigvals_only=True)[1:]), rel=1e-9)
    # The notes' figure for both readings: 14.6 kHz.
    fastest = np.abs(eigenvalues(system.mass, system.damping, system.stiffness)).max() / (2 * np.pi)
    assert fastest == pytest.approx(14.6e3, rel=5e-3)


def test_table_7_6_rigid_body_mode(ours):
    """The mode that the matrices have is the printed one, to its printed digits."""
    _, geometry, system = ours
    mode = eigh(system.stiffness, system.mass)[1][:, 0]
    mode *= TABLE_7_6[2] / mode[2]
    assert np.abs(mode - TABLE_7_6).max() < 1e-5 * np.abs(TABLE_7_6).max()
    exact = system.direction(rigid_vector(geometry)) * TABLE_7_6[2]
    assert np.abs(exact - TABLE_7_6).max() < 1e-5
    assert mode @ system.mass @ mode == pytest.approx(0.374, abs=5e-4)


@pytest.mark.parametrize(
    ("name", "angles"),
    [
        ("unsw_planetary", None),
        ("unsw_planetary_hunting", None),
        ("unsw_planetary", (0, 90, 180, 270)),
        ("unsw_planetary", (0, 117, 246)),
        ("unsw_planetary", (15,)),
    ],
)
def test_one_free_motion_and_only_one(name, angles):
    """Symmetry, no other mode without energy, nothing acts on the rigid one: for any planets."""
    params = load_planetary_params(name)
    if angles is not None:
        stage = params.stage
        fields = {one: getattr(stage, one) for one in stage.__dataclass_fields__}
        fields["planet_angles_rad"] = tuple(math.radians(angle) for angle in angles)
        params = params.model_copy(update={"stage": type(stage)(**fields)})
    geometry = make_geometry(params)
    system = assemble(params, geometry)
    assert len(system.dof_names) == 9 + 3 * params.planets
    for matrix in (system.mass, system.damping, system.stiffness):
        assert np.array_equal(matrix, matrix.T)
        assert np.linalg.eigvalsh(matrix)[0] > -1e-9 * np.abs(matrix).max()
    squared = eigh(system.stiffness, system.mass, eigvals_only=True)
    assert abs(squared[0]) < 1e-12 * squared[-1]
    assert squared[1] > (2 * np.pi * 100) ** 2
    rigid = system.direction(rigid_vector(geometry))
    for matrix in (system.stiffness, system.damping):
        assert np.abs(matrix @ rigid).max() < 1e-14 * np.abs(matrix).max()
    # Transmission errors, stiffness changes and bearing forces do no work on it.
    assert np.abs(system.interfaces.T @ rigid).max() < 1e-15


@pytest.mark.parametrize("trial", range(3))
def test_error_forces_equal_the_flat_oracle(system, trial):
    """F_a of (7.36) is what an error put in series with the teeth brings about."""
    rng = np.random.default_rng(trial)
    errors, rates = rng.normal(size=(2, 3)) * 1e-6, rng.normal(size=(2, 3)) * 1e-3
    expected = plain.error_force(errors[SUN], errors[RING], rates[SUN], rates[RING])
    force = np.zeros(18)
    for side in (SUN, RING):
        for planet in range(3):
            column = system.interfaces[:, system.interface_names.index(mesh_name(side, planet))]
            force -= column * (3e8 * errors[side, planet] + 620 * rates[side, planet])
    # Rows are sums of six terms of the same size.
    assert np.abs(force - expected).max() <= 1e-13 * np.abs(expected).max()


def test_kinematics_of_tables_7_3_and_7_4():
    """All frequencies of Table 7.4 at 6 Hz of the input shaft; the thesis rounds 2.133 to 2.13 Hz."""
    plate = load_machine("unsw_planetary")
    (stage,) = plate.planetary_stages
    speed = {shaft.name: shaft.nominal_speed_hz for shaft in plate.shafts}
    assert speed["input"] == pytest.approx(6.0)
    assert speed["carrier"] == pytest.approx(2.13, abs=5e-3)
    assert speed["output"] == pytest.approx(6.39, rel=2e-3)
    assert speed["planet"] == pytest.approx(8.52, rel=2e-3)
    assert plate.gear_meshes[0].driving_teeth * speed["input"] == pytest.approx(192)
    assert stage.ring_teeth * speed["carrier"] == pytest.approx(170.4, rel=2e-3)
    assert len(stage.planet_angles_rad) * speed["carrier"] == pytest.approx(6.39, rel=2e-3)
    turns = stage.member_ratios()
    assert (turns["carrier"], turns["planet"] + turns["carrier"], turns["ring"], turns["sun"]) == (
        1,
        -3,
        0,
        3,
    )


def test_torques_of_section_7_4(ours):
    """Power balance (7.11) to (7.13): 140.6 N m at the carrier, 46.9 at the sun, the ring holds the rest."""
    _, geometry, system = ours
    rigid = system.direction(rigid_vector(geometry))
    motor, load, _ = rigid @ system.inputs
    carrier = -load * 46.875 / motor
    assert carrier == pytest.approx(140.625)
    force = system.inputs @ np.array([carrier, 46.875, 0.0])
    x = np.linalg.lstsq(system.stiffness, force, rcond=None)[0]
    held = -5.65e6 * x[system.dof("theta_r")]  # by the support, on the ring
    assert held == pytest.approx(-(140.625 - 46.875), rel=1e-6)
    # All six meshes are pressed together, alike: T_s / (3 R_s).
    teeth = 3e8 * (system.interfaces.T @ x)[:6]
    assert teeth == pytest.approx(np.full(6, 46.875 / 3 / plain.RS), rel=1e-6)


def test_contact_ratios(ours):
    _, geometry, _ = ours
    assert [contact.ratio for contact in geometry.contacts] == pytest.approx([1.64, 1.89], abs=5e-3)


def test_pair_stiffness_gives_the_mean_by_the_contact_ratio():
    """2.8e8 N/m of one pair (thesis 7.5.1): 36 % of the time one, 64 % two pairs in the sun's mesh."""
    params, geometry, _ = machine(**{"mesh.pair_stiffness": "2.8e8 N/m", "mesh.pair_stiffness_ratio": "2"})
    for side, ratio in ((SUN, 1.6351860), (RING, 1.8896813)):
        assert mean_stiffness(params, geometry, side) == pytest.approx(2.8e8 * ratio, rel=1e-6)


def tooth_positions(geometry, side, planet, carrier_turns):
    """Distance along the pitch circle from the planet's pitch point to its nearest flank, in pitches.

    From the drawing alone: planet rolls in the ring and turns; its flanks are half a pitch apart.
    """
    stage = geometry.stage
    psi = stage.planet_angles_rad[planet] + 2 * np.pi * carrier_turns  # in space
    ring, own = stage.ring_teeth, stage.planet_teeth
    # The ring has flanks at angles 2 pi k / Z_r; a planet's driven flank lies on one at the pitch point.
    trailing = ring * psi / (2 * np.pi)  # how far the planet has rolled, in pitches
    if side == RING:
        return trailing % 1.0
    # Sense of turning: seen on the planet, tooth flanks move from ring to sun by half its circle.
    leading = trailing + 0.5  # the other flank of the same tooth is half a pitch ahead
    return (leading - own / 2) % 1.0


@pytest.mark.parametrize("name", ["unsw_planetary", "unsw_planetary_hunting"])
def test_mesh_phases(name):
    """Phases from tooth numbers against rolling the planet by hand; sequential (7.17)."""
    params = load_planetary_params(name)
    geometry = make_geometry(params)
    stage = params.stage
    for side in (SUN, RING):
        for planet in range(3):
            expected = tooth_positions(geometry, side, planet, 0.0)
            got = geometry.phase_offset(side, planet)
            assert abs((got - expected + 0.5) % 1 - 0.5) < 1e-9
            tooth = geometry.planet_offset_turns(side, planet) * stage.planet_teeth
            assert abs((tooth - got + 0.5) % 1 - 0.5) < 1e-9
    # Parker and Lin: the sun counts its own teeth, backwards, and comes to the same phase.
    for planet, psi in enumerate(stage.planet_angles_rad):
        own = -stage.sun_teeth * psi / (2 * np.pi) + geometry.sun_ring_phase
        assert abs((own - geometry.phase_offset(SUN, planet) + 0.5) % 1 - 0.5) < 1e-9
    # Three planets, not in phase, and their phases add up to nothing.
    phases = [2 * np.pi * geometry.phase_offset(RING, planet) for planet in range(3)]
    assert abs(np.exp(1j * np.array(phases)).sum()) < 1e-9


def test_gyroscopic_terms_are_small(system):
    """What the carrier's frame leaves out shifts no mode below 4 kHz by more than 3e-4 at 2.13 Hz."""
    speed = 2 * np.pi * 64 / 30
    turning = np.zeros((18, 18))
    for body in (0, 3, 6, 9, 12, 15):
        turning[body, body + 1], turning[body + 1, body] = -2, 2
    coriolis = speed * system.mass @ turning
    flat = np.diag([0.0 if name.startswith("theta") else 1.0 for name in system.dof_names])
    centrifugal = speed**2 * system.mass @ flat
    without = np.sort_complex(eigenvalues(system.mass, np.zeros((18, 18)), system.stiffness))
    with_all = np.sort_complex(eigenvalues(system.mass, coriolis, system.stiffness - centrifugal))
    frequency = np.sort(np.abs(without.imag))[2:]
    change = np.abs(np.sort(np.abs(with_all.imag))[2:] / frequency - 1)
    # First order in speed: twins split by the speed itself, 2.13 Hz at most.
    assert np.all(change * frequency <= 1.05 * speed)
    assert change.max() < 4e-3
    assert change[frequency > 2 * np.pi * 2000].max() < 1e-3


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        ({"teeth.addendum": 1.2}, "undercut"),
        ({"teeth.addendum": 0.5}, "contact is lost"),
        ({"drive.speed": "10 Hz"}, "<= 6"),
    ],
)
def test_impossible_stages_are_refused(overrides, words):
    with pytest.raises(InputError) as error:
        machine(**overrides)
    assert words in str(error.value)
