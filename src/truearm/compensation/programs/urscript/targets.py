"""Where the moves of a URScript file go: from the words of a move to the six numbers behind them.

Source: script manual, "Module motion" (movej, movel, movep, movec, servoj, optimovej, optimovel), "Module internals"
(get_inverse_kin, set_tcp) and "Module urmath" (``pose_trans(p_from, p_from_to)`` is the product of both poses,
``pose_add(p_1, p_2)`` the sum of the positions and the product of the rotations).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

from truearm.compensation.programs.urscript.names import Names
from truearm.compensation.programs.urscript.script import Assignment, Script
from truearm.compensation.programs.urscript.tcp import Places, Tcp
from truearm.compensation.programs.urscript.text import Called, Name, Numbers, Other, Value

#: Variables are followed through this many assignments.
_DEEPEST: Final = 20
#: Functions that tell where the robot is.
_WHERE_IT_IS: Final = frozenset(
    f"get_{which}_{what}"
    for which in ("actual", "target")
    for what in ("tcp_pose", "joint_positions", "tool_flange_pose", "tcp_pose_along_path")
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
    there: bool = True  #: Whether the move ends at the spot, and not at an offset beyond it that only the robot knows.


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
            found = self.names.find(value.name, at.routine, at.place)
            if isinstance(found, Assignment) and not found.aimed:
                found.aimed = True
                if found.value is not None and at.depth < _DEEPEST:
                    self.aim(found.value, At(found.routine, found.start, at.depth + 1))
        elif isinstance(value, Called) and value.function in ("get_inverse_kin", "pose_add"):
            first = self._argument(value, 0, "x" if value.function == "get_inverse_kin" else "p_1")
            if first is not None and at.depth < _DEEPEST:
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
        if at.depth > _DEEPEST:
            return "it is computed in too many steps"
        if isinstance(value, Numbers):
            if frame and value.kind == "joints":
                return "joints stand in no frame"
            return Use(self._spot(value, name, frame, None, False), words)
        if isinstance(value, Name):
            found = self._found(value.name, at)
            if isinstance(found, str):
                return found
            if found.value is None:
                return f"the numbers of {value.name} are changed one by one"
            numbers = found.numbers
            if numbers is not None:
                found.series.reached = True
                use = self.reach(numbers, at, frame, value.name)
                return use if isinstance(use, str) else Use(use.spot, words)
            if self._comes_round(found.value, At(found.routine, found.start)):
                return f"{value.name} is computed from what changes later"
            use = self.reach(found.value, At(found.routine, found.start, at.depth + 1), frame, value.name)
            if isinstance(use, str):
                return use
            return Use(use.spot, _in_frame(use, frame, words), use.near, use.there)
        deeper = At(at.routine, at.place, at.depth + 1)
        if value.function == "get_inverse_kin":
            return "joints stand in no frame" if frame else self._solved(value, deeper, name)
        if value.function == "pose_trans":
            return self._transformed(value, deeper, frame, name)
        if value.function == "pose_add":
            return self._added(value, deeper, frame, name)
        if value.function in _WHERE_IT_IS:
            return "it depends on where the robot is"
        return f"it is computed by {value.function}"

    def plain(self, value: Value | None, at: At) -> tuple[Numbers, str] | None:
        """Return six numbers and their name, if a value is that or a variable that was assigned that."""
        if isinstance(value, Name):
            found = self.names.find(value.name, at.routine, at.place)
            if isinstance(found, Assignment) and found.numbers is not None:
                return found.numbers, value.name
        return (value, "") if isinstance(value, Numbers) else None

    def _found(self, name: str, at: At) -> Assignment | str:
        found = self.names.find(name, at.routine, at.place)
        if found is None:
            return f"{name} is not declared in this program"
        return f"{name} is an argument of its routine" if found == "argument" else found

    def _argument(self, called: Called, index: int, keyword: str) -> Value | None:
        return self._script.argument(called.opened, index, keyword)

    def _comes_round(self, value: Value, at: At) -> bool:
        """Return whether a value has variables that are computed again behind it: a loop may sum it up."""
        if isinstance(value, Name):
            found = self.names.find(value.name, at.routine, at.place)
            return isinstance(found, Assignment) and found.series.last_computed >= at.place
        if isinstance(value, Called) and at.depth < _DEEPEST:
            deeper = At(at.routine, at.place, at.depth + 1)
            arguments = self._script.arguments(value.opened)
            return any(self._comes_round(one.value, deeper) for one in arguments)
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
        if plain is None or not use.there:
            return Use(parent, (0, 0), there=False)
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
        found = self._found(value.name, at)
        if isinstance(found, str):
            undeclared = self.names.find(value.name, at.routine, at.place) is None
            return _Frame(value.name) if undeclared else _Frame("", f"its frame {found}")
        if found.aimed:
            return None
        if found.numbers is None:
            if isinstance(found.value, Name) and at.depth < _DEEPEST:
                return self._frame(found.value, At(found.routine, found.start, at.depth + 1))
            return None
        if found.series.several and found.routine != at.routine:
            return _Frame("", f"its frame {value.name} is assigned more than once, in another routine")
        return self._named_frame(found.numbers, value.name)

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
    return words if use.there and use.spot.frame == frame else (0, 0)
