"""Corrected programs on robots that do what the model does not contain: play, hysteresis, gears, noise, forces.

And with calibrations that know little where the program is: nothing gets worse without a word.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.answered import compensate
from tests.calibration.test_external_force import elastic_twin
from tests.compensation.workplace import HEAD
from tests.compensation.workplace import cell as cell_file
from tests.compensation.workplace import plate as plate_file
from tests.plate import PLATE

import truearm
from truearm import InputError
from truearm.calibration.calibrate import calibrate
from truearm.calibration.result import Calibration
from truearm.compensation.program_correction import CorrectedPrograms, commanded, corrected_programs
from truearm.compensation.result import ProgramCorrection
from truearm.engine.programs.cell import Cell, Placed, TargetWrench, read_wrenches
from truearm.engine.programs.chosen_targets import Choice, wrenches_of_targets
from truearm.engine.programs.correction import Correction
from truearm.engine.programs.fake_targets import matrices
from truearm.engine.programs.gauge import best_agreement
from truearm.engine.programs.program import Program, Source
from truearm.engine.programs.program_files import edited
from truearm.engine.programs.rapid import RAPID
from truearm.engine.robot.inverse.branches import branch_rule
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import Transform, quaternion_from_rotation
from truearm.engine.robot.wrench import Wrench
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure
from truearm.engine.twin.twin_joint import PERFECT

NOISE = 0.03e-3
EVERY = Choice(joint_targets=True)
LOW, HIGH = np.radians([[-90, 0, -80, -150, -90, -180], [90, 110, 70, 150, 90, 180]])


def worn_twin(rng: np.random.Generator) -> Twin:
    """Return the IRB 120 of the thesis with hysteresis in every joint and a gear that errs."""
    twin = truth_twin(load_robot("irb120"), "tracker-triangular", rng)
    joints = {
        number: replace(twin.joints.get(number, PERFECT), hysteresis=math.radians(0.004), backlash=math.radians(0.004))
        for number in range(1, 7)
    }
    joints[2] = replace(joints[2], gear=((240, math.radians(0.006), 0.4),))
    return replace(twin, joints=joints)


@pytest.fixture(scope="module")
def campaign() -> tuple[Twin, Calibration]:
    rng = np.random.default_rng(5)
    twin = worn_twin(rng)
    data = measure(twin, rng.uniform(LOW, HIGH, (200, 6)), NOISE, rng)
    return twin, calibrate("irb120", data, model="elastic", payload=twin.robot.payload)


def plate(text: str) -> Program:
    return RAPID.read([Source(Path("plate.mod"), text)])


def missed(twin: Twin, calibration: Calibration, program: Program, meant: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return how far the tip of the twin is from where it was meant to be, as its controller sends it [m]."""
    tips = twin.frames(commanded(calibration.robot, program)[rows])["1"][:, :3, 3]
    return np.asarray(np.linalg.norm(tips - meant[rows], axis=1))


def poses_corrected(result: Correction) -> np.ndarray:
    """Return the corrected targets that are poses."""
    return np.array([i for i, t in enumerate(result.program.targets) if t.form.kind == "pose" and result.corrected[i]])


def corrected(calibration: Calibration, program: Program, cell: Cell) -> tuple[Correction, Program]:
    """Return a correction of everything, and the program that it makes."""
    result = corrected_programs(calibration.robot, [program], cell, choice=EVERY).corrections[0]
    assert result.corrected.all()
    return result, plate(edited(program.sources[0].text, result.edits))


def all_over_the_workspace(count: int, rng: np.random.Generator) -> str:
    """Return a program that goes to poses all over the workspace, in the work object of the plate."""
    nominal = load_robot("irb120")
    tool, frame = np.eye(4), np.eye(4)
    tool[2, 3], frame[:3, 3] = 0.125, (0.31, -0.11, 0.06)
    joints = rng.uniform(LOW, HIGH, (count, 6))
    poses = np.linalg.inv(frame) @ matrices(nominal, joints) @ tool
    quadrants = np.floor(np.degrees(joints[:, [0, 3, 5]]) / 90).astype(int)
    elbows = branch_rule(nominal).numbers(nominal.forward_kinematics(joints)) & 2  # type: ignore[union-attr]
    lines = [
        f"    MoveJ [[{x:.2f},{y:.2f},{z:.2f}],[{','.join(f'{v:.7f}' for v in q)}],[{a},{b},{c},{elbow}],"
        "[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tProbe\\WObj:=wobjPlate;"
        for (x, y, z), q, (a, b, c), elbow in zip(
            poses[:, :3, 3] * 1e3, quaternion_from_rotation(poses[:, :3, :3]), quadrants, elbows, strict=True
        )
    ]
    head, remaining = PLATE.split("  PROC main()")
    return f"{head}  PROC main()\n" + "\n".join(lines) + f"\n  ENDPROC\n  PROC rest(){remaining}"


