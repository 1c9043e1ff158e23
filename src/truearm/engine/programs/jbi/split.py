"""Yaskawa INFORM: jobs with more positions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from truearm.engine.programs.jbi.job import Job, Position, State, jobs_of
from truearm.engine.programs.program import (
    Edit,
    Lines,
    Program,
    ProgramTarget,
    Split,
    SplitEdits,
    indentation,
    line_end,
    written,
)


@dataclass
class _Additions:
    """What is added to the table of one job."""

    text: str
    next_number: int
    width: int
    state: State
    written: list[str] = field(default_factory=list)

    def position(self, numbers: Sequence[float], like: Position, target: ProgramTarget) -> str:
        """Add a position in the state of another one and return its name."""
        self.written += _changes(self.state, like.state)
        self.state = like.state
        name = f"C{self.next_number:0{self.width}d}"
        self.next_number += 1
        seventh = self.text[like.places[len(numbers) - 1][1] : like.stop]
        self.written.append(f"{name}={_listed(numbers, target)}{seventh}")
        return name


def split_moves(program: Program, splits: Sequence[Split]) -> SplitEdits:
    """Split linear and circular moves.

    Every job gets its new positions behind the last one of its table, with the next free numbers. Between the segments
    of a circle stands a MOVL to the point where the robot is already: circles of different curvature have to be
    separated in this way (NX100 operator's manual, "Continuous circular arcs").
    """
    edits: list[Edit] = []
    by_source: dict[int, list[Split]] = {}
    for split in sorted(splits, key=lambda split: program.moves[split.move].statement):
        by_source.setdefault(program.moves[split.move].source, []).append(split)
    for source, wanted in sorted(by_source.items()):
        text = program.sources[source].text
        for job in jobs_of(program.sources[source], Lines(text)):
            own = [split for split in wanted if job.start <= program.moves[split.move].statement[0] < job.stop]
            if own:
                edits += _of_job(program, source, job, own)
    return SplitEdits(edits, [])


def _of_job(program: Program, source: int, job: Job, splits: Sequence[Split]) -> Iterator[Edit]:
    text = program.sources[source].text
    steps = [position for position in job.positions if position.table == "C"]
    last = (steps or list(job.positions))[-1]
    by_place = {position.places[0]: position for position in job.positions}
    additions = _Additions(
        text=text,
        next_number=max((position.number for position in steps), default=-1) + 1,
        width=len(last.name) - 1 if steps else 5,
        state=last.state,
    )
    for split in splits:
        move = program.moves[split.move]
        target = program.targets[move.target]
        like = by_place[target.places[0] or (0, 0)]
        if move.via is None or move.via_text is None or split.last_via is None:
            line = move.statement[0] - len(indentation(text, move.statement[0]))
            head = text[line : move.target_text[0]].upper().replace("MOVC", "MOVL")
            tail = text[move.target_text[1] : move.statement[1]] + line_end(text, move.statement[1])
            names = [additions.position(numbers, like, target) for numbers, _ in split.points]
            yield Edit(source, line, line, "".join(f"{head}{name}{tail}" for name in names))
        else:
            circle = [(numbers, through) for numbers, through in split.points if through is not None]
            via = program.targets[move.via]
            line = move.statement[0] - len(indentation(text, move.statement[0]))
            head, end = text[line : move.via_text[0]], line_end(text, move.via_text[1])
            tail = text[move.via_text[1] : text.index(end, move.via_text[1])] + end
            straight = head.upper().replace("MOVC", "MOVL")
            new = [
                f"{words}{additions.position(place, like, target)}{tail}"
                for numbers, through in circle
                for words, place in ((head, through), (head, numbers), (straight, numbers), (head, numbers))
            ]
            yield Edit(source, line, line, "".join(new))
            places = [place for place in via.places if place is not None]
            yield Edit(source, places[0][0], places[-1][1], _listed(split.last_via, via))
    count = len(steps) + sum(not line.startswith("/") for line in additions.written)
    yield Edit(source, *job.count, str(count))
    end = line_end(text, last.stop)
    new = [*additions.written, *_changes(additions.state, last.state)]
    yield Edit(source, last.stop, last.stop, "".join(end + line for line in new))


def _listed(numbers: Sequence[float], like: ProgramTarget) -> str:
    """Write numbers as a line of the table has them."""
    lengths, angles = like.form.decimals
    decimals = [lengths] * 3 + [angles] * 3 if like.form.kind == "pose" else [angles] * len(numbers)
    return ",".join(written(number, digits) for number, digits in zip(numbers, decimals, strict=True))


def _changes(old: State, new: State) -> list[str]:
    """Return the lines that lead from one state to another."""
    changes = []
    if new.user and new.user != old.user:
        changes.append(f"///USER {new.user}")
    if new.tool != old.tool:
        changes.append(f"///TOOL {new.tool}")
    if new.postype != old.postype:
        marker = {"PULSE": "///PULSE", "ANGLE": "///ANGLE"}.get(new.postype, "///RECTAN")
        changes += [f"///POSTYPE {new.postype}", marker]
    if new.rconf and new.rconf != old.rconf:
        changes.append(f"///RCONF {new.rconf}")
    return changes
