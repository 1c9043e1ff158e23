"""Reading files, and refusing in plain words what cannot be read or does not fit its schema."""

from __future__ import annotations

import re
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from copy import deepcopy
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from truearm.engine.base.errors import InputError, nearest_names, wrong_kind
from truearm.engine.base.limits import limit, refuse_beyond
from truearm.engine.base.manifest import hash_of, refuse_unfinished
from truearm.engine.base.schemas import Model, validated

#: What an entry of a YAML file cannot do without, unless it is the first: one of these stands before it.
_BETWEEN_ENTRIES: Final = ("\n", ",", ":", "[", "{", "- ", "-\t", "? ")
_BRACKET: Final = re.compile(r"[\[\]{}]")
#: An entry that stands for another one, or what looks like it.
_ALIAS: Final = re.compile(r"(?:^|[\s\[{,:])\*[^\s\[\]{},]")
#: YAML texts up to this length are kept as they were parsed, in case they are read again.
_CACHED_SIZE: Final = 200_000
#: What is read but is no file, for messages. Whoever reads them may wait for ever, or never come to an end.
_NO_FILES: Final = (
    (stat.S_ISFIFO, "a named pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)


#: Hashes of what has been read, where somebody wants to know them.
_NOTED: Final[ContextVar[dict[Path, list[str]] | None]] = ContextVar("noted", default=None)


@contextmanager
def noted_reads() -> Iterator[dict[Path, list[str]]]:
    """Note what is read: the SHA-256 of every content, in the order of reading, by the absolute path of its file."""
    noted: dict[Path, list[str]] = {}
    token = _NOTED.set(noted)
    try:
        yield noted
    finally:
        _NOTED.reset(token)


#: Folders in which files may be read; None for everywhere.
_CONFINED: Final[ContextVar[tuple[Path, ...] | None]] = ContextVar("confined", default=None)


@contextmanager
def confined_reads(folder: Path) -> Iterator[None]:
    """Let files be read in one folder and in this package alone, whatever other files name and wherever links lead."""
    token = _CONFINED.set((folder.resolve(), Path(__file__).parents[2].resolve()))
    try:
        yield
    finally:
        _CONFINED.reset(token)


def _refuse_outside(path: Path) -> None:
    confined = _CONFINED.get()
    if confined is not None and not any(path.resolve().is_relative_to(folder) for folder in confined):
        raise InputError(
            "this file is not in the project's folder, and is not read",
            where=str(path),
            cure="Copy it into the folder, and name it there.",
        )


def read_bytes(path: Path, most: str = "file_size") -> bytes:
    """Return the content of a file, or refuse with the reason it cannot be read.

    Args:
        most: Name of the limit of its size, see :mod:`truearm.engine.base.limits`.
    """
    try:
        _refuse_outside(path)
        state = path.stat()
        if stat.S_ISDIR(state.st_mode):
            raise InputError("this is a folder, a file is needed", where=str(path))
        refuse_unfinished(path)
        if not stat.S_ISREG(state.st_mode):
            raise InputError(
                "this is no file",
                where=str(path),
                came=next((kind for is_kind, kind in _NO_FILES if is_kind(state.st_mode)), None),
                allowed="a file on disk",
                cure="Write what it yields into a file first.",
            )
        refuse_beyond(most, state.st_size, where=str(path))
        with path.open("rb") as stream:
            content = stream.read(state.st_size + 1)
            if len(content) > state.st_size:  # it grows, or its size is not known beforehand, as that of some of /proc
                content += stream.read(limit(most) + 1)
        refuse_beyond(most, len(content), where=str(path))
        noted = _NOTED.get()
        if noted is not None:
            noted.setdefault(path.absolute(), []).append(hash_of(content))
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


def wide_encoding(content: bytes) -> str | None:
    """Return the encoding of which zero bytes all over a text speak, ``utf-16-le`` or ``utf-16-be``; None if none."""
    looked = content[:4096]
    for name, of_high_bytes in (("utf-16-le", looked[1::2]), ("utf-16-be", looked[0::2])):
        # Western text: nearly every second byte is zero, and hardly any other.
        if 2 * of_high_bytes.count(0) > len(of_high_bytes) and looked.count(0) < 1.1 * of_high_bytes.count(0):
            return name
    return None


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
    if "\0" in text and (wide := wide_encoding(content)) is not None:
        raise InputError(
            "the file is not UTF-8 text: its zero bytes are those of UTF-16",
            where=str(path),
            came=wide,
            cure="Save it as UTF-8.",
        )
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
        content = deepcopy(_loaded(text)) if len(text) <= _CACHED_SIZE else _loaded.__wrapped__(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark
        where = f"{path}, line {mark.line + 1}" if mark else str(path)
        raise _not_yaml(" ".join(str(error.problem or "not valid").split()), where) from error
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


@lru_cache(maxsize=128)
def _loaded(text: str) -> Any:
    """Return what a YAML text holds; files that are read again and again are not parsed again, which is slow."""
    from ruamel.yaml import YAML

    return YAML(typ="safe", pure=True).load(text)


def _deepest(text: str) -> int:
    """Return how many brackets are open at once in a YAML document, those in quotes and comments included."""
    depth = deepest = 0
    for match in _BRACKET.finditer(text):
        depth = depth + 1 if match[0] in "[{" else max(depth - 1, 0)
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
            parts = [part for pair in node.value for part in (pair if isinstance(pair, tuple) else (pair,))]
            counts[id(node)] = 1 + sum(map(entries, parts))
            inside.discard(id(node))
        return counts[id(node)]

    refuse_beyond("entries", entries(root), where=str(path))


#: What the YAML parser says, the same in plain words, and the cure; what is in quotes there is what came.
_YAML_FAULTS: Final = (
    ('duplicate key "([^"]*)"', "an entry is given twice", "Keep one of them."),
    ("constructor for the tag '([^']*)'", "tags with ! cannot be used here", "Remove the tag."),
    (
        "undefined alias '?([^']*)'?",
        "an alias with * stands for something that the file does not have",
        "Write it out.",
    ),
    (
        "unhashable key()",
        "a list or a table stands where the name of an entry belongs",
        "Write a name before the colon.",
    ),
    ("another document()", "a second document begins here, behind ---", "Keep one of them."),
    (r"character '(\\t)'", "a tab stands where blanks belong", "Indent with blanks."),
)


def _not_yaml(problem: str, where: str) -> InputError:
    for pattern, what, cure in _YAML_FAULTS:
        match = re.search(pattern, problem)
        if match is not None:
            return InputError(what, where=where, came=match[1] or None, cure=cure)
    return InputError(
        f"this is not valid YAML ({problem})",
        where=where,
        cure="Look for a quote, a bracket or a colon too many or too few, here or in the line above.",
    )


def path_argument(path: object, parameter: str) -> Path:
    """Return a path that was given as a text or a path."""
    if isinstance(path, str | Path) and _can_be_path(str(path)):
        if str(path):
            return Path(path)
        raise InputError("no file is given", parameter=parameter, came=str(path))
    raise wrong_kind(
        "a path belongs here", path, parameter, "the path of a file or folder, as a text in UTF-8 or a pathlib.Path"
    )


def _can_be_path(text: str) -> bool:
    try:
        text.encode()
    except UnicodeEncodeError:  # half a character
        return False
    return "\0" not in text
