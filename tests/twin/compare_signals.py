"""Signals of closed form for the comparison: noise, lines of shafts and meshes, impacts with slip."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
from scipy.signal import lfilter

from gearsim_dsp.kinematics import bearing_orders
from gearsim_io.machines import load_machine
from gearsim_io.record import EdgeTrain, PulseTrain, Record
from gearsim_twin.compare.features import Features, Plan, features, make_plan
from gearsim_twin.view import View, view_of

RATE_HZ, SPEED_HZ, SECONDS = 25600.0, 10.0, 5.0
LINES = ((1, 0.3), (2, 0.1), (32, 0.8), (64, 0.4), (33, 0.1), (31, 0.08), (96, 0.05))
RESONANCE_HZ, DECAY_S = 4000.0, 1e-3


@cache
def machine():
    return load_machine("unsw_parallel")


def noise(seed: int, std: float = 0.2, seconds: float = SECONDS, pole: float = 0.5) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return lfilter([1.0], [1.0, -pole], rng.normal(size=int(seconds * RATE_HZ))) * std


def lines(seconds: float = SECONDS, table=LINES) -> np.ndarray:
    t = np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    return sum(a * np.sin(2 * np.pi * order * SPEED_HZ * t + order) for order, a in table)


def impacts(
    seed: int,
    order: float,
    *,
    jitter: float = 0.003,
    size: float = 3.0,
    seconds: float = SECONDS,
    decay_s: float = DECAY_S,
) -> np.ndarray:
    """Bursts at an order, each gap random by `jitter`, sizes random by a tenth."""
    rng = np.random.default_rng(seed + 1000)
    count = int(seconds * RATE_HZ)
    period = 1 / (order * SPEED_HZ)
    times = np.cumsum(period * (1 + jitter * rng.normal(size=int(seconds / period) + 5))) - period
    at = times * RATE_HZ
    at = at[(at >= 0) & (at < count - 1)]
    sizes = size * (1 + 0.1 * rng.normal(size=at.size))
    first = at.astype(int)
    train = np.zeros(count)
    np.add.at(train, first, sizes * (1 - at + first))  # between samples: shared by both
    np.add.at(train, first + 1, sizes * (at - first))
    tau = np.arange(int(10 * decay_s * RATE_HZ)) / RATE_HZ
    return np.convolve(train, np.exp(-tau / decay_s) * np.sin(2 * np.pi * RESONANCE_HZ * tau))[:count]


def record(*signals: np.ndarray, channels=("b1_y", "b2_y")) -> Record:
    """A record with a tacho of one pulse per turn of the input."""
    data = np.stack(signals).astype(np.float32)
    pulses = np.arange(0, data.shape[1], RATE_HZ / SPEED_HZ)
    names = tuple(channels[: len(signals)])
    return Record(RATE_HZ, names, "m/s^2", data, tachos=(PulseTrain("input", 1.0, pulses),))


def with_encoder(one: Record, torsion: tuple[tuple[float, float], ...]) -> Record:
    """The record with an encoder on the input, whose angle holds sines of (order, amplitude in rad)."""
    edges = np.arange(int(900 * SPEED_HZ * one.seconds) - 2)
    turn = edges / 900
    # A shaft that is ahead by x passes its line earlier by x.
    ahead = sum(a * np.sin(2 * np.pi * order * turn) for order, a in torsion) / (2 * np.pi)
    samples = (turn - ahead) / SPEED_HZ * RATE_HZ
    keep = (samples >= 0) & (samples < one.sample_count)
    return replace(one, encoders=(EdgeTrain("input", 900, int(edges[keep][0]), samples[keep]),))


def view(one: Record) -> View:
    return view_of(one, machine())


def plan_of(*views: View) -> Plan:
    return make_plan(SimpleNamespace(machine=machine()), views)


def measured(one: Record, plan: Plan | None = None) -> Features:
    seen = view(one)
    return features(seen, plan or plan_of(seen))


def level(found: Features, **wanted) -> tuple[float, float]:
    """Level and standard deviation at the one place that fits."""
    rows = [
        k
        for k, p in enumerate(found.places)
        if all(getattr(p, name) == value for name, value in wanted.items())
    ]
    assert len(rows) == 1, [found.places[k] for k in rows]
    return float(found.level_db[rows[0]]), float(found.std_db[rows[0]])


BPFO_SEEDS = tuple(range(100, 116))


def features_of_replicates(kind: str, seeds: tuple[int, ...]) -> list[Features]:
    """Features of records that differ by their seeds: sound, or with an outer or inner race that strikes."""
    orders = bearing_orders(machine().bearings[0])
    order = {"outer": orders.bpfo, "inner": orders.bpfi, "sound": None}[kind]
    records = []
    for seed in seeds:
        x = noise(seed) + lines()
        if order is not None:
            strikes = impacts(seed, order, jitter=0.005)
            t = np.arange(strikes.size) / RATE_HZ
            turning = 1 + 0.6 * np.cos(2 * np.pi * SPEED_HZ * t) if kind == "inner" else 1.0
            x = x + strikes * turning
        rng = np.random.default_rng(seed + 5000)
        one = with_encoder(record(x), ((1.0, 2e-3), (32.0, 5e-4), (64.0, 1e-4)))
        (train,) = one.encoders
        shaken = np.sort(train.samples + 0.3 * rng.normal(size=train.samples.size))
        records.append(replace(one, encoders=(replace(train, samples=shaken),)))
    plan = plan_of(view(records[0]))
    return [measured(one, plan) for one in records]
