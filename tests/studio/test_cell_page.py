"""The page Cell, without a browser: boxes, base, targets and fixtures as rows, in plain files and in the scene."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.studio.conftest import Serving
from tests.studio.pressing import below
from tests.studio.typing_in import typed

from truearm.engine.base.errors import InputError
from truearm.engine.base.files import read_yaml
from truearm.engine.motion.constraints import Constraints, keep_out
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.proof import Proof
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.transform import Transform
from truearm.studio.cell_places import Thing, file_for_places, placed_text, things_of, with_base, with_thing
from truearm.studio.cell_rules import changed_rules, read_rules, with_box, with_length, without_box
from truearm.studio.pages.cell import CellPage
from truearm.studio.pages.jog import JogPage
from truearm.studio.serving import Studio

#: A file with what the page does not show, in another unit, with comments.
_ROOM = """# measured on Monday
truearm: truearm-constraints/1
units: {length: m, angle: deg}
limits: {1: [-90, 90]}   # the cable
keep_out:
  table: {x: [0.35, 0.8], z: [-0.6, 0.1]}  # oak
"""


@pytest.fixture
def studio(serving: Serving, monkeypatch: pytest.MonkeyPatch) -> Studio:
    monkeypatch.setattr("truearm.studio.typing_at_rest._REST", 0.01)  # nobody types here
    return serving()


def page_of(studio: Studio) -> CellPage:
    return next(page for page in studio.window.pages if isinstance(page, CellPage))


def drawn(studio: Studio, name: str) -> list[Any]:
    return next(page for page in studio.window.pages if isinstance(page, JogPage)).scene._parts.get(name, [])


def said(studio: Studio) -> str:
    return "".join(studio.window._told)


def test_boxes_are_rows_a_plain_file_and_in_the_scene(studio: Studio) -> None:
    window, boxes = studio.window, page_of(studio).boxes
    typed(studio, boxes._add, True)
    typed(studio, boxes._add, True)
    file = window.project.folder / "cell-constraints.yaml"
    assert window.project.settings.constraints == "cell-constraints.yaml"
    assert window.project.changes() == ()
    assert list(keep_out(read_yaml(file, Constraints), "file")) == ["box_1", "box_2"]
    assert len(drawn(studio, "boxes")) == 4
    typed(studio, boxes._rows["box_1"].ranges[0], "350..800")
    assert "x: [350, 800]" in file.read_text()
    typed(studio, boxes._rows["box_1"].ranges[2], "")
    assert "z" not in read_yaml(file, Constraints).keep_out["box_1"].model_dump(exclude_none=True)
    typed(studio, boxes._rows["box_1"].name, "table")
    assert list(boxes._rows) == ["box_2", "table"]
    assert list(read_yaml(file, Constraints).keep_out) == ["table", "box_2"]
    typed(studio, boxes._fields.element("clearance"), "60")
    assert read_yaml(file, Constraints).clearance == 60
    typed(studio, boxes._fields.element("clearance"), "")
    assert read_yaml(file, Constraints).clearance is None
    window.edit(robot="ur5e")
    assert len(drawn(studio, "boxes")) == 4
    typed(studio, boxes._draws, False)
    assert drawn(studio, "boxes") == []
    typed(studio, boxes._draws, True)
    assert len(drawn(studio, "boxes")) == 4
    for _ in range(3):
        window._undo_edit()
    assert list(boxes._rows) == ["box_2", "table"]
    window._undo_edit()
    assert sorted(boxes._rows) == ["box_1", "box_2"]
    for _ in range(4):
        window._redo_edit()
    typed(studio, boxes._file, "(none)")
    assert drawn(studio, "boxes") == []
    assert boxes._rows == {}


@pytest.mark.parametrize(
    ("field", "text", "words"),
    [
        ("x", "350", "a range of two numbers belongs here"),
        ("x", "350..", "or an empty field where the box ends on neither side"),
        ("x", "..350", "or an empty field where the box ends on neither side"),
        ("x", "1,5..800", "both with a decimal point"),
        ("x", "800..350", "the range is empty"),
        ("x", "-500..500", "holds the base of the robot"),
        ("y", "0..1e300", "too large to be plausible"),
        ("name", "", "a box needs a name"),
        ("name", "box_2", "there is a box of this name already"),
    ],
)
def test_a_box_that_cannot_be_is_refused_beside_its_field(studio: Studio, field: str, text: str, words: str) -> None:
    boxes = page_of(studio).boxes
    typed(studio, boxes._add, True)
    typed(studio, boxes._add, True)
    file = studio.window.project.folder / "cell-constraints.yaml"
    before, row = file.read_text(), boxes._rows["box_1"]
    element = row.name if field == "name" else row.ranges["xyz".index(field)]
    typed(studio, element, text)
    assert words in below(studio.window, element)
    assert file.read_text() == before
    assert element.value == text


def test_a_decimal_comma_is_refused_and_told_of(studio: Studio) -> None:
    floor = page_of(studio).boxes._fields.element("floor")
    typed(studio, floor, "1,5")
    assert "Write a decimal point" in below(studio.window, floor)
    assert studio.window.project.settings.constraints is None


def test_the_rest_of_a_constraints_file_stays_as_it_is(tmp_path: Path) -> None:
    file, robot = tmp_path / "room.yaml", load_robot("irb120")
    file.write_text(_ROOM)
    rules = read_rules(file)
    assert rules.boxes == {"table": ("350..800", "", "-600..100")}
    made = changed_rules(file, robot, with_box("post", ("-500..-300", "-300..-200", "")))
    assert made.text == _ROOM + "  post: {x: [-0.5, -0.3], y: [-0.3, -0.2]}\n"
    assert made.corners["post"][0][:2] == pytest.approx([-0.5, -0.3])
    assert np.isinf(made.corners["post"][1][2])
    assert "floor: -0.6" in changed_rules(file, robot, with_length("floor", -600.0)).text
    gone = changed_rules(file, robot, without_box("table"))
    assert gone.boxes == {}
    assert "the cable" in gone.text
    file.write_text("truearm: truearm-constraints/1\n")
    with pytest.raises(InputError):
        changed_rules(file, robot, without_box("table"))


def test_a_file_that_another_program_has_changed_is_not_overwritten(studio: Studio) -> None:
    boxes = page_of(studio).boxes
    typed(studio, boxes._add, True)
    file = studio.window.project.folder / "cell-constraints.yaml"
    file.write_text(file.read_text() + "# mine\n")
    typed(studio, boxes._add, True)
    assert "another program has changed this file" in said(studio)
    assert file.read_text().endswith("# mine\n")
    typed(studio, boxes._add, True)  # what was refused shows the file as it is now
    assert len(boxes._rows) == 2
    file.write_text("nothing")
    studio.window.refresh()
    assert "room" not in boxes._said.content
    assert "named entries" in boxes._said.content


def test_base_targets_and_fixtures_go_into_a_robot_file_of_the_project(studio: Studio) -> None:
    window, places = studio.window, page_of(studio).places
    window.edit(payload="2.7kg,50mm,25mm,100mm")
    typed(studio, places._base, (2000.0, 0.0, 500.0))
    assert window.project.settings.robot == "irb120-cell.yaml"
    typed(studio, places._turns, (0.0, 0.0, 90.0))
    folder = window.project.folder
    assert abs(load_robot(folder / "irb120-cell.yaml").base.rotation[1, 0] - 1.0) < 1e-9
    for kind in ("target", "point", "plane"):
        typed(studio, places._add, kind)
    typed(studio, places._rows["point_1"].place, (100.0, 200.0, 300.0))
    typed(studio, places._rows["point_1"].name, "nest")
    assert "nest" in places._rows
    robot = load_robot(folder / "irb120-cell.yaml")
    assert robot.base.translation == pytest.approx((2.0, 0.0, 0.5))
    assert [target.name for target in robot.targets] == ["target_1"]
    assert [(one.name, one.kind) for one in robot.fixtures] == [("nest", "point"), ("plane_1", "plane")]
    assert robot.fixture_kinematics("nest").position[:, 0] == pytest.approx([0.1, 0.2, 0.3])
    assert robot.payload == load_robot("irb120").payload
    assert len(drawn(studio, "fixtures")) == 4
    typed(studio, places._rows["nest"].kind, "frame")
    assert load_robot(folder / "irb120-cell.yaml").fixtures[0].kind == "frame"
    typed(studio, places._rows["nest"].name, "plane_1")
    assert "of this name already" in below(window, places._rows["nest"].name)
    typed(studio, places._rows["target_1"].name, "a\tb")
    assert below(window, places._rows["target_1"].name) != ""
    while window.project.settings.robot != "irb120":
        window._undo_edit()
    assert places._rows == {}
    assert not (folder / "irb120-cell.yaml").exists()
    window._redo_edit()
    assert load_robot(folder / "irb120-cell.yaml").base.translation == pytest.approx((2.0, 0.0, 0.5))


def test_what_is_called_as_in_the_data_leaves_other_names_free(studio: Studio) -> None:
    places = page_of(studio).places
    typed(studio, places._add, "target")
    typed(studio, places._rows["target_1"].name, "1")
    typed(studio, places._add, "target")
    assert list(places._rows) == ["1", "target_2"]
    typed(studio, places._add, "point")
    typed(studio, places._rows["point_1"].name, "fixture_point_1")
    typed(studio, places._add, "point")
    assert list(places._rows) == ["1", "target_2", "fixture_point_1", "point_2"]


@pytest.mark.parametrize(
    "text", ["2.7kg", "-3kg,0mm,0mm,50mm", "2.7,50,25,100", "nan kg,0mm,0mm,0mm", "2.7kg,50mm,25mm,100"]
)
def test_a_payload_that_cannot_be_is_refused_below_its_field_and_not_kept(studio: Studio, text: str) -> None:
    field = page_of(studio)._payload
    typed(studio, field, text)
    assert "payload" in below(studio.window, field)
    assert studio.window.project.settings.payload is None
    assert field.value == text


def test_a_payload_that_the_arm_cannot_carry_is_warned_of(studio: Studio) -> None:
    field, rated = page_of(studio)._payload, load_robot("irb120").rated_load
    typed(studio, field, "2kg,0mm,0mm,50mm")
    assert "payload" not in said(studio)
    typed(studio, field, "500kg,0mm,0mm,50mm")
    assert f"The flange carries 500 kg, and irb120 is rated for {rated:g} kg." in said(studio)
    assert "payload-far" not in said(studio)
    typed(studio, field, "2kg,0mm,0mm,50m")
    assert studio.window.project.settings.payload == "2kg,0mm,0mm,50m"
    assert "is 50000 mm from the flange, and irb120 is " in said(studio)
    told = len(said(studio))
    typed(studio, field, "")
    assert studio.window.project.settings.payload is None
    assert len(said(studio)) == told


def test_things_are_put_where_they_were_and_only_what_is_meant_changes() -> None:
    turned = Transform((0.1, 0.0, 0.2), (0.7071067811865476, 0.0, 0.7071067811865476, 0.0))
    robot = load_robot("irb120").with_frames(Transform((1.0, 0.0, 0.0)), {"a": (0.0, 0.0, 0.1), "b": turned})
    robot = robot.with_fixtures({"wall": ("plane", turned), "ball": ("point", Transform((0.3, 0.1, 0.0)))})
    things = things_of(robot)
    assert [thing.kind for thing in things] == ["target", "target with axes", "plane", "point"]
    for thing in things:
        same = with_thing(robot, thing, thing.name)
        assert [one.name for one in things_of(same)] == ["a", "b", "wall", "ball"]
        assert things_of(same) == things
    moved = with_thing(robot, Thing("wall", "target", (1.0, 2.0, 3.0)), "wall")
    assert [one.name for one in things_of(moved)] == ["a", "b", "wall", "ball"]
    assert [target.name for target in moved.targets] == ["a", "b", "wall"]
    assert things_of(with_base(robot, (0.0, 0.0, 0.0), (0.0, 90.0, 0.0))) == things
    with pytest.raises(InputError):
        with_thing(robot, Thing("a", "point", (float("nan"), 0.0, 0.0)), "a")


def test_places_are_written_into_files_of_their_own() -> None:
    assert file_for_places("irb120", "irb120", []) == "irb120-cell.yaml"
    assert file_for_places("irb120", "irb120", ["irb120-cell.yaml"]) == "irb120-cell-2.yaml"
    assert file_for_places("mine.yaml", "irb120", ["mine.yaml"]) == "mine-cell.yaml"
    assert file_for_places("mine-cell.yaml", "irb120", ["mine-cell.yaml"]) == "mine-cell.yaml"
    assert file_for_places("mine-cell-2.yaml", "irb120", ["mine-cell-2.yaml"]) == "mine-cell-2.yaml"


def test_a_robot_file_of_the_user_and_a_calibrated_robot_are_not_changed(studio: Studio) -> None:
    window, places = studio.window, page_of(studio).places
    file = window.project.folder / "my-cell.yaml"
    file.write_text("# mine\n" + robot_text(load_robot("irb120")))
    window.edit(robot="my-cell.yaml")
    typed(studio, places._base, (1.0, 0.0, 0.0))
    assert "was not written here" in below(window, places._base)
    assert file.read_text().startswith("# mine\n")


def test_a_calibrated_robot_is_not_placed_by_hand() -> None:
    calibrated = replace(load_robot("irb120"), proof=Proof("converged", (), (), (), (), (), ()))
    with pytest.raises(InputError, match="stands where it was measured"):
        placed_text(calibrated, "x.yaml")
