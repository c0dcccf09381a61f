"""What a misspelt name was perhaps meant to be."""

from __future__ import annotations

import difflib
import re

_LIST = re.compile(r"\b(?:one|some) of (?:the [a-z]+ )?([^;]*)|\bthere are ([^;]*)")


def did_you_mean(name: str, expected: str) -> str:
    """`; did you mean X?` where `expected` lists a name like `name`, as in `one of a, b, c`; else empty."""
    match = _LIST.search(expected)
    if match is None:
        return ""
    listed = (match[1] or match[2]).split(", ")
    names = {_plain(one): one for one in listed if one and " " not in one}
    close = difflib.get_close_matches(_plain(name), names, n=1)
    return f"; did you mean {names[close[0]]}?" if close and names[close[0]] != name else ""


def _plain(name: str) -> str:
    return name.strip().lower().replace("-", "_")
