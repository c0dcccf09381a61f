"""Diagnostic nodes: they translate between topics and the monitors, nothing more."""
