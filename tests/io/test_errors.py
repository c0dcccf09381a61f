"""Errors speak to the person who wrote the file: names, places, units, and where YAML ends to be YAML."""

import math
from typing import Annotated

import numpy as np
import pytest
from pydantic import Field

from gearsim_io.errors import InputError
from gearsim_io.numbers import number, plural
from gearsim_io.places import place_in
from gearsim_io.quantities import Si, Strict, load_yaml, read_yaml, validate


@pytest.mark.parametrize(
    ("value", "expected", "question"),
    [
        ("bearing3", "one of bearing_1, bearing_3", "; did you mean bearing_3?"),
        ("Outer-Race-Spal", "one of outer_race_spall, wear", "; did you mean outer_race_spall?"),
        ("heathy", "one of demo, healthy, or the path of a .yaml file", "; did you mean healthy?"),
        ("inptu", "one of the shafts input, output", "; did you mean input?"),
        ("time", "this column; there are time_s, speed", "; did you mean time_s?"),
        ("moon", "one of demo, healthy", ""),
        ("numbr", "a number in m", ""),
        (3.0, "one of 3.1, 3.2", ""),
    ],
)
def test_a_misspelt_name_is_asked_for(value, expected, question):
    assert str(InputError("x", "kind", value, expected)).endswith(f"expected {expected}{question}")


class _Entry(Strict):
    kind: str
    shape: str = "round"


class _File(Strict):
    entries: tuple[_Entry, ...] = ()
    named: dict[str, _Entry] = Field(default_factory=dict)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"entires": []}, "x: got entires, expected one of the keys entries, named; did you mean entries?"),
        (
            {"entries": [{"kind": "a"}, {"kid": "b"}, {"kind": "c"}]},  # told before the key that is missing
            "x: entries (entry 2 of 3): got kid, expected one of the keys kind, shape; did you mean kind?",
        ),
        ({"entries": [{"kind": "a"}, {}]}, "x: entries (entry 2 of 2).kind: got nothing, expected this key"),
        ({"named": {"one": {}}}, "x: named.one.kind: got nothing, expected this key"),
    ],
)
def test_keys_are_told_with_their_place(content, message):
    with pytest.raises(InputError) as caught:
        validate(_File, content, "x")
    assert str(caught.value) == message


def test_places_are_counted_from_one():
    content = {"a": {"b": [{"c": [1, 2]}]}}
    assert place_in(content, ("a", "b", 0, "c", 1)) == "a.b (entry 1 of 1).c (entry 2 of 2)"
    assert place_in(content, ("a", "lacking", "c")) == "a.lacking.c"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: [1\nb: 2", "line 2, column 2: got ':', expected ',' or ']' for what begins in line 1"),
        ("a: {x: 1", "line 1, column 9: got the end of the file, expected ',' or '}'"),
        ("a: b: c", "line 1, column 5: got a second ':', expected the keys of a section equally far in, and"),
        ("a: 1\nb\nc: 2", "line 2, column 1: got a line without ':', expected a key with ':' after it"),
        ("a: 1\n\tb: 2", "line 2, column 1: got character '\\t' that cannot start any token, expected valid"),
        ("a: 1\na: 2", 'line 2, column 1: got duplicate key "a", expected valid YAML'),
        ("- 1\nb: 2", "line 2, column 1: got a key, expected an entry as far in as the one before it"),
        ("a: \x01", "character 4: got unacceptable character #x0001, expected text without such characters"),
    ],
)
def test_what_is_no_yaml_is_told_in_one_line_with_its_place(tmp_path, text, message):
    path = tmp_path / "x.yaml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_yaml(path)
    assert str(caught.value).startswith(f"{path}: {message}")
    assert "\n" not in str(caught.value)
    with pytest.raises(InputError):
        load_yaml(_File, path)


@pytest.mark.parametrize(
    ("field", "value", "expected", "shown"),
    [
        ("width_m", 0.03, "less than 7.12 mm, so that it fits", "30 mm"),
        ("depth_m", 1e-4, "less than 12.5 um", "100 um"),
        ("width_m", 0.03, "up to 0.0071 m", "0.03 m"),
        ("angle_rad", math.pi, "10 to 90 deg", "180 deg"),
        ("speed_hz", 600.0, "0 to 500 Hz", "600 Hz"),
        ("severity", 3.0, "0 to 2", "3.0"),
        ("row", 3, "1 to 2", "3"),
    ],
)
def test_a_value_is_told_in_the_unit_of_its_bound(field, value, expected, shown):
    assert str(InputError("x", field, value, expected)) == f"x: {field}: got {shown}, expected {expected}"


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (150.0, 2, "150"),
        (1234.0, 2, "1200"),
        (0.1 + 0.2, 9, "0.3"),
        (65536.0, 3, "65500"),
        (1e5, 9, "100000"),
        (2.5e7, 3, "2.5e+07"),
        (1.26e-5, 2, "1.3e-05"),
        (0.00012345, 3, "0.000123"),
        (-0.0, 3, "-0"),
        (math.nan, 3, "nan"),
    ],
)
def test_numbers_have_no_exponent_where_people_use_none(value, digits, text):
    assert number(value, digits) == text


def test_numbers_with_their_sign():
    assert [number(x, 2, sign=True) for x in (150.0, -3.25, 0.5)] == ["+150", "-3.2", "+0.5"]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.1 + 0.2, "0.3"),
        (3.0, "3.0"),
        (16777217, "16777217"),
        (np.float32(0.3), "0.3"),
        (np.int64(4), "4"),
        ((0.1 + 0.2, 1), "(0.3, 1)"),
        ([np.float64(0.1) * 3, None], "[0.3, None]"),
        (True, "True"),
    ],
)
def test_what_was_found_is_told_without_errors_of_rounding(value, text):
    assert str(InputError("x", "", value, "y")) == f"x: got {text}, expected y"


class _Tooth(Strict):
    teeth: Annotated[float, Si("", gt=0, lt=10)]
    width: Annotated[float, Si("m", gt=0, le=1e5)]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"teeth": {"value": 19.5, "unit": 1}, "width": "1 mm"}, "teeth: got 19.5, expected a number"),
        ({"teeth": 3, "width": {"value": 0.1 + 0.2, "unit": "s"}}, "width: got 0.3 s, expected"),
        ({"teeth": 3, "width": {"value": -1, "unit": "m"}}, "> 0 and <= 100000"),
    ],
)
def test_numbers_of_yaml_are_told_as_people_write_them(content, words):
    with pytest.raises(InputError) as caught:
        validate(_Tooth, content, "x")
    assert words in str(caught.value)


def test_counted_things():
    assert [plural(1, "gap"), plural(3, "gap"), plural(2, "entry", "entries")] == [
        "1 gap",
        "3 gaps",
        "2 entries",
    ]
