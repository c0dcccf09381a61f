"""The description of the shipped casing under another name, with large elements: a second of work."""

from __future__ import annotations

from pathlib import Path

from gearsim_sim.model.casing.params import FOLDER

_CHANGES = (
    ("name: unsw_casing", "name: coarse"),
    ("plate_size: {value: 7.5,", "plate_size: {value: 25,"),
    ("ring_size: {value: 7.5,", "ring_size: {value: 20,"),
    ("ring_layers: {value: 4,", "ring_layers: {value: 1,"),
)


def write_coarse_casing(folder: Path) -> Path:
    """Write `coarse.yaml` into a folder."""
    text = (FOLDER / "unsw_casing.yaml").read_text()
    for old, new in _CHANGES:
        assert old in text
        text = text.replace(old, new)
    path = folder / "coarse.yaml"
    path.write_text(text)
    return path
