"""The spots and moves of URScript files as a :class:`Program`: which spots are targets, and which have to stay."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Final, NamedTuple

from truearm.compensation.programs.program import (
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
from truearm.compensation.programs.urscript.script import Call, Script
from truearm.compensation.programs.urscript.targets import Spot, Targets, Use
from truearm.compensation.programs.urscript.tcp import COMPUTED, Places, Stretch, Tcp
from truearm.modeling.orientations import ROTATION_VECTOR

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


def made_program(
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
    for source, (script, found, goings, left) in enumerate(parts):
        _note_tcps(goings)
        _note_shared(found)
        skips = list(left)
        kept: list[tuple[Spot, ProgramTarget]] = []
        for spot in _with_unused(found, script, skips):
            trouble = _trouble(spot, found)
            if not spot.shared and trouble:
                skips.append((spot.numbers.start, trouble))
            elif not spot.shared:
                kept.append((spot, _target(spot, source, script, unset)))
        kept.sort(key=lambda pair: pair[0].numbers.start)
        for index, (spot, _) in enumerate(kept, len(targets)):
            spot.index = index
        for spot, target in kept:
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
            if use is not None and use.near is not None and use.there:
                use.spot.nears = (use.spot.nears or set()) | {use.near}


def _note_shared(found: Targets) -> None:
    """Note the numbers that stand for more than one spot: offsets that several targets share, and confusions."""
    first: dict[int, Spot] = {}
    several: dict[int, list[Spot]] = {}
    for spot in found.spots:
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


def _with_unused(found: Targets, script: Script, skips: list[tuple[int, str]]) -> list[Spot]:
    """Return the spots, and those that variables of moves are assigned without a move that is known to go there."""
    reached = {spot.numbers.start for spot in found.spots} | found.framed
    tcps = {tcp for spot in found.spots for tcp in spot.tcps or ()}
    frames = {spot.frame for spot in found.spots if spot.numbers.kind == "pose"}
    spots = list(found.spots)
    for series in found.names.series:
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


def _trouble(spot: Spot, found: Targets) -> str:
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
    elif spot.numbers.start in found.framed:
        reason = "it is a frame of other targets"
    elif spot.parent is not None and _trouble(_final(spot.parent), found):
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
        lost += not end.there or end.spot.shared
    return moves


def _words(use: Use) -> tuple[int, int]:
    return _NOWHERE if use.spot.shared else use.words
