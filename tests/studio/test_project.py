"""A project's folder: what is one, what its file says, and that nothing of it is lost or overwritten."""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import MISSING
from pathlib import Path
from typing import Any

import pytest
from tests.killing import killed, leftovers, operations

from truearm.calibration.calibrate import Calibrate
from truearm.engine.base.errors import InputError
from truearm.engine.base.files import confined_reads, read_bytes, read_yaml
from truearm.engine.base.writing import remove_known, write_text_over
from truearm.measuring.measure import Measure
from truearm.planning.plan import PlanPoses
from truearm.studio.measure_fields import MeasureFields
from truearm.studio.plan_fields import PlanFields
from truearm.studio.project import PROJECT_FILE, Project, open_project
from truearm.studio.settings import Settings


@pytest.fixture
def project(tmp_path: Path) -> Project:
    return open_project(tmp_path / "cell")


def test_a_missing_and_an_empty_folder_become_projects(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    for folder in (tmp_path / "new" / "deep", tmp_path / "empty"):
        made = open_project(folder)
        assert [path.name for path in folder.iterdir()] == [PROJECT_FILE]
        assert made.settings == Settings()
        assert open_project(folder).settings == made.settings


def test_a_folder_with_other_things_is_refused_and_left_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "letter.txt").write_text("dear")
    with pytest.raises(InputError, match="holds other things and is no project") as refused:
        open_project(tmp_path)
    assert refused.value.came == "letter.txt"
    assert [path.name for path in tmp_path.iterdir()] == ["letter.txt"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is empty"),
        ("truearm: truearm-studio/2\n", "not known"),
        ("truearm: truearm-studio/1\ncolour: red\n", "this entry is not known here"),
        ("truearm: truearm-studio/1\ndata: ../secret.csv\n", "no place in the project's folder"),
        ("truearm: truearm-studio/1\nrobot: /etc/passwd\n", "no place in the project's folder"),
        ("truearm: truearm-studio/1\ncontroller_kinematics: ../c.conf\n", "no place in the project's folder"),
        ("truearm: truearm-studio/1\nseed: -1\n", "too small"),
        ("truearm: truearm-studio/1\nseed: true\n", "whole number"),
        ("a: [", "not valid YAML"),
        ("&a [*a]", "holds itself"),
    ],
)
def test_a_project_file_that_cannot_be_used_is_refused_and_stays(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / PROJECT_FILE).write_text(text)
    with pytest.raises(InputError, match=said):
        open_project(tmp_path)
    assert (tmp_path / PROJECT_FILE).read_text() == text


def test_edits_are_on_disk_at_once_and_undone_and_done_again(project: Project) -> None:
    def on_disk() -> Settings:
        return read_yaml(project.folder / PROJECT_FILE, Settings)

    assert project.edit(robot="kr5", payload="2kg,1mm,2mm,3mm", train=40, taught=["tools", "frames"], dark=True)
    assert not project.edit(robot="kr5")
    assert project.edit(train="all", taught=["none"])
    assert on_disk() == project.settings == open_project(project.folder).settings
    project.undo()
    assert (on_disk().train, on_disk().taught) == (40, ("tools", "frames"))
    project.undo()
    assert on_disk() == Settings()
    project.undo()
    assert on_disk() == Settings()
    project.redo()
    project.redo()
    project.redo()
    assert on_disk().train == "all"
    project.undo()
    project.edit(seed=3)
    edited = on_disk()
    project.redo()
    assert on_disk() == edited


def test_small_files_of_an_edit_are_undone_with_it(project: Project) -> None:
    file = project.folder / "excluded.csv"
    assert project.edit({"excluded.csv": "one\n"}, exclude="excluded.csv")
    assert not project.edit({"excluded.csv": "one\n"}, exclude="excluded.csv")
    assert project.edit({"excluded.csv": "two\n"})
    project.undo()
    assert (file.read_text(), project.settings.exclude) == ("one\n", "excluded.csv")
    project.undo()
    assert (file.exists(), project.settings.exclude) == (False, None)
    project.redo()
    assert (file.read_text(), project.settings.exclude) == ("one\n", "excluded.csv")
    assert project.changes() == ()
    (project.folder / PROJECT_FILE).write_text("truearm: truearm-studio/1\n")
    with pytest.raises(InputError, match="another program has changed this file"):
        project.edit({"excluded.csv": "three\n"}, exclude=None)
    assert file.read_text() == "one\n"
    with pytest.raises(InputError, match="no place in the project"):
        project.edit({"../excluded.csv": "three\n"})


