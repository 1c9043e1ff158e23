"""What a file must hold: entries that do not fit their schema are refused by name, in plain words."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, TypeVar, get_args

from pydantic import BaseModel, ValidationError

from truearm.errors import InputError, did_you_mean

Model = TypeVar("Model", bound=BaseModel)


def validated(content: object, schema: type[Model], where: str) -> Model:
    """Return `content` as `schema`, or refuse it naming the entry that is wrong."""
    if not isinstance(content, Mapping):
        raise InputError("the file must hold named entries (name: value)", where=where, came=type(content).__name__)
    try:
        return schema.model_validate(dict(content))
    except ValidationError as error:
        raise _refusal(error, content, schema, where) from error


_NUMBER: Final = ("a number belongs here", "a number without quotes and unit, such as 0.5")
_WHOLE: Final = ("a whole number belongs here", "a whole number without quotes, such as 2")
_TABLE: Final = ("named entries belong here", "NAME: VALUE, each on a line of its own or all in {{ }}")
_LIST: Final = ("a list belongs here", "entries in brackets, such as [1, 2], or each on a line that begins with -")
#: What pydantic finds wrong, by its names of errors: what that is in plain words, and what is allowed. What stands in
#: braces is filled in from what pydantic says of the error.
_FAULTS: Final[Mapping[str, tuple[str, str]]] = {
    "float_type": _NUMBER,
    "float_parsing": _NUMBER,
    "finite_number": ("a finite number belongs here", "no nan, no infinity"),
    "int_type": _WHOLE,
    "int_from_float": _WHOLE,
    "int_parsing": _WHOLE,
    "greater_than": ("the number is too small", "more than {gt:g}"),
    "greater_than_equal": ("the number is too small", "{ge:g} or more"),
    "less_than_equal": ("the number is too large", "{le:g} or less"),
    "string_type": ("a text belongs here", "a text, in quotes if it looks like a number, a date, yes or no"),
    "string_too_short": ("the text is empty", "at least one character"),
    "string_pattern_mismatch": ("the text does not have the form that belongs here", "{pattern}"),
    "literal_error": ("this value is not known", "{expected}"),
    "dict_type": _TABLE,
    "model_type": _TABLE,
    "list_type": _LIST,
    "tuple_type": _LIST,
    "too_short": ("there are too few entries", "at least {min_length}"),
    "too_long": ("there are too many entries", "{max_length}"),
    "invalid_key": ("the name of an entry must be a text", "a name, in quotes if it looks like a number"),
}
#: Of so many names the right one is found without a hint.
_FEW_NAMES: Final = 6
#: Lists and tables of more characters are not shown in messages.
_LONGEST_SHOWN: Final = 60


def shown_entry(value: object) -> object:
    """Return an entry of a file as messages show it: of a long list or table only that it is one, nothing as such."""
    if value is None:
        return "nothing"
    if not isinstance(value, list | tuple | Mapping):
        return value
    try:
        text = str(value)
    except (ValueError, RecursionError):  # numbers of very many digits, very many brackets
        text = ""
    if 0 < len(text) <= _LONGEST_SHOWN:
        return value
    return f"{'a table' if isinstance(value, Mapping) else 'a list'} of {len(value)} entries"


def _refusal(error: ValidationError, content: Any, schema: type[BaseModel], where: str) -> InputError:
    """Return the first fault that pydantic found as a refusal that names the entry."""
    faults = error.errors(include_url=False)
    first = faults[0]
    kind, place = first["type"], first["loc"]
    is_name = place[-1:] == ("[key]",)  # what stands before the colon
    if is_name:
        place = place[:-1]
    holder, entry, holders = content, "", ""
    for part in place:  # items of a list count from 1, keys stand as they are
        holders, holder = entry, content
        if isinstance(content, list) and isinstance(part, int):
            entry += f"[{part + 1}]"
            content = content[part] if part < len(content) else None  # of six numbers the fourth may be missing
        else:
            entry += f".{part}"
            content = content.get(part) if isinstance(content, Mapping) else None
    entry, holders = entry.lstrip("."), holders.lstrip(".")

    def refused(what: str, came: object = None, allowed: str | None = None, cure: str | None = None) -> InputError:
        return InputError(what, where=f"{where}, {entry}" if entry else where, came=came, allowed=allowed, cure=cure)

    if kind == "extra_forbidden":
        known = _known_entries(schema, place)
        allowed = ", ".join(known) or None
        return refused("this entry is not known here", None, allowed, did_you_mean(str(place[-1]), known))
    if kind == "missing" and isinstance(holder, list):
        entry = holders
        needed = 1 + max(int(f["loc"][-1]) for f in faults if f["type"] == kind and f["loc"][:-1] == place[:-1])
        return refused("there are too few entries", len(holder), f"{needed}")
    if kind == "missing":
        return refused("this entry is missing")
    came, details = first.get("input"), first.get("ctx", {})
    cause = details.get("error")
    if isinstance(cause, InputError):  # a check of our own
        came = cause.came if cause.came is not None else came
        return refused(cause.what, shown_entry(came), cause.allowed, cause.cure)
    if kind not in _FAULTS:
        what = first["msg"].removeprefix("Value error, ")
        return refused(what[0].lower() + what[1:], None if isinstance(came, dict | list) else came)
    what, allowed = _FAULTS[kind]
    if is_name:
        what = f"{what}, as the name of the entry"
    cure = None
    if kind == "literal_error":
        known = re.findall("'([^']*)'", details["expected"])
        details = {"expected": ", ".join(known)}
        cure = did_you_mean(str(came), known) if len(known) > _FEW_NAMES else None
    if kind in ("too_short", "too_long"):
        came = details["actual_length"]
    return refused(what, shown_entry(came), allowed.format(**details), cure)


def _known_entries(schema: type[BaseModel], place: Sequence[int | str]) -> list[str]:
    """Return which entries there may be beside the one at a place, none if that is not one of a fixed set."""
    holder: type[BaseModel] | None = schema
    for part in place[:-1]:
        if holder is not None and part in holder.model_fields:
            holder = next(_models_in(holder.model_fields[str(part)].annotation), None)
    return [] if holder is None else list(holder.model_fields)


def _models_in(annotation: object) -> Iterator[type[BaseModel]]:
    """Return the pydantic models that a type is, or is made of."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from _models_in(part)
