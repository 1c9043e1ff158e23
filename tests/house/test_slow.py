"""What ``script/test`` leaves to ``script/test --all`` is there."""

from __future__ import annotations

import ast

from tests.conftest import SLOW
from tests.house.test_documents import ROOT


def test_every_slow_test_is_there() -> None:
    for file in sorted({entry.partition("::")[0] for entry in SLOW}):
        tree = ast.parse((ROOT / file).read_text())
        functions = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
        named = {entry.partition("::")[2].partition("[")[0] for entry in SLOW if entry.startswith(f"{file}::")}
        assert named <= functions, file
