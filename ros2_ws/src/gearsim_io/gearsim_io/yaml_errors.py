"""Where a YAML file is no YAML, and what was expected there."""

from __future__ import annotations

import re

from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.reader import ReaderError

_INSTEAD = re.compile(r"expected (?P<expected>.+), but (?:got|found) (?P<got>.+)")
_TOKENS = {
    "stream end": "the end of the file",
    "block end": "an entry as far in as the one before it",
    "block mapping start": "keys further in",
    "block sequence start": "a list further in",
    "document start": "--- after the directive",
    "scalar": "a text",
    "the node content": "a value",
    "?": "a key",
}
_PLAIN = {  # the parser's words, and what is found and expected
    "mapping values are not allowed here": (
        "a second ':'",
        "the keys of a section equally far in, and quotes around a text with ': ' in it",
    ),
    "could not find expected ':'": ("a line without ':'", "a key with ':' after it"),
}


def syntax_error(error: YAMLError) -> tuple[str, str, str]:
    """Place in the file (line and column from 1), what was found there, what was expected."""
    if isinstance(error, ReaderError):
        place = f"character {error.position + 1}"
        return place, str(error).split(":", maxsplit=1)[0], "text without such characters"
    if not isinstance(error, MarkedYAMLError) or error.problem is None:
        return "", str(error), "valid YAML"
    # A key without ':' is told where it stands, not in the next line, where the parser notices.
    late = error.problem.startswith("could not find expected ':'") and error.context_mark is not None
    mark = error.context_mark if late else error.problem_mark
    place = f"line {mark.line + 1}, column {mark.column + 1}" if mark is not None else ""
    return place, *_found_and_expected(error)


def _found_and_expected(error: MarkedYAMLError) -> tuple[str, str]:
    problem = str(error.problem).split(" with value ")[0]  # of a key that is there twice the name is enough
    if problem in _PLAIN:
        return _PLAIN[problem]
    match = _INSTEAD.fullmatch(problem)
    if match is None:
        return problem.removeprefix("found "), "valid YAML"
    return _word(match["got"]), _word(match["expected"]) + _begun(error)


def _begun(error: MarkedYAMLError) -> str:
    """Where the list or section began that does not end as it must."""
    begin, end = error.context_mark, error.problem_mark
    if begin is None or end is None or begin.line == end.line:
        return ""
    return f" for what begins in line {begin.line + 1}"


def _word(token: str) -> str:
    """A name that the parser has for a piece of YAML, in words."""
    return _TOKENS.get(token.strip("()'<>,"), token)
