"""Reading and writing files: every failure is said in words."""

from __future__ import annotations

import os
from hashlib import sha256
from pathlib import Path

import pytest
from pydantic import BaseModel

from truearm.engine.base.errors import InputError
from truearm.engine.base.files import exists, noted_reads, read_bytes, read_text, read_yaml
from truearm.engine.base.writing import write_text


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
        ("a: 1\na: 2", "f.yaml, line 2: an entry is given twice; got 'a'. Keep one of them."),
        (
            "a: !!python/object:os.system x",
            "tags with ! cannot be used here; got 'tag:yaml.org",
        ),
        ("a: *y", "line 1: an alias with * stands for something that the file does not have; got 'y'"),
        ("a: 1\n---\na: 2", "line 2: a second document begins here, behind ---"),
        ("a:\tb\n\tc: 1", "line 1: a tab stands where blanks belong"),
        (
            "a: {b: 1",
            "this is not valid YAML (expected ',' or '}', but got '<stream end>'). Look",
        ),
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


def test_what_is_read_is_noted_where_somebody_wants_to_know_it(tmp_path: Path) -> None:
    one, other = tmp_path / "one.txt", tmp_path / "other.txt"
    one.write_text("first")
    other.write_text("other")
    with noted_reads() as noted:
        read_text(one)
        one.write_text("second")
        read_bytes(one)
        with pytest.raises(InputError):
            read_text(tmp_path / "missing.txt")
    read_text(other)
    assert noted == {one: [sha256(b"first").hexdigest(), sha256(b"second").hexdigest()]}
