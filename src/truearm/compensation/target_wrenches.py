"""What acts on the tool at the targets of programs, target by target."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from truearm.compensation.cell import TargetWrench
from truearm.compensation.chosen_targets import Patterns
from truearm.compensation.programs.program import Program
from truearm.errors import InputError, did_you_mean
from truearm.modeling.wrench import Wrench

#: What the flange is called where a target has no tool.
_FLANGE: Final = "flange"


def wrenches_of_targets(programs: Sequence[Program], given: Sequence[TargetWrench]) -> list[tuple[Wrench | None, ...]]:
    """Return what acts at each target of each program; None where nothing does.

    What names a target holds before what names its tool alone, and that before what names neither.

    Raises:
        InputError: If a name fits no target or no tool of the programs, or two entries of one kind fit one target.
    """
    fits = [Patterns(programs, one.targets, "wrench", one.where or None) for one in given]
    used = {target.tool.lower() for program in programs for target in program.targets}
    for one in given:
        for tool in one.tools:
            if _key(tool) not in used:
                names = sorted(name or _FLANGE for name in used)
                raise InputError(
                    "no target of the programs has this tool",
                    parameter="wrench",
                    where=one.where or None,
                    came=tool,
                    allowed=", ".join(names),
                    cure=did_you_mean(tool, names),
                )
    found = []
    for program in programs:
        of_program: list[Wrench | None] = []
        for target in program.targets:
            best: dict[int, TargetWrench] = {}
            for one, patterns in zip(given, fits, strict=True):
                if one.targets and not patterns.fit(target.name):
                    continue
                if one.tools and target.tool.lower() not in map(_key, one.tools):
                    continue
                rank = 0 if one.targets else 1 if one.tools else 2
                if rank in best:
                    raise InputError(
                        "two forces are given for one target",
                        parameter="wrench",
                        where=one.where or None,
                        came=target.name or target.tool or _FLANGE,
                        cure=f"It is in {best[rank].where}, too: take it out of one of them.",
                    )
                best[rank] = one
            of_program.append(best[min(best)].wrench if best else None)
        found.append(tuple(of_program))
    return found


def _key(tool: str) -> str:
    return "" if tool.lower() == _FLANGE else tool.lower()
