"""Programs corrected with good and bad calibrations of simulated robots: which get worse, and whether that is said.

Every case is a robot drawn from its priors, or at 0.3 or 3 times their size, half of them with hysteresis, backlash and
a gear that errs, which the model does not contain; a campaign that is narrow, far from the program, of few
configurations, or good; and a program, with or without measured tool and frame. Arguments: cases (200), first case (0).
Writes benchmarks/programs_on_twins.json beside a line for each case.
"""

from __future__ import annotations

import json
import math
import sys
import tempfile
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

import truearm
from truearm.compensation.program_correction import commanded
from truearm.engine.base.errors import InputError
from truearm.engine.command.split import refuse_unaccepted
from truearm.engine.data.dataset import Dataset
from truearm.engine.programs.fake_targets import matrices
from truearm.engine.programs.gauge import best_agreement
from truearm.engine.programs.program import Program, Source
from truearm.engine.programs.program_files import edited
from truearm.engine.programs.rapid import RAPID
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.branches import branch_rule
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform, quaternion_from_rotation
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure
from truearm.engine.twin.twin_joint import PERFECT

ROBOTS = ("irb120", "irb120", "lrmate200ic", "kr5", "puma560")
CAMPAIGNS = ("narrow", "far", "few", "full")
NOISE = 0.02e-3
FRAME = (0.31, -0.11, 0.06)
ACCEPTED = ("rank-loss", "not-converged", "implausible", "wrong-robot", "maker", "narrow-data")
#: Notices that name targets.
NAMED = ("not-better-here", "beyond-measured")
HERE = Path(__file__).parent


def main() -> None:
    count, first = (int(sys.argv[1]) if len(sys.argv) > 1 else 200), int(sys.argv[2]) if len(sys.argv) > 2 else 0
    cases = []
    for seed in range(first, first + count):
        cases.append(one(seed))
        print(seed, json.dumps(cases[-1]), flush=True)  # noqa: T201
    done = summed_up(cases)
    print(json.dumps(done, indent=1))  # noqa: T201
    (HERE / "programs_on_twins.json").write_text(json.dumps({"summary": done, "cases": cases}, indent=1) + "\n")


