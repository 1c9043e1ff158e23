"""What happens to files that stand where a plan shall be written."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.base.manifest import sets_in
from truearm.engine.base.writing import write_files
from truearm.engine.command.driving import plan_files_for, refuse_ways_of_another, replaced_notices

QUICK: dict[str, Any] = {"poses": 10, "candidates": 60, "clearance": 0.0, "no_floor": True}
FILES = ("plan.csv", "plan.html", "plan-ways.csv")


@pytest.fixture
def written(tmp_path: Path) -> Path:
    """Return the table of a plan that truearm wrote."""
    write_files(tmp_path, dict.fromkeys(FILES, "a,b\n"), "truearm plan irb120")
    return tmp_path / "plan.csv"


def test_another_plan_is_replaced_and_that_is_told(tmp_path: Path) -> None:
    table = tmp_path / "plan.csv"
    first = truearm.plan("irb120", **QUICK, command="truearm plan first", out=table)
    again = truearm.plan("irb120", **QUICK, command="truearm plan again", out=table)
    assert not first.replaced
    assert not again.replaced
    other = truearm.plan("irb120", **QUICK, seed=1, out=table)
    (notice,) = other.replaced
    assert (notice.code, notice.level) == ("plan-replaced", "warning")
    assert f"Another plan stood in {table}, written by 'truearm plan again', and was replaced." in notice.message
    assert any("plan-replaced" in line for line in other.lines())
    assert [one["code"] for one in other.summary()["warnings"]] == ["plan-replaced", "tool-assumed"]
    table.write_text(table.read_text() + "11,0,0,0,0,0,0\n")
    before = table.read_bytes()
    with pytest.raises(InputError, match="written here by truearm and has been changed since") as refusal:
        truearm.plan("irb120", **QUICK, out=table)
    assert refusal.value.parameter == "out"
    with pytest.raises(InputError, match="changed since") as refusal:
        other.save(table)
    assert (refusal.value.parameter, table.read_bytes()) == ("file", before)


@pytest.mark.parametrize("name", FILES)
def test_a_file_that_was_changed_or_is_foreign_stays(name: str, written: Path) -> None:
    plan_files_for(FILES, written)
    written.with_name(name).write_text("mended by hand\n")
    with pytest.raises(InputError, match=r"has been changed since.*Choose another `out`") as refusal:
        plan_files_for(FILES, written)
    assert refusal.value.where == str(written.with_name(name))
    elsewhere = written.parent / "new" / "plan.csv"
    elsewhere.parent.mkdir()
    elsewhere.with_name(name).write_text("mine\n")
    with pytest.raises(InputError, match="not written here by truearm"):
        plan_files_for(FILES, elsewhere)


def test_the_files_of_another_result_stay(written: Path) -> None:
    write_files(written.parent, {"plan.csv": "1", "plan.html": "2", "plan-poses.csv": "3"}, "truearm poses irb120")
    with pytest.raises(InputError, match=r"to another result there; got .written together with plan-poses\.csv"):
        plan_files_for(FILES, written)


def test_no_ways_stay_beside_a_plan_that_has_none(written: Path) -> None:
    with pytest.raises(InputError, match="the ways of another plan are there") as refusal:
        refuse_ways_of_another(written.with_name(FILES[2]))
    assert refusal.value.parameter == "out"
    refuse_ways_of_another(written.with_name("other-ways.csv"))


def test_what_was_removed_or_is_the_same_is_not_told_of(written: Path) -> None:
    assert not replaced_notices(written.parent, "plan.csv", "a,b\n")
    assert replaced_notices(written.parent, "plan.csv", "c,d\n")
    written.unlink()
    assert not replaced_notices(written.parent, "plan.csv", "c,d\n")


def test_plans_of_tests_and_of_inclinometers_and_sets_of_poses_keep_to_the_same(tmp_path: Path) -> None:
    cube = tmp_path / "cube.yaml"
    cube.write_text("truearm: truearm-cube/1\nunits: {length: mm}\ncentre: [350, 0, 350]\nside: 200\n")
    tests: dict[str, Any] = {"cube": cube, "criteria": ["ap"], "out": tmp_path / "iso"}
    truearm.iso9283_plan("irb120", **tests)
    assert "plan-replaced" not in {one.code for one in truearm.iso9283_plan("irb120", **tests).warnings}
    other = truearm.iso9283_plan("irb120", **tests, limit_band=0.2e-3)
    assert other.warnings[-1].code == "plan-replaced"
    tilts: dict[str, Any] = {"poses": 8, "candidates": 60, "pull": 20.0}
    truearm.plan_inclinometers("katana450", **tilts, out=tmp_path / "tilts.csv")
    table = truearm.plan_inclinometers("katana450", **tilts, seed=1, out=tmp_path / "tilts.csv")
    assert [one["code"] for one in table.summary()["warnings"]] == ["plan-replaced"]
    poses: dict[str, Any] = {"set": "iso-cube", "centre": (0.35, 0, 0.35), "side": 0.2}
    truearm.poses("irb120", **poses, out=tmp_path / "set.csv")
    truearm.poses("irb120", **poses, out=tmp_path / "set.csv")
    for name, job in (
        ("iso/sheet.html", lambda: truearm.iso9283_plan("irb120", **tests)),
        ("tilts.csv", lambda: truearm.plan_inclinometers("katana450", **tilts, out=tmp_path / "tilts.csv")),
        ("set.csv", lambda: truearm.poses("irb120", **poses, out=tmp_path / "set.csv")),
    ):
        (tmp_path / name).write_text("filled in\n")
        with pytest.raises(InputError, match="has been changed since") as refusal:
            job()
        assert refusal.value.parameter == "out"
        assert (tmp_path / name).read_text() == "filled in\n"
    assert sets_in(tmp_path)
