"""Functions of the package as faults are kept by: the body without what may change although it does the same.

Docstrings, annotations and imports are left out, so that a function keeps its hash when it moves to another file.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

Body = list[ast.stmt]
ROOT = Path(__file__).parents[2]
PACKAGE = Path("src") / "truearm"


@dataclass
class Mutant:
    """A fault in a function, and whether the tests found it when the mark was set."""

    name: str
    body: str
    operator: str
    index: int
    before: str
    after: str
    found: bool | None = None
    by: str | None = None


@dataclass(frozen=True)
class Function:
    """A function or method; its nodes are those of its bare body, in the order of `ast.walk`."""

    path: Path
    name: str
    hash: str
    nodes: list[ast.AST] = field(repr=False)

    def lines(self, index: int) -> list[set[int]]:
        """Give the lines of a node, then the first line of its statement."""
        node = self.nodes[index]
        assert isinstance(node, ast.expr | ast.stmt)
        around = [n.lineno for n in self.nodes if isinstance(n, ast.stmt) and n.lineno <= node.lineno <= _end(n)]
        return [set(range(node.lineno, _end(node) + 1)), {around[-1]}]

    def mutated(self, text: str, mutant: Mutant) -> str:
        """Give the text of the file with the fault; all other lines keep their numbers."""
        node = self.nodes[mutant.index]
        assert isinstance(node, ast.expr | ast.stmt)
        assert node.end_col_offset is not None
        lines = text.encode().splitlines(keepends=True)
        start = sum(map(len, lines[: node.lineno - 1])) + node.col_offset
        end = sum(map(len, lines[: _end(node) - 1])) + node.end_col_offset
        blank = "\n" * (_end(node) - node.lineno)
        after = f"({mutant.after}{blank})" if isinstance(node, ast.expr) else mutant.after + blank
        old = text.encode()
        return (old[:start] + after.encode() + old[end:]).decode()


def _end(node: ast.expr | ast.stmt) -> int:
    return node.end_lineno or node.lineno


class _Bare(ast.NodeTransformer):
    """Takes docstrings, annotations and imports away."""

    def visit_Import(self, node: ast.Import | ast.ImportFrom) -> None:
        return None

    visit_ImportFrom = visit_Import  # noqa: N815

    def visit_arg(self, node: ast.arg) -> ast.arg:
        node.annotation = None
        return node

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST | None:
        if node.value is None:
            return None
        assigned = ast.Assign([node.target], node.value)
        return self.generic_visit(ast.copy_location(assigned, node))

    def visit_FunctionDef(self, node: ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef) -> ast.AST:
        if ast.get_docstring(node, clean=False) is not None:
            del node.body[0]
        if not isinstance(node, ast.ClassDef):
            node.returns = None
        return self.generic_visit(node)

    visit_AsyncFunctionDef = visit_ClassDef = visit_FunctionDef  # noqa: N815


def _shape(value: object) -> object:
    """Give a tree as lists, the same in every version of Python: what is empty is left out."""
    if isinstance(value, ast.AST):
        fields = ((k, v) for k, v in ast.iter_fields(value) if v is not None and v != [])
        return [type(value).__name__, *((k, _shape(v)) for k, v in fields)]
    return [_shape(v) for v in value] if isinstance(value, list) else value


def functions(text: str, path: Path) -> Iterator[Function]:
    """Give the functions and methods of a file; a function within a function is a part of it."""
    todo: list[tuple[str, Body]] = [("", ast.parse(text).body)]
    while todo:
        within, body = todo.pop()
        for node in body:
            if isinstance(node, ast.ClassDef):
                todo.append((f"{within}{node.name}.", node.body))
            elif isinstance(node, ast.FunctionDef):
                bare: Body = _Bare().visit(node).body
                digest = hashlib.sha256(repr(_shape(bare)).encode()).hexdigest()[:20]
                yield Function(path, within + node.name, digest, [n for s in bare for n in ast.walk(s)])


def all_functions(root: Path = ROOT) -> list[Function]:
    """Give the functions of the package, whatever their files."""
    files = sorted((root / PACKAGE).rglob("*.py"))
    return [f for file in files for f in functions(file.read_text(encoding="utf-8"), file.relative_to(root))]


def found_again(mutant: Mutant, among: list[Function]) -> Function | None:
    """Find the function of a mutant by its body; of several the one of the same name; None when it is gone."""
    same = [function for function in among if function.hash == mutant.body]
    named = [function for function in same if function.name == mutant.name]
    return next((found for (found,) in (one for one in (named, same) if len(one) == 1)), None)
