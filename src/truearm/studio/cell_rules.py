"""Boxes to keep clear of, floor and clearance of a constraints file: read in mm, and changed in the file's own text.

What else the file says, its units and its comments stay as they are.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any, Final

from truearm.engine.base.errors import InputError, refusals_at
from truearm.engine.base.files import exists, read_text, read_yaml
from truearm.engine.base.schemas import validated
from truearm.engine.base.units import as_number, from_si, sized_si, to_si
from truearm.engine.motion.cell import Cell, boxes_of
from truearm.engine.motion.collisions import CollisionCheck
from truearm.engine.motion.constraints import Constraints, keep_out
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot

#: What a new file begins with.
_NEW: Final = "truearm: truearm-constraints/1\nunits: {length: mm, angle: deg}\n"
_RANGE: Final = "LOW..HIGH in mm, both with a decimal point; or an empty field where the box ends on neither side"


@dataclass(frozen=True, eq=False)
class CellRules:
    """What a constraints file says of the cell, as fields of a page show it."""

    text: str  #: The file.
    #: For each box its ranges x, y and z in mm, such as ``350..800``; empty where it does not end.
    boxes: Mapping[str, tuple[str, str, str]]
    #: Lowest and highest corner of each in the base frame [m], infinite where it does not end.
    corners: Mapping[str, tuple[Array, Array]]
    floor: float | None  #: floor, clearance: in mm; None where nothing is said.
    clearance: float | None


def read_rules(path: Path) -> CellRules:
    """Read what a constraints file says of the cell.

    Raises:
        InputError: If it is none, or a box has no end or a range the wrong way round.
    """
    return _rules(read_text(path, "yaml_size"), read_yaml(path, Constraints), str(path))


def changed_rules(path: Path, robot: Robot, change: Callable[[dict[str, Any], str], None]) -> CellRules:
    """Return what a constraints file says after a change; a file that is missing is a new one.

    Args:
        robot: Whose base no box may hold.
        change: Called with the entries of the file and its unit of lengths, to change the entries.

    Raises:
        InputError: If the file would not be one that can be used.
    """
    from ruamel.yaml import YAML

    yaml, stream = YAML(), StringIO()
    yaml.width, yaml.preserve_quotes = 4096, True
    if exists(path):
        read_yaml(path, Constraints)  # what cannot be read safely is refused before it is read to be changed
    content = yaml.load(read_text(path, "yaml_size") if exists(path) else _NEW)
    change(content, str(content["units"]["length"]))
    for name in ("keep_out", "floor", "clearance"):
        if content.get(name) in (None, {}):
            content.pop(name, None)
    yaml.dump(content, stream)
    rules = _rules(stream.getvalue(), validated(_plain(content), Constraints, path.name), path.name)
    with refusals_at(path.name):
        CollisionCheck(robot, Cell(None, boxes_of(rules.corners)))
    return rules


def with_box(
    name: str, ranges: tuple[str, str, str], before: str | None = None
) -> Callable[[dict[str, Any], str], None]:
    """Return a change that puts a box with ranges in mm into a file.

    Args:
        before: What the box was called; None for a new one.
    """

    def change(content: dict[str, Any], unit: str) -> None:
        from ruamel.yaml.comments import CommentedMap, CommentedSeq

        boxes = content.setdefault("keep_out", CommentedMap())
        if not name:
            raise InputError("a box needs a name", parameter="name", came=name, allowed="any text")
        if name != before and name in boxes:
            raise InputError("there is a box of this name already", parameter="name", came=name)
        box = CommentedMap()
        for axis, text in zip("xyz", ranges, strict=True):
            if text.strip():
                ends = CommentedSeq(_ends(text, axis, unit))
                ends.fa.set_flow_style()
                box[axis] = ends
        box.fa.set_flow_style()
        if before is None:
            boxes[name] = box
            return
        kept = [(name, box) if key == before else (key, value) for key, value in boxes.items()]
        for key in list(boxes):
            del boxes[key]
        for key, value in kept:
            boxes[key] = value

    return change


def without_box(name: str) -> Callable[[dict[str, Any], str], None]:
    """Return a change that takes a box out of a file."""

    def change(content: dict[str, Any], _: str) -> None:
        content["keep_out"].pop(name, None)

    return change


def with_length(name: str, value: float | None) -> Callable[[dict[str, Any], str], None]:
    """Return a change that sets ``floor`` or ``clearance`` of a file [mm]; None takes it out."""

    def change(content: dict[str, Any], unit: str) -> None:
        if value is None:
            content.pop(name, None)
        else:
            content[name] = _in_file(value, unit, name)

    return change


def _rules(text: str, constraints: Constraints, where: str) -> CellRules:
    unit = constraints.units.length

    def shown(given: tuple[float, float] | None) -> str:
        return "" if given is None else "..".join(f"{_in_mm(end, unit):.10g}" for end in given)

    return CellRules(
        text,
        {name: (shown(box.x), shown(box.y), shown(box.z)) for name, box in constraints.keep_out.items()},
        keep_out(constraints, where),
        None if constraints.floor is None else _in_mm(constraints.floor, unit),
        None if constraints.clearance is None else _in_mm(constraints.clearance, unit),
    )


def _in_mm(value: float, unit: str) -> float:
    return value if unit == "mm" else round(from_si(to_si(value, unit), "mm"), 9)


def _ends(text: str, axis: str, unit: str) -> list[float]:
    ends = [as_number(end.strip()) for end in text.split("..")]
    if len(ends) != 2 or None in ends:
        raise InputError("a range of two numbers belongs here", parameter=axis, came=text, allowed=_RANGE)
    return [_in_file(end, unit, axis) for end in ends if end is not None]


def _in_file(value: float, unit: str, parameter: str) -> float:
    metres = sized_si(value, "mm", parameter=parameter)
    in_unit = value if unit == "mm" else round(from_si(metres, unit), 12)
    return int(in_unit) if in_unit == int(in_unit) else in_unit


def _plain(content: Any) -> Any:
    """Return entries as plain mappings, lists and values, as a reader sees them."""
    if isinstance(content, Mapping):
        return {key: _plain(value) for key, value in content.items()}
    if isinstance(content, list):
        return [_plain(value) for value in content]
    return str(content) if isinstance(content, str) else content
