"""What thesis chapter 7 reports of the planetary stage's signals, over ten seeds.

Run-out is 5 um here instead of the 20 um of (7.40): with these the force of a mesh swings between nothing
and twice its mean, and a cracked tooth that comes round unloaded makes no impulse (`docs/planetary.md`).
Spalls are rectangular as in thesis Figure 7.10, of a depth that gives kurtoses of the size of Table 7.7.
"""

from functools import lru_cache

import numpy as np
import pytest
from oracles import plain_planetary as plain
from planet_signals import RATE_HZ, ar_residual, best_residual, envelope, impulses, kurtosis

from gearsim_sim.engine import Engine
from gearsim_sim.events import FaultSpec
from gearsim_sim.model import planet_plant
from gearsim_sim.model.plant import RotatingSite
from gearsim_sim.params import load_planetary_params

CARRIER_HZ = 32 / 15
SEEDS = range(10)
NOISE_MS2 = 0.05  # of the sensors, white, as without it a prediction of lines leaves rounding errors only
SECONDS = 2.2
# Top and side of the ring: both stand, so they turn against the carrier's frame.
SITES = {
    "ring": RotatingSite({"x_r": 1.0}, {"y_r": 1.0}, 0, -1.0, 0.25),
    "ring_side": RotatingSite({"x_r": 1.0}, {"y_r": 1.0}, 0, -1.0, 0.0),
    "carrier": {"y_c": 1.0, "theta_c": 0.060},
}
CASES = {
    "healthy": None,
    "crack": ("planet_tooth_crack", {"closing": 1.0}),
    "spall_sun": ("planet_tooth_spall", {"side": "sun", "shape": "rectangular", "depth_m": 0.4e-6}),
    "spall_ring": ("planet_tooth_spall", {"side": "ring", "shape": "rectangular", "depth_m": 0.4e-6}),
    "real_spall_sun": ("planet_tooth_spall", {"side": "sun"}),
    "real_spall_ring": ("planet_tooth_spall", {"side": "ring"}),
}


@lru_cache
def record(case, seed, casing=False):
    """Noisy records of all sites; the faulty tooth, and so the places of the impulses, go with the seed."""
    overrides = {"gear_errors.runout": "5 um", "casing.included": int(casing)}
    faults = []
    if CASES[case] is not None:
        kind, params = CASES[case]
        faults = [FaultSpec(kind, "planet_1", {**params, "tooth": 1 + 2 * seed})]
    engine = Engine(load_planetary_params(overrides=overrides), seed, RATE_HZ, 8, faults, sites=SITES)
    output = engine.advance(int(SECONDS * RATE_HZ))
    noise = NOISE_MS2 * np.random.default_rng(seed).normal(size=output.accel.shape)
    return dict(zip(output.site_names, output.accel + noise, strict=True))


@lru_cache
def ring_kurtosis(case, seed, casing=False):
    return kurtosis(best_residual(record(case, seed, casing)["ring"]))


def on_both_ring_sensors(case, seed, **options):
    signals = record(case, seed)
    return impulses(
        [ar_residual(signals[name], 240) for name in ("ring", "ring_side")], CARRIER_HZ, **options
    )


@pytest.mark.parametrize("seed", SEEDS)
def test_impulses_in_four_turns_of_the_carrier(seed):
    """Table 7.7: a crack makes 32, a spall on either flank 16, a healthy stage none."""
    assert len(on_both_ring_sensors("healthy", seed)[0]) == 0
    times, _ = on_both_ring_sensors("crack", seed)
    assert len(times) == 32
    for case in ("spall_sun", "spall_ring"):
        times, _ = on_both_ring_sensors(case, seed)
        assert len(times) == 16
        # One for each turn of the planet on the carrier, to within the smoothing of the envelope.
        assert np.diff(times) == pytest.approx(1 / (4 * CARRIER_HZ), abs=4e-3)


@pytest.mark.parametrize("seed", SEEDS)
def test_kurtosis_of_crack_spall_and_healthy_stage(seed):
    """As in the simulated column of Table 7.7: crack 22.2 > spalls 8.0 and 19.5 > healthy 5.8."""
    healthy, crack = ring_kurtosis("healthy", seed), ring_kurtosis("crack", seed)
    spalls = ring_kurtosis("spall_sun", seed), ring_kurtosis("spall_ring", seed)
    assert crack > max(spalls)
    assert min(spalls) > healthy


