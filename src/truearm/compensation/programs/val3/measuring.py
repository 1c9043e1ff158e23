"""VAL3 applications with stops, waits and circles.

Source: Staubli, VAL3 reference manual: movej, movel, movec, waitEndMove, delay, watch, userPage, putln, get, and the
motion descriptor, whose ``vel`` is the share of the joints' speed in percent and ``tvel`` the speed of the tip in mm/s,
its ``rvel`` in deg/s; the slowest of the three counts. In data files the two are called ``tmax`` and ``rmax``; 99999
leaves the speed to the others. ``delay`` does not wait for the arm, so waitEndMove stands before it; ``watch`` says
whether what it waits for came in time, and ``get`` waits for a key. The load is set on the controller, not in programs.
"""

from __future__ import annotations

from truearm.compensation.programs.motion_program import (
    CircleMove,
    InputWait,
    JointMove,
    MotionProgram,
    Pause,
    Remark,
    StraightMove,
    Wait,
    number,
)
from truearm.compensation.programs.val3.new import JOINT, NAMES, POINT, SAME, application, element, variable


def motion_program(program: MotionProgram) -> dict[str, str]:
    """Return data, program and project.

    Joint motions have the descriptor mJoint, straight moves and arcs that stop mStop, and others mBlend.
    """
    places = program.places()
    rows = {kind: [row for one, row in places if one == kind] for kind in ("joints", "pose")}
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
    said: dict[str, str] = {}

    def say(name: str, value: str) -> None:
        if said.get(name) != value:
            said[name] = value
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
