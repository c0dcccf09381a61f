"""Worked stories on measured records: what is wrong, why, what mends it, and how that does on other records.

`STORIES` is the registry: a name in it is the module here with `tell(records)`, the numbers, and
`draw(records)`, the picture `docs/images/stories/<name>.png` that `docs/stories.md` shows.
"""

STORIES: tuple[str, ...] = (
    "mfpt_slip",
    "hit_wide_spall",
    "hit_converter",
    "cwru_race",
    "cwru_filter",
    "turbine",
    "gear0",
)
