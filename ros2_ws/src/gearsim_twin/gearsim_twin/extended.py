"""The extended model as a scenario file that `simulate` and the live rig accept."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML

from gearsim_twin.causes.cause import Content

__all__ = ["write_extended"]

_WIDTH = 110


def write_extended(path: Path, content: Content, comments: Sequence[str]) -> Path:
    """Write a scenario, with comments on what was fitted and how sure it is.

    Parameters
    ----------
    path : Path
        File to be written; its folder must be there.
    content : mapping
        What the scenario holds.
    comments : sequence of str
        Paragraphs that go before it.
    """
    yaml: Any = YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.width = _WIDTH
    yaml.sort_base_mapping_type_on_output = False
    text = io.StringIO()
    yaml.dump(_plain(content), text)
    head = "".join(
        textwrap.fill(" ".join(each.split()), _WIDTH, initial_indent="# ", subsequent_indent="#   ") + "\n"
        for each in comments
    )
    path.write_text(head + text.getvalue(), encoding="utf-8")
    return path


def _plain(value: Any) -> Any:
    """Without types of arrays, which no YAML file knows."""
    if isinstance(value, Mapping):
        return {str(key): _plain(each) for key, each in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [_plain(each) for each in value]
    return value.item() if isinstance(value, np.generic) else value
