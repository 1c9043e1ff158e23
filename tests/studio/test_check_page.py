"""The page Check: findings in the scene, and readings that are excluded and restored."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.simulated import campaign
from tests.studio.conftest import Serving
from tests.studio.pressing import act, at_once, notices

from truearm.calibration import calibrating as following
from truearm.calibration.calibrate import calibrate
from truearm.engine.base.errors import InputError, Notice
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.studio.checked import Checked
from truearm.studio.pages.calibrate import CalibratePage
from truearm.studio.pages.check import CheckPage
from truearm.studio.pages.jog import JogPage
from truearm.studio.pages.proof import ProofPage
from truearm.studio.tasks import Outcome
from truearm.studio.window import Window

TWIN, DATA = campaign("irb120", 24, 0.05e-3, 4)


@pytest.fixture
def window(serving: Serving, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Window:
    """A project in which one reading of configuration 3 is 5 mm off."""
    folder = tmp_path / "project"
    folder.mkdir()
    position = DATA.position.copy()
    position[7] += [0.005, 0.0, 0.0]
    (folder / "data.csv").write_text(csv_text(replace(DATA, position=position)))
    (folder / "truearm-studio.yaml").write_text(
        "truearm: truearm-studio/1\nrobot: irb120\ndata: data.csv\nmodel: offsets\n"
    )
    window = serving(folder).window
    at_once(window, monkeypatch)
    return window


def page_of(window: Window) -> tuple[CheckPage, JogPage]:
    (page,) = (page for page in window.pages if isinstance(page, CheckPage))
    (jog,) = (page for page in window.pages if isinstance(page, JogPage))
    return page, jog


def test_a_finding_shows_its_readings_where_they_were_read(window: Window) -> None:
    page, jog = page_of(window)
    act(page._run)
    assert page._finding.value == "1. warning outliers"
    assert page._reading.options == ("(all of them)", "3/2")
    (drawn,) = jog.scene._parts["finding"]
    # In the base frame of the drawn arm, though the instrument stands elsewhere.
    base = TWIN.robot.base
    expected = (DATA.position[7] + [0.005, 0.0, 0.0] - np.array(base.translation)) @ base.rotation
    assert drawn.points[0] == pytest.approx(expected, abs=3e-3)
    assert len(jog.scene._parts["readings"][0].points) == len(DATA.position) - 1
    act(page._arm)
    assert jog.jogging is not None
    assert jog.jogging.joints == pytest.approx(DATA.joints[2])
    act(page._finding, "(any reading)")
    act(page._reading, "24/3")
    assert "1 reading chosen" in page._drawn.content
    assert len(jog.scene._parts["finding"][0].points) == 1
    act(page._draws, False)
    assert jog.scene._parts["finding"] == jog.scene._parts["readings"] == []


def test_readings_are_excluded_with_a_reason_undone_and_restored(window: Window) -> None:
    page, jog = page_of(window)
    file = window.project.folder / "excluded.csv"
    act(page._run)
    act(page._exclude)
    assert "a reading is excluded for a reason" in notices(window)
    assert not file.exists()
    page._reason._impl.value = " beam\n broken "
    act(page._exclude)
    x, y, z = DATA.position[7] * 1e3 + [5.0, 0.0, 0.0]
    head, row = file.read_text().splitlines()
    assert head == "configuration,target,reason,read [mm]"
    assert row.startswith("3,2,beam broken,")
    assert [float(word) for word in row.rpartition(",")[2].split()] == pytest.approx([x, y, z], abs=1e-6)
    assert window.project.settings.exclude == "excluded.csv"
    assert "Exclusions have changed: check again." in page._found.content
    assert "beam broken" in page._table.content
    assert len(jog.scene._parts["excluded"][0].points) == 1
    assert jog.scene._parts["finding"] == []
    window._undo_edit()
    assert not file.exists()
    assert window.project.settings.exclude is None
    assert jog.scene._parts["excluded"] == []
    window._redo_edit()
    assert "3,2,beam broken" in file.read_text()
    act(page._run)
    assert "(outliers)" not in page._found.content
    assert "1 reading is excluded: beam broken (1)." in page._found.content
    act(page._restore)
    assert file.read_text() == "configuration,target,reason\n"
    assert page._excluded == ()
    assert window.project.changes() == ()
    file.write_text("configuration,target,reason\n1,1,by another program\n")
    with pytest.raises(InputError, match="another program has changed this file, and it is not overwritten"):
        window.project.undo()
    window.refresh()
    assert "by another program" in page._table.content


def test_a_calibration_is_without_what_is_excluded_and_says_so(
    window: Window, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(following, "_TIME", 1e9)  # however slow this computer is, every step is told
    page, _ = page_of(window)
    (calibrating,) = (page for page in window.pages if isinstance(page, CalibratePage))
    (proof,) = (page for page in window.pages if isinstance(page, ProofPage))
    act(page._run)
    page._reason._impl.value = "beam broken"
    act(page._exclude)
    act(calibrating._run)
    folder = window.project.folder
    command = "truearm calibrate irb120 data.csv --model offsets --exclude excluded.csv --out DIR"
    calibrate(
        "irb120",
        folder / "data.csv",
        model="offsets",
        exclude=folder / "excluded.csv",
        out=tmp_path / "r",
        command=command,
    )
    assert (folder / "result/calibrated.yaml").read_bytes() == (tmp_path / "r/calibrated.yaml").read_bytes()
    assert "Excluded: 1 reading (1 of the " in calibrating._said.content
    assert [step.number for step in calibrating._steps][:2] == [1, 2]
    assert calibrating._steps[-1].error < calibrating._steps[0].error
    assert calibrating._course.place.visible
    assert "other readings than those that are excluded now" not in proof._now.content
    assert calibrating._now.content == ""
    act(page._restore)
    assert "other readings than those that are excluded now" in proof._now.content
    assert "(other-settings)" in calibrating._now.content


def test_other_measurements_are_calibrated_without_what_was_excluded_from_the_first(window: Window) -> None:
    page, _ = page_of(window)
    (calibrating,) = (page for page in window.pages if isinstance(page, CalibratePage))
    folder, project = window.project.folder, window.project
    (folder / "other.csv").write_text(csv_text(DATA))
    act(page._run)
    page._reason._impl.value = "reflector bumped"
    act(page._exclude)
    window.refresh()
    act(calibrating._data, "other.csv")
    assert (project.settings.data, project.settings.exclude) == ("other.csv", None)
    assert "excluded.csv excludes readings of data.csv" in notices(window)
    assert "None." in page._table.content
    act(page._run)
    act(page._finding, "(any reading)")
    act(page._reading, "5/1")
    page._reason._impl.value = "beam broken"
    act(page._exclude)
    assert project.settings.exclude == "excluded-2.csv"
    assert "reflector bumped" in (folder / "excluded.csv").read_text()
    act(page._file, "excluded.csv")  # on purpose, and refused: in these measurements the reading is a good one
    act(calibrating._run)
    assert "another reading stands here in the measurements than the one that was excluded" in notices(window)
    assert not (folder / "result").exists()
    for _ in range(3):
        window._undo_edit()
    assert (project.settings.data, project.settings.exclude) == ("data.csv", "excluded.csv")
    told = len(notices(window))
    act(page._data, "data.csv")
    act(page._file, "(none)")
    act(page._data, "other.csv")
    assert "nothing-excluded" not in notices(window)[told:]


def test_a_reason_is_that_of_the_readings_for_which_it_was_given(window: Window) -> None:
    page, _ = page_of(window)
    (window.project.folder / "other.csv").write_text(csv_text(DATA))
    act(page._run)

    def given(do: Callable[[], None]) -> str:
        """Return what is left of a reason after something is done."""
        page._reason._impl.value = "beam broken"
        do()
        return str(page._reason.value)

    assert given(window.refresh) == "beam broken"
    assert given(lambda: act(page._reading, "3/2")) == ""
    assert given(lambda: act(page._finding, "(any reading)")) == ""
    assert given(lambda: act(page._exclude)) == "beam broken"  # refused: no reading is chosen
    act(page._reading, "3/2")
    assert given(lambda: act(page._exclude)) == ""
    assert [one.reason for one in page._excluded] == ["beam broken"]
    assert given(lambda: act(page._file, "(none)")) == ""
    assert given(lambda: act(page._data, "other.csv")) == ""


def test_where_a_file_excludes_nothing_nothing_is_said_of_it_when_other_measurements_are_chosen(window: Window) -> None:
    page, _ = page_of(window)
    (window.project.folder / "other.csv").write_text(csv_text(DATA))
    act(page._run)
    page._reason._impl.value = "beam broken"
    act(page._exclude)
    act(page._restore)
    assert page._file.value == "excluded.csv"
    act(page._data, "other.csv")
    assert (window.project.settings.data, window.project.settings.exclude) == ("other.csv", None)
    assert "nothing-excluded" not in notices(window)


def test_the_worst_finding_is_chosen_also_where_it_names_no_readings(window: Window) -> None:
    page, jog = page_of(window)
    scaled = replace(DATA, position=DATA.position * 1e-3)
    (window.project.folder / "data.csv").write_text(csv_text(scaled))
    act(page._run)
    assert page._finding.value == "1. error unit-length"
    assert (page._reading.value, page._reading.options) == ("(none)", ("(none)",))
    assert "This finding names no readings." in page._drawn.content
    act(page._draws, True)
    assert "This finding names no readings. 0 readings chosen" in page._drawn.content
    assert jog.scene._parts["finding"] == []
    page._reason._impl.value = "beam broken"
    act(page._exclude)
    assert "no reading is chosen" in notices(window)


def test_where_nothing_is_wrong_nothing_is_drawn_before_it_is_asked_for(window: Window) -> None:
    page, jog = page_of(window)
    (window.project.folder / "data.csv").write_text(csv_text(DATA))
    act(page._run)
    assert (page._finding.value, page._draws.value) == ("(any reading)", False)
    assert jog.scene._parts.get("readings", []) == []
    act(page._draws, True)
    assert len(jog.scene._parts["readings"][0].points) == len(DATA.position)
    page._reason._impl.value = "beam broken"
    act(page._exclude)  # nobody has chosen a reading
    assert "no reading is chosen" in notices(window)
    assert page._excluded == ()
    act(page._reading, "1/1")
    page._reason._impl.value = "beam broken"
    act(page._exclude)
    window.edit(robot="irb1600")
    assert not page._readings.visible
    assert jog.scene._parts["excluded"] == []


def test_readings_without_a_place_are_chosen_and_not_drawn() -> None:
    readings = (("1", "a"), ("1", "b"), ("2", "a"))
    found = Checked(Outcome(()), (), readings, np.full((3, 3), np.nan), ((1.0,), (), (3.0,)), np.zeros((3, 6)))
    assert found.rows_of((("1", ""),)).tolist() == [0, 1]
    assert found.rows_of((("2", "a"), ("9", "z"))).tolist() == [2]
    assert found.named([1, 2]) == {("1", "b"): (), ("2", "a"): ((3.0,),)}
    assert Notice("x", "y") == Notice("x", "y", at=(("1", "a"),))


def test_files_that_were_edited_under_their_names_make_what_stands_there_old(window: Window) -> None:
    page, _ = page_of(window)
    (calibrating,) = (page for page in window.pages if isinstance(page, CalibratePage))
    folder = window.project.folder
    (folder / "arm.yaml").write_text(robot_text(load_robot("irb120")))
    window.edit(robot="arm.yaml")
    act(page._run)
    act(calibrating._run)
    assert calibrating._now.content == ""
    for name in ("arm.yaml", "data.csv"):
        act(page._run)
        (folder / name).write_text((folder / name).read_text() + "\n")
        window._reload()
        assert "Robot or measurements have changed: check again." in page._found.content
        assert "(other-settings)" in calibrating._now.content
