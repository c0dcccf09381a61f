"""Signal processing, diagnosis and the diagnostic nodes of the gearsim test rig."""

__version__ = "0.1.0"
