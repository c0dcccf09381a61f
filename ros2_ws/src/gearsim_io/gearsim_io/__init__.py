"""Signals, records, bags, importers and rerun export of the gearsim test rig."""

__version__ = "0.1.0"
