"""Staubli VAL3: data files (``.dtx``) with the programs that use them (``.pgx``) and the project (``.pjx``).

A point's numbers stand in the data file, relative to a frame, its father; which tool it is reached with stands in the
program. So both are read together; an application is what lies in one folder. Sources: Staubli, VAL3 reference manual
(version 5.3, D28062804A, and 7), chapters "Arm positions" (types joint, trsf, frame, tool, point, config) and
"Movement control"; Staubli, VAL3 XML format (s6.x).

Shoulder words: `lefty` is the posture with the wrist before axis 1 and `righty` the one with the wrist behind it, as
the public post-processors for these arms have it. `epositive` and `wpositive` are the signs of joints 3 and 5.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from math import inf, radians
from pathlib import Path
from typing import Final

from truearm.engine.base.errors import InputError
from truearm.engine.programs.program import (
    ANY_POSTURE,
    BYTE_ORDER_MARK,
    Configuration,
    Form,
    Language,
    Lines,
    Move,
    Program,
    ProgramTarget,
    Skipped,
    Source,
    with_lines_behind,
)
from truearm.engine.programs.val3.code import Routine, Words, routines_of
from truearm.engine.programs.val3.data import NUMBERS, Element, Variable, father_of, name_of, transforms, variables_of
from truearm.engine.programs.val3.new import motion_program, new_program
from truearm.engine.robot.transform import MOVING_XYZ_ANGLES

#: The root of a file; a document type, which could name other files, is not let pass before it.
_ROOT: Final = re.compile(
    rf"(?:{BYTE_ORDER_MARK})?\s*+(?>(?:<\?.*?\?>|<!--.*?-->)\s*)*+<(?:\w+:)?(Database|dataList|Programs|programList|[Pp]roject)\b"
    r"[^<>]*(?:VAL3|NameSpace)",
    re.DOTALL,
)
_BEGIN: Final = re.compile(r"<(?:\w+:)?Code>\s*+(?:<!\[CDATA\[)?\s*+begin\b", re.I)
_HEAD: Final = re.compile(rf"(?:{BYTE_ORDER_MARK})?\s*+(?:<\?xml\b.*?\?>)?", re.DOTALL)
_MILLIMETRES: Final = re.compile(r"\bmillimeterUnit\s*=\s*[\"'](\w+)[\"']")
_POINTS: Final = ("pointRx", "pointRs")
_JOINTS: Final = ("jointRx", "jointRs")

_POSTURES: Final[dict[str, Configuration]] = {
    "lefty": Configuration(shoulder="front"),
    "righty": Configuration(shoulder="back"),
    "epositive": Configuration(ranges=((3, 0.0, inf),)),
    "enegative": Configuration(ranges=((3, -inf, 0.0),)),
    "wpositive": Configuration(ranges=((5, 0.0, inf),)),
    "wnegative": Configuration(ranges=((5, -inf, 0.0),)),
}

#: An element by its variable and its key.
Key = tuple[str, str]
#: Names of tools that moves have, None for one that a variable chooses.
Tools = set[str | None]


def recognizes(text: str) -> bool:
    """Tell whether a text is a file of a VAL3 application."""
    return _ROOT.match(text) is not None


def commented(text: str, lines: Sequence[str]) -> str:
    """Return a file with a comment: a program's in its code, any other's behind the XML declaration."""
    begin = _BEGIN.search(text)
    if begin is not None:
        return with_lines_behind(text, begin.end(), [f"  // {line}" for line in lines], "//")
    head = _HEAD.match(text)
    return with_lines_behind(text, head.end() if head else 0, [f"<!-- {line} -->" for line in lines], None)


def read(sources: Sequence[Source]) -> Program:
    """Read the files of one or more VAL3 applications.

    Args:
        sources: Data, program and project files. A project says whether lengths are millimetres or inches; without one
            they are millimetres.

    Raises:
        InputError: If a file is not well-formed or not complete, or a number is malformed.
    """
    lines = [Lines(source.text) for source in sources]
    applications: dict[Path, _Application] = {}
    for index, source in enumerate(sources):
        application = applications.setdefault(source.path.parent, _Application())
        _take(application, index, source, lines[index])
    contents = _Contents()
    for application in applications.values():
        _note_tools(application)
        places = _add_data(contents, application)
        _add_moves(contents, application, places)
    targets, moves = _in_order(contents)
    every = applications.values()
    return Program(
        language=VAL3.name,
        sources=tuple(sources),
        targets=targets,
        moves=moves,
        tools=transforms("tool", sources, [(app.variables, app.changed, app.length) for app in every]),
        frames=transforms("frame", sources, [(app.variables, app.changed, app.length) for app in every]),
        skipped=tuple(sorted(contents.skipped, key=lambda skipped: (skipped.source, skipped.line))),
        unknown=dict(sum((routine.unknown for app in every for _, routine in app.routines), Counter())),
    )


@dataclass
class _Application:
    """What lies in one folder: its variables, its programs with the number of their file, and what these tell."""

    variables: dict[str, Variable] = field(default_factory=dict)
    routines: list[tuple[int, Routine]] = field(default_factory=list)
    length: float = 1e-3
    changed: set[str] = field(default_factory=set)
    handed_over: set[str] = field(default_factory=set)
    tools_of_elements: dict[Key, Tools] = field(default_factory=dict)
    tools_of_variables: dict[str, Tools] = field(default_factory=dict)
    tools: Tools = field(default_factory=set)


@dataclass
class _Contents:
    targets: list[ProgramTarget] = field(default_factory=list)
    moves: list[Move] = field(default_factory=list)
    skipped: list[Skipped] = field(default_factory=list)
    routines: int = 0


def _take(application: _Application, index: int, source: Source, lines: Lines) -> None:
    root = _ROOT.match(source.text)
    if root is None:
        raise InputError("this is no file of a VAL3 application", where=str(source.path))
    if root[1] in ("Database", "dataList"):
        for variable in variables_of(source, index, lines):
            if variable.name in application.variables:
                source.refuse(variable.line, f"{variable.name} is declared twice in one application")
            application.variables[variable.name] = variable
    elif root[1] in ("Programs", "programList"):
        for routine in routines_of(source, lines):
            application.routines.append((index, routine))
            application.changed |= routine.changed - routine.own
            application.handed_over |= routine.handed_over - routine.own
    else:
        unit = _MILLIMETRES.search(source.text)
        if unit is not None and unit[1].lower() == "false":
            application.length = 0.0254


def _note_tools(application: _Application) -> None:
    """Note which tools the moves of an application have, and with which they reach each point."""
    for _, routine in application.routines:
        for move in routine.moves:
            if move is None:
                continue
            tool = None
            if move.tool is not None and move.tool[1] is not None and move.tool[0] not in routine.own:
                tool = "" if move.tool[0] == "flange" else name_of(move.tool[0], move.tool[1])
            application.tools.add(tool)
            for words in (move.target, move.via):
                if words is None or words.point is None or words.point[0] in routine.own:
                    continue
                name, key = words.point
                if key is None:
                    application.tools_of_variables.setdefault(name, set()).add(tool)
                else:
                    application.tools_of_elements.setdefault((name, key), set()).add(tool)


def _add_data(contents: _Contents, application: _Application) -> dict[Key, int]:
    """Make targets of the elements of points and joint positions, and return the places of the targets."""
    places: dict[Key, int] = {}
    declared: Tools = {
        name_of(name, key)
        for name, variable in application.variables.items()
        if variable.type == "tool" and name != "flange"
        for key in variable.elements
    }
    # A point that no move uses has the tool that all moves have, or without moves the only one there is.
    otherwise: Tools = application.tools or (declared if len(declared) == 1 else set())
    for name, variable in application.variables.items():
        if variable.type not in (*_POINTS, *_JOINTS):
            continue
        form = _form(variable.type, application.length)
        chosen = application.tools_of_variables.get(name)
        for key, element in variable.elements.items():
            tools = application.tools_of_elements.get((name, key))
            if chosen is not None:
                tools = chosen if tools is None else chosen | tools
            elif tools is None:
                tools = otherwise
            written = name_of(name, key)
            reason = _reason(application, variable, element, tools)
            if reason is not None:
                contents.skipped.append(Skipped(variable.source, element.line, f"{written} {reason}"))
                continue
            places[name, key] = len(contents.targets)
            contents.targets.append(
                ProgramTarget(
                    variable.source,
                    element.line,
                    written,
                    form,
                    element.values,
                    element.places,
                    tool=next(iter(tools)) or "",
                    frame=father_of(element, "frame") if variable.type in _POINTS else "",
                    configuration=_configuration(element.posture) if variable.type == "pointRx" else ANY_POSTURE,
                )
            )
    return places


def _reason(application: _Application, variable: Variable, element: Element, tools: Tools) -> str | None:
    """Return why an element is left as it is, None if it is not."""
    if variable.name in application.changed:
        return "is changed by the program"
    if variable.name in application.handed_over:
        return "is handed to another program"
    if variable.type in _POINTS and not element.father:
        return "has no frame"
    if variable.type in _POINTS and all(start == stop for start, stop in element.places):
        return "is not taught: none of its numbers is written"
    if not tools:
        return "is used by no move, and it is not known with which tool it is reached"
    if len(tools) > 1:
        return "is used with several tools, or by no move where moves have several"
    if None in tools:
        return "is reached with a tool that a variable chooses"
    return None


def _add_moves(contents: _Contents, application: _Application, places: dict[Key, int]) -> None:
    """Make moves of the programs, and targets of the offsets in them."""
    for index, routine in application.routines:
        for move in routine.moves:
            ends: list[int | None] = []
            for words in (move.via, move.target) if move is not None else ():
                target = _target(contents, application, places, index, routine, words) if words is not None else None
                if isinstance(target, str) and words is not None:
                    contents.skipped.append(Skipped(index, words.line, target))
                ends.append(target if isinstance(target, int) else None)
            via, end = ends or (None, None)
            if move is None or end is None or (move.via is not None and via is None):
                contents.routines += 1
                continue
            contents.moves.append(
                Move(
                    move.kind,
                    end,
                    index,
                    move.line,
                    via,
                    contents.routines,
                    (move.start, move.stop),
                    (move.target.start, move.target.stop),
                    (move.via.start, move.via.stop) if move.via is not None else None,
                )
            )
        contents.routines += 1


def _target(
    contents: _Contents, application: _Application, places: dict[Key, int], index: int, routine: Routine, words: Words
) -> int | str | None:
    """Return the target that words of a move mean, or why it is not known, or None if the reason is given elsewhere."""
    if words.point is None or words.point[0] in routine.own:
        return "the target of the move is computed when the program runs"
    name, key = words.point
    variable = application.variables.get(name)
    if variable is None:
        return f"{name} is not declared in the data given"
    if key is None:
        return None
    if key not in variable.elements:
        return f"{name_of(name, key)} has no value in the data"
    place = places.get((name, key))
    if not words.offset:
        return place
    if place is None:
        return f"the offset is from {name_of(name, key)}, which is left as it is"
    parent = contents.targets[place]
    if parent.form.kind != "pose":
        return place
    contents.targets.append(
        replace(
            parent,
            source=index,
            line=words.line,
            name="",
            values=words.offset,
            places=words.places,
            parent=place,
            turned=True,
        )
    )
    return len(contents.targets) - 1


def _in_order(contents: _Contents) -> tuple[tuple[ProgramTarget, ...], tuple[Move, ...]]:
    """Return targets and moves with the targets in the order of the text."""
    order = sorted(
        range(len(contents.targets)), key=lambda i: (contents.targets[i].source, contents.targets[i].places[0])
    )
    if order == list(range(len(order))):
        return tuple(contents.targets), tuple(contents.moves)
    new = {old: i for i, old in enumerate(order)}
    ordered = (contents.targets[old] for old in order)
    targets = (replace(t, parent=new[t.parent]) if t.parent is not None else t for t in ordered)
    moves = (
        replace(move, target=new[move.target], via=new[move.via] if move.via is not None else None)
        for move in contents.moves
    )
    return tuple(targets), tuple(moves)


@cache
def _form(type_: str, length: float) -> Form:
    unit = radians(1.0)
    absent = tuple(f' {name}="{{}}"' for name in NUMBERS[type_])
    decimals = (3, 4) if length < 0.01 else (5, 4)
    if type_ in _JOINTS:
        return Form(type_, "joints", length, unit, None, decimals, absent)
    return Form(type_, "pose", length, unit, MOVING_XYZ_ANGLES, decimals, absent)


@cache
def _configuration(words: tuple[str, ...]) -> Configuration:
    postures = [_POSTURES.get(word, ANY_POSTURE) for word in words]
    return Configuration(
        shoulder=next((part.shoulder for part in postures if part.shoulder is not None), None),
        ranges=tuple(reading for part in postures for reading in part.ranges),
    )


#: The transformation of a point, or a part of it, that is not assigned.
_READS: Final = re.compile(
    r"//[^\n]*+|\"[^\"\n]*+\"|\b([A-Za-z]\w*+)(?:\[[^\]\n]*+\])?+\.trsf\b(?!(?:\.\w++)?+\s*+=(?!=))(?:\.\w++)?+"
)

VAL3: Final = Language(
    "VAL3",
    (".dtx", ".pgx", ".pjx"),
    ("Stäubli",),
    recognizes,
    read,
    commented,
    new=new_program,
    motion=motion_program,
    together=True,
    base=("world",),
    reads=_READS,
)
