"""A rig of closed forms: what a simulator and seven representations would give, in microseconds.

Levels at places come from a base, two knobs, and effects that add power or change levels. What is measured
has, beyond the effects, errors of the model that neighbours, channels and records share, as real models
have, and sampling errors.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from gearsim_twin.causes.cause import Parameter
from gearsim_twin.causes.context import Context
from gearsim_twin.causes.edit import with_entry
from gearsim_twin.causes.prior import LogNormal, Uniform
from gearsim_twin.fit import fit_tuning
from gearsim_twin.likelihood import TAU_FACTOR, Yardstick
from gearsim_twin.model import Model
from gearsim_twin.select import select
from gearsim_twin.settings import Settings
from gearsim_twin.systematic import smooth_errors
from gearsim_twin.tuning import Setting, Tuning
from gearsim_twin.workbench import Workbench

SAMPLING_DB = 0.5
CHANNELS = ("a", "b", "c")
PSD_HZ = np.geomspace(100.0, 20e3, 40)
ORDERS = np.concatenate(
    [np.arange(1.0, 9.0), np.arange(28.0, 37.0), np.arange(60.0, 69.0), np.arange(92.0, 101.0)]
)
BPFO, BPFI = 4.88, 7.12
ENVELOPE = np.sort(
    np.concatenate([np.arange(1.0, 6.0), BPFO * np.arange(1, 9), BPFI * np.arange(1, 9), [0.4, 2.6]])
)


@dataclass(frozen=True)
class ToyPlace:
    domain: str
    channel: str
    kind: str
    at: float
    unit: str = "1"
    width: float = 1.0


PLACES = tuple(
    ToyPlace(domain, channel, "line", float(at))
    for channel in CHANNELS
    for domain, grid in (
        ("psd", PSD_HZ),
        ("orders", ORDERS),
        ("envelope", ENVELOPE),
        ("statistics", np.arange(4.0)),
    )
    for at in grid
)
DOMAIN = np.array([p.domain for p in PLACES])
AT = np.array([p.at for p in PLACES])
CHANNEL = np.array([CHANNELS.index(p.channel) for p in PLACES])
LOADS = (1.0, 1.6)


def lines(grid_order, at, count, width=0.02):
    return sum((np.abs(grid_order - at * k) < width) / k for k in range(1, count + 1))


def bump(centre_hz, octaves):
    return np.exp(-0.5 * (np.log2(np.maximum(AT, 1e-9) / centre_hz) / octaves) ** 2) * (DOMAIN == "psd")


def base_power(knobs, load):
    mesh, resonance = knobs
    level = np.zeros(AT.size)
    level += np.where(DOMAIN == "orders", 10.0 + 3.0 * np.cos(AT) + 20 * np.log10(mesh) * (AT > 20), 0.0)
    level += 12.0 * bump(3000.0 * resonance, 0.25) + 20.0 * np.log10(load) * (DOMAIN != "statistics")
    return 10 ** (0.1 * level)


def effect_power(name, v, load):
    """Power that an effect adds, in the units of the base."""
    envelope, orders, psd = DOMAIN == "envelope", DOMAIN == "orders", DOMAIN == "psd"
    impulsive = 2 * bump(9e3, 0.5) + 0.4 * (DOMAIN == "statistics")
    modulated = 20 * lines(AT, BPFI, 8) + 5 * lines(AT, 1, 4)
    near = np.array([1.0, 0.4, 0.1])[CHANNEL]
    shape = {
        "outer": lambda: near * load**2 * (20 * lines(AT, BPFO, 8) * envelope + impulsive),
        "inner": lambda: near * load**2 * (modulated * envelope + impulsive),
        "runout": lambda: 20 * orders * ((AT < 4) + 0.6 * np.isin(AT, [31, 33, 63, 65, 95, 97])),
        "pitch": lambda: 6.0 * orders,
        "resonance": lambda: 20 * load**2 * bump(v["hz"], 0.3),
        "floor": lambda: 1.0 * psd,
        # Outside the library.
        "whirl": lambda: 60.0 * (envelope | orders) * np.isin(np.round(AT, 3), [0.4, 2.6, 3.0]),
        "hum": lambda: 60.0 * psd * np.isin(AT, PSD_HZ[5:9]),
    }
    return v["size"] ** 2 * shape[name]() if name in shape else np.zeros(AT.size)


def levels(content):
    knobs = [1.0, 1.0]
    for name, value in content.get("parameters", {}).items():
        knobs[("mesh", "resonance").index(name)] = value["value"]
    load = content["load"]
    power = base_power(knobs, load)
    for effect in content.get("effects", ()):
        power = power + effect_power(effect["name"], effect["values"], load)
    level = 10 * np.log10(power)
    for effect in content.get("effects", ()):
        v = effect["values"]
        if effect["name"] == "slip":
            level -= v["share"] * 8.0 * (lines(AT, BPFO, 8) > 0) * (DOMAIN == "envelope")
        if effect["name"] == "rolloff":
            level -= 10 * np.log10(1 + (AT / v["hz"]) ** 4) * (DOMAIN == "psd")
    return level


class ToyCause:
    def __init__(self, name, parameters, start, confused_with=()):
        self.name, self.parameters, self._start, self.confused_with = name, parameters, start, confused_with

    def applies(self, _):
        return True

    def starts(self, context):
        return self._start(context)

    def extend(self, content, values, _):
        return with_entry(content, "effects", {"name": self.name, "values": dict(values)})

    def signature(self, _):
        return f"{self.name} shows"


def at_most(context):
    """A resonance is looked for where the noise differs most."""
    found = [d for d in context.differences("psd") if 300 < d.place.at < 15e3][:1]
    return [{"size": 1.0, "hz": d.place.at} for d in found]


SIZE = Parameter("size", "1", LogNormal(1.0, 2.5, 0.02, 50.0))
CAUSES = (
    ToyCause("outer", (SIZE,), lambda _: [{"size": 1.0}], (("inner", "BPFI"),)),
    ToyCause("inner", (SIZE,), lambda _: [{"size": 1.0}], (("outer", "BPFO"),)),
    ToyCause("runout", (SIZE,), lambda _: [{"size": 1.0}]),
    ToyCause("pitch", (SIZE,), lambda _: [{"size": 1.0}]),
    ToyCause("resonance", (SIZE, Parameter("hz", "Hz", LogNormal(2500.0, 2.5, 200.0, 18e3))), at_most),
    ToyCause("floor", (SIZE,), lambda _: [{"size": 1.0}]),
    ToyCause("slip", (Parameter("share", "1", Uniform(0.0, 2.0)),), lambda _: [{"share": 0.5}]),
    ToyCause("rolloff", (Parameter("hz", "Hz", LogNormal(12e3, 1.6, 2e3, 60e3)),), lambda _: [{"hz": 12e3}]),
)
NAMES = tuple(cause.name for cause in CAUSES)
TUNING = Tuning(
    (
        Setting("mesh", LogNormal(1.0, 1.1), (("mesh", 1.0, "1"),)),
        Setting("resonance", LogNormal(1.0, 1.05), (("resonance", 1.0, "1"),)),
    )
)


def model_error(rng, size_db):
    """Errors that neighbours share over some four places, channels in half, records altogether."""
    smooth = np.exp(-0.5 * (np.arange(-8, 9) / 2.0) ** 2)
    smooth /= np.sqrt(np.sum(smooth**2))

    def rough():
        return np.convolve(rng.standard_normal(AT.size + 16), smooth, mode="valid")

    per = AT.size // len(CHANNELS)
    common = np.tile(rough()[:per], len(CHANNELS))
    return size_db * (np.sqrt(0.5) * common + np.sqrt(0.5) * rough())


class NoNuisance:
    assumed = ()

    def fit(self, _):
        return None

    def apply(self, _, simulated):
        return simulated

    def corrections_db(self, _):
        return ()


def places_features(places, level_db, std_db):
    """What a record shows at some places, all of it clear of noise."""
    return SimpleNamespace(
        places=places,
        level_db=level_db,
        std_db=np.full(len(places), std_db),
        stands_out=np.ones(len(places), dtype=bool),
        own=np.ones(len(places)),
        repeat_db=np.zeros(len(places)),
    )


def toy_case(seed, effects, error_db=0.8):
    """Workbench of a machine with some effects: records 0 and 1 for training, 2 and 3 held out."""
    rng = np.random.default_rng(seed)
    truth = {
        "mesh": {"value": 1.1 ** rng.standard_normal()},
        "resonance": {"value": 1.05 ** rng.standard_normal()},
    }
    wrong = model_error(rng, error_db)
    measured = []
    for record in range(4):
        content = {"load": LOADS[record % 2], "parameters": truth, "effects": effects}
        level = levels(content) + wrong + SAMPLING_DB * rng.standard_normal(AT.size)
        measured.append(places_features(PLACES, level, SAMPLING_DB))
    noise = [np.random.default_rng(1000 * seed + k).standard_normal(AT.size) for k in range(4)]

    def run(jobs):
        sampling = 0.5 * SAMPLING_DB
        return [
            places_features(PLACES, levels(content) + sampling * noise[k], sampling) for k, content in jobs
        ]

    nominal = tuple({"load": LOADS[k % 2]} for k in range(4))
    return Workbench(tuple(measured), nominal, (0, 1), run, NoNuisance())


def context_of(bench):
    def build(trial):
        records = bench.training
        compared = []
        for k in records:
            difference = bench.measured[k].level_db - trial.features[k].level_db
            compared.append(SimpleNamespace(difference_db=difference, z=difference / 1.2))
        pick = tuple(bench.measured[k] for k in records)
        return Context(
            None, (), pick, tuple(trial.features[k] for k in records), tuple(compared), bench.nominal, ()
        )

    return build


def yard_of(bench):
    stack = bench.stack
    count = len(stack.domains)
    use = stack.part((*bench.training, -1)) & stack.told
    smooth = smooth_errors(stack, use, np.ones(count))
    return Yardstick(stack, np.full(count, 0.3), np.full(count, 0.5), np.full(count, TAU_FACTOR), use, smooth)


def solve(bench, settings=None, causes=CAUSES):
    """The causes that are found in a toy case."""
    yard = yard_of(bench)
    tuned = fit_tuning(bench, yard, Model(TUNING, TUNING.nominal))
    return select(bench, yard, tuned, causes, context_of(bench), settings or Settings())


def effect(rng, name, severity):
    """An effect of some severity (1 is medium: some 3 dB where it shows), drawn."""
    size = 0.7 * severity * rng.uniform(0.85, 1.2)
    if name == "slip":
        return {"name": name, "values": {"share": 0.7 * size}}
    if name == "rolloff":
        return {"name": name, "values": {"hz": 11e3 * severity**-0.8 * rng.uniform(0.85, 1.2)}}
    values = {"size": size}
    if name == "resonance":
        values["hz"] = rng.choice([700.0, 1500.0, 7000.0, 11000.0]) * rng.uniform(0.9, 1.1)
    return {"name": name, "values": values}
