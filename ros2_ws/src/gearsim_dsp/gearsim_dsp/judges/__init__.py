"""Judges: what the evidence says of bearings, gears, planets and shafts; files listed in `registry`."""
