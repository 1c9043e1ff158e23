"""Damage to files, as people, spreadsheets, editors and broken disks do it; everything follows from a generator."""

from __future__ import annotations

import io
import json
import math
import re
import zipfile
from collections.abc import Callable
from copy import deepcopy
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from ruamel.yaml import YAML

Random = np.random.Generator
Damage = Callable[[Random, str], str]

#: What stands where a number or a name belongs.
ODD: Final = (
    *("", " ", "nan", "NaN", "inf", "-inf", ".nan", ".inf", "1e308", "-1e308", "1e999", "1e-320", "0", "-0", "-1"),
    *("1e16", "1e9", "1e-9", "180", "360.5", "9" * 400, "1_000", "1,5", "1.234,5", "0x10", "1e3", "1 000", "12.5"),
    *("\u0661\u0662", "\u00bd", "\u2212" + "5", "5 mm", "1e", "--1", "+1", "1.", ".5", "1/2", "1:30", "2026-02-30"),
    *("true", "no", "null", "~", "None", "#", "# x", "//", "\u202e" + "abc", "\ufeff", "\x00", "\x1b[31mred", "a\tb"),
    *("\r", "\n", "\u2028", "\x85", "\u00e9", "e\u0301", "\U0001f600", '"', "'", "\\", "=1+1", "[", "]", "{", "}"),
    *("(", ")", ":", ";", ",", "|", "&a", "*a", "!!python/object:os.system", "<<", "%", "{{x}}", "{0}", "<b>", "&amp;"),
    *("`train`", "--out", "-", "..", "/dev/null", "a/b", "x" * 3000, "1" * 5000, "[" * 300, "mm", "m", "deg", "rad"),
    *("in", "um", "flange", "base", "world", "1", "2", "7", "tip", "target", "reference", "fixture", "nominal"),
)
UNITS: Final = ("mm", "m", "um", "in", "deg", "rad", "mrad", "degC", "N", "N m", "", "Mm", "cm", "MM", "degrees")
_NUMBER: Final = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")
_CELL: Final = re.compile(r"[,;\t]| {2,}")


def one_of(rng: Random, things: Any) -> Any:
    """Return one of a sequence."""
    return things[int(rng.integers(len(things)))]


def odd_number(rng: Random, text: str) -> str:
    """Return a number near a number, or something that is none."""
    if rng.random() < 0.5:
        return str(one_of(rng, ODD))
    try:
        value = float(text)
    except ValueError:
        return str(one_of(rng, ODD))
    factor = one_of(rng, (-1.0, 0.0, 1e3, 1e-3, 25.4, 1e6, 1e-6, 57.29577951308232, 1e12, 1e-12, 2.0, 1.0000001, 1e150))
    return repr(value * factor) if rng.random() < 0.8 else repr(value + factor)


# -- any text --------------------------------------------------------------------------------------------------


def _bytes(rng: Random, text: str) -> str:
    """Change single characters and pieces."""
    data = list(text)
    for _ in range(int(rng.integers(1, 4))):
        if not data:
            break
        at = int(rng.integers(len(data)))
        end = min(len(data), at + int(rng.integers(1, 40)))
        way = int(rng.integers(6))
        if way == 0:
            data[at] = chr(int(rng.integers(256)))
        elif way == 1:
            del data[at:end]
        elif way == 2:
            data[at:at] = data[at:end]
        elif way == 3:
            data[at:at] = list(str(one_of(rng, ODD)))
        elif way == 4:
            del data[at:]
        else:
            data[at:end] = reversed(data[at:end])
    return "".join(data)


def _lines(rng: Random, text: str) -> str:
    """Drop, repeat, exchange or mix lines."""
    lines = text.split("\n")
    way, at, other = int(rng.integers(7)), int(rng.integers(len(lines))), int(rng.integers(len(lines)))
    if way == 0:
        del lines[at]
    elif way == 1:
        lines.insert(at, lines[other])
    elif way == 2:
        lines[at], lines[other] = lines[other], lines[at]
    elif way == 3:
        lines = lines[:1] + [lines[1:][i] for i in rng.permutation(len(lines) - 1)]
    elif way == 4:
        lines[at] = " " * int(rng.integers(1, 9)) + lines[at]
    elif way == 5:
        lines = lines[: at + 1]
    else:
        low, high = sorted((at, other))
        lines[high:high] = lines[low:high]
    return "\n".join(lines)


def _number(rng: Random, text: str) -> str:
    """Change numbers."""
    found = list(_NUMBER.finditer(text))
    for match in sorted(rng.permutation(len(found))[: int(rng.integers(1, 4))].tolist(), reverse=True):
        low, high = found[match].span()
        text = text[:low] + odd_number(rng, found[match][0]) + text[high:]
    return text