def test_carrier_modulates_outside_and_not_inside():
    """Heights of a spall's impulses: alike on the carrier, and on the ring as the load passes the sensor."""
    spreads = {"carrier": [], "ring": []}
    for seed in SEEDS:
        times, _ = on_both_ring_sensors("spall_sun", seed)
        for name, found in spreads.items():
            shape = envelope(ar_residual(record("spall_sun", seed)[name], 240))
            places = np.round(times * RATE_HZ).astype(int)
            heights = [shape[max(0, place - 80) : place + 80].max() for place in places]
            found.append(min(heights) / max(heights))
    assert min(spreads["carrier"]) > 0.8
    # Four places 90 degrees apart: the weakest over the strongest is the tangent of their offset.
    assert min(spreads["ring"]) < 0.5
    assert np.mean(spreads["ring"]) < 0.75 < np.mean(spreads["carrier"])


# Table 7.7: the spall on the sun's flank -----------------------------------------------------------------


def ring_response(*, printed, side):
    """Acceleration (x, y) of the ring for a unit error in one mesh of planet 1, over frequency.

    `printed`: the planet's rows of the force vector as in (7.38) and Table C.1, R_s and -R_r.
    """
    mass, damping, stiffness = plain.matrices(**plain.READING)
    sun = np.array([1.0, 0, 0]) if side == "sun" else np.zeros(3)
    ring = np.array([1.0, 0, 0]) if side == "ring" else np.zeros(3)
    force = plain.error_force(sun / plain.KM, ring / plain.KM, np.zeros(3), np.zeros(3))
    if printed:
        force[11] = plain.RS if side == "sun" else -plain.RR
    frequency = np.arange(1, 40 * 80 * CARRIER_HZ, 8.0)
    result = np.empty((frequency.size, 2), dtype=complex)
    for i, omega in enumerate(2 * np.pi * frequency):
        dynamic = stiffness - omega**2 * mass + 1j * omega * damping
        drive = force * (plain.KM + 1j * omega * plain.CM)
        result[i] = -(omega**2) * np.linalg.solve(dynamic, drive)[3:5]
    return frequency, result


def step_peak(*, printed, side):
    """Largest acceleration of the ring after a step of the error, smoothed as the model's spall is."""
    frequency, response = ring_response(printed=printed, side=side)
    step = np.sinc(frequency / frequency[-1]) / (2j * np.pi * frequency)
    spectrum = np.zeros((4097, 2), dtype=complex)
    spectrum[1 : frequency.size + 1] = response * step[:, None]
    motion = np.fft.irfft(spectrum, axis=0) * 8.0 * 8192
    return np.hypot(*motion.T).max()


def test_the_thesis_has_the_sun_weak_because_of_its_printed_force_vector():
    """Its simulation: 8.0 for the sun, 19.5 for the ring, a ratio of 0.41; measured 64.8 and 9.4.

    The printed arms R_s, -R_r on the planet, twice and four times R_p, give a ratio of 0.39. With the right
    arms the sun's spall is the stronger one on the ring, as measured.
    """
    printed = [step_peak(printed=True, side=side) for side in ("sun", "ring")]
    right = [step_peak(printed=False, side=side) for side in ("sun", "ring")]
    assert printed[0] / printed[1] == pytest.approx(8.0 / 19.5, abs=0.05)
    assert right[0] / right[1] > 1.5


def test_spall_on_the_sun_is_the_stronger_one_in_the_corrected_model():
    for seed in SEEDS:
        assert ring_kurtosis("spall_sun", seed) > ring_kurtosis("spall_ring", seed)


def test_a_path_through_the_casing_keeps_the_sun_strong():
    ratios = [
        ring_kurtosis("spall_sun", seed, True) / ring_kurtosis("spall_ring", seed, True) for seed in range(4)
    ]
    assert np.mean(ratios) > 1


