"""How fast joint motions may be: shares of the joints' speed at 100 % that keep a tip, and every joint, to a limit.

Where the robot file says how fast a joint goes at 100 %, that is taken. Where it does not, both limits are kept for
all arms between slow and fast ones: the speed of the tip for the fastest, where a language says shares, and the share
of the joints' speed for the slowest, where it says times or speeds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise, product
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError, Notice, Rule
from truearm.engine.base.units import from_si
from truearm.engine.programs.urscript.new import FASTEST
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.kinematics import reach
from truearm.engine.robot.robot import Robot

# Programs for a controller of which nobody said how it counts the joints: what is refused, and what is said.
#
# FANUC's controllers count the third joint together with the second (:mod:`truearm.engine.robot.controller`), which no
# table of link parameters can say: there the model's joint positions are wrong by the second joint, often by tens of
# degrees.

#: Languages of controllers that are known to count joints together.
_COUNTED_TOGETHER: Final = ("FANUC LS",)
#: What stands in a program with joint positions of the model, in comments of 32 characters at most.
ASSUMED: Final = ("Joint counting is not known:", "compare joints with the pendant")


def refuse_unknown_counts(robot: Robot, language: str) -> None:
    """Refuse a program with joint positions for controllers that are known to count otherwise than a model can.

    Raises:
        InputError: If the robot file does not say how its controller counts, and the language is of such controllers.
    """
    if robot.controller.counts_known or language not in _COUNTED_TOGETHER:
        return
    raise InputError(
        f"it is not known how the controller of {robot.name} counts its joints, and controllers that run "
        f"{language} count joint 3 together with joint 2: the model's joint positions would drive the arm elsewhere",
        parameter="program",
        where=robot.name,
        allowed="a robot file with the entry controller",
        cure="State under controller, joints, how it counts, as {joint: axis_3, sign: -1, coupling: {axis_2: 1}}, "
        "and compare with the pendant; or, under controller, the source that says it counts as the model does.",
    )


CONTROLLER_COUNTS_ASSUMED: Final = Rule(
    "controller-counts-assumed",
    "warning",
    "the robot file does not say how the controller counts the joints: the program has the model's",
    cure="Compare them with the pendant before anything moves, and say under controller in the robot file how it "
    "counts.",
)


def counts_notices(robot: Robot) -> list[Notice]:
    """Return what is to be said of a program for a robot whose controller's counting is not known."""
    if robot.controller.counts_known:
        return []
    return [
        CONTROLLER_COUNTS_ASSUMED(
            f"It is not known how the controller of {robot.name} counts its joints: the program has the model's "
            "joint positions."
        )
    ]


