"""Reading and writing files: every failure is said in words."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from pydantic import BaseModel

from truearm.compensation.cell import CellFile
from truearm.compensation.program_files import CorrectionRecord
from truearm.errors import InputError
from truearm.files import exists, read_bytes, read_yaml
from truearm.identification.solving.bounds import Bounds
from truearm.measurement.readers.mapping import MappingFile
from truearm.modeling.formats.robot_file import RobotFile
from truearm.planning.constraints.constraints import Constraints
from truearm.printable import is_one_line
from truearm.schemas import validated
from truearm.writing import write_text


class Anything(BaseModel):
    a: str = ""
    n: float = 0
    numbers: dict[int, float] = {}


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("a: 2023-02-30", "a value cannot be understood (day is out of range for month). Put text into quotes."),
        ("a: 2023-02-03T25:00:00", "a value cannot be understood (hour must be in 0..23)"),
        ("n: " + "9" * 5000, "a value cannot be understood (Exceeds the limit"),
        ("a: " + "[" * 3000 + "]" * 3000, "nested too deep"),
        ("a: !!bool x", "a value cannot be understood"),
        ("a: !!int ''", "a value cannot be understood"),
        ("%YAML 1.3\n---\na: 1", "a value cannot be understood (version"),
        ("a: \x07", "this is not valid YAML"),
        (
            "a: 0x" + "f" * 6000,
            "f.yaml, a: a text belongs here; got a number of very many digits; allowed: a text, in quotes",
        ),
        ("numbers: {2: x}", "f.yaml, numbers.2: "),
        ("1: 2\na: [1, 2]", "f.yaml, a: "),
    ],
)
def test_yaml_that_cannot_be_used(tmp_path: Path, text: str, part: str) -> None:
    (tmp_path / "f.yaml").write_text(text)
    with pytest.raises(InputError) as caught:
        read_yaml(tmp_path / "f.yaml", Anything)
    assert part in str(caught.value)
    assert "f.yaml" in str(caught.value)


def test_only_near_names_are_offered(tmp_path: Path) -> None:
    for name in ("data.csv", "data1.csv", "data2.csv", "robot.yaml"):
        (tmp_path / name).touch()
    with pytest.raises(InputError, match=r"no such file. Did you mean data\S*.csv or data\S*.csv\?$"):
        read_bytes(tmp_path / "data3.csv")
    with pytest.raises(InputError, match="Check the path"):
        read_bytes(tmp_path / "notes.csv")


@pytest.mark.parametrize(("name", "reason"), [("x" * 300, "File name too long"), ("a\0b", "null")])
def test_paths_that_cannot_be(tmp_path: Path, name: str, reason: str) -> None:
    with pytest.raises(InputError, match=f"the file cannot be read .*{reason}"):
        read_bytes(tmp_path / name)
    assert not exists(tmp_path / name)


def test_a_file_is_no_folder(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="Not a directory"):
        read_bytes(tmp_path / "file" / "data.csv")
    with pytest.raises(InputError, match="this is a file, a folder is needed"):
        write_text(tmp_path / "file" / "data.csv", "")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everywhere")
def test_folders_that_may_not_be_entered(tmp_path: Path) -> None:
    shut = tmp_path / "shut"
    shut.mkdir()
    shut.chmod(0)
    try:
        with pytest.raises(InputError, match="Permission denied"):
            read_bytes(shut / "data.csv")
        with pytest.raises(InputError, match=r"Permission denied|cannot be written to"):
            write_text(shut / "below" / "data.csv", "")
    finally:
        shut.chmod(0o700)


@pytest.mark.parametrize("call", ["stat", "lstat"])
def test_a_permission_that_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: str) -> None:
    def denied(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, call, denied)
    monkeypatch.setattr(Path, "read_bytes", denied)
    with pytest.raises(InputError, match="Permission denied"):
        read_bytes(tmp_path / "data.csv")
    with pytest.raises(InputError, match="Permission denied"):
        write_text(tmp_path / "data.csv", "")


@pytest.mark.parametrize("text", ["smr 1", "<b>", "Träger", "a: #{}", "日本", "\u00a0x"])
def test_one_line(text: str) -> None:
    assert is_one_line(text)


@pytest.mark.parametrize("text", ["", "  ", "\u00a0", "a\nb", "a\tb", "a\0", "a\x7f", "a\u2028b", "a\x85b", "\ud800"])
def test_not_one_line(text: str) -> None:
    assert not is_one_line(text)


# -- what pydantic finds, in plain words

SCHEMAS: list[type[BaseModel]] = [RobotFile, CellFile, Bounds, Constraints, MappingFile, CorrectionRecord]
BOUNDS = {"truearm": "truearm-bounds/1", "units": {"length": "mm", "angle": "deg"}}
ALLOWED = {"truearm": "truearm-constraints/1", "units": {"length": "mm", "angle": "deg"}}


@pytest.mark.parametrize(
    ("schema", "content", "said"),
    [
        (Bounds, BOUNDS | {"units": 3}, "units: named entries belong here; got 3; allowed: NAME: VALUE"),
        (Bounds, BOUNDS | {"within": [1]}, "within: named entries belong here; got [1]; allowed: NAME: VALUE"),
        (Bounds, BOUNDS | {"within": {"d_1": None}}, "within.d_1: a number belongs here; got nothing"),
        (Bounds, BOUNDS | {"within": {"d_1": 10**400}}, "within.d_1: a number belongs here; got a number of very"),
        (Bounds, BOUNDS | {"within": {"d_1": float("inf")}}, "within.d_1: a finite number belongs here; got inf"),
        (
            Bounds,
            BOUNDS | {"within": {"d_1": -1.0}},
            "within.d_1: the number is too small; got -1.0; allowed: 0 or more",
        ),
        (Bounds, BOUNDS | {"within": {5: 1.0}}, "within.5: a text belongs here, as the name of the entry; got 5"),
        (Bounds, BOUNDS | {"between": {"d_1": [1]}}, "between.d_1: there are too few entries; got 1; allowed: 2."),
        (Bounds, BOUNDS | {"between": {"d_1": []}}, "between.d_1: there are too few entries; got 0; allowed: 2."),
        (
            Bounds,
            BOUNDS | {"between": {"d_1": [1, 2, 3]}},
            "between.d_1: there are too many entries; got 3; allowed: 2.",
        ),
        (Bounds, BOUNDS | {"between": {"d_1": 3}}, "between.d_1: a list belongs here; got 3; allowed: entries in"),
        (
            Bounds,
            BOUNDS | {"between": {"d_1": [1, [10**5000]]}},
            "between.d_1[2]: a number belongs here; got a list of 1 entries",
        ),
        (Bounds, BOUNDS | {5: 1}, "5: the name of an entry must be a text; got 5; allowed: a name"),
        (
            Bounds,
            BOUNDS | {"withn": {}},
            "withn: this entry is not known here; allowed: truearm, units, within, between. D",
        ),
        (
            Bounds,
            BOUNDS | {"units": {"length": "mm", "angle": "deg", "time": "s"}},
            "units.time: this entry is not known here; allowed: length, angle.",
        ),
        (Constraints, ALLOWED | {"limits": {"a": [1, 2]}}, "limits.a: a whole number belongs here, as the name of"),
        (Constraints, ALLOWED | {"limits": {0: [1, 2]}}, "limits.0: the number is too small, as the name of the entry"),
        (
            Constraints,
            ALLOWED | {"visibility": {"within": 1.0, "targets": {}}},
            "visibility.targets: there are too few entries; got 0; allowed: at least 1",
        ),
        (
            Constraints,
            ALLOWED | {"visibility": {"within": 1.0, "targets": {"1": [0.0, 0.0, 0.0]}}},
            "visibility: a direction cannot be zero; got '1: [0.0, 0.0, 0.0]'",
        ),
        (
            Constraints,
            ALLOWED | {"moments": {1: "up"}},
            "moments.1: this value is not known; got 'up'; allowed: positive",
        ),
        (
            CorrectionRecord,
            {"truearm": "truearm-corrected/1", "original_sha256": "x"},
            "program: this entry is missing",
        ),
    ],
)
def test_entries_that_do_not_fit_are_told_in_plain_words(
    schema: type[BaseModel], content: dict[object, object], said: str
) -> None:
    with pytest.raises(InputError) as caught:
        validated(content, schema, "f.yaml")
    assert str(caught.value).startswith(f"f.yaml, {said}")


def of_every_kind(value: object) -> Iterator[object]:
    """Return entries of every kind in place of each entry of a file, one after the other."""
    others: list[object] = [
        None,
        True,
        7,
        -3,
        0.5,
        float("nan"),
        "word",
        "",
        [],
        [1],
        {},
        {"word": 1},
        {5: 1},
        [[1] * 9],
    ]
    yield from others
    if isinstance(value, dict):
        yield value | {"unheard_of": 1}
        for key, entry in value.items():
            yield {k: v for k, v in value.items() if k != key}
            yield from ({**value, key: other} for other in of_every_kind(entry))
    if isinstance(value, list):
        for number, entry in enumerate(value):
            yield from ([*value[:number], other, *value[number + 1 :]] for other in of_every_kind(entry))


FILES: dict[type[BaseModel], dict[str, object]] = {
    RobotFile: {
        "truearm": "truearm-robot/1",
        "name": "arm",
        "units": {"length": "mm", "angle": "deg"},
        "convention": "urdf",
        "joints": [{"name": "a", "type": "revolute", "limits": [-1.0, 1.0], "transmission_periods": 40}],
        "flange": {"translation": [0.0, 0.0, 1.0]},
        "controller": {"joints": [{"joint": "a", "sign": 1, "pulses_per_degree": 5.0}]},
        "masses": [{"link": 1, "mass": 1.0, "cog": [0.0, 0.0, 0.0], "inertia": [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]}],
        "effects": ["gain"],
        "truths": {"x": {"source": "", "values": {"a": 1.0}, "compliance": {1: 0.1}}},
        "targets": [{"name": "1", "quaternion": [1.0, 0.0, 0.0, 0.0]}],
    },
    CellFile: {
        "truearm": "truearm-cell/1",
        "units": {"length": "mm", "angle": "deg"},
        "tools": {"t": {"of": "flange", "translation": [0.0, 0.0, 1.0], "abc": [0.0, 0.0, 0.0]}},
    },
    Bounds: {**BOUNDS, "within": {"a": 1.0}, "between": {"b": [1.0, 2.0]}},
    Constraints: {
        **ALLOWED,
        "limits": {1: [0.0, 1.0]},
        "box": {"of": "flange", "x": [0.0, 1.0]},
        "visibility": {"within": 1.0, "targets": {"1": [0.0, 0.0, 1.0]}},
    },
    MappingFile: {
        "truearm": "truearm-mapping/1",
        "layout": {"delimiter": "comma", "header": 1, "encoding": "utf-8"},
        "configuration": {"column": "pose"},
        "names": {"column": "ball", "pattern": "(?P<target>.*)"},
        "length_unit": "mm",
        "readings": [{"x": "X", "y": "Y", "z": "Z"}],
        "joints": {"columns": ["q1"], "unit": "deg"},
        "sigma": {"value": 0.01, "unit": "mm"},
    },
    CorrectionRecord: {
        "truearm": "truearm-corrected/1",
        "program": "p",
        "language": "krl",
        "original_sha256": "0" * 64,
        "corrected_sha256": "0" * 64,
        "applied": {},
        "original": "",
    },
}


@pytest.mark.parametrize("schema", SCHEMAS)
def test_nothing_of_pydantic_is_passed_on(schema: type[BaseModel]) -> None:
    assert validated(FILES[schema], schema, "f.yaml")
    refused = 0
    for content in of_every_kind(FILES[schema]):
        if not isinstance(content, dict):
            continue
        try:
            validated(content, schema, "f.yaml")
        except InputError as error:
            refused += 1
            message = str(error)
            assert message.startswith("f.yaml")
            for word in (
                "nput should",
                "valid dictionary",
                "instance of",
                "Value error",
                "equired",
                "{",
                "items after",
            ):
                assert word not in message.replace("all in {", "").split("; got")[0], message
            assert len(message) < 700
    assert refused > 40
