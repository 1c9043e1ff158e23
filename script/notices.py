"""Write the guide's page of notices from the rules (`--write`), or say if it is not what they say."""

from __future__ import annotations

import importlib
import re
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from truearm.engine.base.errors import Rule

ROOT = Path(__file__).parents[1]
SOURCE, PAGE = ROOT / "src", ROOT / "docs" / "guide" / "notices.md"
HEAD = """# Notices

A notice has a code, a [level](results.md#status-and-warnings) and a message, which says what to do. This page is made
from the rules in the code: first those of the engine, about measurements, fits, robot files, plans and programs, which
several commands tell; then a table for each feature.
"""
_DECLARED = re.compile(r"^(\w+): Final = Rule\(", re.MULTILINE)


def rules() -> Iterator[tuple[str, Rule]]:
    """Give each rule with the folder of the package that declares it."""
    for file in sorted((SOURCE / "truearm").rglob("*.py")):
        names = _DECLARED.findall(file.read_text())
        if names:
            within = file.relative_to(SOURCE).with_suffix("")
            module = importlib.import_module(".".join(within.parts))
            yield from ((within.parts[1], getattr(module, name)) for name in names)


def page() -> str:
    """Return the page: a table for the engine, and one for each feature."""
    tables: dict[str, list[Rule]] = defaultdict(list)
    for folder, rule in rules():
        tables[folder].append(rule)
    text = HEAD
    for folder in sorted(tables, key=lambda name: (name != "engine", name)):
        text += f"\n## `{folder}`\n\n| code | level | what was noticed, and what to do |\n|---|---|---|\n"
        for rule in sorted(tables[folder], key=lambda rule: rule.code):
            told = f"{rule.meaning}. {rule.cure}".removesuffix(". ")
            text += f"| `{rule.code}` | {' or '.join(rule.levels)} | {told} |\n"
    return text


if __name__ == "__main__":
    if "--write" in sys.argv:
        PAGE.write_text(page())
    elif PAGE.read_text() != page():
        sys.exit(f"{PAGE.relative_to(ROOT)} is not what the rules say: python script/notices.py --write")
