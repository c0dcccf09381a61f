"""Angles of shafts: from tacho, encoder or the vibration itself, and signals sampled by angle."""
