"""How robots of a fleet are calibrated: the options that a manifest or its table may give them."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final, get_args

from truearm.errors import InputError, did_you_mean, refusals_at
from truearm.files import exists
from truearm.identification.choosing.choice import AUTO
from truearm.identification.solving.losses import LOSSES
from truearm.identification.solving.models import FRAMES, MODELS
from truearm.identification.solving.rounds import Redundant
from truearm.modeling.effects import EFFECTS
from truearm.modeling.parts import Payload

_WHOLE: Final = re.compile(r"[0-9]{1,18}")
#: What separates several names or numbers in a cell.
_SEPARATORS: Final = re.compile(r"[;,\s]+")


def _text(cell: str) -> str:
    return cell


def _whole(cell: str) -> int | str:
    return int(cell) if _WHOLE.fullmatch(cell) else cell


def _names(cell: str) -> list[str]:
    return [name for name in _SEPARATORS.split(cell) if name]


def _numbers(cell: str) -> list[float]:
    try:
        return [float(number) for number in _names(cell)]
    except ValueError as error:
        raise InputError("numbers belong here", came=cell, allowed="0,0,-9.81") from error


#: Every option by its name, a keyword of :func:`truearm.calibrate`, with what makes it of a cell of a table.
OPTIONS: Final[Mapping[str, Callable[[str], Any]]] = {
    "model": _text,
    "train": _whole,
    "seed": _whole,
    "loss": _text,
    "redundancy": _text,
    "bounds": _text,
    "hold": _names,
    "frames": _text,
    "exclude": _text,
    "bootstrap": _whole,
    "effects": _names,
    "payload": _text,
    "gravity": _numbers,
    "base_changes": _names,
    "without": _names,
    "monte_carlo": _whole,
    "zones": _whole,
}
#: Those that name a file, from the manifest's folder.
FILES: Final = ("bounds", "exclude", "frames", "zones")

_KNOWN: Final[Mapping[str, tuple[str, ...]]] = {
    "model": (*(model.name for model in (FRAMES, *MODELS)), AUTO),
    "loss": tuple(LOSSES),
    "redundancy": get_args(Redundant),
    "effects": tuple(effect.name for effect in EFFECTS),
}
_KINDS: Final[Mapping[str, tuple[tuple[type, ...], str]]] = {
    "train": ((int, str), "a whole number, or all"),
    "seed": ((int,), "a whole number"),
    "bootstrap": ((int,), "a whole number"),
    "monte_carlo": ((int,), "a whole number"),
    "zones": ((int, str), "a whole number, or a file of zones"),
    "hold": ((list,), "a list of names"),
    "effects": ((list,), "a list of names"),
    "base_changes": ((list,), "a list of names"),
    "without": ((list,), "a list of names"),
    "gravity": ((list,), "three numbers"),
}


def of_cells(cells: Mapping[str, str], place: Callable[[str], str]) -> dict[str, Any]:
    """Return the options in the cells of a row, of columns that are options; empty cells are none.

    Args:
        place: The file, line and column of a cell by its column.
    """
    found = {}
    for name, cell in cells.items():
        if cell:
            with refusals_at(place(name)):
                found[name] = OPTIONS[name](cell)
    return found


def checked_options(options: Mapping[str, Any], folder: Path, place: Callable[[str], str]) -> dict[str, Any]:
    """Return options with whole paths, or refuse what no calibration takes, before any robot is calibrated.

    Args:
        folder: That files are named from.
        place: Where an option stands, by its name.

    Raises:
        InputError: For an option or a name that is not known, a value of another kind, and a file that is not there.
    """
    return {name: _checked(name, value, folder, place(name)) for name, value in options.items()}


def _checked(name: str, value: Any, folder: Path, where: str) -> Any:
    if name not in OPTIONS:
        raise InputError(
            "no calibration has such an option",
            where=where,
            came=name,
            allowed=", ".join(OPTIONS),
            cure=did_you_mean(name, OPTIONS),
        )
    kinds, words = _KINDS.get(name, ((str,), "a text"))
    if not isinstance(value, kinds) or isinstance(value, bool):
        raise InputError("this is no value of this option", where=where, came=value, allowed=words)
    if name == "train" and isinstance(value, str) and value != "all":
        raise InputError("this is no value of this option", where=where, came=value, allowed=words)
    if name in FILES and isinstance(value, str):
        if not exists(folder / value):
            raise InputError("there is no such file", where=where, came=value, cure="Check the path.")
        return str(folder / value)
    if name == "payload":
        with refusals_at(where):
            Payload.of(value, name)
    known = _KNOWN.get(name, ())
    for one in value if isinstance(value, list) else [value]:
        if known and one not in known:
            raise InputError(
                "there is nothing of this name",
                where=where,
                came=one,
                allowed=", ".join(known),
                cure=did_you_mean(str(one), known),
            )
    return value
