"""What must hold whatever came in."""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final, NoReturn

from truearm.engine.base.errors import InputError

#: Longest message that is still read.
LONGEST: Final = 3000
#: Words of libraries, and of Python about itself, in a message.
_FOREIGN: Final = re.compile(
    r"Traceback|Input should|instance of _|after validation|NoneType|object at 0x|<class |dtype=|np\.float|\bWarning:"
    r"|unhashable|positional argument|_[A-Z][a-z]+Entry|codec can't"
)
_CONTROL: Final = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069]")
_NOT_FINITE: Final = re.compile(r"(?<![\w.-])-?(?:nan|inf|infinity)(?![\w.-])", re.IGNORECASE)


def of_refusal(error: InputError) -> list[str]:
    """Return what is wrong with a refusal."""
    text = str(error)
    found = [f"the message says {match[0]!r}: {text[:300]}" for match in [_FOREIGN.search(text)] if match]
    if len(text) > LONGEST:
        found.append(f"the message has {len(text)} characters: {text[:200]}")
    return found


def of_printed(text: str, given: str) -> list[str]:
    """Return what is wrong with what was printed; `given` is all that came in."""
    found = [f"{match[0]!r} is printed: {text[:300]!r}" for match in [_CONTROL.search(text)] if match]
    found += [f"the text says {match[0]!r}: {text[:600]}" for match in [_FOREIGN.search(text)] if match]
    match = _NOT_FINITE.search(text)
    if match and not _NOT_FINITE.search(given):
        found.append(f"{text[max(0, match.start() - 80) : match.end() + 40]!r} is not a figure")
    return found


def of_json(text: str) -> list[str]:
    """Return what is wrong with what shall be JSON."""
    try:
        json.loads(text, parse_constant=_refuse)
    except (ValueError, RecursionError) as error:
        return [f"this is no JSON ({error}): {text[:200]!r}"]
    return []


def _refuse(constant: str) -> NoReturn:
    raise ValueError(constant)


def not_finite(summary: Any) -> bool:
    """Return whether a summary holds a number that is none."""
    if isinstance(summary, dict):
        return any(map(not_finite, summary.values()))
    if isinstance(summary, list | tuple):
        return any(map(not_finite, summary))
    return isinstance(summary, float) and not math.isfinite(summary)


def state(folder: Path) -> dict[str, str]:
    """Return what is in a folder: the hash of every file, nothing for a folder."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""
        for path in sorted(folder.rglob("*"))
    }


def of_files(
    before: Mapping[str, str], after: Mapping[str, str], *, done: bool, may_change: Iterable[str] = ()
) -> list[str]:
    """Return what is wrong with the files after a call: inputs are as they were, and a refusal leaves nothing."""
    found = [f"{name} is gone" for name in before if name not in after]
    free = set(may_change)
    found += [
        f"{name} was changed" for name in before if name in after and before[name] != after[name] and name not in free
    ]
    new = [name for name in after if name not in before]
    found += [f"{name} is left behind" for name in new if ".truearm." in Path(name).name and not name.endswith(".json")]
    if not done and new:
        found.append(f"nothing was done, and {', '.join(new[:5])} is there")
    return found
