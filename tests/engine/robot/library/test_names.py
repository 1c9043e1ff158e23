from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from tests.expecting import refusing

import truearm
from truearm.engine.robot.library import close_names, library, load_robot, urdf_source
from truearm.engine.robot.library.wider_limits import wider_limits_notices
from truearm.engine.robot.urdf_writing import urdf_text


def test_the_list_tells_maker_reach_joints_and_whether_the_controller_is_known() -> None:
    result = truearm.robots()
    head, *rows = result.lines()
    assert head.split() == ["id", "maker", "joints", "reach", "controller", "robot"]
    assert len(rows) == len(library())
    by_name = {row.split()[0]: row for row in rows}
    assert by_name["irb1600"].split(maxsplit=6) == ["irb1600", "ABB", "6", "1450", "mm", "known", "IRB 1600-6/1.45"]
    assert by_name["li3"].split(maxsplit=5)[:5] == ["li3", "-", "3", "-", "-"]
    (entry,) = (row for row in result.summary()["robots"] if row["id"] == "ur10e")
    assert entry.pop("source").startswith("Universal Robots")
    assert entry == {
        "id": "ur10e",
        "maker": "Universal Robots",
        "title": "Universal Robots UR10e",
        "joints": 6,
        "reach_mm": 1300.0,
        "reach_from": "axis-2",
        "reach_to": "wrist-centre",
        "controller_known": True,
    }
    (entry,) = (row for row in result.summary()["robots"] if row["id"] == "li3")
    assert (entry["maker"], entry["reach_mm"], entry["reach_from"], entry["controller_known"]) == (
        None,
        None,
        None,
        False,
    )


def test_a_close_name_is_refused_and_all_it_may_be_are_offered() -> None:
    for text, offered in (
        ("irb1200", ["irb1200_5_0.9", "irb1200_7_0.7"]),
        ("IRB 1200", ["irb1200_5_0.9", "irb1200_7_0.7"]),
        ("UR-10e", ["ur10e"]),
        ("kr210", ["kr210_r2700"]),
        ("LR Mate 200", ["lrmate200ic", "lrmate200id"]),
        ("irb12O", ["irb120"]),
        ("LR Mate 200iD/7L", ["lrmate200id"]),
        ("IRB 1200-5/0.9", ["irb1200_5_0.9"]),
        ("Stäubli TX2-60L", ["tx2_60l", "tx2_60"]),
        ("cell/ur5e", ["ur5e", "ur5"]),
        ("zzz", []),
    ):
        assert close_names(text)[: len(offered)] == offered
        titles = [f"{name} ({load_robot(name).title})" for name in offered]
        with refusing(*titles or ["Run 'truearm robots'"], of=text):
            load_robot(text)
    assert len(close_names("ur")) == 8


def test_a_file_or_a_folder_that_is_not_there_is_said_to_be_so_and_no_robot_too(tmp_path: Path) -> None:
    for value, words in (
        ("ur5e.yaml", "no such file"),
        ("LR Mate 200iD/7L.yaml", "no such file"),
        (tmp_path / "ur5e", "no such file"),
        ("", "robot: no robot is given"),
        (" ", "robot: no robot is given"),
    ):
        with refusing(words, of=value):
            load_robot(value)


def test_the_list_is_narrowed() -> None:
    narrowed: list[tuple[dict[str, Any], list[str]]] = [
        ({"text": "irb 1200"}, ["irb1200_5_0.9", "irb1200_7_0.7"]),
        ({"text": "fanuc 200ID"}, ["lrmate200id"]),
        ({"text": "kr5"}, ["kr5"]),
        ({"maker": "stäubli", "text": "60"}, ["tx2_60", "tx2_60l"]),
        ({"maker": "Universal", "axes": 6, "text": "5"}, ["ur5", "ur5e"]),
        ({"maker": "UR", "text": "10"}, ["ur10", "ur10e"]),
        ({"axes": 3}, ["li3"]),
    ]
    for value, result in narrowed:
        assert [robot.name for robot in truearm.robots(**value).robots] == result, value


@pytest.mark.parametrize(
    ("given", "parameter", "words"),
    [
        ({"text": "irb12O"}, "text", "Did you mean irb120"),
        ({"text": ""}, "text", "Run 'truearm robots' for all"),
        ({"text": 5}, "text", "a name belongs here"),
        ({"maker": "Yaskava"}, "maker", "Did you mean Yaskawa"),
        ({"maker": "-"}, "maker", "allowed: ABB, "),
        ({"maker": 5}, "maker", "a name belongs here"),
        ({"axes": 0}, "axes", "1 or more"),
        ({"axes": 9}, "axes", "got 9; allowed: 3, "),
    ],
)
def test_a_list_of_none_is_refused(given: dict[str, Any], parameter: str, words: str) -> None:
    with refusing(words, parameter=parameter):
        truearm.robots(**given)


def test_limits_beyond_those_of_the_library_are_told() -> None:
    known = load_robot("irb120")
    assert not wider_limits_notices(known)
    first, second, *others = known.joints
    wider = replace(known, joints=(replace(first, limits=(-4.0, 2.0)), replace(second, limits=None), *others))
    (notice,) = wider_limits_notices(wider)
    assert (notice.code, notice.level) == ("limits-wider", "note")
    assert "joint 1 -229.18 to 114.59 deg (-165 to 165 deg in the library); joint 2 without limits" in notice.message
    assert not wider_limits_notices(replace(wider, name="mine"))
    assert not wider_limits_notices(replace(wider, joints=wider.joints[:5]))
    assert not wider_limits_notices(replace(known, joints=(replace(first, limits=(-2.0, 2.0)), second, *others)))


def test_what_is_a_urdf(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("there.urdf#old.urdf").touch()
    Path("there.urdf#note.yaml").touch()
    for text, source in (
        ("irb120", None),
        ("my.yaml", None),
        ("my#1.yaml", None),
        ("arm.urdf", ("arm.urdf", None)),
        ("arm.URDF", ("arm.URDF", None)),
        ("arm.xml", ("arm.xml", None)),
        ("arm.urdf.xacro#tip", ("arm.urdf.xacro", "tip")),
        ("arm.urdf#", ("arm.urdf", None)),
        ("cell#3/arm#2.urdf", ("cell#3/arm#2.urdf", None)),
        ("cell#3/arm#2.urdf#tip", ("cell#3/arm#2.urdf", "tip")),
        ("arm.urdf#tip#2", ("arm.urdf", "tip#2")),
        ("arm.urdf#old.urdf#tip", ("arm.urdf#old.urdf", "tip")),
        ("there.urdf#old.urdf", ("there.urdf#old.urdf", None)),
        ("there.urdf#note.yaml", None),
    ):
        expected = source and (Path(source[0]), source[1])
        assert urdf_source(text) == expected, text
        assert urdf_source(Path(text)) == expected, text


def test_a_path_with_a_hash_is_a_path(tmp_path: Path) -> None:
    folder = tmp_path / "cell #3"
    folder.mkdir()
    path = folder / "arm #2.urdf"
    path.write_text(urdf_text(load_robot("li3"))[0])
    for text in (path, f"{path}#tool0"):
        assert len(load_robot(text).joints) == 3
    with refusing("there is no link of this name; got 'tool'"):
        load_robot(f"{path}#tool")
