"""Entries that do not fit are refused in plain words: by name, with what came, what is allowed and the cure."""

from __future__ import annotations

import datetime
import re
from collections.abc import Iterator
from typing import Any, Final

import pytest
from pydantic import BaseModel
from tests.expecting import refused

from truearm.engine.base.errors import InputError
from truearm.engine.base.schemas import validated
from truearm.engine.data.readers.mapping import MappingFile
from truearm.engine.fit.bounds import Bounds
from truearm.engine.motion.constraints import Constraints
from truearm.engine.programs.cell import CellFile
from truearm.engine.programs.program_files import CorrectionRecord
from truearm.engine.robot.robot_file.reading import robot_from_file
from truearm.engine.robot.robot_file.schema import RobotFile

UNITS: Final = {"length": "mm", "angle": "deg"}
BOUNDS: Final[dict[object, object]] = {"truearm": "truearm-bounds/1", "units": UNITS}
ALLOWED: Final[dict[object, object]] = {"truearm": "truearm-constraints/1", "units": UNITS}
UPRIGHT: Final = [1.0, 0.0, 0.0, 0.0]
ABOVE: Final = [0.0, 0.0, 1.0]


#: Of an entry: what it is beside good ones, and what is said.
BAD_BOUNDS: Final[tuple[tuple[dict[object, object], str], ...]] = (
    ({"units": 3}, "units: named entries belong here; got 3; allowed: NAME: VALUE"),
    ({"units": UNITS | {"time": "s"}}, "units.time: this entry is not known here; allowed: length, angle."),
    ({"within": [1]}, "within: named entries belong here; got [1]; allowed: NAME: VALUE"),
    ({"within": {"d_1": None}}, "within.d_1: a number belongs here; got nothing"),
    ({"within": {"d_1": 10**400}}, "within.d_1: a number belongs here; got a number of very"),
    ({"within": {"d_1": float("inf")}}, "within.d_1: the number is not finite; got inf"),
    ({"within": {"d_1": float("nan")}}, "within.d_1: this is not a number; got nan; allowed: a n"),
    ({"within": {"d_1": -1.0}}, "within.d_1: the number is too small; got -1.0; allowed: 0 or more"),
    ({"within": {"d_1": True}}, "within.d_1: a number belongs here; got true; allowed: a number"),
    ({"within": {"d_1": [None, "x"]}}, "within.d_1: a number belongs here; got [null, x]; allowed"),
    ({"within": {"d_1": {"b": 1}}}, "within.d_1: a number belongs here; got {b: 1}; allowed"),
    ({"within": {5: 1.0}}, "within.5: a text belongs here, as the name of the entry; got 5"),
    ({"within": {"\ud800": 1.0}}, "within: the text holds half a character; got '\\ud800'"),
    ({"between": {"d_1": [1]}}, "between.d_1: there are too few entries; got 1; allowed: 2."),
    ({"between": {"d_1": []}}, "between.d_1: there are too few entries; got 0; allowed: 2."),
    ({"between": {"d_1": [1, 2, 3]}}, "between.d_1: there are too many entries; got 3; allowed: 2."),
    ({"between": {"d_1": 3}}, "between.d_1: a list belongs here; got 3; allowed: entries in"),
    ({"between": {"d_1": [1, [10**5000]]}}, "between.d_1[2]: a number belongs here; got a list of 1 entries"),
    ({5: 1}, "5: the name of an entry must be a text; got 5; allowed: a name"),
    ({"Within": {}}, "Within: this entry is not known here; allowed: truearm, units, within, between. Did you mean wi"),
    ({"x": 1}, "x: this entry is not known here; allowed: truearm, units, within, between. Corr"),
)
BAD_CONSTRAINTS: Final[tuple[tuple[dict[object, object], str], ...]] = (
    ({"limits": {"a": [1, 2]}}, "limits.a: a whole number belongs here, as the name of"),
    ({"limits": {0: [1, 2]}}, "limits.0: the number is too small, as the name of the entry"),
    ({"moments": {1: "up"}}, "moments.1: this value is not known; got 'up'; allowed: positive"),
    (
        {"visibility": {"within": 1.0, "targets": {}}},
        "visibility.targets: there are too few entries; got 0; allowed: at least 1",
    ),
    (
        {"visibility": {"within": 1.0, "targets": {"1": [0.0, 0.0, 0.0]}}},
        "visibility: a direction cannot be zero; got '1: [0.0, 0.0, 0.0]'",
    ),
)
BAD_FILES: Final = (
    (Bounds, None, "f.yaml: the file holds no entries, only comments or nothing; allowed: NAME: VALUE"),
    (Bounds, [1, 2], "f.yaml: the file must hold named entries; got [1, 2]; allowed: NAME: VALUE"),
    (Bounds, {**BOUNDS, "units": {"Length": "mm", "angle": "deg"}}, "It may be the entry Length, which is not"),
    (Bounds, {"truearm": "truearm-bounds/1"}, "units: this entry is missing; allowed: named entries (length, "),
    (
        CorrectionRecord,
        {"truearm": "truearm-corrected/1", "original_sha256": "x"},
        "f.yaml, program: this entry is missing",
    ),
    *((Bounds, BOUNDS | content, f"f.yaml, {said}") for content, said in BAD_BOUNDS),
    *((Constraints, ALLOWED | content, f"f.yaml, {said}") for content, said in BAD_CONSTRAINTS),
)


