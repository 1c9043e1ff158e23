"""Data of RAPID written out, and the instructions that move the robot.

Sources: ABB, Technical reference manual, RAPID Instructions, Functions and Data types (3HAC050917-001), syntax of each
instruction; application manuals Arc and Arc Sensor, Spot options, Dispense, Paint and Continuous Application Platform.
"""

from __future__ import annotations

import re
from functools import cache, lru_cache
from math import isfinite, pi
from typing import Final, Literal, NamedTuple

import numpy as np

from truearm.engine.programs.program import LARGEST, NUMBER, Configuration, Form, MoveKind
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.transform import MOVING_XYZ_ANGLES, QUATERNION, Transform, rotation_from_quaternion

# Data of RAPID written out: targets, their configuration data, tools and work objects.
#
# Sources: ABB, Technical reference manual, RAPID Instructions, Functions and Data types (3HAC050917-001), data types
# robtarget, jointtarget, confdata, orient, pose, tooldata and wobjdata, functions Offs and RelTool. The quadrants were
# read in a scan of an ABB manual; the table of cfx and the order of RelTool's angles in public code that quotes ABB.
#
# cf1, cf4 and cf6 of confdata are quadrants: a joint in quadrant k reads k * 90 deg or more and less than
# (k + 1) * 90 deg. cfx numbers the eight postures of an arm that can bend over backwards:
#
# === ============================== ================================ ========
# cfx wrist centre, seen from axis 1 wrist centre, seen from lower arm axis 5
# === ============================== ================================ ========
# 0   in front                       in front                         positive
# 1   in front                       in front                         negative
# 2   in front                       behind                           positive
# 3   in front                       behind                           negative
# 4   behind                         in front                         positive
# 5   behind                         in front                         negative
# 6   behind                         behind                           positive
# 7   behind                         behind                           negative
# === ============================== ================================ ========
#
# The quadrants hold for every arm, and that of joint 1 says front or back already, that of joint 4 to which side joint
# 5 bends. Arms that cannot bend backwards have 0 for cfx, whatever they do. So cfx is asked for the elbow alone, which
# the quadrants leave open: in the words of :mod:`truearm.engine.robot.inverse.branches` the elbow is up where the wrist
# centre is in front of both or behind both. Of an arm with another number of joints the data mean other things.
_DEGREE: Final = pi / 180.0

ROBTARGET: Final = Form("robtarget", "pose", orientation=QUATERNION, decimals=(3, 7))
JOINTTARGET: Final = Form("jointtarget", "joints", angle=_DEGREE)
OFFS: Final = Form("Offs", "pose")
#: The turns of RelTool follow each other about x, the new y and the new z.
RELTOOL: Final = Form("RelTool", "pose", angle=_DEGREE, orientation=MOVING_XYZ_ANGLES)

#: From here on a number says that there is no such axis; written 9E9.
_ABSENT: Final = 9e8
#: A joint in a quadrant beyond these has turned ten times: it is no quadrant.
_QUADRANTS: Final = range(-40, 40)

# The parts in (?>...) are not tried again, so that no text takes longer than its length.
_NUMBER: Final = rf"\s*+(?>{NUMBER})\s*+"
_CAUGHT: Final = rf"\s*+((?>{NUMBER}))\s*+"


def _row(number: str, count: int) -> str:
    return rf"\s*+\[{','.join([number] * count)}\]\s*+"


_POSE: Final = rf"\s*+\[{_row(_CAUGHT, 3)},{_row(_CAUGHT, 4)}\]\s*+"
_ROBTARGET: Final = rf"\[{_row(_CAUGHT, 3)},{_row(_CAUGHT, 4)},{_row(_CAUGHT, 4)},{_row(_NUMBER, 6)}\]"
_JOINTTARGET: Final = rf"\[{_row(_CAUGHT, 6)},{_row(_NUMBER, 6)}\]"
#: Groups 1 to 7 are the pose, 8 to 11 the configuration.
ROBTARGET_TEXT: Final = re.compile(_ROBTARGET)
#: Groups 1 to 6 are the joints of the robot.
JOINTTARGET_TEXT: Final = re.compile(_JOINTTARGET)
#: What stands after the numbers of a robtarget's pose.
ROBTARGET_TAIL: Final = re.compile(rf"\s*+\]\s*+,{_row(_NUMBER, 4)},{_row(_NUMBER, 6)}\]")
NUMBER_TEXT: Final = re.compile(_CAUGHT)
_TOOL_TEXT: Final = re.compile(rf"\s*+\[\s*+(TRUE|FALSE)\s*+,{_POSE},", re.I)
_LOAD_TEXT: Final = re.compile(rf"\s*+\[\s*+(?:TRUE|FALSE)\s*+,{_POSE},\s*+\[{_CAUGHT},{_row(_CAUGHT, 3)},", re.I)
_FRAME_TEXT: Final = re.compile(
    rf"\s*+\[\s*+(TRUE|FALSE)\s*+,\s*+(TRUE|FALSE)\s*+,\s*+\"[^\"]*+\"\s*+,{_POSE},{_POSE}\]", re.I
)

