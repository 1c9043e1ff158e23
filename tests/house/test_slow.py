"""What ``script/test`` leaves to ``script/test --all`` is there."""

from __future__ import annotations

import ast

import pytest
from tests.conftest import SLOW
from tests.house.test_documents import ROOT


@pytest.mark.parametrize("file", sorted({entry.partition("::")[0] for entry in SLOW}))
def test_every_slow_test_is_there(file: str) -> None:
    functions = {node.name for node in ast.parse((ROOT / file).read_text()).body if isinstance(node, ast.FunctionDef)}
    named = {entry.partition("::")[2].partition("[")[0] for entry in SLOW if entry.startswith(f"{file}::")}
    assert named <= functions