@pytest.mark.parametrize(
    "changes",
    [
        {"data": "../a.csv"},
        {"program": "/etc/passwd"},
        {"result": "a/../../b"},
        {"cell": "..\\..\\b"},
        {"corrected": "C:\\x"},
        {"exclude": "../a.csv"},
        {"performance": {"plan": "/a.yaml"}},
        {"performance": {"noise_mm": 0}},
        {"robot": "a\x1bb.yaml"},
        {"train": 0},
        {"seed": "x"},
        {"nonsense": 1},
        {"model": ""},
    ],
)
def test_settings_that_cannot_be_are_refused_and_change_nothing(project: Project, changes: dict[str, Any]) -> None:
    before = (project.folder / PROJECT_FILE).read_bytes()
    with pytest.raises(InputError):
        project.edit(**changes)
    assert (project.folder / PROJECT_FILE).read_bytes() == before
    project.undo()
    assert project.settings == Settings()


def test_links_lead_nowhere_outside(project: Project, tmp_path: Path) -> None:
    (tmp_path / "secret.csv").write_text("x")
    (project.folder / "link.csv").symlink_to(tmp_path / "secret.csv")
    (project.folder / "up").symlink_to(tmp_path)
    for name in ("link.csv", "up/secret.csv", "up"):
        with pytest.raises(InputError, match="no place in the project's folder"):
            project.path(name)
    assert "up/secret.csv" not in project.names(".csv")
    with confined_reads(project.folder):
        with pytest.raises(InputError, match="not in the project's folder, and is not read"):
            read_bytes(project.folder / "link.csv")
        assert read_bytes(project.folder / PROJECT_FILE)
    assert read_bytes(project.folder / "link.csv") == b"x"


def test_another_programs_edit_is_told_never_overwritten_and_taken_by_reloading(project: Project) -> None:
    (project.folder / "a.csv").write_text("1")
    project.look()
    assert project.changes() == ()
    file = project.folder / PROJECT_FILE
    file.write_text("truearm: truearm-studio/1\nrobot: ur5\n")
    os.utime(file, ns=(1, 1))
    (project.folder / "a.csv").unlink()
    (project.folder / "b.csv").write_text("2")
    found = [(one.name, one.how) for one in project.changes()]
    assert found == [("a.csv", "gone"), ("b.csv", "new"), (PROJECT_FILE, "changed")]
    before = file.read_bytes()
    with pytest.raises(InputError, match="another program has changed this file"):
        project.edit(robot="kr5")
    assert file.read_bytes() == before
    project.reload()
    assert project.settings.robot == "ur5"
    assert project.changes() == ()
    assert project.edit(robot="kr5")
    file.unlink()
    with pytest.raises(InputError, match="another program has changed"):
        project.undo()
    assert not file.exists()


def test_the_studios_own_writing_hides_no_change_of_another_program(project: Project) -> None:
    (project.folder / "a.csv").write_text("1")
    project.edit(robot="kr5")
    project.take_in("b.csv", sent(project, b"2"))
    (project.folder / "result").mkdir()
    (project.folder / "result" / "c.yaml").write_text("3")
    project.look("result")
    assert [(one.name, one.how) for one in project.changes()] == [("a.csv", "new")]
    project.look()
    assert project.changes() == ()


