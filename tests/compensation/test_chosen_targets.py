"""Which targets are corrected, and what becomes of those that were taught."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.answered import compensate
from tests.compensation.workplace import cell, codes, module, plate, pose

import truearm
from truearm.compensation.program_correction import commanded
from truearm.engine.base.errors import InputError
from truearm.engine.programs.chosen_targets import Patterns
from truearm.engine.programs.fake_targets import matrices
from truearm.engine.programs.fanuc_ls import FANUC_LS
from truearm.engine.programs.program import Source
from truearm.engine.programs.urscript import URSCRIPT
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot


def worn(effects: tuple[str, ...] = ()) -> Robot:
    """Return an IRB 120 that is another one."""
    robot = load_robot("irb120").with_effects(effects)
    values = {"a_3": 0.2706, "theta_offset_3": 0.002, "alpha_4": -1.5690, "theta_offset_2": -1.5690}
    if effects:
        values |= {"compliance_2": 6e-6, "compliance_3": 8e-6}
    return robot.with_values(values)


def corrected_lines(result: truearm.ProgramCorrection) -> list[str]:
    """Return the names of the targets that were corrected."""
    (correction,) = result.result.corrections
    return [
        t.name
        for t, is_corrected in zip(correction.program.targets, correction.corrected.tolist(), strict=True)
        if is_corrected
    ]


def test_home_stays_unless_it_is_asked_for(tmp_path: Path) -> None:
    result = compensate(worn(), [plate(tmp_path)])
    (correction,) = result.result.corrections
    homes = [i for i, target in enumerate(correction.program.targets) if target.form.kind == "joints"]
    assert [correction.kept.get(i) for i in homes] == ["given by joints"]
    again = result.as_written()[0].targets
    assert again[homes[0]].values == correction.program.targets[homes[0]].values
    asked = compensate(worn(), [plate(tmp_path)], joint_targets="correct")
    assert asked.files[0].kept.total() == 0
    assert asked.as_written()[0].targets[homes[0]].values != correction.program.targets[homes[0]].values


def test_only_some_and_without_some(tmp_path: Path) -> None:
    program = plate(tmp_path)
    some = compensate(worn(), [program], only=["pHole1*", "PHOLE2"], keep=["phole12"])
    names = corrected_lines(some)
    assert {"pHole1", "pHole10", "pHole11", "pHole2"} <= set(names)
    assert all(name.startswith("pHole1") or name == "pHole2" for name in names)
    assert "pHole12" not in names
    file = some.files[0]
    assert file.targets == file.corrected + file.kept.total() + len(file.skipped)
    assert f"{file.kept['not in `only`']} kept (not in `only`)" in file.count_words
    for parameter in ("only", "keep"):
        with pytest.raises(InputError, match="no target of the programs has this name; got 'pHoel1'") as refusal:
            compensate(worn(), [program], **{parameter: ["pHoel1"]})  # type: ignore[arg-type]
        assert refusal.value.parameter == parameter
        assert "Did you mean pHole1" in str(refusal.value)


def test_taught_points_stay_byte_for_byte(tmp_path: Path) -> None:
    program = plate(tmp_path)
    result = compensate(worn(), [program], taught=["points"])
    offsets = {t.name for t in result.result.corrections[0].program.targets if t.parent is not None}
    assert set(corrected_lines(result)) <= offsets
    # A program of which all was taught was written with a record, and refused as corrected already when given again.
    alone, out = tmp_path / "alone.mod", tmp_path / "out"
    alone.write_text("\n".join(line for line in program.read_text().splitlines() if "Offs" not in line))
    result = compensate(worn(), [alone], taught=["points"], out=out)
    assert "Warning (nothing-corrected): Nothing was corrected: the programs are as they were." in result.lines()
    assert (out / "alone.mod").read_bytes() == result.files[0].text == alone.read_bytes()
    again = compensate(worn(), [out / "alone.mod"])
    assert again.files[0].corrected > 10
    assert "nothing-corrected" not in codes(again)


def test_a_tool_that_is_given_is_not_called_missing_where_all_points_were_taught(tmp_path: Path) -> None:
    alone = tmp_path / "alone.mod"
    alone.write_text("\n".join(line for line in plate(tmp_path).read_text().splitlines() if "Offs" not in line))
    tools = cell(tmp_path, "tools:\n  tProbe: {of: flange, translation: [50, 25, 180]}\n")
    given, absent = (compensate(worn(), [alone], taught=["points"], tools=file) for file in (tools, None))
    assert given.files[0].corrected == absent.files[0].corrected == 0
    assert "are where `tools` places them" in given.frame_words[-1]
    assert "No tool has a measured place" in absent.frame_words[-1]


def test_an_offset_from_a_point_that_stays_is_as_long_as_it_says(tmp_path: Path) -> None:
    """The real robot is asked where it is at the point, and 150 mm beside it."""
    for offset in ("Offs(p1,120,-80,60)", "RelTool(p1,120,80,-60)"):
        moves = "MoveJ p1,v100,fine,tool0;", f"MoveL {offset},v100,fine,tool0;"
        path = module(tmp_path, *moves, data=(f"CONST robtarget p1:={pose(400, 100)};",))
        robot, wanted = worn(), np.linalg.norm([120, 80, 60]) * 1e-3
        for words in ({"taught": ["points"]}, {"taught": ["none"], "keep": ["p1"]}):
            result = compensate(robot, [path], **words)  # type: ignore[arg-type]
            (correction,) = result.result.corrections
            assert correction.corrected.tolist() == [False, True], offset
            lengths = []
            for program in (correction.program, result.as_written()[0]):
                tips = matrices(robot, commanded(robot, program))[:, :3, 3]
                lengths.append(float(np.linalg.norm(tips[1] - tips[0])))
            assert abs(lengths[0] - wanted) > 5e-5, offset
            assert lengths[1] == pytest.approx(wanted, abs=2e-6), offset


def test_frames_that_were_taught_each_have_a_shift_of_their_own(tmp_path: Path) -> None:
    """Two plates far apart, each located by its own points: each pattern stays where it was."""
    plates = {"wLeft": (250, 150, 0), "wRight": (250, -300, -1)}
    data = (
        f'PERS wobjdata {name}:=[FALSE,TRUE,"",[[{x},{y},100],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];'
        for name, (x, y, _) in plates.items()
    )
    moves = (
        f"MoveJ {pose(x, y, 150, f'[0,0,1,0],[{quadrant},0,0,0]')},v100,fine,tool0\\WObj:={name};"
        for name, (_, _, quadrant) in plates.items()
        for x in (0, 80, 160)
        for y in (10, 60, 110)
    )
    path = module(tmp_path, "ConfJ\\Off;", *moves, data=tuple(data))
    for taught, apart in ((["none"], True), (["frames"], False)):
        (correction,) = compensate(worn(), [path], taught=taught).result.corrections
        assert correction.corrected.all()
        shifts = (correction.after - correction.before)[:, :3, 3].reshape(2, 9, 3).mean(axis=1)
        assert (np.linalg.norm(shifts, axis=1) > 2e-5).all() == apart
        if not apart:
            np.testing.assert_allclose(shifts, 0.0, atol=2e-7)


def test_what_was_taught_is_asked_and_contradictions_are_refused(tmp_path: Path) -> None:
    program = plate(tmp_path)
    for wrong, words in (
        (None, "or with what was taught: `taught=points`, `taught=frames`, `taught=tools`"),
        (["none", "points"], "what was taught is not clear"),
        ([], "what was taught is not clear"),
        (["holes"], "there is no answer of this name"),
    ):
        with pytest.raises(InputError, match=words):
            compensate(worn(), [program], taught=wrong)
    with pytest.raises(InputError, match="the tools cannot be both taught and measured"):
        compensate(worn(), [program], tools=cell(tmp_path, "tools:\n  tProbe: {of: flange}\n"), taught=["tools"])


def test_the_arm_bends_by_what_the_program_says_that_its_tool_weighs(tmp_path: Path) -> None:
    robot = worn(("compliance",)).with_payload(Payload(1.0, (0.0, 0.0, 0.05)))
    program = plate(tmp_path)
    result = compensate(robot, [program], taught=["none"])
    assert result.result.loads == {"tProbe": Payload(2.7, (0.05, 0.025, 0.1))}
    stated = compensate(robot, [program], taught=["none"], payload="2.7kg,50mm,25mm,100mm")
    assert stated.files[0].text == result.files[0].text
    assert stated.result.loads == {}
    other = compensate(robot, [program], taught=["none"], payload="1kg,0mm,0mm,50mm")
    assert other.files[0].text != result.files[0].text
    dummy = plate(tmp_path, ("[2.7,[50,25,100]", "[0.001,[0,0,0.001]"))
    assert compensate(robot, [dummy], taught=["none"]).result.loads == {"tProbe": None}
    (notice,) = [n for n in compensate(robot, [dummy]).warnings if n.code == "loads-taken"]
    assert "No mass is known of tProbe: there the 1 kg of the calibration are kept." in notice.message
    assert replace(notice).level == "note"


def test_a_script_that_says_once_what_the_robot_carries() -> None:
    carried, low = Payload(1.5, (0.01, -0.02, 0.05)), Payload(1.5, (0.0, 0.0, 0.05))
    for calls, load in {
        "set_payload(1.5, [0.01, -0.02, 0.05])": carried,
        "set_target_payload(m=1.5, cog=[0, 0, 0.05], inertia=[0, 0, 0, 0, 0, 0])": low,
        "set_payload(1.5, [0, 0, 0.05])\n  set_payload(1.5, [0, 0, 0.05])": low,
        "set_payload(1.5, [0, 0, 0.05])\n  set_payload(2.5, [0, 0, 0.05])": None,
        "set_payload(1.5)": None,
        "set_payload(mass, [0, 0, 0.05])": None,
        "set_payload(1e9, [0, 0, 0.05])": None,
        "# set_payload(1.5, [0, 0, 0.05])": None,
    }.items():
        text = f"def job():\n  set_tcp(p[0,0,0.1,0,0,0])\n  {calls}\n  movel(p[0.4,0.1,0.3,0,3.14,0])\nend\n"
        program = URSCRIPT.read([Source(Path("job.script"), text)])
        assert list(program.loads.values()) == ([load] if load else []), calls


def test_a_load_unlike_that_of_the_calibration_is_warned_of(tmp_path: Path) -> None:
    bare, program = worn(("compliance",)), plate(tmp_path)
    (notice,) = [n for n in compensate(bare, [program]).warnings if n.code == "loads-taken"]
    assert notice.level == "warning"
    assert "In its calibration the robot carried 0 kg." in notice.message
    robot = bare.with_payload(Payload(2.7, (0.05, 0.025, 0.1)))
    warnings = codes(compensate(robot, [program]))
    assert warnings["loads-taken"] == "note"
    assert "load-changes" not in warnings
    for line in ("GripLoad lPart;", "tProbe.tload.mass:=6;", "MoveL pHole1,v10,z1,tProbe\\TLoad:=lPart;"):
        changing = plate(tmp_path, ("PROC main()", f"PROC main()\n    {line}"))
        assert "load-changes" in codes(compensate(robot, [changing], accept=["skipped"])), line
    grams = plate(tmp_path, ("[2.7,[50,25,100]", "[2700,[50,25,100]"))
    assert "payload-unlikely" in codes(compensate(worn(), [grams]))


def test_a_tool_elsewhere_than_the_program_has_it_is_named(tmp_path: Path) -> None:
    for x, is_named in (("9", True), ("1", False)):
        tools = cell(tmp_path, f"tools:\n  tProbe: {{of: flange, translation: [{x}, 0, 125]}}\n")
        assert ("tool-apart" in codes(compensate(worn(), [plate(tmp_path)], tools=tools))) == is_named


def test_frames_and_tools_of_targets_that_stay_need_no_place(tmp_path: Path) -> None:
    other = (
        '  PERS wobjdata wOther:=[FALSE,TRUE,"",[[9,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\n'
        f"  CONST robtarget pFar:={pose(300, 10)};\n  PROC main()\n"
        "    MoveJ pFar,v100,fine,tProbe\\WObj:=wOther;"
    )
    program = plate(tmp_path, ("  PROC main()", other))
    place = "frames:\n  wobjPlate: {of: base, translation: [310, -110, 60]}\n"
    frames = cell(tmp_path, place)
    with pytest.raises(InputError, match="only some of the frames"):
        compensate(worn(), [program], frames=frames)
    assert compensate(worn(), [program], frames=frames, keep=["pFar"]).files[0].kept["in `keep`"] == 1
    with pytest.raises(InputError, match="the frames cannot be both taught and measured"):
        compensate(worn(), [program], frames=frames, taught=["frames"])
    frames = cell(tmp_path, place.replace("of: base", "of: controller"))
    assert compensate(worn(), [program], frames=frames, taught=["frames"]).result.frames.frames == "assumed"


def test_a_record_that_is_not_ours_or_holds_the_only_original_is_not_lost(tmp_path: Path) -> None:
    program, out = plate(tmp_path), tmp_path / "out"
    for _ in range(2):
        compensate(worn(), [program], out=out)
    (out / "plate.mod").rename(tmp_path / "moved.mod")
    with pytest.raises(InputError, match="holds the original of a program that is not beside it"):
        compensate(worn(), [program], out=out)
    (out / "plate.mod.truearm.json").write_text("mine")
    with pytest.raises(InputError, match="was not written by truearm or was changed since"):
        compensate(worn(), [program], out=out)
    assert (out / "plate.mod.truearm.json").read_text() == "mine"


#: All was computed, for a controller that computes with the nominal values.
ANSWERED: Mapping[str, Any] = {"taught": ["none"], "controller_kinematics": "nominal"}


def own_names(folder: Path, data: str = "", more: str = "") -> Path:
    """Write a program of three targets, in the flange and the base as the controller calls them."""
    names = {"a": (300, 10), "b": (350, 60), "c": (320, 90)}
    points = tuple(f"CONST robtarget {name}:={pose(*at)};" for name, at in names.items())
    return module(
        folder,
        "MoveL a,v100,fine,tool0\\WObj:=wobj0;",
        "MoveL b,v100,fine,tool0;",
        "MoveL c,v100,fine,tool0;",
        *filter(None, [more]),
        data=(*points, *filter(None, [data])),
    )


def test_tool0_and_wobj0_are_the_flange_and_the_base(tmp_path: Path) -> None:
    """They were unknown in a cell file, and in a program that has the module BASE of its controller along."""
    declared = (
        "PERS tooldata tool0:=[TRUE,[[0,0,0],[1,0,0,0]],[0.001,[0,0,0.001],[1,0,0,0],0,0,0]];\n"
        'PERS wobjdata wobj0:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];'
    )
    for data in ("", declared):
        program, texts = own_names(tmp_path, data), set()
        for tool, frame in (("tool0", "wobj0"), ("flange", "base"), ("Tool0", "WOBJ0")):
            places = cell(
                tmp_path,
                f"tools:\n  {tool}: {{of: flange, translation: [0.1, 0, 0]}}\n"
                f"frames:\n  {frame}: {{of: base, translation: [0, 0.2, 0]}}\n",
            )
            result = truearm.compensate(worn(), [program], tools=places, frames=places, **ANSWERED)
            assert result.files[0].corrected == 3
            assert result.result.frames.tools == result.result.frames.frames == "identified"
            texts.add(result.files[0].text)
        assert len(texts) == 1
        assert texts != {program.read_bytes()}


def test_a_single_target_is_corrected_where_its_frame_is_known(tmp_path: Path) -> None:
    program = own_names(tmp_path)
    alone = truearm.compensate(worn(), [program], only=["a"], **ANSWERED)
    assert alone.lines()[2].startswith("Warning (nothing-corrected): Nothing can be corrected: only one target is left")
    assert "0.000 mm" not in " ".join(alone.lines())
    assert alone.summary()["programs"][0]["expected_mm"] is None
    assert alone.files[0].text == program.read_bytes()
    frames = cell(tmp_path, "frames:\n  wobj0: {of: base}\n")
    known = truearm.compensate(worn(), [program], only=["a"], frames=frames, **ANSWERED)
    assert known.files[0].corrected == 1
    assert known.files[0].largest_shift > 1e-4
    together = truearm.compensate(worn(), [program], **ANSWERED)
    assert not [result for result in (known, together) if "nothing-corrected" in codes(result)]


def test_of_frames_that_were_taught_one_with_a_single_target_leaves_it(tmp_path: Path) -> None:
    other = (
        'PERS wobjdata wOther:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\n'
        f"CONST robtarget d:={pose(310, 20)};"
    )
    program = own_names(tmp_path, other, "MoveJ d,v100,fine,tool0\\WObj:=wOther;")
    apart = truearm.compensate(worn(), [program], taught=["frames"], controller_kinematics="nominal")
    assert corrected_lines(apart) == ["a", "b", "c"]
    assert apart.files[0].kept == {"alone, with `frames` not given": 1}
    together = truearm.compensate(worn(), [program], **ANSWERED)
    assert sorted(corrected_lines(together)) == ["a", "b", "c", "d"]


def test_a_position_of_fanuc_is_named_with_or_without_its_comment() -> None:
    text = "/PROG  SEAM\n/MN\n   1:J P[1] 20% FINE    ;\n   2:J P[2:seam] 20% FINE    ;\n/POS\n" + "".join(
        f"{position}{{\n   GP1:\n\tUF : 0, UT : 0,\n\tJ1=     0.000 deg,\tJ2=   -20.000 deg\n}};\n"
        for position in ("P[1]", 'P[2:"seam"]')
    )
    target = FANUC_LS.read([Source(Path("a.ls"), f"{text}/END\n")])
    for name, meant in (
        ("P[2]", [False, True]),
        ("P[2:seam]", [False, True]),
        ('P[2:"seam"]', [False, True]),
        ("P[2*", [False, True]),
        ("P[1]", [True, False]),
        ("P[1:start]", [True, False]),  # instructions and positions write the comment, or do not
    ):
        fits = Patterns([target], [name], "keep").fit
        assert [fits(position.name) for position in target.targets] == meant, name
    for other in ("P[2:start]", "PR[2]", "P[3]"):
        with pytest.raises(InputError, match="no target of the programs has this name"):
            Patterns([target], [other], "keep")
