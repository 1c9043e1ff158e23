"""The page Performance: the command's values as a table and in space, whoever wrote them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from tests.commanding import Truearm
from tests.commanding import truearm as truearm
from tests.performance_plan import small_plan
from tests.studio.conftest import Serving
from tests.studio.pressing import act, at_once, notices

from truearm.engine.robot.robot_file.writing import robot_text
from truearm.iso9283.evaluating.comparison import read_result
from truearm.iso9283.evaluating.table import conditions_summary, values_of, worst_places
from truearm.iso9283.jobs import iso9283_evaluate, iso9283_simulate
from truearm.iso9283.planning.plan_file import PLAN, ROBOT, plan_text, read_plan
from truearm.studio.cube_in_space import cube_in_space
from truearm.studio.pages.fields import NONE
from truearm.studio.pages.jog import JogPage
from truearm.studio.pages.performance import PerformancePage
from truearm.studio.window import Window


@pytest.fixture(scope="module")
def tested(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project with a plan, what was measured for it, and a result that the command wrote."""
    folder = tmp_path_factory.mktemp("tests") / "project"
    (folder / "iso9283").mkdir(parents=True)
    (folder / "truearm-studio.yaml").write_text("truearm: truearm-studio/1\nrobot: irb120\n")
    plan = small_plan(["AP", "AT", "CR"], cycles={"AP": 5, "AT": 5, "CR": 3})
    (folder / "iso9283" / PLAN).write_text(plan_text(plan))
    (folder / "iso9283" / ROBOT).write_text(robot_text(plan.robot))
    iso9283_simulate("irb120", plan, truth="random", rate=250.0, seed=1, out=folder / "measured")
    return folder


def page_of(window: Window) -> tuple[PerformancePage, JogPage]:
    (page,) = (page for page in window.pages if isinstance(page, PerformancePage))
    (jog,) = (page for page in window.pages if isinstance(page, JogPage))
    return page, jog


def test_the_values_of_the_command_stand_in_the_table_and_in_space(
    tested: Path, serving: Serving, monkeypatch: pytest.MonkeyPatch, truearm: Truearm, tmp_path: Path
) -> None:
    window = serving(tested).window
    page, jog = page_of(window)
    at_once(window, monkeypatch)
    assert "There is no result yet" in page._table.content
    act(page._run)
    assert "no plan is chosen" in notices(window)
    act(page._choices["plan"], "iso9283/plan.yaml")
    act(page._choices["poses"], "measured/poses.csv")
    act(page._choices["paths"], "measured/paths.csv")
    act(page._choices["alignment"], "measured/alignment.yaml")
    act(page._run)
    monkeypatch.chdir(tested)
    words = ["--poses", "measured/poses.csv", "--paths", "measured/paths.csv"]
    words += ["--alignment", "measured/alignment.yaml", "--noise", "0.01", "--noise-rot", "0.005"]
    out = tmp_path / "by-command"
    truearm("iso9283", "evaluate", "iso9283/plan.yaml", *words, "--out", out)
    assert (tested / "iso9283/result/iso9283.json").read_bytes() == (out / "iso9283.json").read_bytes()
    assert window.project.changes() == ()

    result = read_result(out / "iso9283.json")
    shown = page._table.content.replace("\u00a0", " ")
    for worst in worst_places(values_of(result)):
        assert all(cell in shown for k, cell in enumerate(worst.cells) if k != 4)
    act(page._criterion, "AP")
    assert page._table.content.count("<tr>") == 1 + sum(value.id == "AP" for value in values_of(result))
    assert result.warnings
    assert all(f"({one.code})" in page._of.content for one in result.warnings)
    assert page._of.order < page._table.order
    assert "(other-" not in page._of.content
    assert page._picture.visible
    assert "accuracy" in page._picture.options

    act(page._drawn._draw, True)
    space = cube_in_space(read_plan(tested / "iso9283" / PLAN), result)
    ap = {value.where: value.value for value in values_of(result) if (value.id, value.component) == ("AP", "position")}
    rp = {value.where: value.value for value in values_of(result) if (value.id, value.component) == ("RP", "position")}
    assert dict(zip(space.names, space.accuracy, strict=True)) == pytest.approx(ap, abs=1e-9)
    assert dict(zip(space.names, space.repeatability, strict=True)) == pytest.approx(rp)
    at = max(value.value for value in values_of(result) if (value.id, value.component) == ("AT", "position"))
    assert np.nanmax(space.path_errors) == pytest.approx(at, abs=1e-8)
    label = jog.scene._parts["tests-errors"][1].text
    assert label == f"AP x 50, largest {max(ap.values()) * 1e3:.3g} mm; RP x 1000"
    act(page._drawn._factor, 200.0)
    assert jog.scene._parts["tests-errors"][1].text.startswith("AP x 200, ")
    assert len(jog.scene._parts["tests-rp"]) == 5
    radius = jog.scene._parts["tests-rp"][0].radius
    assert radius == pytest.approx(1000.0 * rp[space.names[0]])
    act(page._drawn._draw, False)
    assert not any(jog.scene._parts[name] for name in ("tests-errors", "tests-rp", "tests-frame", "tests-paths"))


