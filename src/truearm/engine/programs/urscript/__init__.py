"""URScript of Universal Robots: targets of movej, movel, movep, movec and their kin, as ``.script`` files have them.

What is read:

- poses ``p[x, y, z, rx, ry, rz]`` (metres, rotation vector) and joints ``[q1, ..., q6]`` (radians), written in the move
  or assigned to a variable that a move uses, straight or through other variables;
- ``get_inverse_kin(pose, qnear)``: the joints near which the posture is; ``movej(pose)`` alone leaves the choice to the
  controller, which takes the posture nearest to where it is;
- ``pose_trans(frame, pose)``: a target in a frame, which is called as the variable is. If moves go to the first pose
  itself, the second one is an offset from that target in its axes; else the first one is a frame;
- ``pose_add(target, offset)``: an offset in the axes of the base;
- ``set_tcp``: the tool, called as the script calls it, else ``tcp``, ``tcp 2`` and so on. Where none was set, the TCP
  of the robot's installation holds, which no script tells: the tool ``tcp`` (``tcp before set_tcp`` where the script
  sets one elsewhere) is left for the user to define;
- ``set_payload`` and ``set_target_payload`` with numbers: what the robot carries, if the script says it only once.

Variables and TCPs are followed in the order of the text; see :mod:`truearm.engine.programs.urscript.text` and
:mod:`truearm.engine.programs.urscript.targets`. Every file is a program of its own.

Source: Universal Robots, The URScript Programming Language (script manual, e-Series, SW 5.x), "Module motion", "Module
internals", "Module urmath", "Scoping rules", "Program Label". Exports of PolyScope define two variables a waypoint,
``Waypoint_1_p`` and ``Waypoint_1_q``. ``.urp`` files are compressed and not read.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from truearm.engine.programs.program import (
    BYTE_ORDER_MARK,
    NUMBER,
    Language,
    MakersCalibration,
    MoveKind,
    Program,
    Source,
    line_end,
)
from truearm.engine.programs.urscript.new import motion_program, new_program
from truearm.engine.programs.urscript.targets import (
    COMPUTED,
    At,
    Going,
    Places,
    Spot,
    Stretch,
    Targets,
    Tcp,
    TcpFlow,
    Use,
    program_of,
)
from truearm.engine.programs.urscript.text import Call, Name, Numbers, Script, Value, split_moves
from truearm.engine.robot.parts import Payload

_LOOKS: Final = re.compile(
    r"^[ \t]*(?:def|thread|sec)[ \t]+\w+[ \t]*\([^)\n]*\)[ \t]*:"
    r"|(?<![\w.])(?:movej|movel|movep|movec|servoj|optimovej|optimovel|set_tcp)[ \t]*\(",
    re.ASCII | re.MULTILINE,
)
#: Beyond this [kg, m] a number is no load.
_MOST_LOAD: Final = 1000.0
#: How the tip goes, and the name of the argument that says where to.
_MOVES: Final[dict[str, tuple[MoveKind, str]]] = {
    "movej": ("joint", "q"),
    "optimovej": ("joint", "goal"),
    "servoj": ("joint", "q"),
    "movel": ("linear", "pose"),
    "movep": ("linear", "pose"),
    "optimovel": ("linear", "goal"),
    "movec": ("circular", "pose_to"),
}
_WHOLE: Final = frozenset(_MOVES) | {"set_tcp"}
_PAYLOAD: Final = re.compile(r"(?<![\w.])set_(?:target_)?payload[ \t]*\(", re.ASCII)
#: Mass [kg] and centre of gravity [m] in the flange frame; without the latter the load is not known.
_LOAD: Final = re.compile(
    rf"\s*(?:m\s*=\s*)?({NUMBER})\s*(?:,\s*(?:cog\s*=\s*)?\[\s*({NUMBER})\s*,\s*({NUMBER})\s*,\s*({NUMBER})\s*\])\s*[,)]",
    re.ASCII,
)
_QUOTED: Final = re.compile(r'"([^"\n]*)"')
#: Functions that move nothing.
_AT_REST: Final = re.compile(
    r"(?:set|get|is|read|write|socket|modbus|rpc|rtde|zero|str|to|end|stop|enter|exit|request|tool|popup|textmsg)"
    r"(?:_\w*)?|varmsg|sleep|sync|halt|stop[jl]|struct|assert|power\w*|kill|join",
    re.ASCII,
)


def _recognizes(text: str) -> bool:
    text = text.removeprefix(BYTE_ORDER_MARK)
    return not text.lstrip().startswith("<") and _LOOKS.search(text.replace("\r", "\n")) is not None


def _read(sources: Sequence[Source]) -> Program:
    tools, frames = Places(), Places()
    unknown: Counter[str] = Counter()
    files = [_File(source, tools, frames, unknown) for source in sources]
    parts = [(file.script, file.targets, file.goings, file.skipped) for file in files]
    program = program_of("URScript", tuple(sources), parts, tools, frames, unknown)
    load = _load_of([file.script for file in files])
    return program if load is None else replace(program, loads={target.tool: load for target in program.targets})


def _commented(text: str, lines: Sequence[str]) -> str:
    mark = BYTE_ORDER_MARK if text.startswith(BYTE_ORDER_MARK) else ""
    return mark + "".join(f"# {line}{line_end(text)}" for line in lines) + text.removeprefix(mark)


def _load_of(scripts: Sequence[Script]) -> Payload | None:
    """Return what the robot carries, if all that the scripts say of it are the same numbers."""
    loads: set[Payload | None] = set()
    for script in scripts:
        for call in _PAYLOAD.finditer(script.code):
            match = _LOAD.match(script.code, call.end())
            mass, *cog = [0.0] if match is None else [float(number) for number in match.groups()]
            plain = match is not None and mass >= 0.0 and all(abs(value) < _MOST_LOAD for value in (mass, *cog))
            loads.add(Payload(mass, (cog[0], cog[1], cog[2])) if plain else None)
    return loads.pop() if len(loads) == 1 else None


class _File:
    """One file: its moves, and what of them could not be followed."""

    def __init__(self, source: Source, tools: Places, frames: Places, unknown: Counter[str]) -> None:
        self.script = Script(source, _WHOLE)
        self.targets = Targets(self.script, frames)
        self.goings: list[Going] = []
        #: Places in the text, with the reason.
        self.skipped: list[tuple[int, str]] = []
        self._tools = tools
        routines = {routine.name: number for number, routine in enumerate(self.script.routines) if number}
        flow = TcpFlow([routine.start for routine in self.script.routines])
        moves: list[tuple[Call, MoveKind, Value | None, Value | None, Stretch, int]] = []
        elsewhere = 0
        for call in self.script.calls:
            if call.name in _MOVES:
                kind, keyword = _MOVES[call.name]
                to, via = self._ends(call, kind, keyword)
                moves.append((call, kind, to, via, flow.reached(call.routine), call.stretch + elsewhere))
            elif call.name == "set_tcp":
                flow.set(call.routine, call.start, self._tcp(call))
            elif call.name in routines:
                flow.call(call.routine, routines[call.name])
                elsewhere += 1
            elif call.statement and _AT_REST.fullmatch(call.name) is None:
                unknown[call.name] += 1
                elsewhere += 1
        flow.follow()
        for call, _, to, via, _, _ in moves:
            for value in (to, via):
                if value is not None and not isinstance(value, Numbers):
                    self.targets.aim(value, At(call.routine, call.start))
        for move in moves:
            self._go(*move)

    def _ends(self, call: Call, kind: MoveKind, keyword: str) -> tuple[Value | None, Value | None]:
        """Return what a move says of its end, and of what it passes."""
        script = self.script
        if kind != "circular":
            to, via = script.first(call.opened, keyword), None
        else:
            to, via = script.argument(call.opened, 1, keyword), script.argument(call.opened, 0, "pose_via")
            mode = script.argument(call.opened, 5, "mode")
            if mode is not None and script.code[mode.start : mode.stop] not in ("0", "0.0"):
                self.skipped.append((call.start, "the orientation at its end follows from the circle (mode)"))
                return None, None
        if to is None or (kind == "circular" and via is None):
            self.skipped.append((call.start, f"{call.name} does not say where to"))
            return None, None
        return to, via

    def _tcp(self, call: Call) -> Tcp:
        value, at = self.script.first(call.opened, "pose"), At(call.routine, call.start)
        named = _QUOTED.search(self.script.source.text, call.opened, self.script.partner[call.opened])
        plain = self.targets.plain(value, at)
        if plain is not None and plain[0].kind == "pose":
            return self._tools.named((named and named[1]) or plain[1] or "tcp", self.script.sized(plain[0]).values)
        undeclared = isinstance(value, Name) and self.targets.names.find(value.name, call.routine, call.start) is None
        return value.name if undeclared and isinstance(value, Name) else COMPUTED

    def _go(
        self, call: Call, kind: MoveKind, to: Value | None, via: Value | None, stretch: Stretch, number: int
    ) -> None:
        at = At(call.routine, call.start)
        end = None if to is None else self._use(to, at)
        passed = None if via is None else self._use(via, at)
        if isinstance(end, str):
            self.skipped.append((call.start, end))
            end = passed = None
        if isinstance(passed, str):
            self.skipped.append((call.start, f"what the circle passes stays as it is: {passed}"))
            passed = None
        if end is not None:
            end.spot.ended = True
            if passed is not None and passed.spot.passed_to is None:
                passed.spot.passed_to = end.spot
        self.goings.append(Going(call, kind, end, passed, stretch, number))

    def _use(self, value: Value, at: At) -> Use | str:
        if isinstance(value, Numbers):
            spot = Spot(self.script.sized(value))
            self.targets.spots.append(spot)
            return Use(spot, (value.start, value.stop))
        return self.targets.reach(value, at)


#: A number of a pose that is not assigned.
_READS: Final = re.compile(
    r"#[^\n]*+|\"[^\"\n]*+\"|\b([A-Za-z_]\w*+)[ \t]*+\[[ \t]*+[0-5][ \t]*+\](?![ \t]*+=(?!=))", re.ASCII
)

URSCRIPT: Final = Language(
    "URScript",
    (".script", ".urscript"),
    ("Universal Robots", "UR"),
    _recognizes,
    _read,
    _commented,
    split_moves,
    new_program,
    motion_program,
    calibration=MakersCalibration("Universal Robots", "the kinematic calibration of the factory", always=True),
    reads=_READS,
)
