"""Fixtures of the command line's tests."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture
def coarse(tmp_path: Path) -> str:
    """The description of a coarse casing, alone in its folder."""
    from coarse_casing import write_coarse_casing

    return str(write_coarse_casing(tmp_path))
