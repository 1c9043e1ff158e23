"""Programs corrected and restored from Python: what is written where, and what is said of it."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.answered import compensate
from tests.compensation.workplace import cell, codes, plate
from tests.simulated import campaign

import truearm
from truearm import InputError, Robot, __version__
from truearm.compensation.result import SimulatedRun
from truearm.engine.base import writing
from truearm.engine.base.manifest import hash_of
from truearm.engine.programs.corrected_targets import LEDGER
from truearm.engine.programs.program import MARK
from truearm.engine.robot.robot_file.writing import robot_text

FAR = ("[[20.0,20.0,0.0]", "[[2000.0,20.0,0.0]")


def calibrated() -> Robot:
    return truearm.load_robot("irb120").with_values({"a_3": 0.2708, "alpha_4": -1.5695, "d_4": 0.3024})


@pytest.fixture
def program(tmp_path: Path) -> Path:
    return plate(tmp_path)


def saved(folder: Path, name: str = "robot") -> Path:
    """Write the robot into a folder of its own, where its ledger is kept."""
    path = folder / name / "calibrated.yaml"
    path.parent.mkdir()
    path.write_text(robot_text(calibrated()))
    return path


def test_nothing_is_written_without_a_folder(program: Path) -> None:
    before = program.read_bytes()
    correction = compensate(calibrated(), [program])
    assert [path.read_bytes() for path in program.parent.iterdir()] == [before]
    (file,) = correction.files
    assert (file.name, file.language, file.targets, file.corrected) == ("plate.mod", "RAPID", 44, 43)
    assert file.text != before
    assert 0.0 < file.mean_shift < file.largest_shift < 3e-3
    assert file.summary()["shift_mm"]["max"] == pytest.approx(1e3 * file.largest_shift)
    names = ["plate.mod", "plate.mod.truearm.json", "compensation.html"]
    assert [path.name for path in correction.save(program.parent / "out")] == names
    assert (program.parent / "out" / "plate.mod").read_bytes() == file.text


def test_the_call_that_made_it_is_in_the_report(program: Path) -> None:
    robot = saved(program.parent)
    correction = compensate(robot, [program], payload="1kg,0mm,0mm,50mm", split=1e-5, out=program.parent / "o")
    answers = "taught=['none'], payload='1kg,0mm,0mm,50mm', controller_kinematics='nominal'"
    assert correction.command == f"truearm.compensate('{robot}', ['{program}'], split=1e-05, {answers})"
    assert correction.robot.payload.mass == 1.0
    (split,) = correction.splits
    assert split.added > 0
    words = f"{split.moves} straight or circular moves were split by {split.added} more targets"
    assert words in (program.parent / "o" / "compensation.html").read_text()
    assert f"  {split.moves} moves split by {split.added} more targets" in correction.lines()
    assert compensate(calibrated(), [program]).command.startswith(f"truearm.compensate(ROBOT, ['{program}'], ")


def test_what_a_simulated_robot_does_is_said_first(program: Path) -> None:
    run = SimulatedRun(np.array([1e-3, 3e-3]), np.array([1e-4, 2e-4]), "the twin")
    correction = replace(compensate(calibrated(), [program]), simulated=run)
    assert correction.lines()[:3] == [
        "Distance of the twin from where the program meant it to be:",
        "  original program   mean 2.000  max 3.000 mm",
        "  corrected program  mean 0.150  max 0.200 mm",
    ]


def test_originals_are_restored(program: Path) -> None:
    """Of two programs of one name each from its folder."""
    other, out, back = plate(program.parent / "two"), program.parent / "out", program.parent / "back"
    result = compensate(calibrated(), [program, other], out=out)
    names = [file.name for file in result.files]
    assert names == [f"{program.parent.name}/plate.mod", "two/plate.mod"]
    corrected = [out / name for name in names]
    restored = truearm.revert(corrected[:1])
    assert restored.files[0].original == program.read_bytes()
    assert restored.folder is None
    assert repr(restored) == "plate.mod: as it was before the correction"
    restored = truearm.revert(corrected, out=back)
    assert restored.paths == tuple(back / name for name in names)
    assert [path.read_bytes() for path in restored.paths] == [program.read_bytes(), other.read_bytes()]
    with pytest.raises(InputError, match="would be overwritten") as refusal:
        truearm.revert(corrected[:1], out=corrected[0].parent)
    assert refusal.value.parameter == "out"
    with pytest.raises(InputError, match="no record beside this program") as refusal:
        truearm.revert([program], out=back)
    assert refusal.value.parameter == "programs"


def test_refusals_name_the_parameter(program: Path) -> None:
    other = cell(program.parent, "tools:\n  tElse: {of: flange}\nframes:\n  wobjElse: {of: base}\n")
    cases: tuple[tuple[dict[str, Any], str, str], ...] = (
        ({"out": program.parent}, "out", "would be overwritten"),
        ({"tools": other}, "tools", r"no tool that the programs use is in the file.*or leave out `tools`"),
        ({"frames": other}, "frames", r"no frame that the programs use is in the file.*or leave out `frames`"),
        ({"tools": program.parent / "none.yaml"}, "tools", "none.yaml"),
        ({"frames": program.parent / "none.yaml"}, "frames", "none.yaml"),
    )
    for keywords, parameter, words in cases:
        with pytest.raises(InputError, match=words) as refusal:
            compensate(calibrated(), [program], **keywords)
        assert refusal.value.parameter == parameter


def test_what_stays_on_purpose_was_not_skipped(program: Path) -> None:
    """One target is out of reach, another is given by joints."""
    text = program.read_text()
    start = next(line for line in text.splitlines() if "pStart:=" in line)
    program.write_text(text.replace(start, re.sub(r"\[\[[^,]*", "[[2000", start, count=1)))
    with pytest.raises(InputError, match="1 target cannot be corrected, and the others would move without it"):
        compensate(calibrated(), [program])
    (file,) = compensate(calibrated(), [program], keep=["pStart"]).files
    assert file.kept == {"in `keep`": 1, "given by joints": 1}
    # Offsets from a point that stays and is out of reach stay with it.
    (file,) = compensate(calibrated(), [plate(program.parent, FAR)], keep=["pHole1"]).files
    assert file.kept["in `keep`"] == 3
    assert not file.skipped


def test_of_many_skipped_targets_all_are_listed(program: Path) -> None:
    move = "    MoveL pNowhere,v100,fine,tool0;\n"
    program.write_text(program.read_text().replace("  ENDPROC", move * 12 + "  ENDPROC", 1))
    with pytest.raises(InputError, match=r"12 targets cannot be corrected, .*; and 7 more\)"):
        compensate(calibrated(), [program])
    correction = compensate(calibrated(), [program], accept=["skipped"])
    (file,) = correction.files
    assert len(file.skipped) > 10
    assert repr(file).startswith("plate.mod  RAPID: ")
    assert len(file.lines()) == 2 + len(file.skipped)
    assert file.targets == file.corrected + file.kept.total() + len(file.skipped)
    assert len(repr(file)) <= 2000
    assert {*file.left_unchanged} <= {*correction.lines()}
    assert len(correction.summary()["programs"][0]["skipped"]) == len(file.skipped)


def test_a_corrected_program_without_its_record_is_known_by_its_comment(program: Path) -> None:
    """In other letters and with other blanks too."""
    out = program.parent / "out"
    compensate(calibrated(), [program], out=out, notes={"date": "2026-02-03"})
    (out / "plate.mod.truearm.json").unlink()
    text, copy = (out / "plate.mod").read_text(), out / "copy.mod"
    with pytest.raises(InputError, match=rf"already; got \"the comment 'corrected by truearm {__version__}'\""):
        compensate(calibrated(), [out / "plate.mod"])
    for other in (text, text.upper(), text.replace("corrected by", "Corrected  by")):
        copy.write_text(other)
        with pytest.raises(InputError, match="corrected already"):
            compensate(calibrated(), [copy])
    compensate(calibrated(), [program], out=program.parent / "other")


def test_the_comment_says_by_what_and_when(program: Path) -> None:
    robot = saved(program.parent)
    for noted, day in (("2026-02-03", "2026-02-03"), ("Tuesday", str(date.today()))):
        out = program.parent / noted
        compensate(robot, [program], out=out, notes={"date": noted})
        assert (out / "plate.mod").read_text().splitlines()[:4] == [
            "MODULE Plate",
            f"  ! corrected by truearm {__version__}",
            f"  ! {day}, calibration {hash_of(robot.read_bytes())[:8]}",
            "  ! for irb120",
        ]
        assert json.loads((out / "plate.mod.truearm.json").read_text())["date"] == day


def test_a_ledger_that_cannot_be_written_is_said(program: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = saved(program.parent)

    def refused(folder: Path) -> None:
        if folder == robot.parent:
            raise PermissionError

    monkeypatch.setattr(writing, "_try_writing", refused)
    assert codes(compensate(robot, [program], out=program.parent / "out"))["ledger-not-written"] == "note"
    assert [path.name for path in robot.parent.iterdir()] == ["calibrated.yaml"]
    monkeypatch.undo()
    # A link to a robot leads to its ledger.
    (program.parent / "link.yaml").symlink_to(robot)
    result = compensate(program.parent / "link.yaml", [program], out=program.parent / "other")
    assert "ledger-not-written" not in codes(result)
    assert [path.name for path in sorted(robot.parent.iterdir())] == ["calibrated.yaml", LEDGER]
    assert not (program.parent / LEDGER).exists()
    assert "ledger-not-written" not in codes(compensate(calibrated(), [program]))


def test_what_has_the_name_of_the_ledger_and_is_none_is_refused(program: Path) -> None:
    robot, out = saved(program.parent), program.parent / "out"
    for text in ("", "[]", "{", '{"truearm": "truearm-corrections/1", "programs": [{"program": "a"}]}'):
        (robot.parent / LEDGER).write_text(text)
        with pytest.raises(InputError, match=f"{LEDGER}: truearm writes a file of this name itself") as refusal:
            compensate(robot, [program], out=out)
        assert refusal.value.parameter == "robot"
        assert (robot.parent / LEDGER).read_text() == text
        assert not out.exists()
    compensate(saved(program.parent, "other"), [program], out=out)  # of another folder it is not asked for


def test_the_program_of_a_path_is_remembered(tmp_path: Path) -> None:
    robot = saved(tmp_path)
    file = tmp_path / "path.yaml"
    file.write_text(
        "truearm: truearm-path/1\nunits: {length: mm, angle: deg, time: s}\nspeed: 100\nacceleration: 500\nstep: 0.1\n"
        "orientation: {quaternion: [0, 0, 1, 0]}\nstart: [350, -50, 300]\nsections:\n  - line: [350, 50, 300]\n"
    )
    options = {"languages": ["rapid"], "move_to": "poses", "controller_kinematics": "nominal"}
    truearm.path(robot, file, out=tmp_path / "out", **options)  # type: ignore[arg-type]
    (written,) = (tmp_path / "out").glob("*.mod")
    with pytest.raises(InputError, match='corrected already; got "the comment'):
        compensate(robot, [written])
    unmarked = tmp_path / "x.mod"
    unmarked.write_text("\n".join(line for line in written.read_text().splitlines() if MARK not in line))
    with pytest.raises(
        InputError, match=r"corrected already; got 'targets of truearm_path\.mod as it was corrected on"
    ):
        compensate(robot, [unmarked])
    (robot.parent / LEDGER).unlink()
    assert compensate(robot, [unmarked]).files[0].corrected > 3


def test_what_stays_by_its_name_is_said_not_to_be_in_the_errors(program: Path) -> None:
    robot = truearm.calibrate("irb120", campaign("irb120", 40, 2e-5, 8)[1], model="geometric").robot
    words = "  Targets that stay because of `keep` or `only` are not in these errors."
    assert words in compensate(robot, [program], keep=["pHole3"]).lines()
    assert words not in compensate(robot, [program]).lines()
