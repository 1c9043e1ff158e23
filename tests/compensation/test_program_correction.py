"""Programs at their edges: none but joint targets, arms that slide or are too short, frames that only some have."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.answered import compensate

from truearm.compensation.program_correction import commanded, corrected_programs
from truearm.engine.base.errors import InputError
from truearm.engine.programs.cell import Cell, Placed
from truearm.engine.programs.chosen_targets import Choice
from truearm.engine.programs.fanuc_ls import FANUC_LS
from truearm.engine.programs.program import Configuration, Program, Source
from truearm.engine.programs.rapid import RAPID
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform

JOINTS = "MoveAbsJ [[{},20,-10,0,45,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;"
POSE = "MoveL [[{},0,400],[0.70710678,0,0.70710678,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0{};"
POSITION = "P[{}]{{\n  GP1:\n  UF : F, UT : F,\n  {}\n}};\n"
FLANGE = Cell({"": Placed(None, Transform())}, {})
FLANGE_AND_BASE = Cell({"": Placed(None, Transform())}, {"": Placed(None, Transform())})


def rapid(*moves: str) -> Program:
    text = "\n".join(["MODULE m", "PROC main()", *moves, "ENDPROC", "ENDMODULE", ""])
    return RAPID.read([Source(Path("m.mod"), text)])


def ls(*positions: str) -> str:
    lines = "".join(f"{i:4}:J P[{i}] 100% FINE ;\n" for i in range(1, len(positions) + 1))
    taught = "".join(POSITION.format(i, words) for i, words in enumerate(positions, 1))
    return f"/PROG  A\n/ATTR\n/MN\n{lines}/POS\n{taught}/END\n"


def joints(*values: str) -> str:
    return ",\n  ".join(f"J{i} = {value}" for i, value in enumerate(values, 1))


def worn(robot: Robot, size: float = 0.3) -> Robot:
    """Return a robot with errors of its geometry, drawn in a share of what is usual."""
    rng = np.random.default_rng(0)
    inside = [p for p in robot.parameters.values() if p.group in ("geometry", "joint zero")]
    return robot.with_values({p.name: p.value + size * p.prior * float(rng.standard_normal()) for p in inside})


IRB120 = worn(load_robot("irb120"))


EVERY = Choice(joint_targets=True)


def test_joint_targets_alone_keep_to_the_base_that_was_measured() -> None:
    measured = Cell(FLANGE.tools, {"": Placed(None, Transform((0.0, 0.0, 0.001)))})
    done = corrected_programs(IRB120, [rapid(JOINTS.format(10), JOINTS.format(30))], measured, choice=EVERY)
    assert (done.frames.tools, done.frames.frames) == ("identified", "identified")
    np.testing.assert_allclose(done.frames.base, Transform((0.0, 0.0, 0.001)).matrix, atol=1e-12)
    correction = done.corrections[0]
    # Where the nominal robot was meant to be, seen from a base that is 1 mm higher, is where the real one goes.
    position, _ = IRB120.world_poses(correction.joints)
    np.testing.assert_allclose(position, correction.tips[:, :3, 3] + [0, 0, 0.001], atol=1e-9)


def test_programs_given_together_share_the_first_frame_that_was_measured() -> None:
    shift = Transform((0.001, 0.002, -0.001))
    defined = Transform((0.1, 0.0, 0.0))
    frames = {"w": Placed(None, Transform.from_matrix(np.eye(3), (shift.matrix @ defined.matrix)[:3, 3]))}
    poses = rapid(POSE.format(300, "\\WObj:=w"), POSE.format(310, "\\WObj:=w"))
    poses = replace(poses, frames={"w": defined})
    first, second = corrected_programs(
        IRB120, [poses, rapid(JOINTS.format(10))], Cell(FLANGE.tools, frames), choice=EVERY
    ).corrections
    assert first.corrected.all()
    position, _ = IRB120.world_poses(second.joints)
    np.testing.assert_allclose(position, second.tips[:, :3, 3] + shift.translation, atol=1e-9)


def test_nothing_to_correct_is_no_error() -> None:
    done = corrected_programs(IRB120, [rapid("WaitTime 1;"), rapid(POSE.format(9000, ""))], Cell({}, {}))
    assert [len(one.corrected) for one in done.corrections] == [0, 1]
    assert not done.corrections[1].corrected.any()
    assert [one.edits for one in done.corrections] == [(), ()]


@pytest.mark.parametrize("values", [("10 deg", "20 deg", "-30 deg"), ("10 deg",) * 5])
def test_an_arm_of_fewer_than_six_joints_is_refused(values: tuple[str, ...]) -> None:
    robot = worn(load_robot({3: "li3", 5: "katana450"}[len(values)]))
    program = FANUC_LS.read([Source(Path("a.ls"), ls(joints(*values)))])
    with pytest.raises(InputError, match=f"six joints or more; got '{len(values)} joints'"):
        corrected_programs(robot, [program], Cell({}, {}))


def on_a_track() -> Robot:
    plain = load_robot("irb120")
    track = replace(plain.joints[0], name="track", kind="prismatic", limits=(0.0, 5.0), row={"d": 0.0})
    return worn(replace(plain, joints=(track, *plain.joints), masses=(), maker="", effect_names=(), known={}))


def test_a_track_is_reported_in_millimetres(tmp_path: Path) -> None:
    six = ("10 deg", "20 deg", "-30 deg", "5 deg", "45 deg", "0 deg")
    program = tmp_path / "a.ls"
    program.write_text(ls(joints("1000 mm", *six), joints("1500 mm", *six), joints("1200 mm", "40 deg", *six[1:])))
    cell = tmp_path / "cell.yaml"
    cell.write_text("truearm: truearm-cell/1\nunits: {length: mm, angle: deg}\ntools:\n  flange: {of: flange}\n")
    done = compensate(on_a_track(), [program], tools=cell, joint_targets="correct")
    assert done.result.corrections[0].corrected.all()
    done.save(tmp_path / "out")
    page = (tmp_path / "out" / "compensation.html").read_text()
    row = page.partition("<tr><td>track</td>")[2].partition("</tr>")[0]
    low, high = (float(part.partition("<")[0]) for part in row.split('<td class="n">')[1:])
    assert (low, high) == pytest.approx((1000, 1500), abs=5)
    assert "<td>mm</td>" in row


def test_a_turn_that_a_controller_takes_to_the_letter_is_not_left() -> None:
    """A joint at the end of its turn: some controllers would go round to the other end, others go a little beyond."""
    robot = worn(load_robot("irb120"))
    program = rapid(POSE.format(400, ""))
    (target,) = program.targets
    free = Program("RAPID", program.sources, (replace(target, configuration=Configuration("front", "up", "flip")),))
    meant = commanded(robot, free)[0, 0]
    real = corrected_programs(robot, [free], FLANGE_AND_BASE).corrections[0].joints[0, 0]
    assert 1e-4 < abs(real - meant) < 1e-2
    side = (1, meant, math.inf) if real < meant else (1, -math.inf, meant)
    found = []
    for literal in (True, False):
        bound = Configuration("front", "up", "flip", (side,), literal=literal)
        told = Program("RAPID", program.sources, (replace(target, configuration=bound),))
        found.append(corrected_programs(robot, [told], FLANGE_AND_BASE).corrections[0])
    assert not found[0].corrected[0]
    assert "it would leave the configuration in the program" in found[0].skipped[0].reason
    assert found[1].corrected[0]
    assert found[1].on_edge == (0,)
