"""The faults are found again in today's tree, and after what a move does to a function."""

from __future__ import annotations

import ast
from dataclasses import replace
from pathlib import Path

import pytest
from tests.mutants.__main__ import lost, stored
from tests.mutants.drawing import NUMBER, drawn, faults
from tests.mutants.measured import REST, WHOLE, worse
from tests.mutants.running import FOUND, GONE, NO_TEST, SURVIVED, TIMED_OUT, Choice, failed
from tests.mutants.tree import ROOT, Function, all_functions, found_again, functions

#: More of them gone, and the mark says little.
MOST_GONE = 0.4

BEFORE = '''
class Arm:
    def reach(self, joints: Joints, least: float = 0.0) -> float:
        """Give the reach."""
        from here import norm

        far: float = norm(
            joints
        )
        return far - least
'''
MOVED = """
from there import norm
class Arm:
    def reach(self, joints, least: "Length" = 0.0) -> "Length":
        far = norm(joints)
        return far - least
"""


@pytest.fixture(scope="module")
def tree() -> list[Function]:
    return all_functions()


def _only(text: str, name: str = "a.py") -> Function:
    (function,) = functions(text, Path(name))
    return function


def test_a_function_is_found_again_where_it_has_moved() -> None:
    before, moved = _only(BEFORE), _only(MOVED, "b/c.py")
    (minus,) = [mutant for mutant in faults(before) if mutant.operator == "arithmetic"]
    assert found_again(minus, [moved]) == moved
    assert moved.mutated(MOVED, minus) == MOVED.replace("far - least", "(far + least)")


@pytest.mark.parametrize(("old", "new"), [("- least", "+ least"), ("norm(\n", "norms(\n"), ("far", "near")])
def test_a_function_that_does_something_else_is_gone(old: str, new: str) -> None:
    mutant = faults(_only(BEFORE))[0]
    assert found_again(mutant, [_only(BEFORE.replace(old, new))]) is None


def test_of_two_bodies_that_are_alike_the_name_decides() -> None:
    mutant = faults(_only(BEFORE))[0]
    here, there = _only(BEFORE), _only(BEFORE.replace("Arm", "Leg"))
    assert found_again(mutant, [there, here]) == here
    assert found_again(mutant, [here, here]) is None


def test_every_fault_that_is_kept_is_in_the_tree_and_can_be_compiled(tree: list[Function]) -> None:
    mutants = stored()
    gone = [mutant.name for mutant in mutants if found_again(mutant, tree) is None]
    for mutant in mutants:
        if (function := found_again(mutant, tree)) is not None:
            node, text = function.nodes[mutant.index], (ROOT / function.path).read_text(encoding="utf-8")
            assert ast.dump(ast.parse(mutant.before)) == ast.dump(ast.parse(ast.unparse(node)))
            changed = function.mutated(text, mutant)
            assert changed.count("\n") == text.count("\n")
            assert ast.dump(ast.parse(changed)) != ast.dump(ast.parse(text))
    assert len(mutants) == NUMBER
    assert len(gone) <= MOST_GONE * NUMBER, f"gone: {gone}. Draw them anew: python -m tests.mutants draw --again"


def test_what_is_drawn_anew_keeps_the_rest(tree: list[Function]) -> None:
    kept = [mutant for mutant in stored() if found_again(mutant, tree)][:-3]
    again = drawn(tree, kept)
    assert again[: len(kept)] == kept
    assert len({mutant.body for mutant in again}) == NUMBER
    assert drawn(tree, kept) == again


def test_the_test_that_failed_is_read() -> None:
    tests = ["tests/a.py::test_b", "tests/a.py::test_b[x - y]", "tests/a.py::test_c"]
    assert failed("FAILED tests/a.py::test_b[x - y] - assert 1 == 2\n", tests) == [tests[1]]
    assert failed("SKIPPED [1] tests/a.py: no data\n3 passed\n", tests) == []


def test_a_test_that_has_moved_is_run_again() -> None:
    mutant = faults(_only(BEFORE))[0]
    mutant.by = "tests/old/test_a.py::test_b[x]"
    assert Choice(["tests/new/test_a.py::test_b[x]", "tests/c.py::test_c"]).again(mutant) == [
        "tests/new/test_a.py::test_b[x]"
    ]


def test_a_fault_that_is_found_no_more_is_told() -> None:
    mutants = [replace(faults(_only(BEFORE))[0], found=found) for found in (*[True] * 5, False, None)]
    results = (FOUND, TIMED_OUT, GONE, SURVIVED, NO_TEST, SURVIVED, NO_TEST)
    assert lost(mutants, {n: (result, None) for n, result in enumerate(results)}) == [3, 4]


def test_less_coverage_than_at_the_mark_is_told() -> None:
    mark = {total: {"lines": 95.0, "branches": 90.0} for total in (WHOLE, REST)}
    less = {WHOLE: mark[WHOLE], REST: {"lines": 94.95, "branches": 89.8}}
    assert worse(mark, mark) == []
    assert worse(less, mark) == [f"branches {REST}: 89.80 %, at the mark 90.00 %"]
