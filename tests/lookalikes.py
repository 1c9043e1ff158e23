"""Pairs of arms that look alike, and are not the same: the one that is measured, and the one whose file is given."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure


def sized(like: str, name: str, **lengths: float) -> Robot:
    """Return an arm built like one of the library, with the lengths of its own data sheet [mm]: ``a_3=455``."""
    robot = load_robot(like)
    joints = list(robot.joints)
    for parameter, length in lengths.items():
        column, number = parameter.split("_")
        joint = joints[int(number) - 1]
        joints[int(number) - 1] = replace(joint, row={**joint.row, column: length / 1e3})
    return replace(robot, name=name, title=name, joints=tuple(joints), masses=(), tools={}, truths={})


# Universal Robots, "DH parameters for calculations of kinematics and dynamics"; CB3 user manual (UR3).
UR3: Final = sized("ur10", "ur3", d_1=151.9, a_2=-243.65, a_3=-213.25, d_4=112.35, d_5=85.35, d_6=81.9)
UR3E: Final = sized("ur10", "ur3e", d_1=151.85, a_2=-243.55, a_3=-213.2, d_4=131.05, d_5=85.35, d_6=92.1)
UR5E: Final = sized("ur10", "ur5e", d_1=162.5, a_2=-425.0, a_3=-392.2, d_4=133.3, d_5=99.7, d_6=99.6)
UR16E: Final = sized("ur10", "ur16e", d_1=180.7, a_2=-478.4, a_3=-360.0, d_4=174.15, d_5=119.85, d_6=116.55)
# FANUC, LR Mate 200iD; KUKA, KR 6 R700 and R900 sixx; ABB, IRB 1600-6/1.2: data sheets.
LRMATE_ID: Final = sized("lrmate200ic", "lrmate200id", d_1=330.0, a_2=50.0, a_3=330.0, a_4=35.0, d_4=335.0, d_6=80.0)
KR6_R700: Final = sized("irb1600", "kr6r700", d_1=400.0, a_2=25.0, a_3=315.0, a_4=35.0, d_4=365.0, d_6=80.0)
KR6_R900: Final = sized("irb1600", "kr6r900", d_1=400.0, a_2=25.0, a_3=455.0, a_4=35.0, d_4=420.0, d_6=80.0)
IRB1600_12: Final = sized("irb1600", "irb1600-12", a_3=475.0)

#: The arm that is measured, and the one whose file is given.
PAIRS: Final = (
    (load_robot("ur10e"), load_robot("ur10")),
    (load_robot("ur10"), load_robot("ur10e")),
    (UR5E, load_robot("ur5")),
    (load_robot("ur5"), UR5E),
    (UR3E, UR3),
    (UR3, UR3E),
    (UR16E, load_robot("ur10e")),
    (LRMATE_ID, load_robot("lrmate200ic")),
    (KR6_R900, KR6_R700),
    (IRB1600_12, load_robot("irb1600")),
)


def campaign_of(robot: Robot, poses: int, seed: int, *, targets: int = 3, noise: float = 5e-5) -> tuple[Twin, Dataset]:
    """Return a twin of an arm, drawn from its priors, and what an instrument read of so many of its targets."""
    rng = np.random.default_rng(seed)
    twin = truth_twin(robot, "random", rng)
    tool = {t.name: [twin.robot.values[t.parameter(a)] for a in "xyz"] for t in twin.robot.targets[:targets]}
    twin = replace(twin, robot=twin.robot.with_frames(twin.robot.base, tool))
    return twin, measure(twin, robot.random_configurations(poses, rng), noise, rng)