def one(seed: int) -> dict[str, Any]:
    """Return what became of one program."""
    rng = np.random.default_rng(seed)
    robot = load_robot(ROBOTS[seed % len(ROBOTS)])
    kind = CAMPAIGNS[seed // len(ROBOTS) % len(CAMPAIGNS)]
    size = float(rng.choice([0.3, 1.0, 1.0, 3.0]))
    worn, measured = bool(rng.integers(2)), bool(rng.integers(2))
    twin = drawn(robot, size, worn, rng)
    calibration = truearm.calibrate(robot, campaign(twin, kind, rng), train="all", model="geometric")
    made: dict[str, Any] = {"robot": robot.name, "campaign": kind, "size": size, "worn": worn, "measured": measured}
    made |= {"status": calibration.status.value}
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "program.mod"
        program.write_text(poses_somewhere(robot, rng))
        cell = in_the_cell(twin, calibration.robot, Path(folder) / "cell.yaml", rng) if measured else None
        where = {} if cell is None else {"tools": cell, "frames": cell}
        try:
            refuse_unaccepted(calibration.robot, ())
            made["refused"] = None
        except InputError as error:
            made["refused"] = str(error.came)
        for name, accept in (("judged", ACCEPTED), ("all", (*ACCEPTED, "not-better-here"))):
            done = truearm.compensate(calibration.robot, [program], accept=accept, **where)
            found = done.result.corrections[0]
            poses = np.array([target.form.kind == "pose" for target in found.program.targets])
            rows = np.flatnonzero(poses & np.isfinite(found.expected.before)) if found.expected else np.zeros(0, int)
            if len(rows) < 4:
                return made | {"true": None}
            text = edited(found.program.sources[0].text, found.edits)
            after = RAPID.read([Source(program, text)])
            misses = [missed(twin, calibration.robot, p, found.before, rows, measured) for p in (found.program, after)]
            made["before"], made[name] = (round(float(m.mean()) * 1e3, 4) for m in misses)
            made[f"expected_{name}"] = round(float(done.files[0].expected[1].mean()) * 1e3, 4)
            made["expected"] = [
                round(float(np.mean(v[rows])) * 1e3, 4) for v in (found.expected.before, found.expected.after)
            ]
            spans = done.files[0].intervals
            made[f"interval_{name}"] = [round(1e3 * v, 4) for v in spans[1]] if spans else None
            if name == "judged":
                made["kept"] = int(sum(not found.corrected[row] for row in rows))
                made["targets"] = len(rows)
                made["said"] = [n.code for n in done.warnings if n.code in (*NAMED, *ACCEPTED)]
            if not made["kept"]:
                made["all"] = made["judged"]
                break
    return made


def drawn(robot: Robot, size: float, worn: bool, rng: np.random.Generator) -> Twin:
    """Return a twin with errors so many times as large as its priors say."""
    twin = truth_twin(robot, "random", rng)
    values = {
        p.name: p.nominal + size * (p.value - p.nominal)
        for p in twin.robot.parameters.values()
        if p.group in ("geometry", "joint zero")
    }
    twin = replace(twin, robot=twin.robot.with_values(values))
    if not worn:
        return twin
    joints = {
        number: replace(twin.joints.get(number, PERFECT), hysteresis=math.radians(0.004), backlash=math.radians(0.004))
        for number in range(1, 7)
    }
    joints[2] = replace(joints[2], gear=((240, math.radians(0.006), 0.4),))
    return replace(twin, joints=joints)


def limits(robot: Robot) -> Array:
    """Return where joints are in programs, ``(2, joints)``: 0.8 of their range, and of half a turn at most."""
    low, high = np.array([joint.limits or (-math.pi, math.pi) for joint in robot.joints]).T
    middle, half = (low + high) / 2, np.minimum((high - low) / 2, math.pi)
    return np.array([middle - 0.8 * half, middle + 0.8 * half])


def campaign(twin: Twin, kind: str, rng: np.random.Generator) -> Dataset:
    """Return readings of a campaign of some kind."""
    low, high = limits(twin.robot)
    count = 60
    if kind == "narrow":
        middle, half = (low + high) / 2 + np.radians([10, 20, 10, 20, 40, 10]), math.radians(rng.choice([1, 3, 5, 15]))
        low, high = middle - half, middle + half
    elif kind == "far":
        middle, half = rng.uniform(low, high), math.radians(rng.choice([5, 15, 30]))
        low, high, count = middle - half, middle + half, int(rng.choice([10, 20, 60]))
    elif kind == "few":
        count = int(rng.integers(3, 10))
    return measure(twin, rng.uniform(low, high, (count, 6)), NOISE, rng)


def poses_somewhere(robot: Robot, rng: np.random.Generator) -> str:
    """Return a program: near to some posture, in paths of straight moves, or all over the workspace, or the plate."""
    if robot.name == "irb120" and rng.random() < 0.4:
        return (files("truearm.starting.examples") / "plate.mod").read_text()
    low, high = limits(robot)
    middle, spread = rng.uniform(low, high), math.radians(rng.choice([5, 15, 180]))
    joints = rng.uniform(np.maximum(low, middle - spread), np.minimum(high, middle + spread), (24, 6))
    tool, frame = np.eye(4), np.eye(4)
    tool[2, 3], frame[:3, 3] = 0.125, FRAME
    base, flange = robot.controller.base.matrix, robot.controller.flange.matrix
    poses = np.linalg.inv(base @ frame) @ matrices(robot.rigid, joints) @ flange @ tool
    quadrants = np.floor(np.degrees(robot.controller.from_model(joints)[:, [0, 3, 5]]) / 90).astype(int)
    rule = branch_rule(robot)
    elbows = np.zeros(24, int) if rule is None else rule.numbers(robot.rigid.forward_kinematics(joints)) & 2
    lines = [
        f"    Move{'J' if i % 6 == 0 else 'L'} [[{x:.2f},{y:.2f},{z:.2f}],[{','.join(f'{v:.7f}' for v in q)}],"
        f"[{a},{b},{c},{elbow}],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tProbe\\WObj:=wobjPlate;"
        for i, ((x, y, z), q, (a, b, c), elbow) in enumerate(
            zip(
                poses[:, :3, 3] * 1e3,
                quaternion_from_rotation(poses[:, :3, :3]),
                quadrants,
                elbows.tolist(),
                strict=True,
            )
        )
    ]
    head, _ = (files("truearm.starting.examples") / "plate.mod").read_text().split("  CONST jointtarget")
    return f"{head}  PROC main()\n" + "\n".join(lines) + "\n  ENDPROC\nENDMODULE\n"


def stands(twin: Twin) -> Array:
    """Return where the work object truly stands in the world, ``(4, 4)``."""
    frame = np.eye(4)
    frame[:3, 3] = FRAME
    base = twin.robot.controller.base.matrix
    return np.asarray(twin.robot.base.matrix @ best_agreement(twin.robot)[0] @ base @ frame)


def in_the_cell(twin: Twin, robot: Robot, path: Path, rng: np.random.Generator) -> Path:
    """Write where a tracker sees the work object; the tip of the tool is target 1."""
    frame = stands(twin)
    place = ", ".join(f"{v * 1e3:.4f}" for v in frame[:3, 3] + NOISE / 3 * rng.standard_normal(3))
    quaternion = ", ".join(f"{v:.9f}" for v in Transform.from_matrix(frame[:3, :3], frame[:3, 3]).quaternion)
    path.write_text(
        "truearm: truearm-cell/1\nunits: {length: mm, angle: deg}\n"
        f'tools:\n  tProbe: {{of: flange, target: "{robot.targets[0].name}"}}\n'
        f"frames:\n  wobjPlate: {{of: world, translation: [{place}], quaternion: [{quaternion}]}}\n"
    )
    return path


def missed(twin: Twin, robot: Robot, program: Program, meant: Array, rows: Array, measured: bool) -> Array:
    """Return how far the tip of the twin is from its targets [m]; where nothing was measured, after the best fit.

    Then the tool is the nominal one, on the twin's own flange.
    """
    frames = twin.frames(commanded(robot, program)[rows])[twin.robot.targets[0].name]
    if measured:
        return np.asarray(np.linalg.norm(frames[:, :3, 3] - (stands(twin) @ meant[rows])[:, :3, 3], axis=1))
    target = [twin.robot.values[twin.robot.targets[0].parameter(axis)] for axis in "xyz"]
    flange = frames.copy()
    flange[:, :3, 3] -= frames[:, :3, :3] @ target
    tool = twin.robot.controller.flange.matrix @ program.tools["tProbe"].matrix
    tips = (flange @ tool)[:, :3, 3]
    a, b = tips - tips.mean(axis=0), meant[rows, :3, 3] - meant[rows, :3, 3].mean(axis=0)
    u, _, vt = np.linalg.svd(a.T @ b)
    return np.asarray(np.linalg.norm(a @ (u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt) - b, axis=1))


def _inside(true: float, interval: list[float]) -> bool:
    """Return whether a true error lies in an interval."""
    return interval[0] <= true <= interval[1]


def summed_up(cases: list[dict[str, Any]]) -> dict[str, Any]:
    """Return how many programs got worse, and what was said of them."""
    known = [case for case in cases if "judged" in case]
    used = [case for case in known if not case["refused"]]
    worse = [case for case in used if case["judged"] > 1.1 * case["before"]]
    full = [case for case in used if case["campaign"] == "full"]
    return {
        "cases": len(known),
        "refused": len(known) - len(used),
        "refused_that_would_have_got_worse": sum(c["all"] > 1.1 * c["before"] for c in known if c["refused"]),
        "worse_without_judging": sum(case["all"] > 1.1 * case["before"] for case in known),
        "worse": len(worse),
        "worse_and_no_notice": sum(not case["said"] for case in worse),
        "worse_and_no_target_named": sum(not {*NAMED} & {*case["said"]} for case in worse),
        "full_campaigns_with_a_notice": sum(bool({*NAMED} & {*c["said"]}) for c in full),
        "kept_targets_of_full_campaigns": [sum(c["kept"] for c in full), sum(c["targets"] for c in full)],
        "full_campaigns_judged_and_all_mm": [float(np.mean([c[n] for c in full])) for n in ("judged", "all")],
        "corrected": len(used),
        "inside_interval": sum(bool(c["interval_judged"]) and _inside(c["judged"], c["interval_judged"]) for c in used),
        "within_factor_2": sum(0.5 < c["judged"] / c["expected_judged"] < 2.0 for c in used),
        "true_over_expected_before_median": float(np.median([c["before"] / c["expected"][0] for c in known])),
        "true_over_expected_after_median": float(np.median([c["all"] / c["expected"][1] for c in known])),
    }


if __name__ == "__main__":
    main()
