"""A run that is killed leaves the old result, the new one or a refusal, and the next run heals it."""

from __future__ import annotations

import json
import os
import shutil
import stat
import tempfile
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from tests.answered import compensate
from tests.expecting import refused
from tests.house.examples import EXAMPLES
from tests.killing import between, contents, found, killed, killed_copies, leftovers, operations

import truearm
from truearm.compensation.result import ProgramCorrection
from truearm.engine.base.files import read_bytes
from truearm.engine.base.manifest import MANIFEST, UNFINISHED, hash_of, sets_in
from truearm.engine.base.writing import output_file, output_folder, write_files, write_text
from truearm.engine.programs.corrected_targets import LEDGER, LedgerEntry, known_by_ledger, remember
from truearm.engine.programs.program_files import program_files, restored, write_programs

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="a process cannot copy itself here")

OLD = {"a": "old a", "folder/c": "old c"}
NEW = {"a": "new a", "b": "new b", "folder/c": "new c"}


def in_bytes(texts: dict[str, str]) -> dict[str, bytes]:
    return {name: text.encode() for name, text in texts.items()}


def fresh(folder: Path, old: dict[str, str]) -> Path:
    if folder.exists():
        shutil.rmtree(folder)
    if old:
        write_files(folder, old)
    return folder


@pytest.fixture(scope="module")
def unfinished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder as a run leaves it that was killed after its first file of three."""
    folder = tmp_path_factory.mktemp("unfinished")
    for number in range(operations(lambda: write_files(folder, NEW), folder)):
        fresh(folder, OLD)
        killed(lambda: write_files(folder, NEW), folder, number)
        if (folder / "a").read_text() == NEW["a"]:
            break
    assert not (folder / "b").exists()
    return folder


def test_several_files_are_old_or_new_or_refused(tmp_path: Path) -> None:
    for number, old in enumerate(({}, OLD)):
        folder, as_new, seen = tmp_path / f"out-{number}", in_bytes(NEW), set()
        fresh(folder, old)
        again = partial(write_files, folder, NEW, "truearm again")
        for copy in killed_copies(again, folder, tmp_path / f"kept-{number}"):
            seen.add(found(copy, in_bytes(old), as_new, [set(NEW)]))
            write_files(copy, NEW, "truearm again")
            assert contents(copy) == as_new
            assert leftovers(copy) == []
            assert [set(one.files) for one in sets_in(copy)] == [set(NEW)]
        assert seen == {"old", "refused", "new"}


def test_a_single_file_is_old_or_new(tmp_path: Path) -> None:
    for number in range(operations(lambda: write_text(tmp_path / "a", "new"), tmp_path)):
        (tmp_path / "a").write_text("old")
        killed(lambda: write_text(tmp_path / "a", "new"), tmp_path, number)
        assert (tmp_path / "a").read_text() in ("old", "new")
        write_text(tmp_path / "a", "new")
        assert contents(tmp_path) == {"a": b"new"}


def test_a_run_that_heals_may_be_killed_too(tmp_path: Path, unfinished: Path) -> None:
    folder = tmp_path / "out"
    before, as_new = in_bytes(OLD), in_bytes(NEW)
    shutil.copytree(unfinished, folder)
    for copy in killed_copies(lambda: write_files(folder, NEW), folder, tmp_path / "kept"):
        found(copy, before, as_new, [set(NEW)])
        write_files(copy, NEW)
        assert contents(copy) == as_new
        assert leftovers(copy) == []


# -- programs: never corrected twice


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("killed")


@pytest.fixture(scope="module")
def corrections(folder: Path) -> tuple[ProgramCorrection, ProgramCorrection]:
    """A program corrected in two ways."""
    given = EXAMPLES["compensate"](folder) | {"out": None, "accept": ["not-better-here"]}
    return compensate(**given), compensate(**given | {"split": None})


@pytest.mark.parametrize("earlier", [False, True])
def test_a_program_is_never_corrected_twice(
    tmp_path: Path, corrections: tuple[ProgramCorrection, ProgramCorrection], earlier: bool
) -> None:
    first, second = corrections
    original = first.files[0].file.original
    out = tmp_path / "out"

    def work(out: Path) -> None:
        write_programs(output_folder(out), [], texts, "truearm again")

    if earlier:
        first.save(out)
    before = contents(out) if earlier else {}
    texts = written_by(second)
    assert before.get("plate.mod") != texts["plate.mod"]
    for copy in killed_copies(lambda: work(out), out, tmp_path / "kept"):
        found(copy, before, texts, [set(texts)])
        if (copy / "plate.mod").exists():
            refused(None, r"corrected already|has not finished", program_files, [copy / "plate.mod"])
            if leftovers(copy).count(UNFINISHED):
                told = r"has not finished.* so run that command again: truearm again$"
                refused(None, told, restored, [copy / "plate.mod"])
            else:
                assert program_files([copy / "plate.mod"], again=True)[0].original == original
                assert restored([copy / "plate.mod"])[0].original == original
        work(copy)
        assert contents(copy) == texts
        assert leftovers(copy) == []


def test_a_ledger_knows_every_program_that_a_killed_run_has_written(
    tmp_path: Path, corrections: tuple[ProgramCorrection, ProgramCorrection]
) -> None:
    """Whatever becomes of the record and of the comment."""
    made, place = corrections[0], tmp_path / "work"
    place.mkdir()
    made = replace(made, ledger=place / "robot" / LEDGER)
    (place / "robot").mkdir()
    seen = set()
    for copy in killed_copies(lambda: made.save(place / "out"), place, tmp_path / "kept"):
        known = known_by_ledger(copy / "robot" / LEDGER)
        if (copy / "out" / "plate.mod").exists():
            assert [one.program for one in known] == ["plate.mod"]
        seen.add((bool(known), (copy / "out" / "plate.mod").exists()))
    assert seen == {(False, False), (True, False), (True, True)}


def test_two_runs_at_once_leave_a_ledger_of_both(tmp_path: Path) -> None:
    ledger = tmp_path / LEDGER
    one, other, third = (LedgerEntry(program=name, date="", robot="r", targets=name * 8) for name in ("a", "b", "c"))
    for number in range(operations(partial(remember, ledger, [one]), tmp_path)):
        ledger.unlink(missing_ok=True)
        for earlier in ([], [third]):
            remember(ledger, earlier)
            between(partial(remember, ledger, [one]), partial(remember, ledger, [other]), tmp_path, number)
            assert sorted(found.program for found in known_by_ledger(ledger)) == ["a", "b", *("c" for _ in earlier)]
            assert leftovers(tmp_path) == []


def written_by(correction: ProgramCorrection) -> dict[str, bytes]:
    """Return what a correction writes, drawn once."""
    with tempfile.TemporaryDirectory() as folder:
        correction.save(folder)
        return contents(Path(folder))


def test_records_stand_before_their_programs(
    tmp_path: Path, corrections: tuple[ProgramCorrection, ProgramCorrection], monkeypatch: pytest.MonkeyPatch
) -> None:
    placed: list[str] = []
    replaced = os.replace

    def noted(source: str, target: str) -> None:
        placed.append(Path(target).name)
        replaced(source, target)

    monkeypatch.setattr(os, "replace", noted)
    corrections[0].save(tmp_path)
    assert placed == [
        "truearm.unfinished.json",
        "plate.mod.truearm.json",
        "plate.mod",
        "compensation.html",
        "truearm.manifest.json",
    ]


# -- two runs at a time


def test_two_runs_into_one_folder_leave_one_of_them_whole(tmp_path: Path) -> None:
    other = {name: f"other {name}" for name in ("folder/c", "a", "d")}
    whole = [NEW, {**NEW, **other}, {**other, **NEW}, other]
    folder = tmp_path / "out"
    for number in range(operations(partial(write_files, folder, NEW), folder)):
        fresh(folder, {})
        folder.mkdir()
        between(partial(write_files, folder, NEW), partial(write_files, folder, other), folder, number)
        assert contents(folder) in [in_bytes(one) for one in whole]
        assert leftovers(folder) == []
        for one in sets_in(folder):
            assert all(hash_of((folder / name).read_bytes()) == known for name, known in one.files.items())


def test_a_file_that_was_changed_later_is_not_what_the_others_describe(folder: Path, tmp_path: Path) -> None:
    data, out = EXAMPLES["validate"](folder)["data"], tmp_path / "out"
    truearm.calibrate("irb120", EXAMPLES["calibrate"](folder)["data"], out=out)
    programs = EXAMPLES["compensate"](folder)["programs"]

    def told(robot: Path) -> list[list[str]]:
        made = truearm.validate(robot, data), compensate(robot, programs)
        return [[one.message for one in each.warnings if one.code == "changed-since-written"] for each in made]

    robot = out / "calibrated.yaml"
    assert told(robot) == [[], []]
    robot.write_text(robot.read_text() + "# looked at\n")
    ((validated,), (_,)) = told(robot)
    assert "written together with result.json, report.html, calibrated.urdf" in validated
    assert told(robot.rename(tmp_path / "calibrated.yaml")) == [[], []]


# -- what a reader says, and what stays readable


def test_what_is_moved_changed_or_stands_beside_can_be_read(tmp_path: Path, unfinished: Path) -> None:
    write_files(tmp_path / "whole", NEW)
    (tmp_path / "whole" / "a").rename(tmp_path / "a")
    assert read_bytes(tmp_path / "a") == b"new a"
    (tmp_path / "whole" / "b").write_text("by hand")
    assert read_bytes(tmp_path / "whole" / "b") == b"by hand"
    out = shutil.copytree(unfinished, tmp_path / "out")
    (out / "mine").write_text("mine")
    assert read_bytes(out / "mine") == b"mine"
    (out / "link").symlink_to(out / "folder" / "c")
    for name in ("a", "folder/c", "folder/../a", "link"):
        words = "a command that writes this file together with others has not finished"
        refused(None, words, read_bytes, out / name)
    other = shutil.copytree(unfinished, tmp_path / "other")
    (other / "a").write_text("by hand")
    write_files(other, {"z": "z"})  # what was changed by hand meanwhile is not put back
    assert contents(other) == {"a": b"by hand", "folder/c": b"old c", "z": b"z"}


@pytest.mark.parametrize("name", [MANIFEST, UNFINISHED])
def test_what_has_the_name_of_a_manifest_and_is_none_is_not_overwritten(tmp_path: Path, name: str) -> None:
    told = f"{name}: truearm writes a file of this name itself, and this is not"
    for text in ("", "[1]", "{}", "x", '{"truearm": "truearm-manifest/1", "sets": [1]}', "[" * 99999):
        (tmp_path / name).write_text(text)
        refused(None, told, output_folder, tmp_path)
        refused(None, told, write_files, tmp_path, NEW)
        assert (tmp_path / name).read_text() == text
        assert len([*tmp_path.iterdir()]) == 1
    (tmp_path / name).unlink()
    refused(None, "truearm writes a file of this name itself", output_file, tmp_path / name)
    os.mkfifo(tmp_path / name)
    refused(None, told, output_folder, tmp_path)


def test_a_mark_removes_no_file_that_its_run_did_not_make(tmp_path: Path) -> None:
    write_text(tmp_path / "doc" / "thesis", "thesis")
    known = hash_of(b"thesis")
    mark = {"truearm": "truearm-unfinished/1", "version": "0.1.0", "command": None, "files": {"doc/thesis": known}}
    for made in (None, {}, {"doc/thesis": ".truearm.0123456789abcdef"}, {"doc/thesis": "thesis"}):
        (tmp_path / UNFINISHED).write_text(json.dumps({**mark, "kept": {}} | ({} if made is None else {"made": made})))
        told = rf"{UNFINISHED}: truearm writes .* this is not one.*Remove or rename"
        refused(None, told, output_folder, tmp_path / "out")
        refused(None, told, write_files, tmp_path, NEW)
        assert contents(tmp_path)["doc/thesis"] == b"thesis"


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root may give files away")
def test_somebody_else_s_mark_in_a_folder_for_everybody_is_not_believed(tmp_path: Path, unfinished: Path) -> None:
    out = shutil.copytree(unfinished, tmp_path / "out")
    os.chown(out / UNFINISHED, 12345, 12345)
    refused(None, "has not finished", read_bytes, out / "a")
    out.chmod(0o1777)
    assert read_bytes(out / "a") == b"new a"


def test_a_manifest_knows_every_set_of_its_folder(tmp_path: Path) -> None:
    write_files(tmp_path, {"plan.csv": "1", "plan.html": "1"}, "plan")
    write_files(tmp_path, {"b.csv": "1", "b.html": "1"})
    write_text(tmp_path / "alone", "1")
    assert [([*one.files], one.command) for one in sets_in(tmp_path)] == [
        (["plan.csv", "plan.html"], "plan"),
        (["b.csv", "b.html"], None),
    ]
    write_text(tmp_path / "b.csv", "2")
    (tmp_path / "plan.csv").unlink()
    write_files(tmp_path, {"plan.html": "2", "more": "2"})
    assert [[*one.files] for one in sets_in(tmp_path)] == [["b.html"], ["plan.html", "more"]]


def test_new_files_are_on_disk_before_an_old_one_is_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    done: list[str] = []
    replaced, removed = os.replace, os.unlink

    def noted(source: str, target: str) -> None:
        done.append(Path(target).name)
        replaced(source, target)

    def unlinked(path: str) -> None:
        if Path(path).name == UNFINISHED:
            done.append("finished")
        removed(path)

    def synchronised(handle: int) -> None:
        done.append("folder" if stat.S_ISDIR(os.fstat(handle).st_mode) else "file")

    monkeypatch.setattr(os, "replace", noted)
    monkeypatch.setattr(os, "unlink", unlinked)
    monkeypatch.setattr(os, "fsync", synchronised)
    write_files(tmp_path, {"a": "a", "b": "b"})
    assert done == ["file"] * 4 + ["folder", UNFINISHED, "folder", "a", "b", MANIFEST, "folder", "finished"]