_NAMES: Final = re.compile(r"[^\W\d]\w*")


@cache
def configuration(cf1: str, cf4: str, cf6: str, cfx: str) -> Configuration:
    """Return the postures that confdata allow, each number as it is written."""
    ranges = []
    for joint, written in ((1, cf1), (4, cf4), (6, cf6)):
        quadrant = float(written)
        if quadrant in _QUADRANTS:
            ranges.append((joint, quadrant * pi / 2, (quadrant + 1) * pi / 2))
    elbow: Literal["up", "down"] | None = None
    if float(cfx) in range(8):
        elbow = "up" if int(float(cfx)) in (0, 1, 6, 7) else "down"
    return Configuration(elbow=elbow, ranges=tuple(ranges))


def why_no_target(text: str) -> str:
    """Return in plain words why an aggregate cannot be read as a target."""
    name = _NAMES.search(re.sub(NUMBER, " ", text))
    return f"has {name[0]} in place of numbers" if name else "has numbers that are missing or computed"


def wrong_number(form: Form, values: tuple[float, ...]) -> tuple[str, str, str] | None:
    """Return what is wrong with the numbers of a target, what came and what is allowed, or None."""
    lengths = values[:3] if form.kind == "pose" else values
    for value in lengths:
        if not isfinite(value) or abs(value) > LARGEST:
            return "a number of a target is out of all proportion", f"{value:g}", "1 000 000 at most"
    return wrong_quaternion(values[3:]) if form.orientation is QUATERNION else None


def wrong_quaternion(quaternion: tuple[float, ...]) -> tuple[str, str, str] | None:
    """Return what is wrong with a quaternion, what came and what is allowed, or None."""
    w, x, y, z = quaternion
    squared = w * w + x * x + y * y + z * z
    # The length is 1 within 1e-3, without the root.
    if 0.998001 <= squared <= 1.002001:
        return None
    return "a quaternion does not have length 1", f"length {squared**0.5:.4g}", "1 within 0.001"


def absent(values: tuple[float, ...]) -> bool:
    """Return whether joints of the robot itself are said not to be there (9E9)."""
    return any(value >= _ABSENT for value in values)


def external_axis_moved(text: str) -> bool:
    """Return whether a robtarget, as it is written, has an external axis that is there and not at zero."""
    return _moved(text[text.rindex("[") + 1 :])


@lru_cache(maxsize=1000)
def _moved(axes: str) -> bool:
    return any(0.0 != float(axis) < _ABSENT for axis in axes.rstrip("] \t\r\n").split(","))


class RefusedPoseError(Exception):
    """A pose of a tool or work object that cannot be: what is wrong, what came, what is allowed."""

    def __init__(self, what: str, came: str, allowed: str) -> None:
        super().__init__(what)
        self.what, self.came, self.allowed = what, came, allowed


def _transform(numbers: tuple[str, ...]) -> Transform:
    x, y, z, *q = (float(number) for number in numbers)
    wrong = wrong_number(ROBTARGET, (x, y, z, *q))
    if wrong is not None:
        raise RefusedPoseError(*wrong)
    w, i, j, k = (float(part) for part in np.array(q) / np.linalg.norm(q))
    return Transform((x / 1000, y / 1000, z / 1000), (w, i, j, k))


def tool_of(text: str, start: int, stop: int) -> tuple[Transform | None, str | None]:
    """Return ``T_flange_tip`` of tooldata written out, None if they are not, and why targets with it are left alone.

    Raises:
        RefusedPoseError: If its pose cannot be.
    """
    match = _TOOL_TEXT.match(text, start, stop)
    if match is None:
        return None, None
    if match[1].upper() == "FALSE":
        return None, "is not held by the robot"
    return _transform(match.groups()[1:]), None


def load_of(text: str, start: int, stop: int) -> Payload | None:
    """Return the load that tooldata written out have, in the controller's flange frame; None if there is none."""
    match = _LOAD_TEXT.match(text, start, stop)
    mass, *cog = [0.0] if match is None else [float(number) for number in match.groups()[7:]]
    if not all(isfinite(number) and abs(number) < LARGEST for number in (mass, *cog)) or mass <= 0.0:
        return None
    x, y, z = (value / 1000 for value in cog)
    return Payload(mass, (x, y, z))