def given(twin: Twin, calibration: Calibration, program: Program) -> tuple[np.ndarray, Cell]:
    """Return where the plate truly is in the world, and tool and plate as a tracker finds them from nine points."""
    stands = twin.robot.base.matrix @ best_agreement(twin.robot)[0] @ program.frames["wobjPlate"].matrix
    seen = stands.copy()
    seen[:3, 3] += NOISE / 3.0 * np.random.default_rng(6).standard_normal(3)
    in_base = np.linalg.inv(calibration.robot.base.matrix) @ seen
    x, y, z = (calibration.robot.values[f"target_1_{axis}"] for axis in "xyz")
    return stands, Cell(
        {"tprobe": Placed(None, Transform((x, y, z)))},
        {"wobjplate": Placed(None, Transform.from_matrix(in_base[:3, :3], in_base[:3, 3]))},
    )


def test_targets_are_reached_within_half_more_than_the_held_out_error(campaign: tuple[Twin, Calibration]) -> None:
    """On the plate and all over the workspace, as the held-out configurations are."""
    twin, calibration = campaign
    assert calibration.validation is not None
    held_out = float(calibration.validation.position_norms.mean())
    program = plate(all_over_the_workspace(150, np.random.default_rng(7)))
    stands, cell = given(twin, calibration, program)
    result = corrected_programs(calibration.robot, [program], cell, choice=EVERY).corrections[0]
    after = plate(edited(program.sources[0].text, result.edits))
    meant = (stands @ result.before)[:, :3, 3]
    for part in (poses_corrected(result), poses_corrected(result)[150:]):
        errors = [missed(twin, calibration, one, meant, part).mean() for one in (program, after)]
        assert errors[1] < 1.5 * held_out
        assert errors[0] > 8 * errors[1]
    assert len(poses_corrected(result)) > 170


def test_without_frames_targets_are_right_to_each_other(campaign: tuple[Twin, Calibration]) -> None:
    """The program as a whole stays where the original was: what is left is judged after the best fit of a plate."""
    twin, calibration = campaign
    assert calibration.validation is not None
    program = plate(PLATE)
    result, after = corrected(calibration, program, Cell({}, {}))
    rows = poses_corrected(result)
    shapes = []
    for shown in (program, after):
        tips = twin.frames(commanded(calibration.robot, shown)[rows])["1"][:, :3, 3]
        shapes.append(fitted(tips, result.before[rows, :3, 3]).mean())
    assert shapes[1] < 1.5 * float(calibration.validation.position_norms.mean())
    assert shapes[1] < 0.4 * shapes[0]


