"""Tables that commands write into pages, between `<!-- NAME: begin -->` and `<!-- NAME: end -->`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gearsim_io.errors import InputError

__all__ = ["check_marks", "put_into", "standing"]


def check_marks(page: Path, name: str) -> None:
    """InputError if the page has not both marks of that name, once and in order."""
    _parts(page, name)


def standing(page: Path, name: str) -> list[str]:
    """Lines between the marks of that name; InputError if they are not there."""
    return _parts(page, name)[1].splitlines()


def put_into(page: Path, name: str, lines: Sequence[str]) -> None:
    """Replace what stands between the two marks of that name; InputError if they are not there."""
    before, _, after = _parts(page, name)
    page.write_text("\n".join([before, *lines, after]), encoding="utf-8")


def _parts(page: Path, name: str) -> tuple[str, str, str]:
    begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    if not page.is_file():
        raise InputError(str(page), "", "no such file", "a page with marks for tables")
    text = page.read_text(encoding="utf-8")
    if text.count(begin) != 1 or text.count(end) != 1 or text.index(begin) > text.index(end):
        raise InputError(str(page), "marks", "none", f"one line {begin} and one {end} after it")
    first, last = text.index(begin) + len(begin), text.index(end)
    return text[:first], text[first:last], text[last:]
