"""Figures of speed and size, each beside its baseline measured in the same run.

One file per group; a group is a function `measure(voice) -> list[Figure]` registered in `GROUPS`.
"""