def test_entries_that_do_not_fit_are_told_in_plain_words() -> None:
    for schema, content, said in BAD_FILES:
        assert said in refused(None, "", validated, content, schema, "f.yaml"), said


#: A whole file of each kind, with every entry that there is.
FILES: Final[dict[type[BaseModel], dict[object, object]]] = {
    RobotFile: {
        "truearm": "truearm-robot/1",
        "name": "arm",
        "title": "An arm",
        "source": "its maker",
        "units": UNITS,
        "convention": "urdf",
        "joints": [{"name": "a", "type": "revolute", "x": 1.0, "limits": [-1.0, 1.0], "transmission_periods": 40}],
        "flange": {"translation": ABOVE, "quaternion": UPRIGHT},
        "controller": {
            "source": "its manual",
            "joints": [{"joint": "a", "sign": 1, "zero": 1.0, "coupling": {}, "pulses_per_degree": 5.0}],
            "base": {"translation": ABOVE},
            "flange": {"quaternion": UPRIGHT},
        },
        "masses": [{"link": 1, "mass": 1.0, "cog": ABOVE, "inertia": [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]}],
        "payload": {"mass": 1.0, "cog": ABOVE},
        "gravity": [0.0, 0.0, -9.81],
        "tools": {"t": {"targets": {"1": ABOVE}, "mass": 1.0, "cog": ABOVE}},
        "truths": {"x": {"source": "", "values": {"z_1": 1.0}, "compliance": {1: 0.1}}},
        "priors": {"length": 1.0, "angle": 1.0},
        "effects": ["gain"],
        "base_quaternion": UPRIGHT,
        "targets": [{"name": "1", "quaternion": UPRIGHT}],
        "fixtures": [{"name": "p", "kind": "plane", "quaternion": UPRIGHT}],
        "parameters": {
            "z_1": {"nominal": 0.0, "value": 0.1, "prior": 1.0, "unit": "mm", "deviation": 0.1, "informed": 0.5}
        },
        "history": ["made"],
    },
    CellFile: {
        "truearm": "truearm-cell/1",
        "units": UNITS,
        "tools": {"t": {"of": "flange", "target": "1", "abc": ABOVE, "controller": {"wpr": ABOVE}}},
        "frames": {"f": {"of": "world", "translation": ABOVE, "quaternion": UPRIGHT}},
    },
    Bounds: {**BOUNDS, "within": {"a": 1.0}, "between": {"b": [1.0, 2.0]}},
    Constraints: {
        **ALLOWED,
        "limits": {1: [0.0, 1.0]},
        "moments": {1: "positive"},
        "box": {"of": "flange", "x": [0.0, 1.0]},
        "floor": 0.0,
        "visibility": {"within": 1.0, "targets": {"1": ABOVE}, "instrument": ABOVE},
        "clearance": 1.0,
    },
    MappingFile: {
        "truearm": "truearm-mapping/1",
        "layout": {"delimiter": "comma", "decimal": "point", "header": 1, "first_row": 2}
        | {"comment": "#", "encoding": "utf-8"},
        "configuration": {"column": "pose"},
        "names": {"column": "ball", "pattern": "(?P<target>.*)", "others": "skip"},
        "length_unit": "mm",
        "readings": [{"x": "X", "y": "Y", "z": "Z", "qw": "a", "qx": "b", "qy": "c", "qz": "d"}],
        "references": ["r"],
        "joints": {"columns": ["q1"], "unit": "mm"},
        "sigma": {"value": 0.01, "unit": "mm"},
        "sigma_rot": {"value": 0.01, "unit": "mrad"},
    },
    CorrectionRecord: {
        "truearm": "truearm-corrected/1",
        "program": "p",
        "language": "krl",
        "original_sha256": "0" * 64,
        "corrected_sha256": "0" * 64,
        "applied": {},
        "original": "",
        "date": "2026-11-27",
        "targets": "AAAAAAAA",
    },
}