def _word(rng: Random, text: str) -> str:
    """Exchange a word for another one of the text, or something odd, everywhere or once."""
    words = sorted(set(re.findall(r"[A-Za-z_][\w-]*", text)))
    if not words:
        return text
    old = str(one_of(rng, words))
    new = str(one_of(rng, words) if rng.random() < 0.5 else one_of(rng, ODD))
    return re.sub(rf"\b{re.escape(old)}\b", lambda _: new, text, count=int(rng.integers(2)))


def _encoding(rng: Random, text: str) -> str:
    """Change ends of lines, or put a mark before the text."""
    way = int(rng.integers(6))
    if way < 3:
        return text.replace("\n", ("\r\n", "\r", "\u2028")[way])
    return (("\ufeff", "\ufeff\ufeff", "\n\n# remark\n")[way - 3]) + text


# -- tables ------------------------------------------------------------------------------------------------------


def _table(rng: Random, text: str) -> str:
    """Change cells, columns and the header of a table."""
    lines = [line for line in text.split("\n") if line]
    sign = next((s for s in (",", ";", "\t", " ") if s in (lines[0] if lines else "")), ",")
    rows = [line.split(sign) for line in lines]
    if not rows:
        return text
    width = len(rows[0])
    way, a, b, r = (int(rng.integers(n)) for n in (16, width, width, len(rows)))
    full = [row for row in rows if len(row) == width]
    if way == 0:
        for row in full:
            row[a], row[b] = row[b], row[a]
    elif way == 1:
        for row in full[1:]:
            row[a], row[b] = row[b], row[a]
    elif way == 2:
        for row in full:
            del row[a]
    elif way == 3:
        for row in full:
            row.insert(b, row[a])
    elif way in (4, 5, 6):
        row = rows[r]
        row[int(rng.integers(len(row)))] = str(one_of(rng, ODD))
    elif way == 7:
        value = str(one_of(rng, ODD))
        for row in full[1:]:
            row[a] = value
    elif way == 8:
        rows[0][a] = re.sub(r"\[.*?\]", f"[{one_of(rng, UNITS)}]", rows[0][a])
    elif way == 9:
        shifted = [row[a] for row in full[1:]]
        for row, value in zip(full[1:], shifted[1:] + shifted[:1], strict=True):
            row[a] = value
    elif way == 10:
        for row in full[1:]:
            row[a] = odd_number(rng, row[a])
    elif way == 11:
        sign = str(one_of(rng, (";", "\t", " ", "|", ", ", " ,")))
    elif way == 12:
        rows[r] = rows[r][: int(rng.integers(width + 1))]
    elif way == 13:
        for row in full[1:]:
            row[a] = f"{row[a]}{rows.index(row)}"
    elif way == 14:
        rows[0][a] = str(one_of(rng, ODD))
    else:
        rows = [rows[0], *(rows[1:] * int(rng.integers(2, 5)))]
    return "\n".join(sign.join(row) for row in rows) + "\n"


# -- entries -----------------------------------------------------------------------------------------------------


