"""Staubli VAL3: the code of a program file (``.pgx``): its moves, and what it computes itself."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field
from typing import Final

from truearm.engine.programs.program import LARGEST, NUMBER, Lines, MoveKind, Source
from truearm.engine.programs.val3.data import Attributes, parse

_KINDS: Final[dict[str, MoveKind]] = {"movej": "joint", "movel": "linear", "movec": "circular"}
#: Words of how many targets, the tool and the motion descriptor.
_ARGUMENTS: Final = {"joint": 3, "linear": 3, "circular": 4}

_CDATA: Final = re.compile(r"<!\[CDATA\[(.*?)\]\]>", re.DOTALL)
_MARKUP: Final = re.compile(r"<!--.*?-->|<\?.*?\?>", re.DOTALL)
_ENTITY: Final = re.compile(r"&(lt|gt|amp|quot|apos|#\w{1,8});")
_CHARACTERS: Final = {"lt": "<", "gt": ">", "amp": "&", "quot": '"', "apos": "'"}
_SILENT: Final = re.compile(r'//[^\r\n]*|"(?:\\.|[^"\\\r\n])*"?')

_CALL: Final = re.compile(r"(?<![\w.:$])(?:(call)[ \t]+)?([A-Za-z_$][\w$]*(?::\w+)?)\s*\(")
#: What follows the bracket of nearly every move.
_PLAIN: Final = re.compile(
    r"\s*((\w+)(?:\[(\d+)\])?)\s*,\s*([A-Za-z_]\w*)(?:\[(\d+)\])?\s*,\s*[A-Za-z_]\w*(?:\[\d+\])?\s*\)"
)
_BRACKET: Final = re.compile(r"[(){}\[\],]")
_ASSIGNED: Final = re.compile(
    r"(?<![\w.:])([A-Za-z_]\w*)\s*(?:\[(?:[^\[\]]|\[[^\[\]]*\])*+\]\s*)?(?:\.\s*\w+\s*)*+=(?!=)"
)
_REFERENCE: Final = re.compile(r"\s*([A-Za-z_]\w*(?::\w+)?)\s*(?:\[([^\[\]]*)\])?\s*")
_APPROACH: Final = re.compile(r"\s*appro\s*\(")
_INDEX: Final = re.compile(r"\d+(?:,\d+)*")
_LITERAL: Final = re.compile(r"\s*\{" + ",".join([rf"\s*((?>{NUMBER}))\s*"] * 6) + r"\}\s*")
_WORD: Final = re.compile(r"[A-Za-z_]\w*")
_BEGIN: Final = re.compile(r"\s*begin\b")
_END: Final = re.compile(r"\bend\Z")

#: Instructions that change what is handed to them, and which argument.
_CHANGERS: Final = {**dict.fromkeys(("link", "resize", "insert", "delete", "append"), 0), "setFrame": -1}
#: Instructions of the manual that send the robot nowhere, and words that a bracket may follow.
_INSTRUCTIONS: Final = (
    "abs acos aioGet aioLink aioSet align and append appro asc asin atan autoConnectMove bAnd bNot bOr bXor case "
    "ceiling chr clearBuffer clock close cls codeAscii compose config cos delay delete dioGet dioLink dioMap dioSet "
    "disablePower distance do elseIf enablePower esStatus find first for fromBinary get getDate getDisplayLen getKey "
    "getMonitorSpeed getSpeed getVersion gotoxy help here herej if insert interpolateC interpolateL isCalibrated "
    "isCompliant isEmpty isInRange isKeyPressed isPowered isSettled jointToPoint keyPressed last left len libDelete "
    "libExist libList libLoad libPath libSave link ln log logMsg max mid min next not open or pointToJoint popUpMsg "
    "position prev put putln random read replace resetMotion resetTurn resize restartMove return right round "
    "roundDown roundUp select setFrame setMonitorSpeed setProfile setTextMode sin sioCtrl sioGet sioSet size sizeof "
    "sqrt stopMove switch synchro tan taskCreate taskCreateSync taskKill taskResume taskStatus taskSuspend title "
    "toBinary toNum toString until userPage wait waitEndMove watch while workingMode write xor"
)
_KNOWN: Final = frozenset(word.lower() for word in _INSTRUCTIONS.split())


#: Words for a variable's element: its name, and its key or None if the key is computed.
Reference = tuple[str, str | None]


@dataclass(slots=True)
class Words:
    """What a move is sent to."""

    start: int  #: start, stop, line: where it stands in the text, and on which line of the file.
    stop: int
    line: int
    point: Reference | None  #: The point or joint position, None if it is computed.
    #: offset, places: the six numbers of an offset that are written, and where; empty for none.
    offset: tuple[float, ...] = ()
    places: tuple[tuple[int, int], ...] = ()


@dataclass(slots=True)
class CodeMove:
    """A move as a program has it."""

    kind: MoveKind
    target: Words
    via: Words | None
    tool: Reference | None
    start: int
    stop: int
    line: int


@dataclass
class Routine:
    """A program: its moves, None where the robot may come from elsewhere."""

    own: set[str] = field(default_factory=set)  #: Names of its parameters and local variables.
    moves: list[CodeMove | None] = field(default_factory=list)
    changed: set[str] = field(default_factory=set)  #: Names of the variables that it changes.
    #: Names in calls of other programs and of instructions that are not known.
    handed_over: set[str] = field(default_factory=set)
    unknown: Counter[str] = field(default_factory=Counter)  #: Instructions that are not known.


def routines_of(source: Source, lines: Lines) -> list[Routine]:
    """Read the programs of a file, or refuse it."""
    reader = _Reader(source)
    parse(source, reader.started, reader.ended)
    for routine, start, stop in reader.codes:
        _read(source, lines, routine, start, stop)
    return [routine for routine, _, _ in reader.codes]


class _Reader:
    """Takes the tags of a program file, in either format."""

    def __init__(self, source: Source) -> None:
        self.codes: list[tuple[Routine, int, int]] = []
        self._source = source
        self._own: set[str] = set()
        self._declaring = False
        self._code: int | None = None

    def started(self, name: str, attributes: Attributes, place: int) -> None:
        folded = name.lower()
        if folded == "program":
            self._own = set()
        elif folded in ("parameters", "locals", "paramsection", "localsection"):
            self._declaring = True
        elif self._declaring and "name" in attributes:
            self._own.add(attributes["name"])
        elif folded == "code":
            self._code = self._source.text.index(">", place) + 1

    def ended(self, name: str, place: int) -> None:
        folded = name.lower()
        if folded in ("parameters", "locals", "paramsection", "localsection"):
            self._declaring = False
        elif folded == "code" and self._code is not None:
            self.codes.append((Routine(own=self._own), self._code, max(self._code, place)))
            self._code = None


def _blank(text: str) -> str:
    return " " * len(text)


def _bare(raw: str) -> str:
    """Return code without markup, comments and strings, every character at its place."""

    def plain(piece: str) -> str:
        def character(entity: re.Match[str]) -> str:
            return _CHARACTERS.get(entity[1], " ").ljust(len(entity[0]))

        return _ENTITY.sub(character, _MARKUP.sub(lambda tag: _blank(tag[0]), piece))

    parts, end = [], 0
    for match in _CDATA.finditer(raw):
        parts += [plain(raw[end : match.start()]), " " * 9, match[1], " " * 3]
        end = match.end()
    parts.append(plain(raw[end:]))
    return _SILENT.sub(lambda silent: _blank(silent[0]), "".join(parts))


def _read(source: Source, lines: Lines, routine: Routine, start: int, stop: int) -> None:
    # The text before the code is left out, so places in `code` are places in the text less `start`.
    code = _bare(source.text[start:stop])
    if not code.strip():
        return
    if _BEGIN.match(code) is None or _END.search(code.rstrip()) is None:
        source.refuse(lines.number(stop), "the code is not complete: it runs from begin to end")
    routine.changed.update(assigned[1] for assigned in _ASSIGNED.finditer(code))
    for match in _CALL.finditer(code):
        name = match[2]
        if name in _KINDS:
            routine.moves.append(_move(source, lines, code, match, start))
            continue
        known = name.rpartition(":")[2].lower() in _KNOWN
        if match[1] is None and known and name not in _CHANGERS:
            continue
        arguments, last = _arguments(source, lines, code, match.end(), start)
        if name in _CHANGERS:
            routine.changed.update(_WORD.findall(code, *arguments[_CHANGERS[name]]))
            continue
        routine.handed_over.update(_WORD.findall(code, match.end(), last))
        routine.moves.append(None)
        if match[1] is None:
            routine.unknown[name] += 1


def _arguments(source: Source, lines: Lines, code: str, place: int, start: int) -> tuple[list[tuple[int, int]], int]:
    """Return where the arguments of a call stand, and where its last bracket does."""
    depth, begin, spans = 0, place, []
    for bracket in _BRACKET.finditer(code, place):
        if bracket[0] in "({[":
            depth += 1
        elif bracket[0] == ",":
            if depth == 0:
                spans.append((begin, bracket.start()))
                begin = bracket.end()
        elif depth:
            depth -= 1
        else:
            spans.append((begin, bracket.start()))
            return spans, bracket.start()
    return source.refuse(lines.number(start + place), "a bracket is not closed")


def _move(source: Source, lines: Lines, code: str, call: re.Match[str], start: int) -> CodeMove | None:
    kind = _KINDS[call[2]]
    plain = _PLAIN.match(code, call.end()) if kind != "circular" else None
    if plain is not None:
        begin, end = plain.span(1)
        first = start + call.start(2)
        line = lines.number(first)
        words = Words(start + begin, start + end, line, (plain[2], plain[3] or "0"))
        return CodeMove(kind, words, None, (plain[4], plain[5] or "0"), first, start + plain.end(), line)
    arguments, last = _arguments(source, lines, code, call.end(), start)
    line = lines.number(start + call.start(2))
    if len(arguments) != _ARGUMENTS[kind]:
        source.refuse(line, f"{call[2]} has {len(arguments)} arguments", allowed=str(_ARGUMENTS[kind]))
    *places, tool, _ = arguments
    targets = [_words(source, lines, code, place, start) for place in places]
    return CodeMove(
        kind=kind,
        target=targets[-1],
        via=targets[0] if len(targets) == 2 else None,
        tool=_reference(code, *tool),
        start=start + call.start(2),
        stop=start + last + 1,
        line=line,
    )


def _words(source: Source, lines: Lines, code: str, place: tuple[int, int], start: int) -> Words:
    begin, end = place
    begin += len(code[begin:end]) - len(code[begin:end].lstrip())
    end = begin + len(code[begin:end].rstrip())
    line = lines.number(start + begin)
    words = Words(start + begin, start + end, line, _reference(code, begin, end))
    approach = _APPROACH.match(code, begin, end)
    if approach is None:
        return words
    arguments, last = _arguments(source, lines, code, approach.end(), start)
    if len(arguments) != 2 or last + 1 != end:
        return words
    words.point = _reference(code, *arguments[0])
    numbers = _LITERAL.fullmatch(code, *arguments[1])
    if numbers is not None:
        words.offset = tuple(map(float, numbers.groups()))
        words.places = tuple((start + first, start + stop) for first, stop in numbers.regs[1:])
        if max(map(abs, words.offset)) > LARGEST:
            source.refuse(line, "an offset is out of all proportion", came=max(words.offset))
    return words


def _reference(code: str, start: int, stop: int) -> Reference | None:
    match = _REFERENCE.fullmatch(code, start, stop)
    if match is None:
        return None
    key = "0" if match[2] is None else "".join(match[2].split())
    return match[1], key if _INDEX.fullmatch(key) else None
