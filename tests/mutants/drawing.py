"""Draws faults from the bodies of functions: one for each of the functions that the seed picks."""

from __future__ import annotations

import ast
import random
from collections import Counter, defaultdict
from collections.abc import Iterator

from tests.mutants.tree import PACKAGE, Function, Mutant

SEED = 31
NUMBER = 100
#: Left out: what is replaced soon.
LEFT_OUT = ("studio",)
#: What only describes itself.
_SHOWN = ("__repr__", "__str__", "__rich__", "_repr_html_")
#: Keywords that change no result.
_QUIET = {"strict", "copy", "stacklevel", "check_finite", "indent", "encoding", "ndmin", "maxsize"}
#: Calls that print, or take a seed.
_UNTESTED = ("print", "echo", "warn", "default_rng", "SeedSequence", "Random")
_COMPARED: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.Gt),
    ast.LtE: (ast.Lt, ast.GtE),
    ast.Gt: (ast.GtE, ast.Lt),
    ast.GtE: (ast.Gt, ast.LtE),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
}
_COUNTED: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.Pow: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.FloorDiv,
}
_CALLED = {"min": "max", "minimum": "maximum", "any": "all", "sin": "cos", "nanmin": "nanmax", "argmin": "argmax"}
_CALLED |= {after: before for before, after in _CALLED.items()}
#: Calls of which the order of arguments does not matter, or fails at once.
_ANY_ORDER = {*_CALLED, "hypot", "isclose", "allclose", "array_equal", "isinstance", "getattr", "range", "cast"}

Fault = tuple[str, ast.AST, ast.AST]


def _silent(node: ast.AST) -> bool:
    """Tell whether a node is a message, or within a call that makes one."""
    if isinstance(node, ast.Call):
        return _name(node).endswith(("Error", "Warning", "Notice")) or _name(node) in _UNTESTED
    return isinstance(node, ast.JoinedStr) or (isinstance(node, ast.keyword) and node.arg in _QUIET)


def _name(call: ast.Call) -> str:
    return call.func.id if isinstance(call.func, ast.Name) else getattr(call.func, "attr", "")


def _texts(*nodes: ast.AST) -> bool:
    return any(
        isinstance(n, ast.JoinedStr) or (isinstance(n, ast.Constant) and isinstance(n.value, str)) for n in nodes
    )


def _called(node: ast.Call) -> Iterator[Fault]:
    if (other := _CALLED.get(_name(node))) is not None:
        func = ast.Name(other) if isinstance(node.func, ast.Name) else ast.Attribute(node.func.value, other)  # type: ignore[attr-defined]
        yield "call", node, ast.Call(func, node.args, node.keywords)
    if len(node.args) > 1 and _name(node) not in _ANY_ORDER:
        first, second, *rest = node.args
        if all(isinstance(n, ast.Name | ast.Attribute | ast.Subscript) for n in (first, second)):
            yield "order", node, ast.Call(node.func, [second, first, *rest], node.keywords)


def _faults(node: ast.AST) -> Iterator[Fault]:
    """Give the faults of one node: the operator, the node that is replaced, and what replaces it."""
    match node:
        case ast.Compare(left=left, ops=[op], comparators=comparators) if type(op) in _COMPARED:
            for other in _COMPARED[type(op)]:
                yield "comparison", node, ast.Compare(left, [other()], comparators)
        case ast.BinOp(left=left, op=ast.MatMult() as op, right=right):
            yield "order", node, ast.BinOp(right, op, left)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _COUNTED and not _texts(left, right):
            yield "arithmetic", node, ast.BinOp(left, _COUNTED[type(op)](), right)
        case ast.BoolOp(op=op, values=values):
            yield "and/or", node, ast.BoolOp(ast.Or() if isinstance(op, ast.And) else ast.And(), values)
        case ast.UnaryOp(op=ast.Not() | ast.USub() as op, operand=operand):
            yield "not" if isinstance(op, ast.Not) else "sign", node, operand
        case ast.Constant(value=bool(value)):
            yield "constant", node, ast.Constant(not value)
        case ast.Constant(value=int(value) | float(value)):
            yield "constant", node, ast.Constant(value + 1)
        case ast.Call():
            yield from _called(node)
        case ast.Return(value=ast.expr() as value) if not isinstance(value, ast.Constant):
            yield "return", value, ast.Constant(None)
        case ast.Raise() | ast.AugAssign() | ast.Break() | ast.Continue() | ast.Expr(value=ast.Call()):
            yield "deleted", node, ast.Pass()
        case ast.Assign(targets=[ast.Subscript() | ast.Attribute()]):
            yield "deleted", node, ast.Pass()
    if isinstance(node, ast.If | ast.While | ast.IfExp):
        yield "condition", node.test, ast.UnaryOp(ast.Not(), node.test)
    if isinstance(node, ast.comprehension):
        for test in node.ifs:
            yield "condition", test, ast.UnaryOp(ast.Not(), test)


def faults(function: Function) -> list[Mutant]:
    """Give all faults that can be put into a function."""
    silent = {id(within) for node in function.nodes if _silent(node) for within in ast.walk(node)}
    place = {id(node): index for index, node in enumerate(function.nodes)}
    return [
        Mutant(function.name, function.hash, operator, place[id(old)], ast.unparse(old), ast.unparse(new))
        for node in function.nodes
        for operator, old, new in _faults(node)
        if id(old) not in silent or isinstance(old, ast.Raise)
    ]


def drawn(among: list[Function], kept: list[Mutant]) -> list[Mutant]:
    """Add faults to those that are kept until there are enough: any function, any operator, any place alike."""
    times = Counter(function.hash for function in among)
    left = sorted(
        (f for f in among if times[f.hash] == 1 and f.path.relative_to(PACKAGE).parts[0] not in LEFT_OUT),
        key=lambda function: (function.name, function.hash),
    )
    used = {mutant.body for mutant in kept}
    chance = random.Random(f"{SEED} {sorted(used)}")
    chance.shuffle(left)
    drawn = list(kept)
    for function in left:
        possible = defaultdict(list)
        for mutant in faults(function):
            possible[mutant.operator].append(mutant)
        if len(drawn) == NUMBER:
            break
        if function.hash in used or function.name.endswith(_SHOWN) or sum(map(len, possible.values())) < 3:
            continue
        kinds = sorted(possible)
        (kind,) = chance.choices(kinds, [1 if kind == "return" else 3 for kind in kinds])
        drawn.append(chance.choice(possible[kind]))
    return drawn