def fitted(points: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return the distances that are left between points and others after the best rigid motion."""
    a, b = points - points.mean(axis=0), others - others.mean(axis=0)
    u, _, vt = np.linalg.svd(a.T @ b)
    turn = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
    return np.asarray(np.linalg.norm(a @ turn - b, axis=1))


#: Half the rated load of the IRB 120.
HALF = 0.5 * 3.0 * 9.80665
FORCES = HEAD.replace("deg}", "deg, force: N, moment: N m}") + "wrenches:\n"


@pytest.fixture(scope="module")
def pushed_campaign() -> tuple[Twin, Calibration]:
    """An elastic IRB 120, measured with a force to all sides in half of the configurations."""
    twin, rng = elastic_twin(), np.random.default_rng(5)
    wrench = np.zeros((100, 6))
    wrench[::2, :3] = 10.0 * rng.standard_normal((50, 3))
    data = measure(twin, rng.uniform(LOW, HIGH, (100, 6)), 0.03e-3, rng, wrench=wrench)
    return twin, calibrate("irb120", data, model="elastic", payload=twin.robot.payload)


def with_forces(
    known: tuple[Twin, Calibration], wrenches: tuple[TargetWrench, ...], frames: bool = True
) -> CorrectedPrograms:
    cell = given(*known, plate(PLATE))[1]
    cell = cell if frames else replace(cell, frames={})
    robot = known[1].robot
    return corrected_programs(robot, [plate(PLATE)], cell, choice=EVERY, wrenches=wrenches, weigh_tools=False)


@pytest.mark.parametrize(
    "wrench", [Wrench((0.0, HALF, 0.0)), Wrench((HALF, 0.0, 0.0)), Wrench((0.0, 0.0, -HALF), frame="tool")]
)
def test_a_correction_that_knows_the_force_is_five_times_better_under_it(
    pushed_campaign: tuple[Twin, Calibration], wrench: Wrench
) -> None:
    twin, calibration = pushed_campaign
    pushed = replace(twin, robot=twin.robot.with_wrench(wrench, "1"))
    stands, _ = given(twin, calibration, plate(PLATE))
    errors = []
    for wrenches in ((), (TargetWrench((), (), wrench),)):
        result = with_forces(pushed_campaign, wrenches).corrections[0]
        after = plate(edited(result.program.sources[0].text, result.edits))
        meant = (stands @ result.before)[:, :3, 3]
        errors.append(missed(pushed, calibration, after, meant, poses_corrected(result)).mean())
    assert errors[0] > 5 * errors[1]
    assert errors[1] < 0.05e-3


def test_only_the_targets_that_are_pushed_change(pushed_campaign: tuple[Twin, Calibration]) -> None:
    wrench = TargetWrench(("pHole1*",), (), Wrench((0.0, HALF, 0.0)))
    free, pushed = (with_forces(pushed_campaign, some).corrections[0] for some in ((), (wrench,)))
    other = np.abs(free.after - pushed.after).max(axis=(1, 2)) > 1e-6
    names = [target.name for target in free.program.targets]
    assert {names[i] for i in np.flatnonzero(other)} >= {"pHole1", "pHole10", "pHole11", "pHole12"}
    assert all(names[i].startswith("pHole1") for i in np.flatnonzero(other))


def test_the_force_does_not_move_the_frame(pushed_campaign: tuple[Twin, Calibration]) -> None:
    """Where the place of the frame is assumed, the bending that all targets share is corrected all the same."""
    wrench = TargetWrench((), (), Wrench((0.0, HALF, 0.0)))
    free, pushed = (with_forces(pushed_campaign, some, frames=False) for some in ((), (wrench,)))
    assert np.abs(free.frames.base - pushed.frames.base).max() < 1e-9
    shift = (pushed.corrections[0].after - free.corrections[0].after)[:, :3, 3]
    assert np.linalg.norm(shift.mean(axis=0)) > 0.1e-3


def test_the_error_to_expect_grows_by_what_the_data_did_not_see(pushed_campaign: tuple[Twin, Calibration]) -> None:
    twin, _ = pushed_campaign
    rng = np.random.default_rng(6)
    data = measure(twin, rng.uniform(LOW, HIGH, (60, 6)), 0.03e-3, rng)
    by_gravity = twin, calibrate("irb120", data, model="elastic", payload=twin.robot.payload)
    wrench = TargetWrench((), (), Wrench((0.0, HALF, 0.0)))
    for frames in (True, False):
        free, pushed = (with_forces(by_gravity, some, frames).corrections[0].expected for some in ((), (wrench,)))
        assert free is not None
        assert pushed is not None
        assert np.nanmean(pushed.after) > 10 * np.nanmean(free.after)


def read(tmp_path: Path, entries: str, head: str = FORCES) -> tuple[TargetWrench, ...]:
    file = tmp_path / "cell.yaml"
    file.write_text(head + entries)
    return read_wrenches(file)


def test_targets_count_before_tools_and_tools_before_all(tmp_path: Path) -> None:
    some = read(
        tmp_path,
        "  - {targets: [pHole1, 'pHole2*'], force: [0, 0, 80], moment: [0, 0, 1.5], frame: tool}\n"
        "  - {tools: [tProbe], force: [5, 0, 0]}\n",
    )
    program = plate(PLATE)
    (result,) = wrenches_of_targets([program], [*some, TargetWrench((), (), Wrench((1.0, 0.0, 0.0)))])
    by_name = dict(zip([target.name for target in program.targets], result, strict=True))
    assert by_name["pHole1"] == by_name["pHole2"] == Wrench((0.0, 0.0, 80.0), (0.0, 0.0, 1.5), "tool")
    tools = {target.name: target.tool for target in program.targets}
    assert by_name["pHole3"] == Wrench((5.0, 0.0, 0.0))
    assert all(by_name[n] == Wrench((1.0, 0.0, 0.0)) for n, tool in tools.items() if tool.lower() != "tprobe")
    assert wrenches_of_targets([program], []) == [(None,) * len(program.targets)]


PLAIN = HEAD + "wrenches:\n"


def test_units_are_those_of_the_file_and_what_is_no_wrench_is_refused(tmp_path: Path) -> None:
    head = FORCES.replace("N, moment: N m", "kN, moment: N mm")
    (one,) = read(tmp_path, "  - {tools: [tProbe], force: [0, 0, 0.08], moment: [0, 0, 1500]}\n", head)
    assert one.wrench.force[2] == pytest.approx(80.0)
    assert one.wrench.moment[2] == pytest.approx(1.5)
    for head, entry, words in (
        (HEAD, "", "the file has no wrenches"),
        (PLAIN, "{tools: [t], force: [0, 0, 8]}", "units.force: no unit of a force is given"),
        (PLAIN, "{tools: [t], moment: [0, 0, 8]}", "units.moment: no unit of a moment is given"),
        (FORCES, "{force: [0, 0, 8]}", "wrenches[1]: targets or tools belong here"),
        (FORCES, "{tools: [t], force: [0, 8]}", "wrenches[1].force"),
        (FORCES, "{tools: [t], force: [0, 0, .nan]}", "wrenches[1].force[3]: this is not a number"),
        (FORCES, "{tools: [t], force: [0, 0, 8N]}", "a number belongs here"),
        (FORCES, "{tools: [t], force: [0, 0, 8], frame: flange}", "wrenches[1]: there is no frame of this name"),
        (FORCES, "{tools: [t], force: [0, 0, 1e7]}", "too large to be plausible"),
        (FORCES, "{tool: [t], force: [0, 0, 8]}", "this entry is not known here"),
    ):
        with pytest.raises(InputError) as refusal:
            read(tmp_path, f"  - {entry}\n" if entry else "", head)
        assert words in str(refusal.value)
        assert "cell.yaml" in str(refusal.value)


def test_names_that_fit_nothing_or_twice_are_refused(tmp_path: Path) -> None:
    for entries, words in (
        (["{targets: [pHole99], force: [0, 0, 8]}"], "wrenches[1]: no target of the programs has this name"),
        (["{tools: [tProb], force: [0, 0, 8]}"], "no target of the programs has this tool; got 'tProb'"),
        (
            ["{targets: [pHole1], force: [0, 0, 8]}", "{targets: ['pHole*'], force: [0, 0, 9]}"],
            "two forces are given for one target; got 'pHole1'. It is in",
        ),
    ):
        with pytest.raises(InputError) as refusal:
            wrenches_of_targets([plate(PLATE)], read(tmp_path, "".join(f"  - {entry}\n" for entry in entries)))
        assert words in str(refusal.value)
        assert "cell.yaml, wrenches[" in str(refusal.value)


def test_too_many_different_forces_are_refused(
    pushed_campaign: tuple[Twin, Calibration], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every one is another robot, and takes a tenth of a second."""
    monkeypatch.setenv("TRUEARM_LIMITS", "wrenches=1")
    first, other = (TargetWrench((name,), (), Wrench((0.0, y, 0.0))) for name, y in (("pHole1", 5.0), ("pHole2", 6.0)))
    assert with_forces(pushed_campaign, (first,)).pushed
    with pytest.raises(InputError, match="there are too many different forces for one run; got '2 forces'"):
        with_forces(pushed_campaign, (first, other))


#: Deviation of readings [m] of calibrations that know little.
FINE = 2e-5


def far_from_the_plate(seed: int) -> tuple[Twin, Calibration]:
    """Return a calibration from postures within 3 deg of one on the other side of the robot."""
    rng = np.random.default_rng(seed)
    twin = truth_twin(load_robot("irb120"), "random", rng)
    middle = np.radians([130, -70, 40, rng.uniform(-120, 120), rng.uniform(-90, 90), 90])
    half = np.radians(3)
    return twin, truearm.calibrate(
        "irb120", measure(twin, rng.uniform(middle - half, middle + half, (60, 6)), FINE, rng), model="geometric"
    )


def stands(twin: Twin) -> np.ndarray:
    return np.asarray(twin.robot.base.matrix @ best_agreement(twin.robot)[0] @ plate(PLATE).frames["wobjPlate"].matrix)


def on_the_plate(twin: Twin, calibration: Calibration, folder: Path, **how: Any) -> ProgramCorrection:
    """Return the plate's program corrected, with the plate and the probe where they are."""
    frame = stands(twin)
    place, quaternion = (
        ", ".join(f"{v:.9f}" for v in values)
        for values in (frame[:3, 3] * 1e3, quaternion_from_rotation(frame[None, :3, :3])[0])
    )
    places = cell_file(
        folder,
        'tools:\n  tProbe: {of: flange, target: "1"}\n'
        f"frames:\n  wobjPlate: {{of: world, translation: [{place}], quaternion: [{quaternion}]}}\n",
    )
    options: dict[str, Any] = {"tools": places, "frames": places, "joint_targets": "correct"}
    return compensate(calibration.robot, [plate_file(folder)], **options, **how)


def missed_by(twin: Twin, done: ProgramCorrection) -> tuple[float, float]:
    """Return how far the twin is from the poses of the plate on average [m], with the original and the new program."""
    result = done.result.corrections[0]
    rows = [row for row, target in enumerate(result.program.targets) if target.form.kind == "pose"]
    meant = (stands(twin) @ result.before)[rows, :3, 3]
    tips = [
        twin.frames(commanded(done.robot, one)[rows])["1"][:, :3, 3] for one in (result.program, done.as_written()[0])
    ]
    before, after = (float(np.linalg.norm(tip - meant, axis=1).mean()) for tip in tips)
    return before, after


def test_a_program_that_would_get_worse_stays_as_it_was(tmp_path: Path) -> None:
    twin, calibration = far_from_the_plate(34)
    assert calibration.status.value == "converged"
    assert calibration.validation is not None
    assert calibration.validation.position_norms.mean() < 0.05e-3
    everything = on_the_plate(twin, calibration, tmp_path, accept=["not-better-here"])
    before, after = missed_by(twin, everything)
    assert after > 1.1 * before
    outcome = on_the_plate(twin, calibration, tmp_path)
    assert missed_by(twin, outcome)[1] == pytest.approx(before, rel=0.01)
    assert {"not-better-here", "narrow-data"} <= {notice.code for notice in outcome.warnings}
    (notice,) = [notice for notice in outcome.warnings if notice.code == "not-better-here"]
    assert "stay as before" in notice.message
    assert "outside of what was measured" in notice.message


def test_a_program_that_gets_better_is_corrected_all_the_same(tmp_path: Path) -> None:
    twin, calibration = far_from_the_plate(8)
    outcome = on_the_plate(twin, calibration, tmp_path)
    before, after = missed_by(twin, outcome)
    assert after < 0.2 * before
    assert outcome.files[0].corrected == outcome.files[0].targets
    assert "not-better-here" not in {notice.code for notice in outcome.warnings}
    assert outcome.files[0].expected is not None
    # It knows that it is not known to 0.03 mm here, as the held-out configurations would have it.
    assert 0.3e-3 < outcome.files[0].expected[1].mean() < 3e-3


def test_three_configurations_correct_nothing(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    twin = truth_twin(load_robot("irb120"), "random", rng)
    calibration = truearm.calibrate(
        "irb120", measure(twin, twin.robot.random_configurations(3, rng), FINE, rng), train="all", model="geometric"
    )
    with pytest.raises(InputError, match="got 'rank-loss'"):
        on_the_plate(twin, calibration, tmp_path)
