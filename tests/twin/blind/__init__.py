"""Blind tests of the judge: machines with a hidden effect, made by a simulator of their own, and the score.

Nothing here is used by the judge, and nothing here uses the judge's integrator, sensors or fits. Shared are
the elements alone: the masses, springs and contacts of a machine, and the shapes of faults.
"""
