"""A model in closed form in place of the engine: every sample is a formula of its index.

Speed follows from the angle's exact derivative. An operating point or a fault only switches a term of the
acceleration on, at its sample, so that a test can see the sample at which it came.
"""

import dataclasses

import numpy as np

from gearsim_sim.engine import EngineOutput
from gearsim_sim.events import Clear, FaultSpec, Inject, SetOperatingPoint

LOOKAHEAD = 25


class RigDouble:
    def __init__(self, rate_hz=65536.0, speed_hz=10.0, sites=("b1_y", "b3_y"), start_turns=0.0):
        self.rate_hz = rate_hz
        self.speed_hz = speed_hz
        self.sites = sites
        self.start_turns = start_turns
        self.next_sample = 0
        self.events = []
        self.calls = []

    @property
    def earliest_event_sample(self):
        return 0 if self.next_sample == 0 else self.next_sample + LOOKAHEAD

    steady = True

    def operating_point_at(self, sample):  # noqa: ARG002
        raise AssertionError("nobody needs that of a steady rig")

    def angle_turns(self, sample, shaft=0):
        """Closed-form angle: a steady turn, a mesh ripple and a slow wander; exact derivative in `speed`."""
        t = np.asarray(sample, dtype=float) / self.rate_hz
        f = self.speed_hz
        ripple = 2e-5 * np.sin(2 * np.pi * 32 * f * t + shaft)
        return self.start_turns + f * t + ripple + 0.01 * np.sin(2 * np.pi * 0.7 * t)

    def speed(self, sample, shaft=0):
        t = np.asarray(sample, dtype=float) / self.rate_hz
        f = self.speed_hz
        ripple = 2e-5 * 2 * np.pi * 32 * f * np.cos(2 * np.pi * 32 * f * t + shaft)
        return f + ripple + 0.01 * 2 * np.pi * 0.7 * np.cos(2 * np.pi * 0.7 * t)

    def advance(self, n, events=()):
        assert not events
        self.calls.append(n)
        k = np.arange(self.next_sample, self.next_sample + n)
        accel = np.stack([(i + 1) * np.sin(0.1 * k + i) for i in range(len(self.sites))])
        for event in self.events:
            sign = -1.0 if isinstance(event, Clear) else 1.0
            accel += sign * 5.0 * (k >= event.at_sample)
        turns = np.stack([self.angle_turns(k, shaft) for shaft in range(2)])
        whole = np.floor(turns).astype(np.int64)
        output = EngineOutput(
            first_sample=self.next_sample,
            site_names=tuple(self.sites),
            accel=accel,
            shaft_names=("input", "output"),
            turns=whole,
            fraction=turns - whole,
            speed_hz=np.stack([self.speed(k, shaft) for shaft in range(2)]),
        )
        self.next_sample += n
        return output

    def _at(self, event):
        sample = self.earliest_event_sample if event.at_sample is None else event.at_sample
        assert sample >= self.earliest_event_sample
        self.events.append(dataclasses.replace(event, at_sample=sample))
        return sample

    def set_operating_point(self, speed_hz=None, load_nm=None, ramp_s=1.0, at_sample=None):
        return self._at(SetOperatingPoint(speed_hz, load_nm, ramp_s, at_sample))

    def inject(self, fault: FaultSpec, ramp_s=0.1, at_sample=None):
        return self._at(Inject(fault, ramp_s, at_sample))

    def clear(self, fault_id="", ramp_s=0.1, at_sample=None):
        return self._at(Clear(fault_id, ramp_s, at_sample))
