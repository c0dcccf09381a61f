"""Measured against simulated: what a simulation gets wrong, why, and the model extended by it."""

__version__ = "0.1.0"
