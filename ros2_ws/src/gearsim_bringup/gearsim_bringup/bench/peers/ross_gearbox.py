"""A gear pair on two shafts in ROSS, 36 and 156 degrees of freedom: run by the peers' Python, prints JSON.

Three or thirteen nodes of six degrees of freedom on each shaft, a gear in the middle, a linear bearing at
each end; masses and stiffnesses are near those of the 34-DOF gearbox. Newmark's method at 65536 Hz, the
processor time per simulated second, with a constant mesh stiffness and, for the small pair, with one that
alternates between one and two pairs of teeth.
"""

import json
import time

import numpy as np
import ross

RATE_HZ, SPEED_RAD_S = 65536, 2 * np.pi * 10
MESH_N_PER_M = 3e8


def shaft(elements: int) -> list[ross.ShaftElement]:
    """Elements of a shaft of 25 mm."""
    steel = ross.materials.steel
    return [ross.ShaftElement(L=0.3 / elements, idl=0.0, odl=0.025, material=steel) for _ in range(elements)]


def rotor(teeth: int, diameter_m: float, elements: int) -> ross.Rotor:
    """A gear between two bearings."""
    gear = ross.GearElement(
        n=elements // 2,
        m=2.0,
        Id=0.002,
        Ip=0.004,
        n_teeth=teeth,
        pitch_diameter=diameter_m,
        pr_angle=np.radians(20),
    )
    bearings = [ross.BearingElement(n=n, kxx=1.5e8, kyy=1.5e8, cxx=1.4e3) for n in (0, elements)]
    return ross.Rotor(shaft(elements), [gear], bearings)


def seconds_per_second(steps: int, *, varying: bool, elements: int = 2) -> tuple[int, float]:
    """Degrees of freedom, and processor time for a simulated second."""
    pair = ross.MultiRotor(
        rotor(32, 0.064, elements),
        rotor(80, 0.160, elements),
        coupled_nodes=(elements // 2, elements // 2),
        gear_mesh_stiffness=MESH_N_PER_M,
        update_mesh_stiffness=varying,
        square_varying_stiffness=varying,
        square_stiffness_amplitude_ratio=0.2 if varying else 0,
    )
    t = np.arange(steps) / RATE_HZ
    force = np.zeros((steps, pair.ndof))
    force[:, 5] = 50.0  # a steady torque at the first node
    began = time.process_time()
    pair.run_time_response(SPEED_RAD_S, force, t, method="newmark")
    return int(pair.ndof), (time.process_time() - began) * RATE_HZ / steps


if __name__ == "__main__":
    seconds_per_second(10, varying=False)  # what is only done once
    dof, constant = seconds_per_second(1000, varying=False)
    _, varied = seconds_per_second(300, varying=True)
    large_dof, large = seconds_per_second(300, varying=False, elements=12)
    told = {"dof": dof, "constant_s": constant, "varying_s": varied}
    print(json.dumps({**told, "large_dof": large_dof, "large_s": large}))
