"""Runs measuring chains in tests."""

import itertools

import numpy as np

from gearsim_sim.sensors.chain import MeasuringChain

RATE = 65536.0


def run_chain(rows, motion, rate=RATE, seed=1, cuts=()):
    """The chain's output, from sample 0, in pieces that end at `cuts`; motion is (sites a and b, samples)."""
    chain = MeasuringChain(rows, ("a", "b"), rate, seed)
    assert chain.past == chain.ahead == 0
    total = motion.shape[1]
    pieces = [
        chain.process(motion[:, start:stop], start, stop - start)
        for start, stop in itertools.pairwise([0, *cuts, total])
    ]
    return np.concatenate(pieces, axis=1).astype(float)


def silence(samples):
    return np.zeros((2, samples))