def _yaml(value: Any) -> str:
    """Return entries as YAML in brackets; numbers and names as they are."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_yaml(key)}: {_yaml(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_yaml, value)) + "]"
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    if isinstance(value, Raw):
        return str(value)
    return json.dumps(value)


class Raw(str):
    """A text that is written without quotes."""

    __slots__ = ()


@cache
def _entries(text: str, is_json: bool) -> str:
    content = json.loads(text) if is_json else YAML(typ="safe", pure=True).load(text)
    return repr(content)


_NAMES: Final = {"nan": math.nan, "inf": math.inf}


def _places(value: Any, place: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    parts = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [place, *(found for key, part in parts for found in _places(part, (*place, key)))]


def _at(value: Any, place: tuple[Any, ...]) -> Any:
    for key in place:
        value = value[key]
    return value


def _tree(rng: Random, text: str, *, is_json: bool = False) -> str:
    """Change entries of a YAML or JSON file: values, names, lists, nesting."""
    try:
        content = eval(_entries(text, is_json), dict(_NAMES))
    except Exception:
        return _lines(rng, text)
    for _ in range(int(rng.integers(1, 4))):
        places = _places(content)[1:]
        if not places:
            break
        *above, key = one_of(rng, places)
        holder = _at(content, tuple(above))
        way, value = int(rng.integers(10)), holder[key]
        if way == 0:
            del holder[key]
        elif way == 1:
            holder[key] = one_of(
                rng, (None, True, False, [], {}, "", 0, -1, 1.5, math.nan, math.inf, 1e308, 10**30, 1e-300)
            )
        elif way == 2:
            holder[key] = Raw(one_of(rng, ODD)) if not is_json and rng.random() < 0.3 else str(one_of(rng, ODD))
        elif way == 3:
            holder[key] = [value]
        elif way == 4:
            holder[key] = {str(one_of(rng, ODD)): value}
        elif way == 5:
            holder[key] = deepcopy(_at(content, one_of(rng, places)))
        elif way == 6 and isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e100:
            holder[key] = value * one_of(rng, (-1, 0, 1e3, 1e-3, 1e6, 1e12, 1e150, 57.3))
        elif way == 7 and isinstance(value, list):
            value.insert(int(rng.integers(len(value) + 1)), one_of(rng, value) if value else 0)
        elif way == 8 and isinstance(holder, dict):
            holder[one_of(rng, ODD) if rng.random() < 0.5 else f"{key}x"] = holder.pop(key)
        else:
            deep: Any = value
            for _ in range(int(rng.integers(2, 120))):
                deep = [deep]
            holder[key] = deep
    return json.dumps(content) if is_json else _yaml(content)


def _xml(rng: Random, text: str) -> str:
    """Change attributes and elements."""
    way = int(rng.integers(5))
    parts = list(re.finditer(r'="[^"]*"' if way < 3 else r"<[^>]*>", text))
    if not parts:
        return text
    low, high = parts[int(rng.integers(len(parts)))].span()
    if way == 0:
        return f'{text[:low]}="{one_of(rng, ODD)}"{text[high:]}'
    if way == 1:
        return f"{text[:low]}{one_of(rng, parts)[0]}{text[high:]}"
    if way == 2:
        return (
            text[:low] + " ".join(odd_number(rng, n) for n in text[low + 2 : high - 1].split()).join('""') + text[high:]
        )
    return text[:low] + (text[low:high] * 2 if way == 3 else "") + text[high:]


_ANY: Final[tuple[Damage, ...]] = (_bytes, _lines, _number, _word, _encoding)


def _damages(name: str) -> tuple[Damage, ...]:
    kind = Path(name).suffix
    if kind in (".csv", ".txt"):
        return (_table, _table, _table, *_ANY)
    if kind == ".yaml":
        return (_tree, _tree, _tree, *_ANY)
    if kind == ".json":
        return (lambda rng, text: _tree(rng, text, is_json=True), *_ANY)
    if kind in (".urdf", ".dtx", ".pgx", ".pjx"):
        return (_xml, _xml, *_ANY)
    return _ANY


def _workbook(rng: Random, content: bytes) -> bytes:
    """Change cells, attributes and elements of a part of a workbook."""
    with zipfile.ZipFile(io.BytesIO(content)) as parts:
        held = {name: parts.read(name) for name in parts.namelist()}
    sheets = [name for name in held if "worksheets/" in name or "sharedStrings" in name]
    name = str(one_of(rng, sheets if rng.random() < 0.8 else sorted(held)))
    text = held[name].decode("utf-8", "surrogateescape")
    damage = one_of(rng, (_number, _number, _word, _xml, _xml, _bytes))
    held[name] = str(damage(rng, text)).encode("utf-8", "replace")
    if rng.random() < 0.1:
        del held[str(one_of(rng, sorted(held)))]
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w") as parts:
        for part, data in held.items():
            parts.writestr(part, data)
    return made.getvalue()


def damaged(rng: Random, name: str, content: bytes) -> bytes:
    """Return a file with a few damages of its kind."""
    if name.endswith(".xlsx") and rng.random() < 0.8:
        return _workbook(rng, content)
    if rng.random() < 0.01:
        return bytes(rng.integers(0, 256, int(rng.integers(0, 2000)), dtype=np.uint8))
    text = content.decode("latin-1" if name.endswith((".png", ".xlsx")) else "utf-8", "surrogateescape")
    damages = (_bytes,) if name.endswith((".png", ".xlsx")) else _damages(name)
    while True:
        text = str(one_of(rng, damages)(rng, text))[:2_000_000]
        if rng.random() < 0.6:
            break
    if name.endswith((".png", ".xlsx")):
        return text.encode("latin-1", "replace")
    if rng.random() < 0.03:
        return text.encode(str(one_of(rng, ("utf-16", "latin-1", "cp1252", "utf-8-sig"))), "replace")
    return text.encode("utf-8", "surrogateescape" if not re.search("[\ud800-\udc7f\udd00-\udfff]", text) else "replace")
