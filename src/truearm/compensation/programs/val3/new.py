"""New VAL3 applications, in files as the controllers of the CS8 and CS9 write them (VAL3 s7)."""

from __future__ import annotations

from math import radians
from typing import Final

from truearm.compensation.programs.new_program import NewProgram
from truearm.compensation.programs.program import Form
from truearm.modeling.orientations import MOVING_XYZ_ANGLES

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
    said = ""
    for row in range(1, count):
        if not straight:
            steps.append(f"  movej(jPath[{row}],flange,mPath)")
            continue
        speed = f"{program.speed(row) * 1e3:.3f}"
        if speed != said:
            steps.append(f"  mPath.tvel={speed}")
            said = speed
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
