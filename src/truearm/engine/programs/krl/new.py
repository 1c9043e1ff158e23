"""New KRL programs: targets one after the other, or with stops, waits and circles.

Source: KUKA System Software 8, operating and programming instructions for system integrators: PTP, LIN, CIRC, WAIT SEC,
``$VEL_AXIS``, ``$VEL``, ``$APO``, ``$ORI_TYPE``, ``$CIRC_TYPE``, ``$LOAD``, HALT. ``BAS(#INITMOV,0)`` gives
accelerations their usual values. WAIT stops the advance run, so that the robot stands before it. A timer that begins at
minus so many ms raises its flag when they are over.
"""

from __future__ import annotations

from truearm.engine.programs.krl.lines import JOINTS, POSE
from truearm.engine.programs.new_program import (
    Carried,
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
    percent,
)

_NAMES = ("X", "Y", "Z", "A", "B", "C")
#: Which of the controller's timers counts the time that an input is waited for.
_TIMER = 20


def motion_program(program: MotionProgram) -> dict[str, str]:
    """Return a ``.src`` file: joint motions have their share ($VEL_AXIS), others their speed ($VEL.CP)."""
    lines = [f"DEF {program.name} ( )", *(f"  ; {line}" for line in program.comments)]
    lines += ["  BAS (#INITMOV,0)", *_carried(program.carried), "  $BASE = {X 0,Y 0,Z 0,A 0,B 0,C 0}"]
    lines += ["  $ORI_TYPE = #VAR", "  $CIRC_TYPE = #BASE", "  $ADVANCE = 3"]
    current: dict[str, str] = {}

    def say(name: str, value: str, axes: int = 0) -> None:
        if current.get(name) != value:
            current[name] = value
            lines.extend([f"  {name}[{axis}] = {value}" for axis in range(1, axes + 1)] or [f"  {name} = {value}"])

    def pose(row: int) -> str:
        numbers = zip(_NAMES, program.pose(row, POSE), strict=True)
        return "{" + ",".join(f"{name} {value}" for name, value in numbers) + "}"

    for step, near in program.zoned():
        match step:
            case JointMove():
                say("$VEL_AXIS", str(percent(step.share)), axes=6)
                axes = ",".join(f"A{axis} {value}" for axis, value in enumerate(program.axes(step.target, JOINTS), 1))
                lines.append(f"  PTP {{{axes}}}")
            case StraightMove() | CircleMove():
                say("$VEL.CP", f"{step.speed:.4f}")
                if near:
                    say("$APO.CDIS", number(near * 1e3, 3))
                way = f"LIN {pose(step.target)}"
                if isinstance(step, CircleMove):
                    way = f"CIRC {pose(step.via)},{pose(step.target)}"
                lines.append(f"  {way}{' C_DIS' if near else ''}")
            case Wait():
                lines.append(f"  WAIT SEC {number(step.seconds, 3)}")
            case Remark():
                lines.append(f"  ; {step.text}")
            case InputWait():
                lines += [
                    f"  $TIMER_STOP[{_TIMER}] = TRUE",
                    f"  $TIMER[{_TIMER}] = -{round(1e3 * step.seconds)}",
                    f"  $TIMER_STOP[{_TIMER}] = FALSE",
                    f"  WAIT FOR (NOT $IN[{step.input}]) OR $TIMER_FLAG[{_TIMER}]",
                    f"  WAIT FOR $IN[{step.input}] OR $TIMER_FLAG[{_TIMER}]",
                    f"  IF $TIMER_FLAG[{_TIMER}] THEN",
                    f"    ; {step.label}: no signal",
                    "    HALT",
                    "  ENDIF",
                ]
            case Pause():
                lines += [f"  ; {step.label}: measure, then start again", "  HALT"]
    return {f"{program.name}.src": "\n".join([*lines, "END", ""])}


def _carried(carried: Carried | None) -> list[str]:
    turned = "A 0,B 0,C 0"
    if carried is None:
        return [f"  $TOOL = {{X 0,Y 0,Z 0,{turned}}}"]
    tip, cog = (",".join(f"{a} {v}" for a, v in zip("XYZ", p, strict=True)) for p in (carried.tip_mm, carried.cog_mm))
    load = f"{{M {number(carried.mass, 3)},CM {{{cog},{turned}}},J {{X 0,Y 0,Z 0}}}}"
    return [f"  $TOOL = {{{tip},{turned}}}", f"  $LOAD = {load}"]


_NAMES_NEW = ("X", "Y", "Z", "A", "B", "C")


def new_program(program: NewProgram) -> dict[str, str]:
    """Return a ``.src`` file: straight moves have their speed ($VEL.CP), for joint motions no time can be said."""
    lines = [f"DEF {program.name} ( )", *(f"  ; {line}" for line in program.comments)]
    lines += ["  $TOOL = {X 0,Y 0,Z 0,A 0,B 0,C 0}", "  $BASE = {X 0,Y 0,Z 0,A 0,B 0,C 0}", "  $ADVANCE = 3"]
    current_speed = ""
    for row in range(len(program)):
        if program.poses is None or row == 0:
            axes = ",".join(f"A{number} {value}" for number, value in enumerate(program.axes(row, JOINTS), 1))
            lines.append(f"  PTP {{{axes}}}{' C_PTP' if program.blend(row) else ''}")
            continue
        speed = f"{program.speed(row):.4f}"
        if speed != current_speed:
            lines.append(f"  $VEL.CP = {speed}")
            current_speed = speed
        blend = program.blend(row) * 1e3
        if blend:
            lines.append(f"  $APO.CDIS = {blend:.3f}")
        pose = ",".join(f"{name} {value}" for name, value in zip(_NAMES_NEW, program.pose(row, POSE), strict=True))
        lines.append(f"  LIN {{{pose}}}{' C_DIS' if blend else ''}")
    return {f"{program.name}.src": "\n".join([*lines, "END", ""])}
