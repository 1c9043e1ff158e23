from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.robot.library import close_names, library, load_robot
from truearm.engine.robot.library.wider_limits import wider_limits_notices


def test_the_library_has_arms_of_many_makers() -> None:
    assert len(library()) >= 45
    assert len({load_robot(name).maker for name in library()}) >= 12


def test_the_list_tells_maker_reach_joints_and_whether_the_controller_is_known() -> None:
    found = truearm.robots()
    head, *rows = found.lines()
    assert head.split() == ["id", "maker", "joints", "reach", "controller", "robot"]
    assert len(rows) == len(library())
    told = {row.split()[0]: row for row in rows}
    assert told["irb1600"].split(maxsplit=6) == ["irb1600", "ABB", "6", "1450", "mm", "known", "IRB 1600-6/1.45"]
    assert told["li3"].split(maxsplit=5)[:5] == ["li3", "-", "3", "-", "-"]
    (one,) = (row for row in found.summary()["robots"] if row["id"] == "ur10e")
    assert one.pop("source").startswith("Universal Robots")
    assert one == {
        "id": "ur10e",
        "maker": "Universal Robots",
        "title": "Universal Robots UR10e",
        "joints": 6,
        "reach_mm": 1300.0,
        "reach_from": "axis-2",
        "reach_to": "wrist-centre",
        "controller_known": True,
    }
    (one,) = (row for row in found.summary()["robots"] if row["id"] == "li3")
    assert (one["maker"], one["reach_mm"], one["reach_from"], one["controller_known"]) == (None, None, None, False)


@pytest.mark.parametrize(
    ("text", "offered"),
    [
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
    ],
)
def test_a_close_name_is_refused_and_all_it_may_be_are_offered(text: str, offered: list[str]) -> None:
    assert close_names(text)[: len(offered)] == offered
    with pytest.raises(InputError) as refusal:
        load_robot(text)
    told = str(refusal.value)
    for name in offered:
        assert f"{name} ({load_robot(name).title})" in told
    if not offered:
        assert "Run 'truearm robots'" in told


def test_many_close_names_are_not_all_offered() -> None:
    assert len(close_names("ur")) == 8


@pytest.mark.parametrize("name", ["ur5e.yaml", "LR Mate 200iD/7L.yaml"])
def test_a_file_that_is_not_there_is_a_file(name: str) -> None:
    with pytest.raises(InputError, match="no such file"):
        load_robot(name)


def test_a_name_in_a_folder_that_exists_is_a_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        load_robot(tmp_path / "ur5e")


@pytest.mark.parametrize(
    ("given", "found"),
    [
        ({"text": "irb 1200"}, ["irb1200_5_0.9", "irb1200_7_0.7"]),
        ({"text": "fanuc 200ID"}, ["lrmate200id"]),
        ({"text": "kr5"}, ["kr5"]),
        ({"maker": "stäubli", "text": "60"}, ["tx2_60", "tx2_60l"]),
        ({"maker": "Universal", "axes": 6, "text": "5"}, ["ur5", "ur5e"]),
        ({"maker": "UR", "text": "10"}, ["ur10", "ur10e"]),
        ({"axes": 3}, ["li3"]),
    ],
)
def test_the_list_is_narrowed(given: dict[str, Any], found: list[str]) -> None:
    assert [robot.name for robot in truearm.robots(**given).robots] == found


@pytest.mark.parametrize(
    ("given", "parameter", "words"),
    [
        ({"text": "irb12O"}, "text", "none of these robots is called so; got 'irb12O'. Did you mean irb120"),
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
    with pytest.raises(InputError) as refusal:
        truearm.robots(**given)
    assert refusal.value.parameter == parameter
    assert words in str(refusal.value)


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