def test_a_result_of_another_plan_is_not_drawn_and_one_that_is_none_is_refused(tested: Path, serving: Serving) -> None:
    other = small_plan(["AP"], rated_velocity=0.7)
    (tested / "other").mkdir()
    (tested / "other" / ROBOT).write_text(robot_text(other.robot))
    (tested / "other" / PLAN).write_text(plan_text(other).replace("limit_band: 0.1", "limit_band: 0.2"))
    made = iso9283_evaluate(
        tested / "iso9283" / PLAN,
        poses=tested / "measured/poses.csv",
        paths=tested / "measured/paths.csv",
        alignment=tested / "measured/alignment.yaml",
    )
    (tested / "kept").mkdir()
    (tested / "kept" / "iso9283.json").write_text(json.dumps(made.summary()))
    window = serving(tested).window
    page, jog = page_of(window)
    window.edit(performance={"plan": f"other/{PLAN}", "result": "kept"})
    act(page._drawn._draw, True)
    assert "its errors are not drawn" in page._drawn._said.content
    assert "(other-settings)" in page._of.content
    assert jog.scene._parts["tests-errors"] == []
    assert len(jog.scene._parts["tests-frame"]) == 1
    window.edit(robot="kr5")
    assert "The plan is of irb120, and kr5 is drawn." in page._drawn._said.content
    (tested / "kept" / "iso9283.json").write_text('{"truearm": "truearm-result/1"}')
    window.refresh()
    assert "this is no result of tests by ISO 9283" in notices(window)
    with pytest.raises(Exception, match="no place in the project"):
        window.edit(performance={"plan": "../plan.yaml"})


def test_the_page_says_what_its_result_is_of_and_what_of_that_is_not_chosen_now(
    tested: Path, serving: Serving, monkeypatch: pytest.MonkeyPatch
) -> None:
    window = serving(tested).window
    page, _ = page_of(window)
    at_once(window, monkeypatch)
    poses = (tested / "measured/poses.csv").read_text()
    (tested / "mine.csv").write_text(poses)
    (tested / "other.csv").write_text(poses + "\n")
    (tested / "none.csv").write_text("criterion,pose\n")
    files = {"plan": f"iso9283/{PLAN}", "alignment": "measured/alignment.yaml"}
    window.edit(robot="irb120", performance={**files, "poses": "mine.csv", "result": "of"})
    act(page._run)
    first = (
        "Of irb120, plan iso9283/plan.yaml, poses mine.csv, alignment measured/alignment.yaml, "
        "noise 0.01 mm and 0.005 deg."
    )
    assert first in page._of.content
    assert "(other-" not in page._of.content
    assert page._said.content.count("Written to of") == 1
    table = page._table.content

    act(page._choices["poses"], "other.csv")
    said = "(other-settings)</b>: This result is of poses mine.csv. Chosen now: poses other.csv. Evaluate again."
    assert said in page._of.content
    act(page._choices["poses"], "none.csv")
    act(page._run)
    assert "(refused)" in notices(window)
    assert page._table.content == table
    assert first in page._of.content
    assert "Chosen now: poses none.csv." in page._of.content
    act(page._choices["poses"], "measured/poses.csv")  # the same readings under another name
    assert "(other-" not in page._of.content
    act(page._choices["forces"], "other.csv")
    assert "is of no forces. Chosen now: forces other.csv." in page._of.content
    act(page._choices["forces"], NONE)
    act(page._choices["poses"], "mine.csv")
    (tested / "mine.csv").write_text(poses + "\n\n")
    window.refresh()
    assert "is of poses mine.csv as it was then. Chosen now: poses mine.csv as it is now." in page._of.content
    (tested / "mine.csv").unlink()
    window.refresh()
    assert "Chosen now: poses mine.csv, which cannot be read." in page._of.content
    (tested / "mine.csv").write_text(poses)
    window.edit(performance={**files, "poses": "mine.csv", "result": "of", "noise_mm": 0.05, "alignment": None})
    said = (
        "(other-settings)</b>: This result was made with alignment measured/alignment.yaml; noise 0.01 mm and 0.005 "
        "deg. Chosen now: no alignment; noise 0.05 mm and 0.005 deg. Evaluate again."
    )
    assert said in page._of.content
    window.edit(performance={**files, "poses": "mine.csv", "result": "of"})
    assert "(other-" not in page._of.content

    assert not page._drawn._draw.value
    window.edit(robot="ur5e")
    said = "The plan that is chosen and this result are of the robot irb120, and ur5e is chosen."
    assert f"(other-settings)</b>: {said}" in page._of.content
    window.edit(robot="irb120")
    robot = (tested / "iso9283" / ROBOT).read_text()
    (tested / "iso9283" / ROBOT).write_text(f"{robot}\n")
    window.refresh()
    assert "robot iso9283/robot.yaml as it was then. Chosen now: robot iso9283/robot.yaml as it is" in page._of.content
    (tested.parent / "outside.yaml").write_text(robot)
    (tested / "iso9283" / ROBOT).unlink()
    (tested / "iso9283" / ROBOT).symlink_to(tested.parent / "outside.yaml")
    window.refresh()
    assert "Chosen now: robot iso9283/robot.yaml, which cannot be read." in page._of.content
    (tested / "iso9283" / ROBOT).unlink()
    (tested / "iso9283" / ROBOT).write_text(robot)

    held = json.loads((tested / "of/iso9283.json").read_text())
    held["inputs"]["robot"]["file"] = ""  # of another program
    (tested / "of/iso9283.json").write_text(json.dumps(held))
    window.refresh()
    assert first in page._of.content
    del held["inputs"]
    (tested / "of/iso9283.json").write_text(json.dumps(held))
    window.refresh()
    assert "does not say which files it is of" in page._of.content
    assert page._said.content == ""  # what the evaluation printed is no longer of the file that stands there


