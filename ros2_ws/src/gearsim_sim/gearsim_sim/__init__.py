"""Gearbox physics, sensors and the simulator node of the gearsim test rig."""

__version__ = "0.1.0"
