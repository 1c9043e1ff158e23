from __future__ import annotations

import pytest

import truearm
from truearm.errors import InputError
from truearm.library import close_names, library, load_robot


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
