"""What the thesis claims of its gearbox in a flexible casing, measured on ours: `docs/casing_results.md`.

`RESULTS` is the registry: a name in it is the module here with `tell(records)`, the numbers; `table(told)`,
the lines that go between the marks of that name in the page; and `draw(records, told)`, the picture
`docs/images/casing/<name>.png`. Nothing here needs a measured record.
"""

RESULTS: tuple[str, ...] = ("spectra", "envelopes", "extended", "mesh_lines", "sizes")
