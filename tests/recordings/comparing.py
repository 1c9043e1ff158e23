"""What differs between two recordings."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from difflib import SequenceMatcher
from itertools import zip_longest
from pathlib import Path
from typing import Any, Final

import numpy as np

import truearm

_NUMBER: Final = re.compile(r"(?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![\w])")
#: What stands for a key or a line that one of two recordings lacks.
_MISSING: Final = ("missing",)
#: Characters of a value that are shown.
_LONGEST: Final = 200
#: The value of a parameter in a robot file, or the turn of its base.
_VALUE: Final = re.compile(r" value: [^,}]*|(?<=^base_quaternion: ).*")


def differences(old: Any, new: Any, place: str = "") -> Iterator[str]:
    """Yield what differs: where, the old value, the new one."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in [*old, *(key for key in new if key not in old)]:
            yield from differences(old.get(key, _MISSING), new.get(key, _MISSING), f"{place} > {key}")
    elif isinstance(old, list) and isinstance(new, list):
        if not same_robot(old, new):
            for number, (one, other) in enumerate(_beside(old, new), 1):
                yield from differences(one, other, f"{place}[{number}]")
    elif not equal(old, new):
        at = 0
        if isinstance(old, str) and isinstance(new, str):  # from shortly before the first character that differs
            at = max(0, next((i for i, (a, b) in enumerate(zip(old, new, strict=False)) if a != b), 0) - 30)
        yield f"{place}: {_shown(old, at)} -> {_shown(new, at)}"


def _beside(old: list[Any], new: list[Any]) -> Iterator[tuple[Any, Any]]:
    """Yield what of two lists belongs together; lines that came or went stand beside nothing."""
    if len(old) == len(new) or not all(isinstance(line, str) for line in (*old, *new)):
        yield from zip_longest(old, new, fillvalue=_MISSING)
        return
    one, other = ([_NUMBER.sub("#", line) for line in lines] for lines in (old, new))
    for kind, a, b, c, d in SequenceMatcher(None, one, other, autojunk=False).get_opcodes():
        if kind == "equal":
            yield from zip(old[a:b], new[c:d], strict=True)
        else:
            yield from ((line, _MISSING) for line in old[a:b])
            yield from ((_MISSING, line) for line in new[c:d])


def _shown(value: Any, at: int) -> str:
    text = f"...{value[at:]}" if at else value
    shown = repr(text)
    return shown if len(shown) <= _LONGEST else f"{shown[:_LONGEST]}..."


def same_robot(old: list[Any], new: list[Any]) -> bool:
    """Say whether two robot files differ in parameter values alone, and not in where the targets are.

    A fit leaves the values of redundant parameters where they happen to be; what they predict together is known.
    """
    if old == new or not old or old[0] != "truearm: truearm-robot/1":
        return False
    others = ([_VALUE.sub("", line) for line in lines] for lines in (old, new))
    if len(old) != len(new) or not all(map(equal, *others)):
        return False
    one, other = predictions(old), predictions(new)
    return bool(np.abs(other - one).max() <= 1e-9 * np.abs(one).max() + 1e-12)


def predictions(lines: list[str]) -> np.ndarray:
    """Return where the targets of a robot file are in some configurations, in a row [m], and how those are that turn.

    Without targets it is the flange; with them that is anywhere, as they can lie elsewhere on it.
    """
    text = re.sub(r"(?m)^proof:\n(?:  .*\n|\d.*\n)+", "", "\n".join(lines) + "\n")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.yaml"
        path.write_text(text, "utf-8")
        robot = truearm.load_robot(path)
    spread = np.random.default_rng(0).uniform(-1.0, 1.0, (20, len(robot.joints)))
    told = []
    for name in [target.name for target in robot.targets] or (None,):
        position, rotation = robot.forward(spread, frame="world", target=name)
        told.append(position.ravel())
        if name is None or f"  target_{name}_rx:" in text:
            told.append(rotation.ravel())
    return np.concatenate(told)


def equal(old: Any, new: Any) -> bool:
    """Say whether two numbers or texts are equal."""
    if isinstance(old, str) and isinstance(new, str):
        if old == new:
            return True
        return _NUMBER.sub("#", old) == _NUMBER.sub("#", new) and all(
            close(float(one), float(other))
            for one, other in zip(_NUMBER.findall(old), _NUMBER.findall(new), strict=True)
        )
    if type(old) in (int, float) and type(new) in (int, float):
        return close(old, new)
    return type(old) is type(new) and bool(old == new)


def close(old: float, new: float) -> bool:
    """Say whether two numbers agree."""
    return abs(new - old) <= 1e-9 * abs(old) + 1e-12
