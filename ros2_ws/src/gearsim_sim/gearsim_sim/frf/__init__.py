"""Bearing forces through the casing's frequency responses: accelerations to 20 kHz, as a stream."""
