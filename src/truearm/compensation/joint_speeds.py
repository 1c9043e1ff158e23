"""How fast joint motions may be: shares of the joints' speed at 100 % that keep a tip, and every joint, to a limit.

Where the robot file says how fast a joint goes at 100 %, that is taken. Where it does not, both limits are kept for
all arms between slow and fast ones: the speed of the tip for the fastest, where a language says shares, and the share
of the joints' speed for the slowest, where it says times or speeds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Final

import numpy as np

from truearm.compensation.programs.urscript.measuring import FASTEST
from truearm.modeling.chain import Array
from truearm.modeling.inverse.kinematics import reach
from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.units import from_si

#: At 100 % no joint of an arm is faster than this: of the first three, and of the others [rad/s], nor do they turn the
#: stretched arm faster [m/s]. Above all that the library knows of; the fastest are FANUC LR Mate 200iD, Yaskawa GP8,
#: Staubli TX2-60L and TX2-90XL.
_FAST: Final = ((math.radians(600.0), 15.0), (math.radians(1600.0), math.radians(2500.0)))
#: At 100 % no joint is slower, of an arm of this length stretched [m] and of longer ones [rad/s]: assumed.
_SLOW: Final = (2.0, math.radians(100.0), math.radians(50.0))
#: The same of sliding joints: the slowest and the fastest [m/s].
_SLIDING: Final = (0.2, 5.0)
_FIRST_JOINTS: Final = 3
#: The finest share that a language says; URScript says a speed instead.
_FINEST: Final = {"KRL": 0.01, "FANUC LS": 0.01, "URScript": 1e-4 / FASTEST}
_FINEST_ELSEWHERE: Final = 1e-4
#: A way is looked at in steps of no more [rad or m].
_STEP: Final = math.radians(3.0)


def stated_speeds(robot: Robot) -> list[float | None]:
    """Return how fast each joint goes at 100 % [rad/s or m/s], as far as that can be relied on.

    Velocities of a URDF cannot: many stand for nothing, and a program that trusts too low ones is too fast.
    """
    return [None if robot.convention_name == "urdf" else joint.max_speed for joint in robot.joints]


def known_speeds(robot: Robot) -> tuple[float, ...] | None:
    """Return how fast every joint goes at 100 % [rad/s or m/s]; None if the robot file does not say it of each."""
    known = tuple(speed for speed in stated_speeds(robot) if speed is not None)
    return known if len(known) == len(robot.joints) else None


def joint_rates(robot: Robot) -> tuple[Array, Array]:
    """Return how fast the joints go at 100 %, at least and at most [rad/s, m/s], ``(joints,)`` each.

    Both are the joint's own speed where it is known, else bounds for arms of its length.
    """
    length = max(reach(robot, None), 0.1)
    slowest = _SLOW[1] if length <= _SLOW[0] else _SLOW[2]
    fastest = [min(rate, along / length) for rate, along in _FAST]
    slow, fast = [], []
    for k, (joint, stated) in enumerate(zip(robot.joints, stated_speeds(robot), strict=True)):
        bounds = (slowest, fastest[k >= _FIRST_JOINTS]) if joint.kind == "revolute" else _SLIDING
        low, high = bounds if stated is None else (stated, stated)
        slow.append(low)
        fast.append(high)
    return np.array(slow), np.array(fast)


def joint_shares(
    robot: Robot, language: str, ways: Array, shown: Array, share: float, speed: float
) -> tuple[float, float]:
    """Return the share that a motion of all joints has, and the highest speed of a point of the arm in it [m/s].

    That is higher than was asked for where the language has no share low enough for the fastest joints.

    Parameters
    ----------
    language
        Its name; languages say speeds in different ways.
    ways
        Joint positions of the model at both ends ``(2, joints)`` [rad or m].
    shown
        The same as the controller shows them.
    share
        Of the joints' speed, at most.
    speed
        Of no target and of the flange is higher [m/s].
    """
    along = fastest_point(robot, ways)
    least, most = turned(ways, shown)
    _, fast = joint_rates(robot)
    if language == "URScript":
        share = _leading_share(robot, most, share)
        fast = np.full(len(least), FASTEST)
    leading = float((least / fast).max())
    said = said_share(share if along <= 0 else min(share, speed * leading / along), language)
    return said, along * said / leading if leading > 0 else 0.0


def first_share(robot: Robot, language: str, share: float, speed: float) -> float:
    """Return the share of a motion that begins nobody knows where, as :func:`joint_shares`."""
    _, fast = joint_rates(robot)
    if language == "URScript":
        share = _leading_share(robot, np.ones(len(fast)), share)
        fast = np.full(len(fast), FASTEST)
    return said_share(min(share, speed / _fastest_anywhere(robot, fast)), language)


def said_share(share: float, language: str) -> float:
    """Return a share as a language says it: no larger, unless it has none so small."""
    finest = _FINEST.get(language, _FINEST_ELSEWHERE)
    return max(math.floor(share / finest + 1e-9), 1) * finest


def turned(ways: Array, shown: Array) -> tuple[Array, Array]:
    """Return how far the joints go at least and at most ``(joints,)`` [rad or m].

    A joint that the controller counts together with another goes one way in its count and another in the model's, and
    nobody says to which of them its speed belongs.
    """
    both = np.abs([ways[1] - ways[0], shown[1] - shown[0]])
    return both.min(axis=0), both.max(axis=0)


def fastest_point(robot: Robot, ways: Array) -> float:
    """Return how fast the fastest of the targets and the flange goes, in the whole way of a move [m]."""
    count = max(2, math.ceil(float(np.abs(np.diff(ways, axis=0)).max()) / _STEP) + 1)
    share = np.linspace(0.0, 1.0, count)[:, None]
    along = (1.0 - share) * ways[0] + share * ways[1]
    fastest = 0.0
    for name in (None, *(target.name for target in robot.targets)):
        steps = np.diff(robot.forward(along, target=name)[0], axis=0)
        fastest = max(fastest, float(np.linalg.norm(steps, axis=1).max()) * (count - 1))
    return fastest


def speed_words(speeds: Sequence[float], robot: Robot) -> str:
    """Return the speeds of joints in words, in deg/s and mm/s."""
    units = ["deg" if joint.kind == "revolute" else "mm" for joint in robot.joints]
    numbers = [f"{from_si(speed, unit):.0f}" for speed, unit in zip(speeds, units, strict=True)]
    same = len(set(units)) == 1
    text = ", ".join(numbers if same else [f"{n} {unit}/s" for n, unit in zip(numbers, units, strict=True)])
    return f"{text} {units[0]}/s" if same else text


def speed_notices(robot: Robot, assumed: str) -> list[Notice]:
    """Return what is to be said of the joints' speed.

    Parameters
    ----------
    assumed
        What was taken where it is not known, in words.
    """
    stated = zip(robot.joints, stated_speeds(robot), strict=True)
    unknown = [joint.name for joint, speed in stated if speed is None]
    if not unknown:
        return []
    some = len(unknown) < len(robot.joints)
    of = f"{', '.join(unknown)} go" if some else f"the joints of {robot.name} are"
    words = f"How fast {of} at 100 % is not known: {assumed}."
    if any(joint.max_speed is not None for joint in robot.joints) and not some:
        words += (
            " The velocities of the URDF are not relied on, as many stand for nothing: compare them with the maker's "
            "data sheet, and convert the robot into another convention."
        )
    return [Notice("joint-speed-assumed", words, "note")]


def _leading_share(robot: Robot, most: Array, share: float) -> float:
    """Return the share of :data:`FASTEST` at which no joint has more than a share of its speed at 100 %.

    URScript says the speed of the joint that goes farthest, and the others go in proportion.
    """
    top = np.array([FASTEST if speed is None else speed for speed in stated_speeds(robot)])
    longest = float((most / top).max())
    return share if longest <= 0.0 else share * float(most.max()) / (FASTEST * longest)


def _fastest_anywhere(robot: Robot, rates: Array) -> float:
    """Return what neither a target nor the flange exceeds with joints of these rates, wherever the arm is [m/s]."""
    fastest = 0.0
    for name in (None, *(target.name for target in robot.targets)):
        kinematics = robot.rigid.forward_kinematics(np.zeros((1, len(robot.joints))), name)
        places = [i for i, element in enumerate(kinematics.elements) if element.variable is not None]
        points = [*(kinematics.origin(i)[:, 0] for i in places), kinematics.position[:, 0]]
        lengths = [float(np.linalg.norm(b - a)) for a, b in pairwise(points)]
        lengths = [
            length + (0.0 if joint.kind == "revolute" else max(map(abs, joint.range)))
            for length, joint in zip(lengths, robot.joints, strict=True)
        ]
        far = np.cumsum(lengths[::-1])[::-1]
        turns = np.array([joint.kind == "revolute" for joint in robot.joints])
        fastest = max(fastest, float((rates * np.where(turns, far, 1.0)).sum()))
    return max(fastest, 1e-6)
