"""Reading files, and refusing in plain words what cannot be read or does not fit its schema."""

from __future__ import annotations

import os
import re
import stat
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, TypeVar, get_args

from pydantic import BaseModel, ValidationError

from truearm.errors import InputError, did_you_mean, nearest_names, wrong_kind
from truearm.limits import limit, refuse_beyond

Model = TypeVar("Model", bound=BaseModel)
#: What an entry of a YAML file cannot do without, unless it is the first: one of these stands before it.
_BETWEEN_ENTRIES: Final = ("\n", ",", ":", "[", "{", "- ", "-\t", "? ")
_BRACKET: Final = re.compile(r"[\[\]{}]")
#: An entry that stands for another one, or what looks like it.
_ALIAS: Final = re.compile(r"(?:^|[\s\[{,:])\*[^\s\[\]{},]")


#: What is read but is no file, for messages. Whoever reads them may wait for ever, or never come to an end.
_NO_FILES: Final = (
    (stat.S_ISFIFO, "a named pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)


def read_bytes(path: Path, most: str = "file_size") -> bytes:
    """Return the content of a file, or refuse with the reason it cannot be read.

    Parameters
    ----------
    most
        Name of the limit of its size, see :mod:`truearm.limits`.
    """
    try:
        state = path.stat()
        if stat.S_ISDIR(state.st_mode):
            raise InputError("this is a folder, a file is needed", where=str(path))
        if not stat.S_ISREG(state.st_mode):
            raise InputError(
                "this is no file",
                where=str(path),
                came=next((kind for is_one, kind in _NO_FILES if is_one(state.st_mode)), None),
                allowed="a file on disk",
                cure="Write what it yields into a file first.",
            )
        refuse_beyond(most, state.st_size, where=str(path))
        with path.open("rb") as stream:
            content = stream.read(state.st_size + 1)
            if len(content) > state.st_size:  # it grows, or its size is not known beforehand, as that of some of /proc
                content += stream.read(limit(most) + 1)
        refuse_beyond(most, len(content), where=str(path))
        return content
    except FileNotFoundError as error:
        raise _missing(path) from error
    except InputError:
        raise
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the path
        raise InputError(f"the file cannot be read ({reason_of(error)})", where=str(path)) from error


def _missing(path: Path) -> InputError:
    try:
        if path.is_symlink():
            return broken_link(path)
    except OSError as error:
        return InputError(f"the file cannot be read ({reason_of(error)})", where=str(path))
    try:
        siblings = [p.name for p in path.parent.iterdir()]
    except OSError:
        siblings = []
    near = nearest_names(path.name, siblings, count=2, likeness=0.75)
    cure = f"Did you mean {' or '.join(near)}?" if near else "Check the path."
    return InputError("there is no such file", where=str(path), cure=cure)


def broken_link(path: Path) -> InputError:
    """Return the refusal of a link that leads to nothing."""
    return InputError(
        "this is a link, and there is nothing where it points to",
        where=str(path),
        came=str(path.readlink()),
        cure="Remove or repair the link.",
    )


def reason_of(error: OSError | ValueError) -> str:
    """Return what the operating system says of a failure."""
    return (error.strerror if isinstance(error, OSError) else None) or str(error)


def exists(path: Path) -> bool:
    """Return whether there is something at `path`; a path that cannot be looked up leads to nothing."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def is_one_line(text: str) -> bool:
    """Return whether a text is one line that can be seen: not blank, without breaks and control characters."""
    return bool(text.strip()) and not any(unicodedata.category(c) in ("Cc", "Cs", "Zl", "Zp") for c in text)


def read_text(path: Path, most: str = "file_size") -> str:
    """Return the text of a UTF-8 file without its byte order mark; `most` as for :func:`read_bytes`."""
    content = read_bytes(path, most)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            f"the file is not UTF-8 text (byte {error.start})", where=str(path), cure="Save it as UTF-8."
        ) from error
    if not text.strip():
        raise InputError("the file is empty", where=str(path))
    return text


def read_yaml(path: Path, schema: type[Model]) -> Model:
    """Read a YAML file into a pydantic model, refusing what does not fit it.

    ``1e-3`` is a number, as YAML 1.2 says; a key given twice is refused.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    text = read_text(path, "yaml_size")
    refuse_beyond("nesting", _deepest(text), where=str(path))
    refuse_beyond("entries", 1 + sum(map(text.count, _BETWEEN_ENTRIES)), where=str(path))
    try:
        if _ALIAS.search(text):
            _refuse_multiplied(YAML(typ="safe", pure=True).compose(text), path)
        content = YAML(typ="safe", pure=True).load(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark
        where = f"{path}, line {mark.line + 1}" if mark else str(path)
        problem = " ".join(str(error.problem or "not valid").split())
        raise InputError(f"this is not valid YAML ({problem})", where=where) from error
    except YAMLError as error:
        raise InputError(f"this is not valid YAML ({' '.join(str(error).split())})", where=str(path)) from error
    except InputError:
        raise
    except RecursionError as error:
        raise InputError("the entries are nested too deep", where=str(path)) from error
    except Exception as error:  # the parser lets pass what its conversions raise: 30 February, 5000 digits
        reason = " ".join(str(error).partition(";")[0].split())
        raise InputError(
            f"a value cannot be understood ({reason})", where=str(path), cure="Put text into quotes."
        ) from error
    return validated(content, schema, str(path))


def _deepest(text: str) -> int:
    """Return how many brackets are open at once in a YAML document, those in quotes and comments included."""
    depth = deepest = 0
    for found in _BRACKET.finditer(text):
        depth = depth + 1 if found[0] in "[{" else max(depth - 1, 0)
        deepest = max(deepest, depth)
    return deepest


def _refuse_multiplied(root: Any, path: Path) -> None:
    """Refuse a YAML document that holds too many entries once each alias is replaced by what it stands for."""
    counts: dict[int, int] = {}
    inside: set[int] = set()

    def entries(node: Any) -> int:
        """Return how many entries a node holds, itself included."""
        if node is None or isinstance(node.value, str):
            return 1
        if id(node) not in counts:
            if id(node) in inside:
                raise InputError("an entry holds itself", where=f"{path}, line {node.start_mark.line + 1}")
            inside.add(id(node))
            held = [part for pair in node.value for part in (pair if isinstance(pair, tuple) else (pair,))]
            counts[id(node)] = 1 + sum(map(entries, held))
            inside.discard(id(node))
        return counts[id(node)]

    refuse_beyond("entries", entries(root), where=str(path))


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


def path_argument(path: object, parameter: str) -> Path:
    """Return a path that was given as a text or a path."""
    if isinstance(path, str | Path) and _can_be_path(str(path)):
        if str(path):
            return Path(path)
        raise InputError("no file is given", parameter=parameter, came=str(path))
    raise wrong_kind(
        "a path belongs here", path, parameter, "the path of a file or folder, as a text or a pathlib.Path"
    )


def _can_be_path(text: str) -> bool:
    try:
        os.fsencode(text)
    except UnicodeEncodeError:  # half a character
        return False
    return "\0" not in text
