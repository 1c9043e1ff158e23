"""Where the moves of URScript files go and with which TCP: which spots are targets, and which have to stay."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

from truearm.engine.programs.program import (
    ANY_POSTURE,
    Configuration,
    Form,
    Move,
    MoveKind,
    Program,
    ProgramTarget,
    Skipped,
    Source,
)
from truearm.engine.programs.urscript.text import Assignment, Call, Called, Name, Names, Numbers, Other, Script, Value
from truearm.engine.robot.transform import ROTATION_VECTOR, Transform

# Which TCP holds where in a URScript file, and the names of TCPs and frames.
#
# ``set_tcp`` holds from where it stands, in the order of the text: of two in the branches of an ``if`` the last one,
# and what a loop carries from its end to its start is not followed. A routine begins with what holds where it is
# called, and what holds at its end holds after the call. One that nothing in the file calls begins with what was set
# before it in the text.

#: A TCP whose numbers are computed.
COMPUTED: Final = "(computed)"
#: A TCP by name; None is the one of the robot's installation, which holds until the script sets one.
Tcp = str | None
#: Calls are followed down to this depth; programs that call deeper than that are no programs.
_DEEPEST: Final = 200


class Places:
    """Tools, or frames, by name: the same name with other numbers becomes another name."""

    def __init__(self) -> None:
        self._named: dict[str, dict[tuple[float, ...], str]] = {}
        self._taken: set[str] = set()
        self.transforms: dict[str, Transform] = {}

    def named(self, name: str, numbers: tuple[float, ...]) -> str:
        """Return the name of a pose ``x, y, z, rx, ry, rz`` [m, rad] that the program calls so."""
        same = self._named.setdefault(name.lower(), {})
        if numbers not in same:
            unique, count = name, len(same) + 1
            while unique.lower() in self._taken:
                unique, count = f"{name} {max(count, 2)}", count + 1
            self._taken.add(unique.lower())
            same[numbers] = unique
            x, y, z, *vector = numbers
            angle = math.hypot(*vector)
            part = math.sin(angle / 2) / angle if angle else 0.5
            rx, ry, rz = (part * v for v in vector)
            self.transforms[unique] = Transform((x, y, z), (math.cos(angle / 2), rx, ry, rz))
        return same[numbers]


class Stretch:
    """Part of a routine in which the TCP does not change; every TCP that holds there, of all calls."""

    __slots__ = ("tcps",)

    def __init__(self) -> None:
        self.tcps: set[Tcp] = set()


class TcpFlow:
    """The TCPs along the routines of a file, each of which has a number."""

    def __init__(self, starts: list[int]) -> None:
        self._starts = starts
        self._stretches = [[Stretch()] for _ in starts]
        #: What ends each stretch: a TCP that is set, or the routine that is called.
        self._events: list[list[tuple[Tcp, int | None]]] = [[] for _ in starts]
        self._set: list[tuple[int, Tcp]] = []
        self._called: set[int] = set()
        self._ends: dict[tuple[int, Tcp], Tcp] = {}

    def reached(self, routine: int) -> Stretch:
        """Return the stretch of a routine that was reached in the text."""
        return self._stretches[routine][-1]

    def set(self, routine: int, place: int, tcp: Tcp) -> None:
        """Note that a routine sets the TCP."""
        self._set.append((place, tcp))
        self._event(routine, (tcp, None))

    def call(self, routine: int, other: int) -> None:
        """Note that a routine calls another one."""
        self._called.add(other)
        self._event(routine, (None, other))

    def follow(self) -> None:
        """Find the TCPs of every stretch."""
        places = [place for place, _ in self._set]
        for routine, start in enumerate(self._starts):
            if routine not in self._called:
                before = bisect_left(places, start)
                self._run(routine, self._set[before - 1][1] if before else None, 0)
        for routine, stretches in enumerate(self._stretches):
            if not stretches[0].tcps:  # routines that only call one another
                self._run(routine, None, 0)

    def _event(self, routine: int, event: tuple[Tcp, int | None]) -> None:
        self._events[routine].append(event)
        self._stretches[routine].append(Stretch())

    def _run(self, routine: int, tcp: Tcp, depth: int) -> Tcp:
        key = (routine, tcp)
        if key in self._ends:
            return self._ends[key]
        self._ends[key] = tcp  # while it runs: a routine that calls itself
        stretches = self._stretches[routine]
        stretches[0].tcps.add(tcp)
        for (new, other), stretch in zip(self._events[routine], stretches[1:], strict=True):
            if other is None:
                tcp = new
            elif depth < _DEEPEST:
                tcp = self._run(other, tcp, depth + 1)
            stretch.tcps.add(tcp)
        self._ends[key] = tcp
        return tcp


# Where the moves of a URScript file go: from the words of a move to the six numbers behind them.
#
# Source: script manual, "Module motion" (movej, movel, movep, movec, servoj, optimovej, optimovel), "Module internals"
# (get_inverse_kin, set_tcp) and "Module urmath" (``pose_trans(p_from, p_from_to)`` is the product of both poses,
# ``pose_add(p_1, p_2)`` the sum of the positions and the product of the rotations).

#: Variables are followed through this many assignments.
_DEEPEST_TARGETS: Final = 20
#: Functions that tell where the robot is.
_CURRENT_PLACES: Final = frozenset(
    f"get_{source}_{quantity}"
    for source in ("actual", "target")
    for quantity in ("tcp_pose", "joint_positions", "tool_flange_pose", "tcp_pose_along_path")
) | {"get_forward_kin", "tool_pose"}


@dataclass(slots=True, eq=False)
class Spot:
    """Six numbers that moves go to, as they are in one frame or as an offset from one other spot."""

    numbers: Numbers
    name: str = ""
    frame: str = ""
    parent: Spot | None = None
    turned: bool = False
    tcps: set[Tcp] | None = None  #: Every TCP that moves reach it with; None before the first.
    nears: set[tuple[float, ...]] | None = None  #: Every ``qnear`` it is reached with.
    ended: bool = False  #: Whether a move ends there; else circles pass it.
    passed_to: Spot | None = None  #: Where the first circle that passes it ends.
    trouble: str = ""  #: Why it has to stay as it is; empty if it need not.
    shared: bool = False  #: Whether it is an offset from several others, so that it stays as it is and those move.
    index: int = -1


class Use(NamedTuple):
    """A spot as a move names it."""

    spot: Spot
    words: tuple[int, int]  #: In whose place other numbers could stand; ``(0, 0)`` if none could.
    near: tuple[float, ...] | None = None  #: The joints that it is named to be near to.
    at_spot: bool = True  #: Whether the move ends there, and not at an offset beyond it that only the robot knows.


class At(NamedTuple):
    """Where a value stands: its routine, its place, and through how many assignments it was reached."""

    routine: int
    place: int
    depth: int = 0


class Targets:
    """The spots of one file.

    Args:
        script: The file.
        frames: Frames of the whole program; those of the file are added.
    """

    def __init__(self, script: Script, frames: Places) -> None:
        self._script, self._frames = script, frames
        self.names = Names(script)
        self.spots: list[Spot] = []
        self._known: dict[tuple[int, int, str], Spot] = {}
        #: Where the numbers of frames begin.
        self.framed: set[int] = set()

    def aim(self, value: Value, at: At) -> None:
        """Note the variables that a move goes to, and not only into the axes of."""
        if isinstance(value, Name):
            assignment = self.names.find(value.name, at.routine, at.place)
            if isinstance(assignment, Assignment) and not assignment.aimed:
                assignment.aimed = True
                if assignment.value is not None and at.depth < _DEEPEST_TARGETS:
                    self.aim(assignment.value, At(assignment.routine, assignment.start, at.depth + 1))
        elif isinstance(value, Called) and value.function in ("get_inverse_kin", "pose_add"):
            first = self._argument(value, 0, "x" if value.function == "get_inverse_kin" else "p_1")
            if first is not None and at.depth < _DEEPEST_TARGETS:
                self.aim(first, At(at.routine, at.place, at.depth + 1))

    def reach(self, value: Value, at: At, frame: str = "", name: str = "") -> Use | str:
        """Return the spot that a value is, or why there is none.

        Args:
            frame: Of the value.
            name: Of the variable that holds the value.
        """
        words = (value.start, value.stop)
        if isinstance(value, Other):
            return value.reason
        if at.depth > _DEEPEST_TARGETS:
            return "it is computed in too many steps"
        if isinstance(value, Numbers):
            if frame and value.kind == "joints":
                return "joints stand in no frame"
            return Use(self._spot(value, name, frame, None, False), words)
        if isinstance(value, Name):
            assignment = self._assignment(value.name, at)
            if isinstance(assignment, str):
                return assignment
            if assignment.value is None:
                return f"the numbers of {value.name} are changed one by one"
            numbers = assignment.numbers
            if numbers is not None:
                assignment.series.reached = True
                use = self.reach(numbers, at, frame, value.name)
                return use if isinstance(use, str) else Use(use.spot, words)
            if self._comes_round(assignment.value, At(assignment.routine, assignment.start)):
                return f"{value.name} is computed from what changes later"
            use = self.reach(
                assignment.value, At(assignment.routine, assignment.start, at.depth + 1), frame, value.name
            )
            if isinstance(use, str):
                return use
            return Use(use.spot, _in_frame(use, frame, words), use.near, use.at_spot)
        deeper = At(at.routine, at.place, at.depth + 1)
        if value.function == "get_inverse_kin":
            return "joints stand in no frame" if frame else self._solved(value, deeper, name)
        if value.function == "pose_trans":
            return self._transformed(value, deeper, frame, name)
        if value.function == "pose_add":
            return self._added(value, deeper, frame, name)
        if value.function in _CURRENT_PLACES:
            return "it depends on where the robot is"
        return f"it is computed by {value.function}"

    def plain(self, value: Value | None, at: At) -> tuple[Numbers, str] | None:
        """Return six numbers and their name, if a value is that or a variable that was assigned that."""
        if isinstance(value, Name):
            assignment = self.names.find(value.name, at.routine, at.place)
            if isinstance(assignment, Assignment) and assignment.numbers is not None:
                return assignment.numbers, value.name
        return (value, "") if isinstance(value, Numbers) else None

    def _assignment(self, name: str, at: At) -> Assignment | str:
        assignment = self.names.find(name, at.routine, at.place)
        if assignment is None:
            return f"{name} is not declared in this program"
        return f"{name} is an argument of its routine" if assignment == "argument" else assignment

    def _argument(self, called: Called, index: int, keyword: str) -> Value | None:
        return self._script.argument(called.opened, index, keyword)

    def _comes_round(self, value: Value, at: At) -> bool:
        """Return whether a value has variables that are computed again behind it: a loop may sum it up."""
        if isinstance(value, Name):
            assignment = self.names.find(value.name, at.routine, at.place)
            return isinstance(assignment, Assignment) and assignment.series.last_computed >= at.place
        if isinstance(value, Called) and at.depth < _DEEPEST_TARGETS:
            deeper = At(at.routine, at.place, at.depth + 1)
            arguments = self._script.arguments(value.opened)
            return any(self._comes_round(argument.value, deeper) for argument in arguments)
        return False

    def _spot(self, numbers: Numbers, name: str, frame: str, parent: Spot | None, turned: bool) -> Spot:
        key = (numbers.start, 0 if parent is None else id(parent), frame)
        spot = self._known.get(key)
        if spot is None:
            spot = self._known[key] = Spot(self._script.sized(numbers), name, frame, parent, turned)
            self.spots.append(spot)
        return spot

    def _solved(self, called: Called, at: At, name: str) -> Use | str:
        pose = self._argument(called, 0, "x")
        if pose is None:
            return "it is computed"
        tcp = self._argument(called, 4, "tcp")
        if tcp is not None and tcp.start < tcp.stop:  # a name in quotes is blank: it is the active one
            return "get_inverse_kin has a TCP of its own"
        use = self.reach(pose, at, "", name)
        if isinstance(use, str):
            return use
        near = self.plain(self._argument(called, 1, "qnear"), at)
        return (
            use
            if near is None or near[0].kind == "pose"
            else Use(use.spot, use.words, self._script.sized(near[0]).values)
        )

    def _transformed(self, called: Called, at: At, frame: str, name: str) -> Use | str:
        of, pose = self._argument(called, 0, "p_from"), self._argument(called, 1, "p_from_to")
        if of is None or pose is None:
            return "it is computed"
        place = self._frame(of, at)
        if place is None:
            use = self.reach(of, at, frame)
            return use if isinstance(use, str) else self._child(use, called, pose, at, frame, name, turned=True)
        if place.why:
            return place.why
        if frame:
            return "its frame stands in another frame"
        return self.reach(pose, at, place.name, name)

    def _added(self, called: Called, at: At, frame: str, name: str) -> Use | str:
        to, offset = self._argument(called, 0, "p_1"), self._argument(called, 1, "p_2")
        if to is None or offset is None:
            return "it is computed"
        use = self.reach(to, at, frame)
        if isinstance(use, str):
            return use
        if use.spot.frame != frame:
            return "it is an offset in the axes of the base from a target in another frame"
        return self._child(use, called, offset, at, frame, name, turned=False)

    def _child(
        self, use: Use, called: Called, offset: Value, at: At, frame: str, name: str, *, turned: bool
    ) -> Use | str:
        """Return a spot that is an offset; with an offset that is computed, the one it is an offset from."""
        parent = use.spot
        if parent.numbers.kind == "joints" or use.near is not None:
            return "it is an offset from joints"
        plain = self.plain(offset, at)
        if plain is None or not use.at_spot:
            return Use(parent, (0, 0), at_spot=False)
        numbers, variable = plain
        if numbers.kind == "joints":
            return "it is an offset by joints"
        spot = self._spot(numbers, variable or name, parent.frame, parent, turned)
        return Use(spot, _in_frame(use, frame, (called.start, called.stop)))

    def _frame(self, value: Value, at: At) -> _Frame | None:
        """Return the frame that the first pose of ``pose_trans`` is; None if it is a target that moves go to."""
        if isinstance(value, Numbers):
            return self._named_frame(value, " ".join(self._script.code[value.start : value.stop].split()))
        if not isinstance(value, Name):
            return None
        assignment = self._assignment(value.name, at)
        if isinstance(assignment, str):
            undeclared = self.names.find(value.name, at.routine, at.place) is None
            return _Frame(value.name) if undeclared else _Frame("", f"its frame {assignment}")
        if assignment.aimed:
            return None
        if assignment.numbers is None:
            if isinstance(assignment.value, Name) and at.depth < _DEEPEST_TARGETS:
                return self._frame(assignment.value, At(assignment.routine, assignment.start, at.depth + 1))
            return None
        if assignment.series.several and assignment.routine != at.routine:
            return _Frame("", f"its frame {value.name} is assigned more than once, in another routine")
        return self._named_frame(assignment.numbers, value.name)

    def _named_frame(self, numbers: Numbers, name: str) -> _Frame:
        if numbers.kind == "joints":
            return _Frame("", "its frame is given by joints")
        self.framed.add(numbers.start)
        return _Frame(self._frames.named(name, self._script.sized(numbers).values))


class _Frame(NamedTuple):
    """A frame by its name, or why it is not known."""

    name: str
    why: str = ""


def _in_frame(use: Use, frame: str, words: tuple[int, int]) -> tuple[int, int]:
    """Return words for a spot if they stand in its frame, so that numbers in that frame can stand there."""
    return words if use.at_spot and use.spot.frame == frame else (0, 0)


#: A pose, and joints; 1e-6 m are 0.001 mm, and 1e-6 rad less than 0.0001 deg.
POSE: Final = Form("p[x, y, z, rx, ry, rz]", "pose", 1.0, 1.0, ROTATION_VECTOR, (6, 6))
JOINTS: Final = Form("[q1, q2, q3, q4, q5, q6]", "joints", 1.0, 1.0, None, (6, 6))
_NOWHERE: Final = (0, 0)


class Going(NamedTuple):
    """A move: where it ends and what it passes, as far as that is known, and the stretch of the text whose TCP holds.

    Moves of one `number` follow each other.
    """

    call: Call
    kind: MoveKind
    end: Use | None
    passed: Use | None
    stretch: Stretch
    number: int


Part = tuple[Script, Targets, list[Going], list[tuple[int, str]]]


def program_of(
    language: str,
    sources: tuple[Source, ...],
    parts: Sequence[Part],
    tools: Places,
    frames: Places,
    unknown: Counter[str],
) -> Program:
    """Return the program that files make, with the names that its tools and frames got."""
    used = {name.lower() for name in tools.transforms}
    unset = "tcp before set_tcp" if "tcp" in used else "tcp"
    targets: list[ProgramTarget] = []
    moves: list[Move] = []
    skipped: list[Skipped] = []
    routines = 0
    for source, (script, script_targets, goings, left) in enumerate(parts):
        _note_tcps(goings)
        _note_shared(script_targets)
        skips = list(left)
        pairs: list[tuple[Spot, ProgramTarget]] = []
        for spot in _with_unused(script_targets, script, skips):
            trouble = _trouble(spot, script_targets)
            if not spot.shared and trouble:
                skips.append((spot.numbers.start, trouble))
            elif not spot.shared:
                pairs.append((spot, _target(spot, source, script, unset)))
        pairs.sort(key=lambda pair: pair[0].numbers.start)
        for index, (spot, _) in enumerate(pairs, len(targets)):
            spot.index = index
        for spot, target in pairs:
            targets.append(target if spot.parent is None else replace(target, parent=_final(spot.parent).index))
        moves += _moves(goings, source, script, routines)
        numbered = ((script.lines.number(place), reason) for place, reason in sorted(skips))
        skipped += [Skipped(source, line, reason) for line, reason in dict.fromkeys(numbered)]
        routines = moves[-1].routine + 1 if moves else 0
    return Program(
        language,
        sources,
        tuple(targets),
        tuple(moves),
        tools.transforms,
        frames.transforms,
        tuple(skipped),
        dict(unknown),
    )


def _note_tcps(goings: list[Going]) -> None:
    for going in goings:
        tcps = going.stretch.tcps
        for use in (going.end, going.passed):
            spot = None if use is None else use.spot
            while spot is not None:
                if spot.tcps is None:
                    spot.tcps = tcps
                elif spot.tcps is not tcps:
                    spot.tcps = spot.tcps | tcps
                spot = spot.parent
            if use is not None and use.near is not None and use.at_spot:
                use.spot.nears = (use.spot.nears or set()) | {use.near}


def _note_shared(targets: Targets) -> None:
    """Note the numbers that stand for more than one spot: offsets that several targets share, and confusions."""
    first: dict[int, Spot] = {}
    several: dict[int, list[Spot]] = {}
    for spot in targets.spots:
        other = first.setdefault(spot.numbers.start, spot)
        if other is not spot:
            several.setdefault(spot.numbers.start, [other]).append(spot)
    for spots in several.values():
        offsets = all(spot.parent is not None for spot in spots)
        for spot in spots:
            spot.shared = offsets
            spot.trouble = "" if offsets else "it is used in two frames, or as a target and as an offset"


def _final(spot: Spot) -> Spot:
    """Return the spot that moves there go to: what shares its offset with others counts as what it is offset from."""
    while spot.shared and spot.parent is not None:
        spot = spot.parent
    return spot


def _with_unused(targets: Targets, script: Script, skips: list[tuple[int, str]]) -> list[Spot]:
    """Return the spots, and those that variables of moves are assigned without a move that is known to go there."""
    reached = {spot.numbers.start for spot in targets.spots} | targets.framed
    tcps = {tcp for spot in targets.spots for tcp in spot.tcps or ()}
    frames = {spot.frame for spot in targets.spots if spot.numbers.kind == "pose"}
    spots = list(targets.spots)
    for series in targets.names.series:
        for assignment in series.assignments if series.reached else ():
            numbers = assignment.numbers
            if numbers is None or numbers.start in reached or (numbers.kind == "pose" and not any(numbers.values)):
                continue
            several = len(tcps) > 1 or (len(frames) > 1 and numbers.kind == "pose")
            if several or series.last_computed >= 0:
                skips.append((numbers.start, f"{assignment.name} is assigned, and no move is known to go there"))
            else:
                frame = next(iter(frames), "") if numbers.kind == "pose" else ""
                spots.append(Spot(script.sized(numbers), assignment.name, frame, tcps=tcps))
    return spots


def _trouble(spot: Spot, targets: Targets) -> str:
    if spot.trouble:
        return spot.trouble
    tcps = spot.tcps or set()
    if COMPUTED in tcps:
        reason = "its TCP is computed"
    elif len(tcps) != 1:
        names = sorted("that of the installation" if tcp is None else tcp for tcp in tcps)
        reason = f"moves reach it with several TCPs: {', '.join(names)}" if names else "it is not known with which TCP"
    elif spot.nears is not None and len(spot.nears) > 1:
        reason = "moves reach it near to different joints"
    elif spot.numbers.start in targets.framed:
        reason = "it is a frame of other targets"
    elif spot.parent is not None and _trouble(_final(spot.parent), targets):
        reason = "it is an offset from a target that stays as it is"
    elif _open(spot) and _rotation(spot) == (0.0, 0.0, 0.0) and not _lends(spot):
        reason = "a circle passes it in an orientation that the program does not tell"
    else:
        return ""
    spot.trouble = reason
    return reason


def _open(spot: Spot) -> bool:
    """Return whether only circles pass a pose, so that its orientation is of no meaning."""
    return spot.passed_to is not None and not spot.ended and spot.parent is None and spot.numbers.kind == "pose"


def _rotation(spot: Spot) -> tuple[float, ...]:
    return spot.numbers.values[3:]


def _lends(spot: Spot) -> bool:
    """Return whether the end of the circle that passes a spot can lend it its orientation."""
    end = spot.passed_to
    return end is not None and end.numbers.kind == "pose" and end.parent is None and end.frame == spot.frame


def _target(spot: Spot, source: int, script: Script, unset: str) -> ProgramTarget:
    numbers = spot.numbers
    values: tuple[float, ...] = numbers.values
    places: tuple[tuple[int, int] | None, ...] = numbers.places
    if _open(spot) and not any(_rotation(spot)) and spot.passed_to is not None:
        values, places = values[:3] + _rotation(spot.passed_to), (*places[:3], None, None, None)
    return ProgramTarget(
        source=source,
        line=script.lines.number(numbers.start),
        name=spot.name,
        form=POSE if numbers.kind == "pose" else JOINTS,
        values=values,
        places=places,
        tool=_tool(spot.tcps, unset),
        frame=spot.frame,
        configuration=Configuration(near=next(iter(spot.nears))) if spot.nears else ANY_POSTURE,
        turned=spot.turned,
    )


def _tool(tcps: set[Tcp] | None, unset: str) -> str:
    tcp = next(iter(tcps)) if tcps else None
    return unset if tcp is None else tcp


def _moves(goings: list[Going], source: int, script: Script, routines: int) -> list[Move]:
    moves = []
    lost = 0
    for call, kind, end, passed, _, number in goings:
        target = -1 if end is None else _final(end.spot).index
        if end is None or target < 0:
            lost += 1
            continue
        via = -1 if passed is None else _final(passed.spot).index
        passes = None if passed is None or via < 0 else _words(passed)
        split_text = _words(end) if kind != "circular" or passes not in (None, _NOWHERE) else _NOWHERE
        moves.append(
            Move(
                kind=kind,
                target=target,
                source=source,
                line=script.lines.number(call.start),
                via=via if via >= 0 else None,
                routine=routines + number + lost,
                statement=(call.start, script.partner[call.opened] + 1),
                target_text=split_text,
                via_text=passes,
            )
        )
        lost += not end.at_spot or end.spot.shared
    return moves


def _words(use: Use) -> tuple[int, int]:
    return _NOWHERE if use.spot.shared else use.words