def frame_of(text: str, start: int, stop: int) -> tuple[Transform | None, str | None]:
    """Return ``T_base_object`` of wobjdata written out, None if they are not, and why targets in it are left alone.

    The object frame stands in the user frame, and that in the frame of the robot's base.

    Raises:
        RefusedPoseError: If one of its poses cannot be.
    """
    match = _FRAME_TEXT.match(text, start, stop)
    if match is None:
        return None, None
    robhold, fixed, *numbers = match.groups()
    if robhold.upper() == "TRUE":
        return None, "is held by the robot"
    if fixed.upper() == "FALSE":
        return None, "is moved by another mechanical unit"
    user, own = _transform(tuple(numbers[:7])), _transform(tuple(numbers[7:]))
    R = user.rotation
    return Transform.from_matrix(
        R @ rotation_from_quaternion(np.array(own.quaternion)), np.array(user.translation) + R @ own.translation
    ), None


class Motion(NamedTuple):
    """An instruction that moves the robot."""

    kind: MoveKind  #: How the tip goes.
    target: int = 0  #: target, tool: which of the arguments that are not optional they are; -1 for the last one.
    tool: int = -1
    via: int | None = None  #: Which of them the circle passes, None for no circle.
    joints: bool = False  #: Whether the target is a jointtarget.
    searches: bool = False  #: Whether the robot may stop on the way.
    splittable: bool = False  #: Whether several of it after each other do what one does.


def _motions() -> dict[str, Motion]:
    motions: dict[str, Motion] = {}
    for ending in ("", "do", "ao", "go", "sync"):
        motions[f"movej{ending}"] = Motion("joint", tool=3)
        motions[f"movel{ending}"] = Motion("linear", tool=3, splittable=not ending)
        motions[f"movec{ending}"] = Motion("circular", target=1, tool=4, via=0, splittable=not ending)
    motions["moveabsj"] = Motion("joint", tool=3, joints=True)
    motions["triggabsj"] = motions["arcmoveabsj"] = Motion("joint", joints=True)
    for word in ("triggj", "triggjios", "arcmovej", "spotj", "spotmj", "dispj", "nutj"):
        motions[word] = Motion("joint")
    for word in ("triggl", "trigglios", "arcmovel", "spotl", "spotml", "displ", "capl", "paintl", "gluel", "nutl"):
        motions[word] = Motion("linear")
    for word in ("triggc", "arcmovec", "dispc", "capc", "paintc", "gluec"):
        motions[word] = Motion("circular", target=1, via=0)
    for number in ("", "1", "2"):
        for phase in ("", "start", "end"):
            motions[f"arcl{number}{phase}"] = Motion("linear", splittable=not phase)
            motions[f"arcc{number}{phase}"] = Motion("circular", target=1, via=0, splittable=not phase)
    motions["searchl"] = Motion("linear", target=2, searches=True)
    motions["searchc"] = Motion("circular", target=3, via=2, searches=True)
    motions["contactl"] = Motion("linear", searches=True)
    return motions


#: By first word, in lower case.
MOTIONS: Final = _motions()

#: Instructions after which the robot is where it was, by first word, in lower case.
QUIET: Final = frozenset(
    re.findall(
        r"\w+",
        """
        accset actunit bookerrno break cirpathmode clkreset clkstart clkstop close confj confl corrclear corrcon
        corrdiscon corrwrite deactunit eoffsoff eoffson eoffsset errlog errwrite gripload idelete idisable ienable
        invertdo iodisable ioenable isignalai isignalao isignaldi isignaldo isignalgi isignalgo isleep itimer iwatch
        load motionsup moveextj open paccset pathacclim pathresol pdispoff pulsedo reset save set setao setdo setgo
        setsysdata singarea socketaccept socketbind socketclose socketconnect socketcreate socketlisten socketreceive
        socketsend softact softdeact speedrefresh stop syncmoveoff syncmoveon tperase tpreaddnum tpreadfk tpreadnum
        tpshow tpwrite triggcheckio triggequip triggint triggio triggrampao triggspeed tunereset tuneservo uimsgbox
        uishow unload velset waitai waitao waitdi waitdo waitgi waitgo waitload waitrob waitsynctask waittime
        waituntil worldacclim write writebin writestrbin
        """,
    )
)
#: Instructions that move all targets after them.
DISPLACING: Final = frozenset(("pdispon", "pdispset"))
