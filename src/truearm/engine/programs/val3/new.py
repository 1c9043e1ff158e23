"""New VAL3 applications, in files as the controllers of the CS8 and CS9 write them (VAL3 s7).

Source: Staubli, VAL3 reference manual: movej, movel, movec, waitEndMove, delay, watch, userPage, putln, get, and the
motion descriptor, whose ``vel`` is the share of the joints' speed in percent and ``tvel`` the speed of the tip in mm/s,
its ``rvel`` in deg/s; the slowest of the three counts. In data files the two are called ``tmax`` and ``rmax``; 99999
leaves the speed to the others. ``delay`` does not wait for the arm, so waitEndMove stands before it; ``watch`` says
whether what it waits for came in time, and ``get`` waits for a key. The load is set on the controller, not in programs.
"""

from __future__ import annotations

from math import radians
from typing import Final

from truearm.engine.programs.new_program import (
    CircleMove,
    InputWait,
    JointMove,
    MotionProgram,
    NewProgram,
    Pause,
    Remark,
    StraightMove,
    Wait,
    number,
)
from truearm.engine.programs.program import Form
from truearm.engine.robot.transform import MOVING_XYZ_ANGLES

JOINT: Final = Form("jointRx", "joints", angle=radians(1.0))
POINT: Final = Form("pointRx", "pose", angle=radians(1.0), orientation=MOVING_XYZ_ANGLES)

_TYPES = 'xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"'
_DATA = f'{_TYPES} xmlns="http://www.staubli.com/robotics/VAL3/Data/2"'
_CODE = f'{_TYPES} xmlns="http://www.staubli.com/robotics/VAL3/Program/2"'
_PROJECT = 'xmlns="http://www.staubli.com/robotics/VAL3/Project/3"'
NAMES = ("x", "y", "z", "rx", "ry", "rz")
#: On its way the arm stays in the posture in which it began.
SAME = 'shoulder="ssame" elbow="esame" wrist="wsame" fatherId="world[0]"'
_MOTION = '<Value key="0" accel="100" vel="10" decel="100" blend="joint" leave="1" reach="1" />'
_HEAD = '<?xml version="1.0" encoding="utf-8"?>'


def new_program(program: NewProgram) -> dict[str, str]:
    """Return data, program and project: straight moves have their speed (tvel), for joint motions no time can be said.

    All targets of a kind are one array, in the order of the moves.
    """
    name, count = program.name, len(program)
    straight = program.poses is not None
    by_joints = range(1 if straight else count)
    joints = [element(k, zip("123456", program.axes(k, JOINT), strict=False), "j") for k in by_joints]
    data = [variable("jPath", "jointRx", joints), variable("mPath", "mdesc", [_MOTION])]
    steps = [f"  // {line}" for line in program.comments]
    steps += ["  movej(jPath[0],flange,mPath)", "  waitEndMove()"]
    if straight:
        points = [element(k - 1, zip(NAMES, program.pose(k, POINT), strict=True), "", SAME) for k in range(1, count)]
        data.append(variable("pPath", "pointRx", points))
    current_speed = ""
    for row in range(1, count):
        if not straight:
            steps.append(f"  movej(jPath[{row}],flange,mPath)")
            continue
        speed = f"{program.speed(row) * 1e3:.3f}"
        if speed != current_speed:
            steps.append(f"  mPath.tvel={speed}")
            current_speed = speed
        steps.append(f"  movel(pPath[{row - 1}],flange,mPath)")
    return application(name, data, steps)


def application(name: str, data: list[str], steps: list[str]) -> dict[str, str]:
    """Return the files of an application: its data, its program, which waits at its end, and its project."""
    code = "\n".join(["begin", *steps, "  waitEndMove()", "end"])
    files = {
        f"{name}.dtx": [f"<Database {_DATA}>", "<Datas>", *data, "</Datas>", "</Database>"],
        "start.pgx": [
            f"<Programs {_CODE}>",
            '<Program name="start" access="public">',
            f"<Code><![CDATA[\n{code}\n]]></Code>",
            "</Program>",
            "</Programs>",
        ],
        f"{name}.pjx": [
            f"<Project {_PROJECT}>",
            '<Parameters version="s7.5.3" stackSize="5000" millimeterUnit="true" />',
            '<Programs><Program file="start.pgx" /></Programs>',
            f'<Database><Data file="{name}.dtx" /></Database>',
            "<Libraries />",
            "</Project>",
        ],
    }
    return {f"{name}/{file}": "\n".join([_HEAD, *lines, ""]) for file, lines in files.items()}


