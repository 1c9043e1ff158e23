"""Counts what there is to hold, and refuses what grows unsaid: ``script/counters.py``, ``--write`` to say it.

Prints lines by area and kind, and the counters of the house beside those in ``counters.json``. A counter that is worse
than there ends it with 1; ``--write`` writes the file anew, and the commit that has it says that it grew, or shrank.
"""

from __future__ import annotations

import ast
import io
import json
import re
import subprocess
import sys
import tokenize
from collections import Counter, defaultdict
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "truearm"
MARKS = Path(__file__).with_name("counters.json")
KINDS = ("import", "signature", "docstring", "blank", "comment", "checks and messages", "fields", "logic")
#: Functions of more lines are counted.
LONG = 80
#: Modules that declare options, beside the jobs: commands, the studio, the manifest of a fleet.
DECLARING = re.compile(r"truearm\.(\w+\.command|studio|fleets\.(manifest|entries))\b")
#: Calls that are messages.
MESSAGES = {"InputError", "CommandError", "Notice", "wrong_kind", "refused_value"}
Lines = set[int]


def tracked() -> list[Path]:
    """Return the files of text that are tracked or new, without robot data, recordings and pictures."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True
    )
    left_out = ("src/truearm/engine/robot/library/", "tests/recordings/", "docs/images/", "requirements.lock")
    kinds = (".py", ".md", ".jinja", ".js", ".toml", ".sh", ".yaml", ".yml", "")
    paths = [ROOT / name for name in listed.stdout.splitlines()]
    return [
        path
        for path in paths
        if path.is_file()
        and path.suffix in kinds
        and (path.suffix == ".py" or not str(path.relative_to(ROOT)).startswith(left_out))
    ]


def area(path: Path) -> str:
    """Return what a file is counted with."""
    parts = path.relative_to(ROOT).parts
    if parts[0] != "src":
        return parts[0] if len(parts) > 1 and parts[0] in ("tests", "papers", "docs", "benchmarks") else "other"
    return parts[2] if len(parts) > 3 else "package"


def by_kind(text: str, tree: ast.Module) -> Counter[str]:
    """Return how many lines of each kind a Python file has; a line is of the first kind that fits."""
    imports, signatures, docstrings, messages, fields = (Lines() for _ in range(5))
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and ast.get_docstring(
            node, clean=False
        ):
            docstrings |= span(node.body[0])
        if isinstance(node, ast.Import | ast.ImportFrom):
            imports |= span(node)
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            signatures |= set(range(node.lineno, node.body[0].lineno))
        elif isinstance(node, ast.Raise) or (isinstance(node, ast.Call) and name_of(node.func) in MESSAGES):
            messages |= span(node)
        elif isinstance(node, ast.If) and all(isinstance(one, ast.Raise) for one in node.body):
            messages |= span(node.test) | {node.lineno}
        elif isinstance(node, ast.ClassDef):
            for one in node.body:
                fields |= span(one) if isinstance(one, ast.AnnAssign) else set()
    code = Lines()
    layout = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER)
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in layout:
            code |= set(range(token.start[0], token.end[0] + 1))
    found: Counter[str] = Counter()
    for number, line in enumerate(text.splitlines(), 1):
        kinds = zip(KINDS, (imports, signatures, docstrings, (), (), messages, fields), strict=False)
        if number not in code:
            found["comment" if line.strip() else "blank"] += 1
        else:
            found[next((kind for kind, lines in kinds if number in lines), "logic")] += 1
    return found


def span(node: ast.stmt | ast.expr) -> Lines:
    """Return the lines of a node."""
    return set(range(node.lineno, (node.end_lineno or node.lineno) + 1))


def name_of(node: ast.expr) -> str:
    """Return the last name of what is called."""
    return node.attr if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else ""


def named(node: ast.AnnAssign) -> str:
    """Return the name of what is declared."""
    return name_of(node.target)


def is_option(node: ast.AnnAssign) -> bool:
    """Return whether this declares an option of a request."""
    return isinstance(node.value, ast.Call) and name_of(node.value.func) in ("option", "required")


def imported(tree: ast.AST, files: dict[str, Path]) -> set[str]:
    """Return the modules that a module imports anywhere, but for types alone."""
    found, left = set[str](), list(ast.iter_child_nodes(tree))
    while left:
        node = left.pop()
        if isinstance(node, ast.If) and name_of(node.test) == "TYPE_CHECKING":
            left += node.orelse
            continue
        left += ast.iter_child_nodes(node)
        if isinstance(node, ast.ImportFrom) and node.module:
            names = [f"{node.module}.{alias.name}" for alias in node.names]
            found |= {name if name in files else node.module for name in names}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    return found & set(files)


def cycles(graph: dict[str, set[str]]) -> list[list[str]]:
    """Return the groups of modules that import each other, directly or not."""
    reached = dict[str, set[str]]()
    for start in graph:
        seen, left = set[str](), [start]
        while left:
            more = graph[left.pop()] - seen
            seen |= more
            left += more
        reached[start] = seen
    groups = {tuple(sorted(b for b in reached[a] if a in reached[b])) for a in graph if a in reached[a]}
    return sorted(map(list, groups))


def counted() -> tuple[dict[str, Counter[str]], dict[str, int], list[str]]:
    """Return lines by area and kind, the counters, and what they are made of where that is short."""
    table = defaultdict[str, Counter[str]](Counter)
    functions, declared, codes, words, graph, told = (
        0,
        Counter[str](),
        set[str](),
        0,
        dict[str, set[str]](),
        list[str](),
    )
    modules, options, requests = dict[str, Path](), set[str](), set[ast.AST]()
    trees = dict[Path, ast.Module]()
    for path in tracked():
        text = path.read_text("utf-8", errors="replace")
        where = area(path)
        table[where]["files"] += 1
        if path.suffix == ".md":
            words += len(text.split()) if path.name != "CHANGELOG.md" else 0
        if path.suffix != ".py":
            table[where]["other"] += len(text.splitlines())
            continue
        trees[path] = ast.parse(text)
        table[where].update(by_kind(text, trees[path]))
        if path.is_relative_to(PACKAGE):
            dotted = ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__")
            modules[dotted] = path
    jobs = next(n for n in trees[PACKAGE / "__init__.py"].body if isinstance(n, ast.AnnAssign) and named(n) == "JOBS")
    homes = ast.literal_eval(jobs.value or jobs)
    for job, home in homes.items():
        for function in trees[modules[home]].body:
            if isinstance(function, ast.FunctionDef) and function.name == job:
                requests.add(function)
                options |= {one.arg for one in function.args.kwonlyargs} - {"progress", "command"}
    for tree in trees.values():
        options |= {named(one) for one in ast.walk(tree) if isinstance(one, ast.AnnAssign) and is_option(one)}
    for dotted, path in modules.items():
        graph[dotted] = imported(trees[path], modules) - {dotted}
        for node in ast.walk(trees[path]):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                lines = (node.end_lineno or 0) - node.lineno + 1
                if lines > LONG:
                    functions += 1
                    told.append(f"{dotted}.{node.name}: {lines} lines")
                if node not in requests and not DECLARING.match(dotted):
                    continue
                arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
                declared.update(one.arg for one in arguments if one.arg in options)
            elif isinstance(node, ast.AnnAssign) and is_option(node):
                declared[named(node)] += 1
            elif isinstance(node, ast.ClassDef) and DECLARING.match(dotted):
                held = [n.target for n in node.body if isinstance(n, ast.AnnAssign)]
                declared.update(name_of(one) for one in held if name_of(one) in options)
            elif isinstance(node, ast.Call) and name_of(node.func) == "Rule" and node.args:
                first = node.args[0]
                codes |= {first.value} if isinstance(first, ast.Constant) and isinstance(first.value, str) else set()
    loops = cycles(graph)
    told += [f"cycle: {', '.join(loop)}" for loop in loops]
    told += [f"declared {count} times: {name}" for name, count in declared.most_common(8)]
    lines = {name: sum(row[kind] for kind in (*KINDS, "other")) for name, row in table.items()}
    source = {name for name in table if name not in ("tests", "papers", "docs", "benchmarks", "other")}
    features = {name: lines[name] for name in source - {"engine", "studio", "package"}}
    return (
        dict(table),
        {
            "lines of the package without studio": sum(lines[name] for name in source - {"studio"}),
            "lines of the studio": lines["studio"],
            "lines of papers": lines["papers"],
            "lines of tests": lines["tests"],
            "lines of the largest feature": max(features.values()),
            "files of the package": sum(table[name]["files"] for name in source),
            "top-level entries of the package": sum(
                not one.name.startswith("__pycache__") for one in PACKAGE.iterdir()
            ),
            "cycles of files": len(loops),
            "declarations of options": declared.total(),
            f"functions above {LONG} lines": functions,
            "notice codes": len(codes),
            "words of documentation": words,
        },
        told,
    )


def main() -> int:
    """Print the counters; return 1 if one is worse than its mark."""
    table, counters, told = counted()
    columns = ("files", *KINDS, "other")
    print(f"{'':18}" + "".join(f"{re.sub(r' .*', '', column):>11}" for column in columns))
    for name in sorted(table, key=lambda one: -sum(table[one].values())):
        print(f"{name:18}" + "".join(f"{table[name][column]:11}" for column in columns))
    print("\n" + "\n".join(told))
    marks = json.loads(MARKS.read_text()) if MARKS.exists() else {}
    worse = [name for name, count in counters.items() if count > marks.get(name, count)]
    print()
    for name, count in counters.items():
        mark = marks.get(name)
        print(f"{name:40} {count:8}" + ("" if mark in (None, count) else f"   was {mark}"))
    if "--write" in sys.argv[1:]:
        MARKS.write_text(json.dumps(counters, indent=4) + "\n")
        return 0
    if worse:
        print(f"\nGrown: {', '.join(worse)}. Fix it, or say so in this commit: python script/counters.py --write")
    return bool(worse)


if __name__ == "__main__":
    sys.exit(main())
