"""Nodes: they translate between topics and the numerics, nothing more."""