def element(key: int, numbers: zip[tuple[str, str]], before: str, more: str = "") -> str:
    """Return an element of a variable: its numbers by their names, with letters before each, and other attributes."""
    values = " ".join(f'{before}{name}="{value}"' for name, value in numbers)
    return f'<Value key="{key}" {values}{" " + more if more else ""} />'


def variable(name: str, kind: str, values: list[str]) -> str:
    """Return a variable with its elements."""
    rows = "\n".join(values)
    form = f'access="public" xsi:type="array" type="{kind}" size="{len(values)}"'
    return f'<Data name="{name}" {form}>\n{rows}\n</Data>'


def motion_program(program: MotionProgram) -> dict[str, str]:
    """Return data, program and project.

    Joint motions have the descriptor mJoint, straight moves and arcs that stop mStop, and others mBlend.
    """
    places = program.places()
    rows = {kind: [row for place_kind, row in places if place_kind == kind] for kind in ("joints", "pose")}
    keys = {(kind, row): key for kind, known in rows.items() for key, row in enumerate(known)}
    axes = [zip("123456", program.axes(row, JOINT), strict=False) for row in rows["joints"]]
    poses = [zip(NAMES, program.pose(row, POINT), strict=True) for row in rows["pose"]]
    joints = [element(key, numbers, "j") for key, numbers in enumerate(axes)]
    points = [element(key, numbers, "", SAME) for key, numbers in enumerate(poses)]
    data = [variable("jPath", "jointRx", joints)] if joints else []
    data += [variable("pPath", "pointRx", points)] if points else []
    data += [
        variable(name, "mdesc", [_motion(blend, velocity)])
        for name, blend, velocity in (("mJoint", "off", 10), ("mStop", "off", 100), ("mBlend", "joint", 100))
    ]
    waits = [step for step in program.steps if isinstance(step, InputWait)]
    if waits:
        data.append(variable("diMeasure", "dio", [f'<Value key="0" link="BasicIO-1\\%I{waits[0].input}" />']))
    if any(isinstance(step, InputWait | Pause) for step in program.steps):
        data.append(variable("nKey", "num", ['<Value key="0" value="0" />']))
    lines = [f"  // {line}" for line in program.comments]
    lines += [] if program.carried is None else ["  // The controller must hold this load"]
    current: dict[str, str] = {}

    def say(name: str, value: str) -> None:
        if current.get(name) != value:
            current[name] = value
            lines.append(f"  {name}={value}")

    for step, near in program.zoned():
        match step:
            case JointMove():
                say("mJoint.vel", number(max(100.0 * step.share, 0.01), 2))
                lines.append(f"  movej(jPath[{keys['joints', step.target]}],flange,mJoint)")
            case StraightMove() | CircleMove():
                motion = "mBlend" if near else "mStop"
                say(f"{motion}.tvel", number(step.speed * 1e3, 3))
                if near:
                    say("mBlend.leave", number(near * 1e3, 3))
                    say("mBlend.reach", number(near * 1e3, 3))
                end = f"pPath[{keys['pose', step.target]}],flange,{motion})"
                if isinstance(step, CircleMove):
                    lines.append(f"  movec(pPath[{keys['pose', step.via]}],{end}")
                else:
                    lines.append(f"  movel({end}")
            case Wait():
                lines += ["  waitEndMove()", f"  delay({number(step.seconds, 3)})"]
            case Remark():
                lines.append(f"  // {step.text}")
            case InputWait():
                lines.append("  waitEndMove()")
                for state in ("false", "true"):
                    lines.append(f"  if watch(diMeasure=={state},{number(step.seconds, 2)})==false")
                    lines += [f"  {line}" for line in _asked(f"{step.label}: no signal, press a key")] + ["  endIf"]
            case Pause():
                lines += ["  waitEndMove()", *_asked(f"{step.label}: measure, press a key")]
    return application(program.name, data, lines)


def _motion(blend: str, velocity: int) -> str:
    speeds = f'vel="{velocity}" decel="100" tmax="99999" rmax="99999"'
    return f'<Value key="0" accel="100" {speeds} blend="{blend}" leave="1" reach="1" />'


def _asked(words: str) -> list[str]:
    return ["  userPage()", f'  putln("{words}")', "  nKey=get()"]