HUGE: Final = 10**5000
ITSELF: Final[list[object]] = []
ITSELF.append(ITSELF)
#: Entries of every kind that somebody may write in place of the right one.
OTHERS: Final[list[Any]] = [
    *(None, True, 7, -3, 0, 0.5, 1e300, float("nan"), float("inf"), HUGE, datetime.date(2020, 1, 1)),
    *("word", "", "two words", "3", "MM", "\x1b[31m", "a\u202eb", "\ud800", "x" * 5000),
    *([], [1], [[1] * 9], [1.0] * 7, ["x"], [None], [float("nan")] * 3, ITSELF),
    *({}, {"word": 1}, {5: 1}, {HUGE: 1}),
]


def damaged(value: object) -> Iterator[object]:
    """Return a file with one entry after the other replaced, removed, doubled or under another name."""
    yield from OTHERS
    if isinstance(value, dict):
        yield from (value | {name: 1} for name in ("unheard_of", 5, None, HUGE, "\x1b[1m" + "y" * 400))
        for name, entry in value.items():
            rest = {key: kept for key, kept in value.items() if key != name}
            yield rest
            if isinstance(name, str):
                yield from (rest | {other: entry} for other in (name.upper(), name[:-1] or "word"))
            yield from ({**value, name: other} for other in damaged(entry))
    if isinstance(value, list):
        yield from (value * 2, value[:-1])
        for number, entry in enumerate(value):
            yield from ([*value[:number], other, *value[number + 1 :]] for other in damaged(entry))


#: What only programmers call so, and what pydantic says.
FORBIDDEN: Final = re.compile(
    r"\b(tuple|dict|dictionary|str|int|NoneType|None|True|False|bool|instance|class|object|validation|valid|input|"
    r"Input|codec|digits\)|Exceeds|unprintable|list_type|Value|surrogates|Error|_[A-Z]\w+)\b"
)
#: The place, what is wrong, what came, what is allowed, the cure.
FORM: Final = re.compile(r"f\.yaml(, [^:]+)?: [a-z][^;]+(; got [^;]+)?(; allowed: .+)?\.( [A-Z].+[.?])?")
#: Of what says itself what would be right, no more need be said.
SAYS_IT: Final = re.compile(r"\b(give|must|none may|needs?|would have|twice|belong|is given|cannot be zero)\b")


def read(content: object, schema: type[BaseModel]) -> None:
    made = validated(content, schema, "f.yaml")
    if isinstance(made, RobotFile):
        robot_from_file(made, "f.yaml")


@pytest.mark.parametrize("schema", FILES)
def test_every_damaged_entry_is_told_in_the_form_of_the_house(schema: type[BaseModel]) -> None:
    read(FILES[schema], schema)
    refused = 0
    for content in damaged(FILES[schema]):
        try:
            read(content, schema)
        except InputError as error:
            refused += 1
            message = str(error)
            said = message.partition("; got ")[0] + message.rpartition("; allowed: ")[2]
            assert FORM.fullmatch(message), message
            assert message.isprintable(), message
            assert not FORBIDDEN.search(said.replace("named groups", "")), message
            assert "; got " in message or "; allowed: " in message or SAYS_IT.search(message), message
            assert len(message) < 900, message
    assert refused > 100
