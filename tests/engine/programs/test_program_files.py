"""Program files: what is refused, what is written, and how the original comes back."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from truearm.engine.base.errors import InputError
from truearm.engine.base.limits import VARIABLE
from truearm.engine.programs.program import Edit
from truearm.engine.programs.program_files import (
    ProgramFile,
    edited,
    program_files,
    read_programs,
    record_path,
    recorded,
    restored,
    write_programs,
)

POINT = b"  CONST robtarget p1:=[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\r\n"
MODULE = b"MODULE m\r\n  ! gr\xfc\xdfe\r\n" + POINT + b"ENDMODULE\r\n"


def write(folder: Path, name: str, content: bytes = MODULE) -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    return path


def corrected(folder: Path, name: str = "m.mod") -> Path:
    """Return a program that was corrected, with its record beside it."""
    source = write(folder / "source", name)
    (file,) = program_files([source])
    new = MODULE.replace(b"[1,2,3]", b"[1.5,2,3]")
    write_programs(
        folder / "out", [source], {name: new, f"{name}.truearm.json": recorded(file, new, "RAPID", {"a": 1})}
    )
    return folder / "out" / name


def test_a_record_holds_the_original_byte_for_byte(tmp_path: Path) -> None:
    path = corrected(tmp_path)
    record = json.loads(record_path(path).read_text())
    assert record["truearm"] == "truearm-corrected/1"
    assert record["applied"] == {"a": 1}
    (file,) = restored([path])
    assert file.original == MODULE
    (again,) = program_files([path], again=True)
    assert again.original == MODULE


def test_a_corrected_program_is_refused_and_an_original_has_no_record(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"corrected already.*`again`.*`revert`"):
        program_files([corrected(tmp_path)])
    path = write(tmp_path, "m.mod")
    assert program_files([path]) == (ProgramFile(path, "m.mod", MODULE),)
    with pytest.raises(InputError, match="no record beside this program"):
        restored([path])


def test_a_comment_that_says_so_is_believed(tmp_path: Path) -> None:
    for comment, says in (
        (b"! corrected by truearm 0.1.0\r\n", "corrected by truearm 0.1.0"),
        (b"!** corrected by truearm\r\n", "corrected by truearm"),
        (b"! to be corrected by truearm\r\n", None),
        (b"! corrected by truearm on Monday, perhaps\r\n", None),
        (b'TPWrite "corrected by truearm";\r\n', None),
    ):
        path = write(tmp_path, "m.mod", MODULE.replace(b"ENDMODULE", comment + b"ENDMODULE"))
        if says is None:
            assert program_files([path])[0].path == path, comment
            continue
        with pytest.raises(InputError, match=f"this program was corrected already; got \"the comment '{says}'\""):
            program_files([path])


def test_a_program_changed_since_is_no_longer_what_its_record_says(tmp_path: Path) -> None:
    path = corrected(tmp_path)
    path.write_bytes(path.read_bytes() + b"! taught anew\r\n")
    for ask in (partial(program_files, [path], again=True), partial(restored, [path])):
        with pytest.raises(
            InputError, match=r"changed after it was corrected.*move it away from m\.mod\.truearm\.json"
        ):
            ask()


def test_a_damaged_record_is_refused(tmp_path: Path) -> None:
    path = corrected(tmp_path)
    record = json.loads(record_path(path).read_text())
    damaged = "the original in this record is damaged"
    for text, said in (
        ('{"truearm": "truearm-corrected/1"}', "is missing"),
        ("{", "this record cannot be read"),
        ("[" * 100_000, "this record cannot be read"),
        ("[]", "must hold named entries"),
        *((json.dumps({**record, "original": o}), damaged) for o in ("AAAA", "not base64!", record["original"][:-8])),
    ):
        record_path(path).write_text(text)
        with pytest.raises(InputError, match=said):
            restored([path])


def test_what_is_no_program_is_refused(tmp_path: Path) -> None:
    for name, content, said in (
        ("m.mod", b"", "the file is empty"),
        ("m.mod", b"MODULE m\0\nENDMODULE", "zero bytes.*Export the program as text"),
        ("m.mod", "MODULE m\nENDMODULE".encode("utf-16"), "UTF-16.*Save it as UTF-8"),
        ("m.doc", MODULE, r"no robot language has files of this kind.*\.doc.*RAPID"),
        ("m", MODULE, "no suffix"),
        ("m.ls", MODULE, "called as a program in FANUC LS and is none; got 'what looks like RAPID'"),
        ("m.mod", b"hello world", "called as a program in RAPID and is none"),
    ):
        with pytest.raises(InputError, match=said):
            read_programs(program_files([write(tmp_path, name, content)]))


def test_a_program_that_is_too_large_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, "program_size=50")
    with pytest.raises(InputError, match=r"too large to be corrected at once.*Split it"):
        program_files([write(tmp_path, "m.mod")])


def test_a_program_given_twice_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path, "m.mod")
    (tmp_path / "link.mod").symlink_to(path)
    for other in (path, tmp_path / "link.mod"):
        with pytest.raises(InputError, match="given twice"):
            program_files([path, other])


def test_programs_in_two_languages_are_refused(tmp_path: Path) -> None:
    job = b"/JOB\r\n//NAME A\r\n//POS\r\n///NPOS 0,0,0,0,0,0\r\n//INST\r\n///DATE 2024/01/01 10:00\r\nNOP\r\nEND\r\n"
    files = program_files([write(tmp_path, "m.mod"), write(tmp_path, "a.jbi", job)])
    with pytest.raises(InputError, match=r"a\.jbi: the programs are in different languages.*INFORM.*RAPID"):
        read_programs(files)


def test_programs_of_the_same_name_keep_their_folders(tmp_path: Path) -> None:
    names = ["cell1/m.mod", "cell2/m.mod", "cell2/n.mod", "a/x/k.mod", "b/x/k.mod"]
    paths = [write(tmp_path, name) for name in names]
    files = program_files(paths)
    assert [file.name for file in files] == ["cell1/m.mod", "cell2/m.mod", "n.mod", "a/x/k.mod", "b/x/k.mod"]
    write_programs(tmp_path / "out", paths, {file.name: file.original for file in files})
    assert (tmp_path / "out" / "a" / "x" / "k.mod").read_bytes() == MODULE
    # A way around through another folder is none that results would take.
    write(tmp_path, "m.mod")
    around = program_files([tmp_path / "cell2" / ".." / "m.mod", paths[0]])
    assert [file.name for file in around] == [f"{tmp_path.name}/m.mod", "cell1/m.mod"]


def test_what_truearm_did_not_write_is_not_overwritten(tmp_path: Path) -> None:
    source = write(tmp_path, "m.mod")
    with pytest.raises(InputError, match="would be overwritten"):
        write_programs(tmp_path, [source], {"m.mod": b"new"})
    assert source.read_bytes() == MODULE
    for name in ("m.mod", "compensation.html"):
        theirs = write(tmp_path / "out", name, b"theirs")
        with pytest.raises(InputError, match="not written by truearm or was changed since"):
            write_programs(tmp_path / "out", [], {name: b"new", "n.mod": b"other"})
        assert theirs.read_bytes() == b"theirs"
        assert not (tmp_path / "out" / "n.mod").exists()
        theirs.unlink()
    for page in (b"page", b"other page"):
        write_programs(tmp_path / "out", [], {"n.txt": b"text", "compensation.html": page})
    assert (tmp_path / "out" / "compensation.html").read_bytes() == b"other page"


def test_an_original_is_not_written_beside_the_record_of_a_correction(tmp_path: Path) -> None:
    path = corrected(tmp_path / "one")
    corrected(tmp_path / "two")
    with pytest.raises(InputError, match="a record of a correction stands here"):
        write_programs(tmp_path / "two" / "out", [path], {"m.mod": MODULE})


def test_what_truearm_wrote_may_be_written_again(tmp_path: Path) -> None:
    path = corrected(tmp_path)
    (file,) = program_files([tmp_path / "source" / "m.mod"])
    write_programs(path.parent, [], {"m.mod": b"new", "m.mod.truearm.json": recorded(file, b"new", "RAPID", {})})
    assert path.read_bytes() == b"new"
    path.write_bytes(b"edited by hand")
    with pytest.raises(InputError, match="changed since"):
        write_programs(
            path.parent, [], {"m.mod": b"newer", "m.mod.truearm.json": recorded(file, b"newer", "RAPID", {})}
        )


@given(
    st.text(max_size=60), st.lists(st.tuples(st.integers(0, 60), st.integers(0, 6), st.text(max_size=5)), max_size=6)
)
def test_edits_change_what_they_name_and_nothing_else(text: str, wanted: list[tuple[int, int, str]]) -> None:
    edits, at = [], 0
    for start, length, new in sorted(wanted):
        start = max(start, at)
        if start + length > len(text):
            break
        edits.append(Edit(0, start, start + length, new))
        at = start + length
    done = list(text)
    for edit in reversed(edits):
        done[edit.start : edit.stop] = [edit.text]
    assert edited(text, edits[::-1] if all(e.start < e.stop for e in edits) else edits) == "".join(done)
    with pytest.raises(ValueError, match="overlap"):  # a fault of ours
        edited("abcdef", [Edit(0, 0, 3, "x"), Edit(0, 2, 4, "y")])
