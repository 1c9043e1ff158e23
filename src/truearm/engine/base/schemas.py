"""What a file must hold: entries that do not fit their schema are refused by name, in plain words."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, Literal, TypeVar, get_args, get_origin

from pydantic import BaseModel, ValidationError

from truearm.engine.base.errors import InputError, Words, did_you_mean, nearest_names, shortened

Model = TypeVar("Model", bound=BaseModel)

_ENTRIES: Final = "NAME: VALUE, each on a line of its own"


def validated(content: object, schema: type[Model], where: str) -> Model:
    """Return `content` as `schema`, or refuse it naming the entry that is wrong."""
    if content is None:
        raise InputError("the file holds no entries, only comments or nothing", where=where, allowed=_ENTRIES)
    if not isinstance(content, Mapping):
        raise InputError("the file must hold named entries", where=where, came=shown_entry(content), allowed=_ENTRIES)
    try:
        model = schema.model_validate(dict(content))
    except ValidationError as error:
        raise _refusal(error, content, schema, where) from error
    _refuse_half_characters(content, where)
    return model


def _refuse_half_characters(content: object, where: str) -> None:
    r"""Refuse texts such as ``"\ud800"``, which no file that is written later could hold."""
    waiting, seen = [(content, "")], set[int]()
    while waiting:
        value, entry = waiting.pop()
        if isinstance(value, str):
            if not value.isascii() and any("\ud800" <= character <= "\udfff" for character in value):
                what, allowed = _FAULTS["string_unicode"]
                raise InputError(what, where=f"{where}, {entry.lstrip('.')}", came=value, allowed=allowed)
        elif isinstance(value, Mapping | list) and id(value) not in seen:
            seen.add(id(value))  # an entry may hold itself
            if isinstance(value, Mapping):
                waiting += [(part, f"{entry}.{_name(name)}") for name, part in value.items()]
                waiting += [(name, entry) for name in value]
            else:
                waiting += [(part, f"{entry}[{number}]") for number, part in enumerate(value, 1)]


_NUMBER: Final = ("a number belongs here", "a number without quotes and unit, such as 0.5")
_WHOLE: Final = ("a whole number belongs here", "a whole number without quotes, such as 2")
_TABLE: Final = ("named entries belong here", "NAME: VALUE, each on a line of its own or all in {{ }}")
_LIST: Final = ("a list belongs here", "entries in brackets, such as [1, 2], or each on a line that begins with -")
#: What pydantic finds wrong, by its names of errors: what that is in plain words, and what is allowed. What stands in
#: braces is filled in from what pydantic says of the error.
_FAULTS: Final[Mapping[str, tuple[str, str]]] = {
    "float_type": _NUMBER,
    "float_parsing": _NUMBER,
    "finite_number": ("the number is not finite", "a number such as 0.5, neither nan nor infinite"),
    "int_type": _WHOLE,
    "int_from_float": _WHOLE,
    "int_parsing": _WHOLE,
    "int_parsing_size": ("the number is too large", "fewer digits"),
    "greater_than": ("the number is too small", "more than {gt:g}"),
    "greater_than_equal": ("the number is too small", "{ge:g} or more"),
    "less_than": ("the number is too large", "less than {lt:g}"),
    "less_than_equal": ("the number is too large", "{le:g} or less"),
    "string_type": ("a text belongs here", "a text, in quotes if it looks like a number, a date, yes or no"),
    "string_unicode": ("the text holds half a character", "text that can be written as UTF-8"),
    "string_too_short": ("the text is empty", "at least one character"),
    "literal_error": ("this value is not known", "{expected}"),
    "dict_type": _TABLE,
    "model_type": _TABLE,
    "list_type": _LIST,
    "tuple_type": _LIST,
    "too_short": ("there are too few entries", "at least {min_length}"),
    "too_long": ("there are too many entries", "{max_length}"),
    "invalid_key": ("the name of an entry must be a text", "a name, in quotes if it looks like a number"),
}
#: The faults that a value which is no number can have too.
_OF_NUMBERS: Final = ("finite_number", "greater_than", "greater_than_equal", "less_than", "less_than_equal")
#: Of so many names the right one is found without a hint.
_FEW_NAMES: Final = 6
#: Lists and tables of more characters are not shown in messages.
_LONGEST_SHOWN: Final = 60


def shown_entry(value: object) -> object:
    """Return an entry of a file as messages show it, in YAML; of a long list or table only that it is one."""
    if value is None:
        return Words("nothing")
    if not isinstance(value, bool | list | tuple | Mapping):
        return value
    try:
        text = _flow(value)
    except (ValueError, RecursionError):  # numbers of very many digits, very many brackets
        text = ""
    if 0 < len(text) <= _LONGEST_SHOWN or isinstance(value, bool):
        return Words(text)
    return Words(f"{'a table' if isinstance(value, Mapping) else 'a list'} of {len(value)} entries")


def _name(part: object) -> str:
    """Return the name of an entry as messages show it."""
    try:
        text = _flow(part)
    except ValueError:
        text = "<unprintable"
    if text.startswith("<unprintable"):  # as pydantic calls it
        return "a number of very many digits"
    return shortened(text, _LONGEST_SHOWN) or '""'


def _flow(value: object) -> str:
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{_flow(name)}: {_flow(entry)}' for name, entry in value.items())}}}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_flow, value))}]"
    return str(value)


def _refusal(error: ValidationError, content: Any, schema: type[BaseModel], where: str) -> InputError:
    """Return the first fault that pydantic found as a refusal that names the entry."""
    faults = error.errors(include_url=False)
    first = faults[0]
    kind, place = first["type"], first["loc"]
    is_name = place[-1:] == ("[key]",)  # what stands before the colon
    if is_name:
        place = place[:-1]
    if is_name or kind == "invalid_key":  # pydantic says None, and not what the file has
        place = (*place[:-1], first["input"])
    holder, entry, holders = content, "", ""
    for number, part in enumerate(place):  # items of a list count from 1, keys stand as they are
        if isinstance(part, str) and number + 1 < len(place) and not (isinstance(content, Mapping) and part in content):
            continue  # which of several kinds was meant
        holders, holder = entry, content
        if isinstance(content, list) and isinstance(part, int):
            entry += f"[{part + 1}]"
            content = content[part] if part < len(content) else None  # of six numbers the fourth may be missing
        else:
            entry += f".{_name(part)}"
            content = content.get(part) if isinstance(content, Mapping) else None
    entry, holders = entry.lstrip("."), holders.lstrip(".")

    def within(entry: str) -> str:
        return f"{where}, {entry}" if entry else where

    if kind == "extra_forbidden":
        known = _known_entries(schema, place)
        meant = did_you_mean(_name(place[-1]), known)
        return InputError(
            "this entry is not known here",
            where=within(entry),
            allowed=", ".join(known) or None,
            cure=meant or "Correct its name, or remove it.",
        )
    if kind == "missing" and isinstance(holder, list):
        needed = 1 + max(int(f["loc"][-1]) for f in faults if f["type"] == kind and f["loc"][:-1] == place[:-1])
        return InputError("there are too few entries", where=within(holders), came=len(holder), allowed=f"{needed}")
    if kind == "missing":
        return _missing(within(entry), str(place[-1]), holder, _known_entries(schema, place), _field(schema, place))
    return refused_value(first, within(entry), is_name=is_name)


def refused_value(fault: Mapping[str, Any], where: str, *, is_name: bool = False) -> InputError:
    """Return what pydantic found wrong with one value as a refusal in plain words.

    Args:
        fault: One of its errors.
        where: What the refusal names.
        is_name: Whether the value is the name of an entry.
    """
    kind, came, details = fault["type"], fault.get("input"), fault.get("ctx", {})
    cause = details.get("error")
    if isinstance(cause, InputError):  # a check of our own
        came = cause.came if cause.came is not None else came
        return InputError(cause.what, where=where, came=shown_entry(came), allowed=cause.allowed, cure=cause.cure)
    if isinstance(cause, ValueError):
        return InputError(str(cause), where=where)
    what, allowed = _FAULTS.get(kind, ("this cannot be used here", "what the documentation of this file says"))
    if is_name:
        what = f"{what}, as the name of the entry"
    cure = None
    if kind == "literal_error":
        known = re.findall("'([^']*)'", details["expected"])
        details = {"expected": ", ".join(known)}
        cure = did_you_mean(came, known) if isinstance(came, str) and len(known) > _FEW_NAMES else None
    if kind in ("too_short", "too_long"):
        came = details["actual_length"]
    if kind in _OF_NUMBERS and (came != came or came == "nan"):  # of the command line it is a text
        what = "this is not a number"
    return InputError(what, where=where, came=shown_entry(came), allowed=allowed.format(**details), cure=cure)


def _missing(where: str, name: str, holder: object, known: Sequence[str], kind: str | None) -> InputError:
    """Return the refusal of a table without an entry that it needs; it may be there under another name."""
    entries = holder if isinstance(holder, Mapping) else ()
    others = [other for other in entries if isinstance(other, str) and other not in known]
    near = nearest_names(name, others, count=1)
    cure = f"It may be the entry {near[0]}, which is not known here: rename it." if near else "Add it."
    return InputError("this entry is missing", where=where, allowed=kind, cure=cure)


def _known_entries(schema: type[BaseModel], place: Sequence[int | str]) -> list[str]:
    """Return which entries there may be beside the one at a place, none if that is not one of a fixed set."""
    holder = _holder(schema, place)
    return [] if holder is None else list(holder.model_fields)


def _field(schema: type[BaseModel], place: Sequence[int | str]) -> str | None:
    """Return what belongs at a place, None if that cannot be said in a few words."""
    holder = _holder(schema, place)
    if holder is None or place[-1] not in holder.model_fields:
        return None
    annotation = holder.model_fields[str(place[-1])].annotation
    table = next(_models_in(annotation), None)
    if get_origin(annotation) is Literal:
        return ", ".join(map(str, get_args(annotation)))
    if get_origin(annotation) in (list, tuple):
        return _LIST[1]
    if get_origin(annotation) is dict:
        return "named entries"
    if table is not None:
        return f"named entries ({', '.join(table.model_fields)})"
    plain = {float: _NUMBER[1], int: _WHOLE[1], str: "a text"}
    return plain.get(annotation) if isinstance(annotation, type) else None


def _holder(schema: type[BaseModel], place: Sequence[int | str]) -> type[BaseModel] | None:
    """Return the model of the table that a place is in."""
    holder: type[BaseModel] | None = schema
    for part in place[:-1]:
        if holder is not None and part in holder.model_fields:
            holder = next(_models_in(holder.model_fields[str(part)].annotation), None)
    return holder


def _models_in(annotation: object) -> Iterator[type[BaseModel]]:
    """Return the pydantic models that a type is, or is made of."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from _models_in(part)
