"""Faults of gear teeth as stiffness losses and transmission errors over a gear's turn."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gearsim_io.errors import InputError
from gearsim_sim.model.tooth import crack as cracks
from gearsim_sim.model.tooth.contact import ToothContact
from gearsim_sim.model.tooth.crack import Crack, crack_stiffness_loss, cracked_pair_loss, depth_to_middle_m
from gearsim_sim.model.tooth.flanks import (
    Relief,
    ToothSpall,
    relief_depth,
    spall_depth,
    spall_error,
    spall_extent,
    specific_sliding,
    wear_depth,
)
from gearsim_sim.model.tooth.gear import SpurGear
from gearsim_sim.model.tooth.pair import GearPair
from gearsim_sim.model.tooth.runout import eccentricity_error, eccentricity_stiffness
from gearsim_sim.model.tooth.sharing import loaded_error_series, loaded_mesh, shares, tooth_error_series
from gearsim_sim.model.tooth.stiffness import mesh_stiffness, pair_stiffness, stiffness_series
from gearsim_sim.model.tooth.windows import shifted, stretched, truncation_error

MODULE = 2 * 0.0463 / 32 / math.cos(math.radians(20))
RIG = SpurGear(32, MODULE, 0.0175, 0.0125, name="rig")
PAIR = GearPair(RIG, RIG)
PLANET = SpurGear(20, 2e-3, 0.02, 5e-3, fillet=0.3, name="planet")
SUN_MESH = GearPair(PLANET, SpurGear(40, 2e-3, 0.02, 12e-3, fillet=0.3, name="sun"))
RING_MESH = GearPair(PLANET, SpurGear(80, 2e-3, 0.02, 95e-3, internal=True, fillet=0.3, name="ring"))
PHASE = np.linspace(-0.8, 0.8, 9)


# Crack


@pytest.mark.parametrize("opens", [True, False])
def test_the_deeper_the_crack_the_softer_the_tooth(opens):
    depths = np.linspace(0.05e-3, 1.55 * depth_to_middle_m(RIG), 40)
    losses = np.array([cracked_pair_loss(PAIR, Crack(q), PHASE, of_wheel=False, opens=opens) for q in depths])
    assert np.all(np.diff(losses, axis=0) > 0)
    assert np.all(losses[0] < 1e-3 * pair_stiffness(PAIR, PHASE))  # a scratch costs nothing
    assert np.all(losses < 0.6 * pair_stiffness(PAIR, PHASE))


def test_a_crack_halves_the_section():
    """Down to the middle line: at the crack's tip half the thickness is left, elsewhere no more than that
    and a part of the flank; far above the tip corner is whole."""
    root = cracks.root_of(RIG)
    outline = cracks.tooth_outline(RIG, root, np.array([RIG.roll_rad(RIG.tip_radius_m)]))
    left = cracks._left_of_section(RIG, root, outline, depth_to_middle_m(RIG), math.pi / 4)
    start_height, start_half = root.weakest(internal=False)
    tip_height = start_height - start_half  # 45 degrees
    above = outline.height_m > tip_height
    assert np.all(left[~above] == outline.half_m[~above])
    near = np.argmin(np.where(above, outline.height_m, np.inf))
    assert 0 <= left[0, near] < 0.25 * start_half
    assert left[0, -1] == pytest.approx(outline.half_m[0, -1], rel=0.02)


def test_where_a_crack_ends():
    """Sections below its tip are whole: straight across at the height where it begins, else further down."""
    root = cracks.root_of(RIG)
    outline = cracks.tooth_outline(RIG, root, np.array([RIG.roll_rad(RIG.tip_radius_m)]))
    start_height, _ = root.weakest(internal=False)
    for angle, drop in ((math.pi / 2, 0.0), (math.pi / 3, 0.5e-3)):
        left = cracks._left_of_section(RIG, root, outline, 1e-3, angle)
        cut = outline.height_m[left < outline.half_m - 1e-12].min()
        below = outline.height_m[outline.height_m < start_height - drop].max()
        assert cut > start_height - drop >= below
        assert cut - below < 0.1e-3


def test_crack_along_a_part_of_the_face():
    """Springs side by side: half the width loses less than half of it all; running out costs less still."""
    through = cracked_pair_loss(PAIR, Crack(3e-3), PHASE, of_wheel=False, opens=True)
    half = cracked_pair_loss(
        PAIR, Crack(3e-3, width_m=RIG.face_width_m / 2), PHASE, of_wheel=False, opens=True
    )
    full = cracked_pair_loss(PAIR, Crack(3e-3, width_m=RIG.face_width_m), PHASE, of_wheel=False, opens=True)
    assert np.all((half < 0.5 * full) | (half < full))
    assert np.all(full < through)
    assert np.all(half > 0)


def test_a_crack_opens_in_one_mesh_of_a_planet_and_closes_in_the_other():
    crack = Crack(depth_to_middle_m(PLANET))
    opening = crack_stiffness_loss(SUN_MESH, crack, opens=True)
    closing = crack_stiffness_loss(SUN_MESH, crack, opens=False)
    slot = crack_stiffness_loss(SUN_MESH, replace(crack, closing=1.0), opens=False)
    turns = np.arange(2000) / 2000
    assert opening.value(turns).min() < 2 * closing.value(turns).min() < 0
    assert closing.mean == pytest.approx(0.3 * slot.mean, rel=1e-12)
    # A slot bends from either side; seen from the sound flank the radial part of the force helps less.
    assert 1 < slot.mean / opening.mean < 1.6
    ring = crack_stiffness_loss(RING_MESH, crack, opens=True)
    assert ring.mean < opening.mean  # longer contact with the ring, stiffer pair: more to lose


def test_crack_is_there_once_per_turn():
    """Only while the cracked tooth is in contact, around (tooth + 1/2) / teeth turns."""
    loss = crack_stiffness_loss(PAIR, Crack(4e-3), tooth=5, harmonics=40)
    turns = np.arange(6400) / 6400
    value = loss.value(turns)
    middle = 5.5 / 32
    inside = np.abs(turns - middle) < PAIR.contact_ratio / 64
    assert np.abs(value[~inside]).max() < 0.55 * np.abs(value).max()  # rounded ends
    far = np.abs(turns - middle) > PAIR.contact_ratio / 64 + 0.3 / 32
    assert np.abs(value[far]).max() < 0.01 * np.abs(value).max()
    exact = np.zeros_like(turns)
    phase = (turns - middle) * 32
    exact[inside] = -cracked_pair_loss(PAIR, Crack(4e-3), phase[inside], of_wheel=False, opens=True)
    assert loss.mean == pytest.approx(exact.mean(), rel=3e-3)  # a sample of 334 at the ends
    deep = np.abs(turns - middle) < 0.5 / 32
    assert value[deep] == pytest.approx(exact[deep], abs=0.02 * np.abs(exact).max())


def test_all_teeth_cracked_is_a_softer_gear():
    """Independent sum: 32 single cracks make the mesh stiffness of a wheel with every tooth cracked."""
    phase = np.arange(64) / 64
    single = crack_stiffness_loss(PAIR, Crack(3e-3), harmonics=8)
    total = sum(shifted(single, k / 32).value(phase / 32) for k in range(32))
    mesh = _series_of(lambda t: cracked_pair_loss(PAIR, Crack(3e-3), t, of_wheel=False, opens=True), 8)
    assert total == pytest.approx(-mesh(phase), rel=1e-5)  # trapezium rule of the other side


def _series_of(function, harmonics):
    """Fourier sum by plain summation over the path, with the same Lanczos factors."""
    half = PAIR.contact_ratio / 2
    points = 20_001
    t = np.linspace(-half, half, points)
    weight = np.full(points, t[1] - t[0])
    weight[[0, -1]] /= 2
    values = function(t) * weight

    def series(phase):
        result = np.full(phase.shape, values.sum())
        for n in range(1, harmonics + 1):
            c = np.sum(values * np.exp(-2j * np.pi * n * (t + 0.5))) * np.sinc(n / (harmonics + 1))
            result = result + 2 * (c * np.exp(2j * np.pi * n * phase)).real
        return result

    return series


def test_impossible_cracks_are_refused():
    for crack, word in (
        (Crack(0.0), "depth_m"),
        (Crack(9e-3), "a fifth"),
        (Crack(1e-3, width_m=0.03), "width_m"),
        (Crack(1e-3, angle_rad=0.05), "angle_rad"),
    ):
        with pytest.raises(InputError, match=word):
            crack_stiffness_loss(PAIR, crack)


# Spall


def test_a_flank_dips_into_a_spall_as_far_as_it_can():
    """1 mm at the pitch line (thesis 7.3.2): chord of two circles, c w^2 / 8 in small angles."""
    spall = ToothSpall(1e-3, 0.1e-3)
    own, other = 20e-3 * math.sin(math.radians(20)), 40e-3 * math.sin(math.radians(20))
    first, middle, last = spall_extent(SUN_MESH, spall, of_wheel=False)
    depth = spall_depth(SUN_MESH, spall, np.array([first, middle, last]), of_wheel=False)
    chord = sum(r - math.sqrt(r**2 - 0.5e-3**2) for r in (own, other))
    assert depth == pytest.approx([0, chord, 0], rel=3e-3, abs=1e-15)
    # The planet turns by width / radius of curvature meanwhile.
    assert (last - first) / 20 == pytest.approx(1e-3 / own / (2 * math.pi), rel=0.03)  # own changes by 15 %
    on_ring = spall_depth(
        RING_MESH, spall, np.array([spall_extent(RING_MESH, spall, of_wheel=False)[1]]), of_wheel=False
    )
    assert on_ring == pytest.approx(1e-6 * (1 / own - 1 / (4 * own)) / 8, rel=1e-9)


def test_a_shallow_spall_has_a_floor_and_a_rectangular_one_only_that():
    phase = np.linspace(-0.5, 0.5, 401)
    shallow = spall_depth(SUN_MESH, ToothSpall(1e-3, 5e-6), phase, of_wheel=False)
    assert np.mean(shallow == 5e-6) > 0.2
    square = spall_depth(SUN_MESH, ToothSpall(1e-3, 5e-6, shape="rectangular"), phase, of_wheel=False)
    assert set(np.unique(square)) == {0.0, 5e-6}
    half = spall_depth(SUN_MESH, ToothSpall(1e-3, 5e-6, face_fraction=0.5), phase, of_wheel=False)
    assert half == pytest.approx(shallow / 2)


def test_spall_on_the_wheel_is_met_at_the_same_place_as_on_the_pinion():
    """On the pitch line both flanks are touched at once, whoever has the pit."""
    for mesh in (SUN_MESH, RING_MESH, PAIR):
        spall = ToothSpall(0.5e-3, 1e-4)
        one = spall_extent(mesh, spall, of_wheel=False)
        two = spall_extent(mesh, spall, of_wheel=True)
        assert one[1] == pytest.approx(two[1], abs=1e-9)
        assert two[0] < two[1] < two[2]


def test_spall_error_counts_with_the_share_of_the_load():
    spall = ToothSpall(1e-3, 1e-4)
    series = spall_error(SUN_MESH, spall, harmonics=40)
    turns = np.arange(4000) / 4000
    first, middle, last = spall_extent(SUN_MESH, spall, of_wheel=False)

    def exact(u):
        phase = ((u * 20 - 0.5 + 10) % 20) - 10
        inside = (phase > first) & (phase < last)
        at = np.where(inside, phase, middle)
        return np.where(inside, -spall_depth(SUN_MESH, spall, at, of_wheel=False) * shares(SUN_MESH, at), 0.0)

    rms, largest = truncation_error(series, exact)
    assert rms < 0.01 * np.abs(exact(turns)).max()
    assert largest < 0.15 * np.abs(exact(turns)).max()  # at the sharp middle
    assert series.mean == pytest.approx(exact(turns).mean(), rel=5e-3)


def test_impossible_spalls_are_refused():
    with pytest.raises(InputError, match="width_m"):
        spall_error(SUN_MESH, ToothSpall(5e-3, 1e-4))
    with pytest.raises(InputError, match="radius_m"):
        spall_error(SUN_MESH, ToothSpall(1e-3, 1e-4, radius_m=18.8e-3))


# Wear, relief, load sharing


def test_wear_follows_sliding():
    pitch = (PAIR.pitch_point_m - sum(PAIR.path_m) / 2) / RIG.base_pitch_m
    phase = np.linspace(-PAIR.contact_ratio / 2, PAIR.contact_ratio / 2, 201)
    for of_wheel in (False, True):
        depth = wear_depth(PAIR, phase, of_wheel=of_wheel)
        assert wear_depth(PAIR, np.array([pitch]), of_wheel=of_wheel) == pytest.approx(0, abs=1e-12)
        assert depth.max() == pytest.approx(1, rel=1e-6)
    root_to_tip = wear_depth(PAIR, phase, of_wheel=False)
    assert root_to_tip[:60].max() > 2 * root_to_tip[-60:].max()  # the dedendum wears most
    # Equal gears: the driven flank is the mirror image.
    assert wear_depth(PAIR, phase, of_wheel=True) == pytest.approx(root_to_tip[::-1], rel=1e-6, abs=1e-9)


def test_specific_sliding_from_velocities():
    """Sliding over rolling speed of a flank, from the speeds of the contact point along it."""
    at = np.array([-0.6])
    rho_1, rho_2 = (float(r[0]) for r in SUN_MESH.curvature_radii_m(SUN_MESH.position_m(at)))
    speed_1, speed_2 = 2.0 * rho_1, 1.0 * rho_2  # 20 teeth turn twice as fast as 40
    assert specific_sliding(SUN_MESH, at, of_wheel=False)[0] == pytest.approx(
        abs(speed_1 - speed_2) / speed_1
    )
    assert specific_sliding(SUN_MESH, at, of_wheel=True)[0] == pytest.approx(abs(speed_1 - speed_2) / speed_2)


def test_shares_add_up():
    half = PAIR.contact_ratio / 2
    for phase in (-0.4, 0.1, 0.45):
        pairs = [phase + step for step in (-1, 0, 1) if abs(phase + step) <= half]
        assert sum(shares(PAIR, np.array([one]))[0] for one in pairs) == pytest.approx(1, rel=1e-12)


def test_equal_errors_of_all_teeth_are_that_error():
    """A gear whose flanks all lie 3 um back has a transmission error of -3 um everywhere."""
    series = tooth_error_series(PAIR, lambda t: np.full_like(t, -3e-6), np.ones(32), teeth=32, harmonics=8)
    assert series.value(np.linspace(0, 1, 500)) == pytest.approx(-3e-6, rel=1e-9)


def test_pitch_errors_hold_while_a_pair_is_alone():
    rng = np.random.default_rng(3)
    errors = rng.normal(size=32) * 1e-6
    series = tooth_error_series(PAIR, np.ones_like, errors, teeth=32, harmonics=60)
    assert series.value((np.arange(32) + 0.5) / 32) == pytest.approx(errors, abs=0.03e-6)
    assert series.mean == pytest.approx(errors.mean(), rel=1e-9)


def brute_compression(k, e, force):
    """Bisection of force = sum k max(0, d + e)."""
    low, high = -1e-2, 1e-2
    for _ in range(200):
        middle = (low + high) / 2
        if np.sum(k * np.maximum(0, middle + e)) < force:
            low = middle
        else:
            high = middle
    return (low + high) / 2


def test_load_sharing_under_load():
    """Against bisection; at high load the linear rule; at low load one pair alone."""
    relief = Relief(tip_m=20e-6, root_m=0.0, length=1.0)

    def profile(t):
        return -relief_depth(PAIR, relief, t, of_wheel=False) - relief_depth(PAIR, relief, t, of_wheel=True)

    phase = np.linspace(0, 1, 21)
    for force in (5.0, 1000.0, 1e5):
        stiffness, error = loaded_mesh(PAIR, profile, force, phase)
        for i, u in enumerate(phase):
            t = np.array([u % 1 - 0.5 + s for s in (-1, 0, 1)])
            k, e = pair_stiffness(PAIR, t), profile(t)
            d = brute_compression(k[k > 0], e[k > 0], force)
            assert stiffness[i] * (d + error[i]) == pytest.approx(force, rel=1e-9)
            assert stiffness[i] == pytest.approx(k[(k > 0) & (d + e > 0)].sum(), rel=1e-9)
    alone, _ = loaded_mesh(PAIR, profile, 1e-3, phase[1:-1])
    assert alone.max() < 1.05 * pair_stiffness(PAIR, np.zeros(1))[0]
    together, _ = loaded_mesh(PAIR, profile, 1e6, phase)
    assert together == pytest.approx(mesh_stiffness(PAIR, phase), rel=1e-9)


def test_relief_for_the_load_quietens_the_mesh():
    """Long relief of the right depth: the static transmission error F / k - e varies least at its load."""
    force = 50 / 0.0463
    phase = np.linspace(0, 1, 201)

    def swing(depth):
        relief = Relief(tip_m=depth, length=1.0)

        def profile(t):
            return sum(-relief_depth(PAIR, relief, t, of_wheel=wheel) for wheel in (False, True))

        stiffness, error = loaded_mesh(PAIR, profile, force, phase)
        return np.ptp(force / stiffness - error)

    deflection = force / pair_stiffness(PAIR, np.zeros(1))[0]
    none, right, much = swing(0.0), swing(deflection), swing(10 * deflection)
    assert right < 0.6 * none
    assert right < 0.3 * much


def test_loaded_error_gives_the_compression_under_the_load():
    """With the stiffness of the unmodified mesh: the mean exactly, the curve but for its jumps."""
    relief, force = Relief(tip_m=5e-6, length=0.5), 1000.0

    def profile(t):
        return -relief_depth(PAIR, relief, t, of_wheel=False)

    series = loaded_error_series(PAIR, profile, force, 40)
    phase = (np.arange(1000) + 0.5) / 1000
    k, e = loaded_mesh(PAIR, profile, force, phase)
    exact = force / mesh_stiffness(PAIR, phase) - (force / k - e)
    assert exact.max() < 1e-12 < -exact.min()
    assert series.mean == pytest.approx(exact.mean(), rel=0.01)
    assert np.std(series.value(phase) - exact) < 0.1 * np.abs(exact).max()
    # A heavy load presses all pairs together: what is left is the relief times the share.
    heavy = loaded_error_series(PAIR, profile, 1e6, 40)
    flat = tooth_error_series(PAIR, profile, np.ones(32), teeth=32, harmonics=40)
    assert heavy.value(phase) == pytest.approx(flat.value(phase / 32), abs=0.05 * 5e-6)


# Eccentricity


def test_run_out():
    turns = np.linspace(0, 1, 33)
    assert eccentricity_error(30e-6, 0.4).value(turns) == pytest.approx(
        30e-6 * np.sin(2 * np.pi * turns + 0.4)
    )


def test_eccentricity_modulates_the_mesh():
    """Against the stiffness at the distances of axes that an offset of 0.2 mm makes, turn by turn."""
    offset = 0.2e-3
    series = eccentricity_stiffness(PAIR, offset, 0.7, teeth=32, harmonics=8)
    assert set(series.orders) == {1} | {32 * n + s for n in range(1, 9) for s in (-1, 1)}
    across = 0.7 + math.pi / 2 - PAIR.pressure_angle_rad
    for turns in (0.03, 0.31, 0.77):
        spread = offset * math.sin(2 * math.pi * turns + across)
        moved = stiffness_series(replace(PAIR, spread_m=spread), 8)
        expected = moved.value(turns * 32) - stiffness_series(PAIR, 8).value(turns * 32)
        assert series.value(turns) == pytest.approx(expected, abs=0.1 * np.abs(series.cosine).sum())
    assert replace(PAIR, spread_m=offset).contact_ratio < PAIR.contact_ratio


def test_play_that_a_spread_gives():
    """2 spread sin(a) to first order."""
    spread = GearPair(RIG, RIG, 20e-6)
    assert GearPair(RIG, RIG).backlash_m == pytest.approx(0, abs=1e-15)
    assert spread.backlash_m == pytest.approx(40e-6 * math.sin(math.radians(20)), rel=2e-3)


def test_series_helpers():
    series = stiffness_series(PAIR, 3)
    assert shifted(series, 0.2).value(0.5) == pytest.approx(series.value(0.3), rel=1e-12)
    assert stretched(series, 32).value(0.01) == pytest.approx(series.value(0.32), rel=1e-12)


# Contact law


LAWS = [ToothContact(20e-6), ToothContact(20e-6, 8e-6), ToothContact(0.0, 8e-6), ToothContact(7e-6, 8e-6)]


@pytest.mark.parametrize("law", LAWS)
def test_contact_force_is_the_slope_of_an_energy(law):
    d = np.linspace(-60e-6, 40e-6, 4001)
    step = 1e-10
    slope = [(law.energy(x + step) - law.energy(x - step)) / (2 * step) for x in d]
    assert slope == pytest.approx([law.elastic(x) for x in d], abs=1e-10)
    assert np.abs(np.diff([law.elastic(x) for x in d])).max() <= 1.01 * (d[1] - d[0])  # continuous
    assert (law.elastic(-law.backlash_m / 2) == 0.0) == (law.backlash_m in (0.0, 20e-6))


def test_a_growing_play_begins_with_the_law_of_a_mesh_without_any():
    """Force and damper differ from a plain spring by an amount in proportion to the play, in any state."""
    rng = np.random.default_rng(1)
    states = list(zip(rng.uniform(-60e-6, 60e-6, 500), rng.normal(size=500) * 0.1, strict=True))

    def worst(law):
        plain = [3e8 * d + 2594.0 * v for d, v in states]
        return max(abs(law.force(d, v, 3e8, 2594.0) - one) for (d, v), one in zip(states, plain, strict=True))

    for gap in (0.0, 1e-9):
        effects = [worst(ToothContact(play, gap)) for play in (1e-7, 1e-6, 2e-5)]
        assert effects[0] < 0.01 * effects[2]
        assert effects[1] < 0.1 * effects[2]
    assert worst(ToothContact()) < 1e-9


def test_contact_never_pulls_and_its_damper_dissipates():
    law = ToothContact(20e-6, 5e-6)
    rng = np.random.default_rng(0)
    for d, v in zip(rng.uniform(-60e-6, 40e-6, 3000), rng.normal(size=3000) * 0.1, strict=True):
        force = law.force(d, v, 3e8, 2594.0)
        elastic = 3e8 * law.elastic(d)
        assert (force - elastic) * v >= 0
        assert force >= 0 if d > 0 else force <= 0
        if -20e-6 <= d <= 0:
            assert force == 0
    assert abs(law.force(1e-12, -1.0, 3e8, 2594.0)) < 1e-2  # continuous at touch, however fast


def test_a_face_is_a_row_of_springs():
    """Against 4000 strips that touch one after the other, with play and without."""
    law = ToothContact(5e-6, 8e-6)
    strips = (np.arange(4000) + 0.5) / 4000 * 8e-6
    for d in (1e-6, 7.9e-6, 8.1e-6, 3e-5, -2e-6, -9e-6, -3e-5):
        held, free = abs(d) - strips, (d if d > 0 else -d - 5e-6) - strips
        force = 0.75 * np.maximum(0, held).mean() + 0.25 * np.maximum(0, free).mean()  # 5 of 20 um
        assert law.elastic(d) == pytest.approx(np.sign(d) * force, abs=1e-12)
        slope = 0.75 * np.mean(held > 0) + 0.25 * np.mean(free > 0)
        assert law.slope(d) == pytest.approx(slope, abs=1e-3)


def test_no_play_is_a_plain_spring():
    law = ToothContact()
    for d in (-3e-6, 0.0, 2e-6):
        assert law.elastic(d) == d
        assert law.energy(d) == d**2 / 2
    # A lead error costs half its gap once the whole face touches.
    assert ToothContact(0.0, 4e-6).elastic(10e-6) == pytest.approx(8e-6)
    assert ToothContact(0.0, 4e-6).slope(1e-6) == 0.25
