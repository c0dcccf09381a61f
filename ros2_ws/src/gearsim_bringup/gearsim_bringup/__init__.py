"""Command line, scenarios and launch files of the gearsim test rig."""

__version__ = "0.1.0"