def test_a_plan_of_an_arm_of_the_same_name_with_other_kinematics_is_told(tested: Path, serving: Serving) -> None:
    text = (tested / "iso9283" / ROBOT).read_text()
    (tested / "longer.yaml").write_text(text.replace("270", "275"))
    assert (tested / "longer.yaml").read_text() != text
    window = serving(tested).window
    page, _ = page_of(window)
    window.edit(robot="longer.yaml", performance={"plan": f"iso9283/{PLAN}"})
    told = "The plan that is chosen is of the robot irb120 with other kinematics, and irb120 (longer.yaml) is chosen."
    assert told in page._of.content


def test_a_plan_is_simulated_and_what_was_read_is_chosen(
    tested: Path, serving: Serving, monkeypatch: pytest.MonkeyPatch
) -> None:
    window = serving(tested).window
    page, _ = page_of(window)
    at_once(window, monkeypatch)
    act(page._corrected, True)
    window.edit(performance={"plan": f"iso9283/{PLAN}"}, robot="irb120")
    page._velocities._impl.value = "100;50"
    act(page._plan_button)
    assert "numbers separated by commas belong here" in notices(window)
    act(page._simulate_button)
    assert "there is no calibrated robot yet" in notices(window)
    act(page._corrected, False)
    act(page._simulate_button)
    assert page._said.content.count("Written to iso9283/simulated") == 1
    chosen = window.project.settings.performance
    assert (chosen.poses, chosen.paths) == ("iso9283/simulated/poses.csv", "iso9283/simulated/paths.csv")
    assert (chosen.alignment, chosen.settling, chosen.forces) == ("iso9283/simulated/alignment.yaml", None, None)
    page._velocities._impl.value, page._criteria._impl.value = "100", "nothing"
    act(page._plan_button)
    assert "nothing" in notices(window)


def test_conditions_of_a_file_are_those_that_it_was_written_from(tested: Path) -> None:
    made = iso9283_evaluate(
        tested / "iso9283" / PLAN, poses=tested / "measured/poses.csv", alignment=tested / "measured/alignment.yaml"
    )
    path = tested.parent / "iso9283.json"
    path.write_text(json.dumps(made.summary()))
    for read, value in zip(values_of(read_result(path)), made.values, strict=True):
        assert (read.id, read.where, read.component, read.status) == (
            value.id,
            value.where,
            value.component,
            value.status,
        )
        assert conditions_summary(read.conditions) == conditions_summary(value.conditions)
        assert read.value == pytest.approx(value.value, nan_ok=True)