def counts_comments(robot: Robot) -> tuple[str, ...]:
    """Return the same for the comments of a program."""
    return () if robot.controller.counts_known else ASSUMED


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
#: A bound of a speed is above what was found by no more than this share, of speeds that are no smaller a share of what
#: the stretched arm could have.
_OVER: Final = 2e-3
_SHARE_OF_BOUND: Final = 0.02
#: Configurations that a search for the fastest looks at in each round, and how far it goes from the best in the next
#: ones, in ranges of the joints; what it finds is taken for less than there is.
_SEARCHED: Final = 1000
_NARROWER: Final = (0.1, 0.05, 0.02, 0.01)
_SEARCH_MARGIN: Final = 1.03
#: Of joints for derivatives [rad or m].
_NUDGE: Final = 1e-5


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

    Args:
        language: Its name; languages say speeds in different ways.
        ways: Joint positions of the model at both ends ``(2, joints)`` [rad or m].
        shown: The same as the controller shows them.
        share: Of the joints' speed, at most.
        speed: Of no target and of the flange is higher [m/s].
    """
    along = fastest_point(robot, ways)
    least, most = turned(ways, shown)
    _, fast = joint_rates(robot)
    if language == "URScript":
        share = _leading_share(robot, most, share)
        fast = np.full(len(least), FASTEST)
    leading = float((least / fast).max())
    written = written_share(share if along <= 0 else min(share, speed * leading / along), language)
    return written, along * written / leading if leading > 0 else 0.0


def first_share(robot: Robot, language: str, share: float, speed: float) -> float:
    """Return the share of a motion that begins nobody knows where, as :func:`joint_shares`."""
    return first_shares(robot, language, share, speed)[0]


def first_shares(robot: Robot, language: str, share: float, speed: float) -> tuple[float, float]:
    """Return the share of a motion that begins nobody knows where, and what no point of the arm exceeds in it [m/s].

    That is higher than was asked for where the language has no share so low.
    """
    _, fast = joint_rates(robot)
    if language == "URScript":
        share = _leading_share(robot, np.ones(len(fast)), share)
        fast = np.full(len(fast), FASTEST)
    # In the model's count a joint may go as fast as all that its controller counts together.
    together = np.abs(np.linalg.inv(robot.controller.coupling(len(fast))))
    rates = np.maximum(fast, together @ fast)
    anywhere = _fastest_anywhere(robot, rates)
    written = written_share(min(share, speed / anywhere), language)
    if anywhere * written > speed:  # no lower share can be said: see whether the arm could go so fast at all
        anywhere = min(anywhere, _SEARCH_MARGIN * _fastest_sampled(robot, rates))
    return written, anywhere * written


def written_share(share: float, language: str) -> float:
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
    """Return what none of the targets and the flange exceeds on the way of a move, in the whole way in a unit of time.

    A bound [m], at most some tenths of a percent above the highest speed where that matters. The mean velocity of a
    step is that in its middle to within ``h^2 / 24`` of the largest third derivative of the position, where h is the
    step, and so is what lies between two middles to within ``h^2 / 8`` of that of the straight line between theirs.

    Args:
        ways: Joint positions at both ends ``(2, joints)`` [rad or m].
    """
    return max(_fastest_of(robot, ways, name) for name in (None, *(target.name for target in robot.targets)))


def _fastest_of(robot: Robot, ways: Array, target: str | None) -> float:
    """Return the bound of :func:`fastest_point` for one target, or the flange."""
    moved = np.abs(ways[1] - ways[0])
    turns = np.array([joint.kind == "revolute" for joint in robot.joints])
    # Before each link turn the joints up to its own; a link grows and shrinks with the joint that slides.
    turned = np.cumsum(np.where(turns, moved, 0.0))
    lengths, slid = _link_lengths(robot, target, ways), np.where(turns, 0.0, moved)
    third = float((lengths * turned**3 + 3.0 * slid * turned**2).sum())
    bound = float((lengths * turned + slid).sum())
    if bound <= 0.0:
        return 0.0
    rigid, count = robot.rigid, 2
    while True:
        share = np.linspace(-1.0, count + 1.0, count + 3)[:, None] / count
        places = rigid.forward_kinematics((1.0 - share) * ways[0] + share * ways[1], target).position
        along = float(np.linalg.norm(np.diff(places), axis=0).max()) * count
        over = third / (6.0 * count**2)
        if over <= _OVER * max(along, _SHARE_OF_BOUND * bound):
            return along + over
        wanted = math.sqrt(third / (6.0 * _OVER * max(along, _SHARE_OF_BOUND * bound)))
        count = max(2 * count, math.ceil(wanted))


def _link_lengths(robot: Robot, target: str | None, ways: Array) -> Array:
    """Return how long the links are at most on a way, each from its joint to the next, ``(joints,)`` [m]."""
    kinematics = robot.rigid.forward_kinematics(ways, target)
    places = [i for i, element in enumerate(kinematics.elements) if element.variable is not None]
    points = [*(kinematics.origin(i) for i in places), kinematics.position]
    lengths = [np.linalg.norm(after - before, axis=0).max() for before, after in pairwise(points)]
    return np.array(lengths)


def speed_words(speeds: Sequence[float], robot: Robot) -> str:
    """Return the speeds of joints in words, in deg/s and mm/s."""
    units = ["deg" if joint.kind == "revolute" else "mm" for joint in robot.joints]
    numbers = [f"{from_si(speed, unit):.0f}" for speed, unit in zip(speeds, units, strict=True)]
    same = len(set(units)) == 1
    text = ", ".join(numbers if same else [f"{n} {unit}/s" for n, unit in zip(numbers, units, strict=True)])
    return f"{text} {units[0]}/s" if same else text


JOINT_SPEED_ASSUMED: Final = Rule(
    "joint-speed-assumed",
    "note",
    "the language says no share of the joints' speed, or that speed is not known; the message tells what joint "
    "motions have instead",
    gravity=0,
)


def speed_notices(robot: Robot, assumed: str) -> list[Notice]:
    """Return what is to be said of the joints' speed.

    Args:
        assumed: What was taken where it is not known, in words.
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
    return [JOINT_SPEED_ASSUMED(words)]


def _leading_share(robot: Robot, most: Array, share: float) -> float:
    """Return the share of :data:`FASTEST` at which no joint has more than a share of its speed at 100 %.

    URScript says the speed of the joint that goes farthest, and the others go in proportion.
    """
    top = np.array([FASTEST if speed is None else speed for speed in stated_speeds(robot)])
    longest = float((most / top).max())
    return share if longest <= 0.0 else share * float(most.max()) / (FASTEST * longest)


def _fastest_sampled(robot: Robot, rates: Array) -> float:
    """Return how fast the fastest of the targets and the flange goes with joints of these rates, by a search [m/s]."""
    rng, fastest, count = np.random.default_rng(0), 0.0, len(rates)
    signs = np.array([[1.0, *other] for other in product((-1.0, 1.0), repeat=count - 1)])
    low, high = np.array([joint.range for joint in robot.joints]).T
    for name in (None, *(target.name for target in robot.targets)):
        at = rng.uniform(low, high, (_SEARCHED, count))
        for width in (0.0, *_NARROWER):
            at = np.clip(at + width * (high - low) * rng.normal(size=at.shape), low, high)
            moves = np.stack(
                [
                    robot.rigid.forward(at + step, target=name)[0] - robot.rigid.forward(at - step, target=name)[0]
                    for step in _NUDGE * np.eye(count)
                ],
                axis=1,
            )
            moves *= (rates / (2.0 * _NUDGE))[:, None]
            speeds = np.linalg.norm(np.einsum("sj,njk->nsk", signs, moves), axis=2).max(axis=1)
            fastest = max(fastest, float(speeds.max()))
            best = at[np.argsort(-speeds)[: _SEARCHED // 20]]
            at = np.concatenate([best, np.repeat(best, 19, axis=0)])
    return fastest


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
