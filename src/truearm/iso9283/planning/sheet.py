"""The sheet of tests by ISO 9283: what is measured where and how often, and what to write down beside it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from truearm.engine.document.document import Document, Section, answer, pictured, tabled
from truearm.engine.document.planning_figures import pose_cube
from truearm.engine.motion.largest_cube import PosePlan
from truearm.engine.robot.transform import quaternion_from_rotation
from truearm.iso9283.planning.criteria import TESTS, PerformancePlan, Way, visited

if TYPE_CHECKING:
    from truearm.engine.document.drawing import Figure
    from truearm.iso9283.planning.result import Iso9283Plan

#: What the standard asks to be noted with the results, and what a reader of them needs.
_NOTED = (
    "Date, place, operator",
    "Robot: serial number, hours in use, controller and its software",
    "Tool and load: mass, centre of mass",
    "Instrument: serial number, calibrated when, standard deviation of a reading",
    "How the instrument was tied to the robot's base",
    "Warm-up: how long, with which motion (none before the test of drift)",
    "Temperature of the room: at the beginning, at the end",
    "Slow run of every program at 10 % completed: when, by whom",
)


def iso9283_sheet(planned: Iso9283Plan) -> str:
    """Return the sheet."""
    plan = planned.plan
    words = [
        *planned.answer,
        _tip(plan),
        "The rows of different criteria are never evaluated together: measure each of them.",
        "Run every program at 10 % of the velocity first, from the first motion to the last, with nobody in reach of "
        "the robot, and note that it was completed. Only then run it faster.",
        "The tests follow ISO 9283:1998 as the literature describes it. Who wants to claim conformity needs the "
        "standard's own text.",
    ]
    cube = "The cube, its diagonal planes, P1 to P5 and the paths. Tails show from where the tip's z axis comes."
    return Document(
        f"Tests of {plan.robot.title} by ISO 9283",
        [
            answer(words, planned.warnings),
            _tests(plan),
            *_orders(plan),
            _poses(plan),
            tabled("To note", ("What", ""), tuple((heading, "_" * 40) for heading in _NOTED)),
            pictured("cube", "Where the poses and paths lie", cube, _cube(plan)),
        ],
        planned.command,
        subtitle="What to measure, in which order, and what to note.",
    ).html(planned)


def _cube(plan: PerformancePlan) -> Figure:
    named = [plan.poses[f"P{k}"] for k in range(1, 6) if f"P{k}" in plan.poses]
    positions = np.array([pose.position for pose in named])
    tips = np.array([pose.rotation[:, 2] for pose in named])
    joints = np.array([pose.joints for pose in named])
    drawn = PosePlan(plan.cube, positions, tips, (plan.plane,) * len(named), joints, plan.target)
    paths = {name: Way(path).position(Way(path).evenly(60)) for name, path in plan.paths.items()}
    return pose_cube(drawn, paths)


def _tests(plan: PerformancePlan) -> Section:
    rows = []
    for test in plan.tests:
        known = TESTS[test.id]
        places = ", ".join((*test.places, *test.approaches))
        percent = (", ".join(f"{100 * v:g}" for v in shares) for shares in (test.velocities, test.loads))
        rows.append((f"{', '.join(known.criteria)}: {known.name}", places, str(test.cycles), *percent, "________"))
    heading = ("Criteria and test", "Where", "Cycles", "Velocity [%]", "Load [%]", "Done")
    return tabled("Tests", heading, tuple(rows))


def _tip(plan: PerformancePlan) -> str:
    if plan.target is None:
        return "The flange itself is measured: poses are those of its middle."
    x, y, z = (f"{1e3 * v:.3f}" for v in plan.robot.tool_place(plan.target).translation)
    return f"What is measured is the tip {plan.target}, at x {x}, y {y}, z {z} mm in the flange frame."


def _orders(plan: PerformancePlan) -> list[Section]:
    """Return the order in which a program drives the poses of a cycle, for whoever writes down the readings."""
    rows = [(test.id, ", ".join(visited(test))) for test in plan.tests if visited(test)]
    heading = ("Test", "Poses of a cycle, in the order in which programs drive them")
    return [tabled("Order of the poses", heading, tuple(rows))] if rows else []


def _poses(plan: PerformancePlan) -> Section:
    rows = []
    for pose in plan.poses.values():
        turned = quaternion_from_rotation(pose.rotation[None])[0]
        rows.append((pose.name, *(f"{v * 1e3:.3f}" for v in pose.position), *(f"{v + 0.0:.6f}" for v in turned)))
    heading = ("Pose", "x [mm]", "y [mm]", "z [mm]", "qw", "qx", "qy", "qz")
    return tabled("Poses in the robot's base frame", heading, tuple(rows))