def test_real_flanks_make_the_sun_several_times_stronger():
    """Table 7.7 measured 64.8 for the sun and 9.4 for the ring, 6.9 times as much; here it is 4 to 8 times.

    At the pitch point one pair of teeth carries the sun's mesh, two pairs that with the ring; and the
    convex sun dips deeper into the pit than the concave ring.
    """
    for seed in range(4):
        sun, ring = (ring_kurtosis(f"real_spall_{side}", seed) for side in ("sun", "ring"))
        assert 3 < sun / ring < 12
        assert ring > ring_kurtosis("healthy", seed)


# Lines at half the mesh order --------------------------------------------------------------------------


def half_mesh_level_db(monkeypatch, *, sun_over_carrier, **overrides):
    """Strongest line at 0.5, 1.5, 2.5 times the mesh order over the line at the mesh order, ring in y."""
    fixed = {"gear_errors.runout": "5 um", "gear_errors.surface_rms": "0 um"}  # no random lines
    params = load_planetary_params(overrides={**fixed, **overrides})
    if sun_over_carrier:
        right = planet_plant.make_meshes

        def wrong(params, geometry, seed, tracks, interfaces):
            tracks = {**tracks, "sun_on_carrier": tracks["ring_on_carrier"]}
            return right(params, geometry, seed, tracks, interfaces)

        monkeypatch.setattr(planet_plant, "make_meshes", wrong)
    # In the carrier's frame as the thesis has it, so that lines have no sidebands.
    sites = {"one": {"y_r": 1.0}, "two": {"x_r": 1.0}, "three": {"x_r": 1.0, "y_r": 1.0}}
    accel = Engine(params, 1, RATE_HZ, 8, sites=sites).advance(int(4 / CARRIER_HZ * RATE_HZ)).accel[0]
    spectrum = np.abs(np.fft.rfft(accel))
    lines = [spectrum[round(4 * 80 * order)] for order in (0.5, 1.5, 2.5)]
    return 20 * np.log10(max(lines) / spectrum[4 * 80])


def test_half_mesh_orders_come_from_the_suns_errors_told_in_turns_of_the_carrier(monkeypatch):
    """With the sun's 40 teeth over one turn of the carrier they are there, over its own turn they vanish.

    Nothing else that the thesis names does that: its planets alike or not, speed constant as here.
    """
    assert half_mesh_level_db(monkeypatch, sun_over_carrier=False) < -200
    different = {"gear_errors.identical_planets": 0}
    assert half_mesh_level_db(monkeypatch, sun_over_carrier=False, **different) < -200
    assert half_mesh_level_db(monkeypatch, sun_over_carrier=True) > -6


def test_varying_stiffness_cannot_bring_half_mesh_orders():
    """Floquet: over a mesh period all multipliers are inside the unit circle, so the motion repeats with it.

    The teeth's stiffness at its most uneven, two pairs twice as stiff as one; damping as in the model. The
    free rotation has multiplier one. A multiplier near -1 would be a line at half the mesh order.
    """
    params = load_planetary_params(overrides={"mesh.pair_stiffness_ratio": "2"})
    plant = planet_plant.make_planetary(params, 1)
    system, meshes = plant.system, plant.meshes
    inverse = 1 / np.diag(system.mass)
    steps, n = 4000, 18
    h = 1 / (80 * CARRIER_HZ) / steps
    transition = np.eye(2 * n)
    for i in range(steps):
        phases = plant.phases((i + 0.5) / (80 * steps))
        change = np.array([m.stiffness_at(phases) - m.mean_stiffness_n_per_m for m in meshes])
        stiffness = system.stiffness + (system.interfaces * change) @ system.interfaces.T
        # Midpoint rule, exact enough at 4000 steps a period: it keeps stability at any step.
        lower = np.hstack([-inverse[:, None] * stiffness, -inverse[:, None] * system.damping])
        matrix = np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), lower])
        transition = np.linalg.solve(np.eye(2 * n) - h / 2 * matrix, transition + h / 2 * matrix @ transition)
    multipliers = np.linalg.eigvals(transition)
    elastic = np.sort(np.abs(multipliers))[:-2]
    assert elastic.max() < 0.6
