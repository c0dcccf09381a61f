"""The extended model as a scenario file that `simulate` and the live rig accept."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

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
    yaml.dump(content, text)
    head = "".join(
        textwrap.fill(" ".join(each.split()), _WIDTH, initial_indent="# ", subsequent_indent="#   ") + "\n"
        for each in comments
    )
    path.write_text(head + text.getvalue(), encoding="utf-8")
    return path
