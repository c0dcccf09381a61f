"""The compiled loop gives the same bits wherever its arrays lie in memory.

The compiler asks at run time whether arrays may overlap, with bounds that reach a bit beyond their ends, and
has another version of a loop for the case that they may. Arrays that lie end to end, as a heap with holes
sometimes puts them, get that version.
"""

import math

import numpy as np
import pytest

from gearsim_sim.engine import Engine
from gearsim_sim.events import FaultSpec
from gearsim_sim.model.faults import REGISTRY
from gearsim_sim.verify.machines import SEED, params_of, plant_of

PLACEMENTS = 400  # of some 70 arrays: every ordered pair lies end to end about 6 times
LARGE = 10**6  # bytes: arrays beyond this come from the system one by one, never end to end
STEPS = 320


def leaves(value):
    """All arrays of nested tuples, in order."""
    if isinstance(value, np.ndarray):
        return [value]
    return [leaf for one in value for leaf in leaves(one)] if isinstance(value, tuple) else []


def rebuilt(value, arrays):
    """The same with its arrays taken from an iterator."""
    if isinstance(value, np.ndarray):
        return next(arrays)
    if not isinstance(value, tuple):
        return value
    items = [rebuilt(one, arrays) for one in value]
    return type(value)(*items) if hasattr(value, "_fields") else tuple(items)


def loop_call(model, faulty):
    """The loop of an engine and the arguments of a call in the middle of a run."""
    kinds = sorted(REGISTRY) if faulty else ()
    places = [(kind, REGISTRY[kind].components(plant_of(model))) for kind in kinds]
    faults = [
        FaultSpec(kind, found[number % len(found)], severity=0.5)
        for number, (kind, found) in enumerate(places)
        if found
    ]
    engine = Engine(params_of(model), SEED, 4096.0, faults=faults)
    engine.advance(math.ceil(0.05 * 4096))
    calls = []
    stepper = engine._stepper

    def listening(loop):
        def called(*arguments):
            if not calls:
                calls.append((loop, rebuilt(arguments, (leaf.copy() for leaf in leaves(arguments)))))
            return loop(*arguments)

        return called

    stepper._loops = [listening(loop) for loop in stepper._loops]
    engine.advance(STEPS)
    return calls[0]


def outcome(loop, arguments, arrays):
    """All arrays after a call of STEPS steps with `arrays` in place of those of the arguments."""
    s0, s1, data, drive, side, memory, work, first, count, *rest = rebuilt(arguments, iter(arrays))
    assert count >= STEPS
    loop(s0, s1, data, drive, side, memory, work, first, STEPS, *rest)
    return arrays


@pytest.mark.parametrize("faulty", [False, True])
@pytest.mark.parametrize("model", ["lpm34", "planetary18", "bearing4"])
def test_bits_do_not_hang_on_where_arrays_lie(model, faulty):
    loop, arguments = loop_call(model, faulty)
    given = leaves(arguments)
    expected = outcome(loop, arguments, [one.copy() for one in given])
    small = [i for i, one in enumerate(given) if one.nbytes <= LARGE]
    ground = np.zeros(sum(given[i].size + 16 for i in small) + 8)
    random = np.random.default_rng(1)
    changed = 0
    for _ in range(PLACEMENTS):
        arrays = list(given)
        place = int(random.integers(8))
        for i in random.permutation(small):
            one = given[i]
            arrays[i] = ground[place : place + one.size].view(one.dtype).reshape(one.shape)
            arrays[i][...] = one
            place += one.size + int(random.choice([0, 2, 4]))  # doubles
        found = outcome(loop, arguments, arrays)
        changed += not all(np.array_equal(a, b, equal_nan=True) for a, b in zip(found, expected, strict=True))
    assert changed == 0, f"{changed} of {PLACEMENTS} placements gave other bits"
