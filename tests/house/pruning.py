"""Takes what uses a deleted module out of other files, by their syntax trees and until nothing more is to go.

A function that uses what is gone goes as a whole, and what uses the function then; of a dictionary, list or tuple only
the entry goes. In the registries of the tests an entry goes too that names a job, or the key of another entry, that is
gone.
"""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

Definition = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef
Words = tuple[str, ...]
#: Modules of functions that take the words of a command, or run what stands in a list.
RUNNING: Final = ("tests.commanding.", "tests.honesty.telling.", "truearm.commands.")


@dataclass
class Gone:
    """What is gone."""

    modules: set[str] = field(default_factory=set)  #: By their dotted names.
    names: set[tuple[str, str]] = field(default_factory=set)  #: Of other modules: module and name.
    keys: set[str] = field(default_factory=set)  #: By which registries of the tests know jobs and other things.
    kept: set[str] = field(default_factory=set)  #: Jobs that stay: where one list loses them, others do not.
    commands: set[Words] = field(default_factory=set)  #: By their words.
    fixtures: set[tuple[str, str]] = field(default_factory=set)  #: Where they hold, and their names.
    tests: list[str] = field(default_factory=list)  #: Test functions, each with its file.

    def has(self, dotted: str) -> bool:
        """Whether this is gone, or lies in what is gone."""
        parts = dotted.split(".")
        return any(
            ".".join(parts[:n]) in self.modules or (".".join(parts[: n - 1]), parts[n - 1]) in self.names
            for n in range(1, len(parts) + 1)
        )

    def in_text(self, text: str) -> bool:
        """Whether a text names something of the package that is gone, or a command."""
        return "truearm" in text and (
            any(self.has(found) for found in re.findall(r"\btruearm(?:\.\w+)+", text))
            or any(self.called(found.split()) for found in re.findall(r"\btruearm ([\w -]+)", text))
            or any(self.has(f"truearm.{found}") for found in re.findall(r"\bfrom truearm import (\w+)", text))
        )

    def called(self, words: Sequence[object]) -> bool:
        """Whether these are words of a command that is gone."""
        return any(tuple(words[: len(command)]) == command for command in self.commands)


def module_of(path: Path) -> str:
    """Return the dotted name of a file below the root of the tree."""
    parts = path.with_suffix("").parts
    return ".".join(parts[1:] if parts[0] == "src" else parts).removesuffix(".__init__")


def _dotted(node: ast.AST) -> str:
    if isinstance(node, ast.arg):
        return f"{node.arg}="
    if isinstance(node, ast.Attribute):
        return f"{_dotted(node.value)}.{node.attr}"
    return node.id if isinstance(node, ast.Name) else "?"


def imported(nodes: Iterable[ast.AST]) -> Iterator[tuple[str, str, ast.alias]]:
    """Give what is imported: the name it has here, its dotted name, and its place."""
    for node in nodes:
        for alias in node.names if isinstance(node, ast.Import | ast.ImportFrom) else ():
            before = f"{node.module}." if isinstance(node, ast.ImportFrom) else ""
            yield alias.asname or alias.name, f"{before}{alias.name}", alias