def test_what_another_program_writes_between_looking_and_writing_is_not_overwritten(
    project: Project, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It writes as late as can be: once the studio has compared the file with what it knows."""
    file, theirs = project.folder / "list.csv", b"theirs\n"

    def late(do: Any) -> Any:
        def called(path: Path, *arguments: Any) -> None:
            if path == file:
                file.write_bytes(theirs)
            do(path, *arguments)

        return called

    with monkeypatch.context() as there:
        there.setattr("truearm.studio.project.write_text_over", late(write_text_over))
        with pytest.raises(InputError, match="another program has changed this file"):
            project.edit({"list.csv": "mine\n"}, exclude="list.csv")
    project.undo()
    assert (file.read_bytes(), project.settings.exclude) == (theirs, None)
    file.unlink()
    project.edit({"list.csv": "mine\n"}, exclude="list.csv")
    with monkeypatch.context() as there:
        there.setattr("truearm.studio.project.remove_known", late(remove_known))
        with pytest.raises(InputError, match="another program has changed this file"):
            project.undo()
    assert (file.read_bytes(), project.settings.exclude) == (theirs, "list.csv")
    file.write_text("mine\n")
    project.undo()  # it stands to be undone
    assert project.settings.exclude is None


def test_an_edit_that_was_made_of_a_text_is_refused_where_another_stands(project: Project) -> None:
    file = project.folder / "list.csv"
    for there, known in (("theirs\n", "one\n"), ("theirs\n", None), (None, "one\n")):
        file.unlink(missing_ok=True)
        if there is not None:
            file.write_text(there)
        with pytest.raises(InputError, match="another program has changed this file"):
            project.edit({"list.csv": "one\ntwo\n"}, known={"list.csv": known})
        assert (file.read_text() if file.exists() else None) == there


def test_of_two_files_of_an_edit_both_are_written_or_none(project: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    project.edit({"a.csv": "one\n"})

    def late(path: Path, *arguments: Any) -> None:
        if path.name == "b.csv":
            path.write_text("theirs\n")
        write_text_over(path, *arguments)

    monkeypatch.setattr("truearm.studio.project.write_text_over", late)
    with pytest.raises(InputError, match="another program has changed this file"):
        project.edit({"a.csv": "two\n", "b.csv": "two\n"})
    assert (project.folder / "a.csv").read_text() == "one\n"
    assert (project.folder / "b.csv").read_text() == "theirs\n"


def test_of_two_that_add_to_a_small_file_at_the_same_time_no_line_is_lost(project: Project) -> None:
    file = project.folder / "list.csv"

    def add(whose: str) -> None:
        mine, done = open_project(project.folder), 0
        while done < 15:
            text = file.read_text() if file.exists() else None
            try:
                done += mine.edit({"list.csv": f"{text or ''}{whose} {done}\n"}, known={"list.csv": text})
            except InputError as error:
                refused.append(str(error))

    refused: list[str] = []
    with ThreadPoolExecutor(3) as threads:
        list(threads.map(add, "abc"))
    lines = file.read_text().splitlines()
    assert all("another program has changed this file" in one for one in refused), refused
    assert sorted(lines) == sorted(f"{whose} {k}" for whose in "abc" for k in range(15))


def sent(project: Project, content: bytes) -> Path:
    """Return a file that has come into a project's folder, and has no name yet."""
    path = project.folder / ".truearm-upload.0123456789abcdef"
    path.write_bytes(content)
    return path


def test_files_taken_in_replace_nothing(project: Project) -> None:
    assert project.take_in("a b.csv", sent(project, b"1")) == "a b.csv"
    assert project.take_in("a b.csv", sent(project, b"1")) == "a b.csv"
    with pytest.raises(InputError, match="stands in the project, and is not overwritten"):
        project.take_in("a b.csv", sent(project, b"2"))
    for name in (
        "../a.csv",
        "x/a.csv",
        "/a.csv",
        "..",
        ".hidden",
        "",
        PROJECT_FILE,
        "truearm.manifest.json",
        "a\nb",
        "x\\y",
    ):
        with pytest.raises(InputError):
            project.take_in(name, sent(project, b"1"))
    assert sorted(project.names()) == ["a b.csv"]
    assert (project.folder / "a b.csv").read_bytes() == b"1"


def test_a_file_too_large_is_not_taken_in(project: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TRUEARM_LIMITS", "upload=3")
    with pytest.raises(InputError, match="the file is too large to be taken in"):
        project.take_in("a.csv", sent(project, b"1234"))


@pytest.mark.skipif(sys.platform == "win32", reason="no such locks there")
def test_of_two_that_edit_at_the_same_time_one_is_told_and_none_is_overwritten(project: Project) -> None:
    """Each edit counts on from what it has read: were one overwritten, a number would be missing in the end."""
    script = (
        "import sys\nfrom truearm.engine.base.errors import InputError\n"
        "from truearm.studio.project import open_project\n"
        "project, done = open_project(sys.argv[1]), 0\n"
        "while done < 20:\n"
        "    try:\n        done += project.edit(seed=project.settings.seed + 1)\n"
        "    except InputError as error:\n"
        "        assert 'another program has changed this file' in str(error), error\n        project.reload()\n"
    )
    others = [subprocess.Popen([sys.executable, "-c", script, str(project.folder)]) for _ in range(2)]
    assert [other.wait(60) for other in others] == [0, 0]
    project.reload()
    assert project.settings.seed == 40


@pytest.mark.skipif(not hasattr(os, "fork"), reason="a process cannot copy itself here")
def test_a_process_killed_at_any_moment_leaves_the_old_or_the_new_project(tmp_path: Path) -> None:
    folder = tmp_path / "cell"

    def work() -> None:
        open_project(folder).edit(robot="kr5", dark=True)

    seen = set()
    for number in range(operations(lambda: open_project(tmp_path / "other").edit(robot="kr5", dark=True), tmp_path)):
        folder.mkdir(exist_ok=True)
        (folder / PROJECT_FILE).unlink(missing_ok=True)
        killed(work, tmp_path, number)
        again = open_project(folder)
        seen.add(again.settings.robot)
        assert again.settings in (Settings(), Settings(robot="kr5", dark=True))
        work()
        assert open_project(folder).settings.robot == "kr5"
        assert leftovers(folder) == []
    assert seen == {"irb120", "kr5"}


def test_defaults_are_those_of_the_jobs() -> None:
    """What a page says before anybody has typed is what Python and the command take."""
    for fields, request in ((Settings, Calibrate), (PlanFields, PlanPoses), (MeasureFields, Measure)):
        for name, field in fields.model_fields.items():
            told = request.__dataclass_fields__.get(name)
            if told is not None and None not in (field.default, told.default) and told.default is not MISSING:
                shown = told.default if isinstance(told.default, str | bool) else float(request.typed_default(name))
                assert field.default == shown, f"{fields.__name__}.{name}"