class Pruned:
    """A file that is pruned.

    Attributes
    ----------
    changed
        By the place of a top-level statement what takes its place; None for nothing.
    """

    def __init__(self, path: Path, text: str, *, registry: bool) -> None:
        self.module, self.path, self.text, self.registry = module_of(path), path, text, registry
        self.tree = ast.parse(text)
        self.changed: dict[int, ast.stmt | None] = {}
        self._trims = 0
        nodes = [*ast.walk(self.tree)]
        self.imported = [(name, dotted) for name, dotted, _ in imported(nodes)]
        meant = Counter(name for name, _ in {*self.imported})  # what functions import under one name is looked at there
        self._known = {name: dotted for name, dotted in self.imported if "." not in name and meant[name] == 1}
        self._known |= {name.partition(".")[0]: name.partition(".")[0] for name, _ in self.imported if "." in name}
        self._commanding = any(dotted.startswith(RUNNING) for _, dotted in self.imported)
        self._starting = {
            _dotted(node.targets[0])
            for node in nodes
            if isinstance(node, ast.Assign) and isinstance(node.value, ast.List) and _last(node.value) == "truearm"
        }
        self._docs = {
            id(node.body[0].value)
            for node in nodes
            if isinstance(node, Definition | ast.Module) and node.body and isinstance(node.body[0], ast.Expr)
        }
        self._parts: dict[str, ast.AST] = {}  # one of each kind of what may be gone, for a quick look
        for node in nodes:
            if isinstance(node, ast.Name | ast.Attribute | ast.arg):
                self._parts.setdefault(_dotted(node), node)
            elif isinstance(node, ast.Import | ast.ImportFrom):
                self._parts[f"import {id(node)}"] = node
            elif (
                isinstance(node, ast.Constant) and isinstance(node.value, str) and (registry or "truearm" in node.value)
            ):
                self._parts.setdefault(f"text {node.value}", node)
            elif isinstance(node, ast.Call | ast.List | ast.Tuple) and self._words(node):
                self._parts[f"words {id(node)}"] = node

    def _words(self, node: ast.Call | ast.List | ast.Tuple) -> list[object]:
        """Return the words of the command that a call or a list is, if it is one."""
        nodes = node.args if isinstance(node, ast.Call) else node.elts
        words: list[object] = [n.value if isinstance(n, ast.Constant) else self._starts(n) for n in nodes]
        if "truearm" in words:
            return words[words.index("truearm") + 1 :]
        called = not isinstance(node, ast.Call) or isinstance(node.func, ast.Name)
        return words if called and self._commanding else []

    def _starts(self, node: ast.AST) -> str | None:
        """Return ``truearm`` for what is called so, or a list put in that ends with it; no other name is a word."""
        started = isinstance(node, ast.Starred) and _dotted(node.value) in self._starting
        return "truearm" if started or _dotted(node) == "truearm" else None

    def touched(self, gone: Gone) -> bool:
        """Whether the file may use what is gone."""
        fixtures = {name for _, name in gone.fixtures}
        return any(
            part.arg in fixtures or (self.module, part.arg) in gone.names
            if isinstance(part, ast.arg)
            else self._is_gone(part, set(), gone) or self._names(part, gone)
            for part in self._parts.values()
        )

    def uses(self, node: ast.AST, gone: Gone) -> bool:
        """Whether a part of the file uses what is gone."""
        parts = [*ast.walk(node)]
        own = {n.id for n in parts if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
        own |= {n.arg for n in parts if isinstance(n, ast.arg)}
        return any(self._is_gone(part, own, gone) for part in parts) or (
            isinstance(node, ast.FunctionDef)
            and (node.name.startswith("test_") or _is_fixture(node))
            and any(self._without(one.arg, gone) for one in node.args.args)
        )

    def _without(self, fixture: str, gone: Gone) -> bool:
        """Whether a fixture is gone, here or in a folder above."""
        return (self.module, fixture) in gone.names or any(
            f"{self.module}.".startswith(f"{place}.") for place, name in gone.fixtures if name == fixture
        )

    def _is_gone(self, node: ast.AST, own: set[str], gone: Gone) -> bool:
        if isinstance(node, ast.Name):
            here = isinstance(node.ctx, ast.Load) and node.id not in own
            return here and ((self.module, node.id) in gone.names or gone.has(self._known.get(node.id, "?")))
        if isinstance(node, ast.Attribute):
            first, _, rest = _dotted(node).partition(".")
            return first not in own and gone.has(f"{self._known.get(first, '?')}.{rest}")
        if isinstance(node, ast.Import | ast.ImportFrom):
            return any(gone.has(dotted) for _, dotted, _ in imported([node]))
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in self._docs:
            return gone.in_text(node.value)
        if isinstance(node, ast.Subscript):
            return _is_constant(node.value) and self._names(node.slice, gone)
        return isinstance(node, ast.Call | ast.List | ast.Tuple) and gone.called(self._words(node))

    def _names(self, entry: ast.AST, gone: Gone) -> bool:
        """Whether an entry of a registry names what is gone."""
        if isinstance(entry, ast.Tuple | ast.Call | ast.Dict):
            kind = "elts" if isinstance(entry, ast.Tuple) else "args" if isinstance(entry, ast.Call) else "values"
            return any(self._names(part, gone) for part in getattr(entry, kind))
        return (
            self.registry
            and isinstance(entry, ast.Constant)
            and isinstance(entry.value, str)
            and (entry.value in gone.keys or gone.called([*entry.value.split()]))
        )

    def _trimmed(self, node: ast.AST, gone: Gone) -> bool:
        """Take the entries that use what is gone out of the outermost collections; whether one has none left."""
        if isinstance(node, ast.Dict):
            pairs = list(zip(node.keys, node.values, strict=True))
            left = [
                (key, value)
                for key, value in pairs
                if not any(
                    part is not None and (self.uses(part, gone) or self._names(part, gone)) for part in (key, value)
                )
            ]
            node.keys, node.values = [key for key, _ in left], [value for _, value in left]
            self._trims += len(pairs) - len(left)
            return bool(pairs) and not left
        if isinstance(node, ast.List | ast.Tuple | ast.Set):
            before = len(node.elts)
            node.elts = [entry for entry in node.elts if not (self.uses(entry, gone) or self._names(entry, gone))]
            self._trims += before - len(node.elts)
            return before > 0 and not node.elts
        if isinstance(node, ast.Call | ast.BinOp | ast.keyword | ast.Starred):
            return any([self._trimmed(child, gone) for child in ast.iter_child_nodes(node)])  # noqa: C419 - all are trimmed
        return False

    def _parametrized(self, one: ast.expr, gone: Gone) -> bool:
        """Take entries out of the values of a test's parameters; whether none is left."""
        if not (isinstance(one, ast.Call) and _dotted(one.func).endswith("parametrize") and len(one.args) > 1):
            return False
        before, empty = self._trims, self._trimmed(one.args[1], gone)
        if self._trims > before:
            one.keywords = [
                k for k in one.keywords if not (k.arg == "ids" and isinstance(k.value, ast.List | ast.Tuple))
            ]
        return empty

    def _kept(self, node: ast.stmt, gone: Gone) -> ast.stmt | None:
        """Return what is left of a statement."""
        bound: list[str] = []
        left: ast.stmt | None = node
        if isinstance(node, ast.Import | ast.ImportFrom):
            kept = [alias for _, dotted, alias in imported([node]) if not gone.has(dotted)]
            bound = [a.asname or a.name for a in node.names if a not in kept]
            self._trims += len(node.names) - len(kept)
            node.names, left = kept, node if kept else None
        elif isinstance(node, Definition):
            empty = any([self._parametrized(one, gone) for one in node.decorator_list])  # noqa: C419 - all are trimmed
            if empty or self.uses(node, gone):
                bound, left = [node.name], None
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            own = [n.id for target in targets for n in ast.walk(target) if isinstance(n, ast.Name)]
            keys = _keys(node.value)
            empty = node.value is not None and self._trimmed(node.value, gone) and isinstance(node, ast.Assign)
            if isinstance(node, ast.AnnAssign):
                empty |= self.uses(node.annotation, gone)
            if own == ["__all__"] and isinstance(node.value, ast.List | ast.Tuple):
                gone_here = [
                    e for e in node.value.elts if isinstance(e, ast.Constant) and (self.module, e.value) in gone.names
                ]
                node.value.elts = [e for e in node.value.elts if e not in gone_here]
                self._trims += len(gone_here)
            elif empty or (node.value is not None and self.uses(node.value, gone)):
                bound, left = own, None
            if self.registry:
                gone.keys |= keys - _keys(node.value) - gone.kept
            if self.module == "truearm":
                gone.names |= {("truearm", key) for key in keys - _keys(node.value)}
        elif isinstance(node, ast.If | ast.With | ast.Try | ast.For):
            body = [one for part in node.body if (one := self._kept(part, gone)) is not None]
            self._trims += len(node.body) - len(body)
            node.body = body
            left = node if node.body and not self.uses(node, gone) else None
        elif isinstance(node, ast.Expr):
            self._trimmed(node.value, gone)
            left = None if self.uses(node.value, gone) else node
        gone.names |= {(self.module, name) for name in bound}
        if isinstance(node, ast.FunctionDef) and left is None and node.name.startswith("test_"):
            gone.tests.append(f"{self.path}::{node.name}")
        if self.path.name == "conftest.py":
            gone.fixtures |= {(self.module.removesuffix(".conftest"), name) for name in bound}
        return left

    def prune(self, gone: Gone) -> None:
        """Take out of it what uses what is gone; once more where more is gone by now."""
        if not self.touched(gone):
            return
        for place, node in enumerate(self.tree.body):
            now = self.changed.get(place, node)
            if now is None:
                continue
            self._trims = 0
            left = self._kept(now, gone)
            if left is None or self._trims:
                self.changed[place] = left

    def written(self) -> str:
        """Return the text without it; what stays as it was keeps its lines."""
        lines = self.text.splitlines(keepends=True)
        for place, left in sorted(self.changed.items(), reverse=True):
            node = self.tree.body[place]
            first = min([node.lineno, *(d.lineno for d in getattr(node, "decorator_list", ()))])
            last, text = node.end_lineno or node.lineno, "" if left is None else f"{ast.unparse(left)}\n"
            if isinstance(left, Definition):
                last, text = left.lineno - 1, "".join(f"@{ast.unparse(one)}\n" for one in left.decorator_list)
            ignored = re.search(r"# type: ignore.*", "".join(lines[first - 1 : last]))
            lines[first - 1 : last] = [f"{text[:-1]}  {ignored[0]}\n" if text and ignored else text]
        return "".join(lines)


def _is_fixture(node: ast.FunctionDef) -> bool:
    return any("fixture" in ast.dump(one) for one in node.decorator_list)


def _last(node: ast.List) -> object:
    return node.elts[-1].value if node.elts and isinstance(node.elts[-1], ast.Constant) else None


def _is_constant(node: ast.expr) -> bool:
    return _dotted(node).rpartition(".")[2].isupper()


def _keys(node: ast.expr | None) -> set[str]:
    """Return the keys of a dictionary that are texts."""
    keys = node.keys if isinstance(node, ast.Dict) else []
    return {key.value for key in keys if isinstance(key, ast.Constant) and isinstance(key.value, str)}


def prune(files: list[Pruned], gone: Gone) -> None:
    """Prune files until nothing more is to go."""
    before: object = None
    while before != (before := (len(gone.names), len(gone.keys), len(gone.fixtures))):
        for file in files:
            file.prune(gone)
