"""Results of correcting programs and of restoring their originals."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np

from truearm.compensation.advice import frame_words
from truearm.compensation.program_correction import CorrectedPrograms, ProgramSplit
from truearm.engine.base.errors import Notice, counted
from truearm.engine.base.writing import output_folder
from truearm.engine.document.document import Block, detail, each, say
from truearm.engine.document.records import Record
from truearm.engine.programs.chosen_targets import Kept
from truearm.engine.programs.corrected_targets import LedgerEntry, corrected_digests
from truearm.engine.programs.correction import Correction, Shared, shared_motion
from truearm.engine.programs.expected_errors import REPEATABILITY
from truearm.engine.programs.gauge import turns_between
from truearm.engine.programs.program import Program, ProgramTarget, Skipped, Source
from truearm.engine.programs.program_files import ProgramFile, language_called, read_sources, recorded, write_programs
from truearm.engine.programs.program_poses import after_edits
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.entries import controller_summary

#: The report beside the corrected programs.
REPORT: Final = "compensation.html"


@dataclass(frozen=True, eq=False, repr=False)
class FileCorrection(Record):
    """One corrected file of a program."""

    file: ProgramFile  #: As it was found.
    correction: Correction  #: Of the program that it is part of.
    source: int  #: Which file of that program, from 0.
    text: bytes  #: Its new bytes.
    relative: bool = False  #: Whether the errors to expect are of the targets relative to each other.
    lower_bound: bool = False  #: Whether they may be larger, for a reason that the calibration knows.

    @property
    def name(self) -> str:
        """Its name in the folder of results."""
        return self.file.name

    @property
    def language(self) -> str:
        """The robot language."""
        return self.correction.program.language

    @cached_property
    def rows(self) -> tuple[int, ...]:
        """Indices of the targets in this file."""
        return tuple(i for i, target in enumerate(self.correction.program.targets) if target.source == self.source)

    @cached_property
    def moved(self) -> Array:
        """By how much each corrected target was moved [m], ``(n,)``."""
        return np.asarray(self.correction.moved[[row for row in self.rows if self.correction.corrected[row]]])

    @cached_property
    def shared(self) -> Shared | None:
        """What the corrected targets share; None of three or fewer."""
        rows = np.array([row for row in self.rows if self.correction.corrected[row]], dtype=np.intp)
        return shared_motion([self.correction.motions(rows)])

    @property
    def targets(self) -> int:
        """How many targets it has: those that were corrected, that stay because they shall, and that were skipped."""
        return self.corrected + self.kept.total() + len(self.skipped)

    @cached_property
    def kept(self) -> Counter[Kept]:
        """How many targets stay because they shall, by the reason."""
        return Counter(self.correction.kept[row] for row in self.rows if row in self.correction.kept)

    @property
    def corrected(self) -> int:
        """How many of them were corrected."""
        return len(self.moved)

    @property
    def mean_shift(self) -> float:
        """By how much targets were moved on average [m]."""
        return float(self.moved.mean()) if self.corrected else 0.0

    @property
    def largest_shift(self) -> float:
        """By how much a target was moved at most [m]."""
        return float(self.moved.max()) if self.corrected else 0.0

    @cached_property
    def expected(self) -> tuple[Array, Array] | None:
        """Expected mean distance from each target [m] before and as it is written now, ``(n,)`` each; None if unknown.

        They are those of the targets that could be corrected. One that is kept has the same as before.
        """
        known = self.correction.expected
        if known is None:
            return None
        rows = np.array([row for row in self.rows if np.isfinite(known.before[row])], dtype=int)
        after = np.where(self.correction.corrected, known.after, known.before)
        return (known.before[rows], after[rows]) if len(rows) else None

    @cached_property
    def intervals(self) -> tuple[tuple[float, float], tuple[float, float]] | None:
        """Where the mean of these distances lies with a probability of 90 % [m], before and as it is written now."""
        known = self.correction.expected
        if known is None:
            return None
        corrected = self.correction.corrected
        own = np.array([target.source == self.source for target in self.correction.program.targets], dtype=bool)
        before, after = (known.drawn.interval(applied, own) for applied in (np.zeros_like(corrected), corrected))
        return None if before is None or after is None else (before, after)

    @cached_property
    def not_better(self) -> tuple[int, ...]:
        """Indices of the targets whose correction would rather do harm."""
        rows = set(self.correction.not_better)
        return tuple(row for row in self.rows if row in rows)

    @cached_property
    def skipped(self) -> tuple[Skipped, ...]:
        """What stays as it is, and why."""
        return tuple(target for target in self.correction.skipped if target.source == self.source)

    def blocks(self) -> Iterator[Block]:
        """Give the error to expect, what became of the targets, and what was skipped, in mm."""
        yield from self.corrected_blocks()
        yield detail(*self.left_unchanged)

    def corrected_blocks(self, *, shared: bool = False) -> Iterator[Block]:
        """Give it without the lines of what was skipped, with what its targets share if that is wanted, in mm."""
        moved = (
            f"; moved by {self.mean_shift * 1e3:.3f} mm on average, {self.largest_shift * 1e3:.3f} mm at most"
            if self.corrected
            else ""
        )
        yield say(
            self.headline,
            f"  {self.name}, {self.count_words}{moved}",
            file=self.name,
            language=self.language,
            targets=self.targets,
            corrected=self.corrected,
            kept={why.replace("`", ""): number for why, number in self.kept.items()},
            skipped=[{"line": target.line, "reason": target.reason} for target in self.skipped],
            expected_mm=self._expected(),
            not_better=self._not_better(),
        )
        yield say(
            f"  {self.shared_words}" if shared and self.shared_words else "",
            shift_mm={
                "mean": self.mean_shift * 1e3,
                "max": self.largest_shift * 1e3,
                "common": None if self.shared is None else self.shared.moved * 1e3,
                "remainder": None if self.shared is None else self.shared.remainder * 1e3,
            },
        )

    @property
    def left_unchanged(self) -> list[str]:
        """What was skipped, line by line of the program, and why."""
        return [f"  {self.name}, line {target.line}: {target.reason}" for target in self.skipped]

    def _expected(self) -> dict[str, dict[str, Any]] | None:
        """Return the errors to expect as JSON holds them [mm]."""
        if self.expected is None or self.intervals is None:
            return None
        return {
            when: {
                "mean": float(values.mean()) * 1e3,
                "max": float(values.max()) * 1e3,
                "interval_90": [1e3 * low, None if self.lower_bound else 1e3 * high],
            }
            for when, values, (low, high) in zip(("before", "after"), self.expected, self.intervals, strict=True)
        }

    def _not_better(self) -> list[dict[str, Any]]:
        """Return the targets whose correction would rather do harm as JSON holds them [mm]."""
        known = self.correction.expected
        return [
            {
                "line": self.correction.program.targets[row].line,
                "kept": not self.correction.corrected[row],
                "probability_worse": float(known.worse[row]),
                "expected_mm": {"before": float(known.before[row]) * 1e3, "after": float(known.after[row]) * 1e3},
            }
            for row in self.not_better
            if known is not None
        ]

    @property
    def headline(self) -> str:
        """What is expected of its targets before and now, in words and figures."""
        if self.expected is None or self.intervals is None:
            return f"{self.name}  {self.language}: the error to expect is not known"
        low, high = self.intervals[1]
        (mean, most), (mean_now, most_now) = ((v.mean() * 1e3, v.max() * 1e3) for v in self.expected)
        interval = f" now (90 %: {low * 1e3:.3f} to {high * 1e3:.3f})"
        about = "about " if self.lower_bound else ""
        if self.lower_bound:
            interval = f" now (90 %: {low * 1e3:.3f} or more)"
        elif mean_now < 1.01e3 * REPEATABILITY:
            interval = " or more now (no robot repeats better)"
        return (
            f"{self.name}  {self.language}: {'relative ' * self.relative}error to expect {mean:.3f} mm before, "
            f"{about}{mean_now:.3f} mm{interval}; largest expected, not a bound: {most:.3f} and {most_now:.3f} mm"
        )

    @property
    def count_words(self) -> str:
        """What became of its targets, in words and figures that add up."""
        parts = [f"{self.corrected} corrected", *(f"{number} kept ({why})" for why, number in self.kept.items())]
        parts += [f"{len(self.skipped)} left unchanged"] if self.skipped else []
        return f"{counted(self.targets, 'target')}: {', '.join(parts)}"

    @property
    def shared_words(self) -> str:
        """What the corrected targets share, and who decides it, in words and figures; empty of few targets."""
        if self.shared is None:
            return ""
        return (
            f"{self.name}, common to its targets: shift {self.shared.moved * 1e3:.3f} mm, turn "
            f"{math.degrees(self.shared.turned):.3f} deg (check frame and tool); remainder "
            f"{self.shared.remainder * 1e3:.3f} mm on average (errors of the robot)"
        )


def _shift_summary(shift: Array) -> dict[str, list[float]]:
    """Return a shift ``(4, 4)`` as a record holds it."""
    turned = turns_between(np.eye(4)[None], shift[None])[0]
    return {
        "mm": [round(float(v) * 1e3, 6) for v in shift[:3, 3]],
        "rotation_vector_deg": [round(math.degrees(v), 7) for v in turned.tolist()],
    }


@dataclass(frozen=True, eq=False)
class SimulatedRun:
    """How far a simulated robot is from each target of a program [m], ``(n,)``."""

    original: Array  #: original, corrected: with the program as it was, and as it is now.
    corrected: Array
    robot: str  #: Which robot, in words.

    def blocks(self) -> Iterator[Block]:
        """Give it in words and figures, in mm."""
        yield say(
            f"Distance of {self.robot} from where the program meant it to be:",
            *(
                f"  {name:17}  mean {1e3 * missed.mean():.3f}  max {1e3 * missed.max():.3f} mm"
                for name, missed in (("original program", self.original), ("corrected program", self.corrected))
            ),
        )


@dataclass(frozen=True, eq=False, repr=False)
class ProgramCorrection(Record):
    """Corrected programs, ready to be written."""

    robot: Robot  #: The calibrated robot, with the payload that holds.
    files: tuple[FileCorrection, ...]  #: In the order of the programs.
    result: CorrectedPrograms  #: How they were corrected.
    splits: tuple[ProgramSplit, ...]  #: How their moves are split, one a program; empty if they are not.
    warnings: tuple[Notice, ...]  #: What to know about it.
    command: str  #: How to do it again.
    simulated: SimulatedRun | None = None  #: What a simulated robot does with the programs, where there is one.
    inputs: tuple[Path, ...] = ()  #: The files that were read besides the programs: none of them is overwritten.
    hashes: dict[str, str] = field(default_factory=dict)  #: SHA-256 of these files, by the parameters that named them.
    notes: dict[str, str] = field(default_factory=dict)  #: What the user noted, by its name.
    date: str = ""  #: When they were corrected.
    ledger: Path | None = None  #: Where their targets are remembered beside their records; None for nowhere.

    def blocks(self) -> Iterator[Block]:
        """Give each file with the error to expect, what is to be known of these errors, and what was skipped."""
        if self.simulated is not None:
            yield from self.simulated.blocks()
        shared = self.result.frames.frames != "assumed"
        yield each("programs", (file.corrected_blocks(shared=shared) for file in self.files))
        known = any(file.expected is not None for file in self.files)
        words = f"  {self.relative}" if known and self.relative else ""
        yield say(words, expected_is_relative=bool(self.relative))
        if known and any(file.kept.keys() & {"in `keep`", "not in `only`"} for file in self.files):
            yield say("  Targets that stay because of `keep` or `only` are not in these errors.")
        more = "  These errors may be larger: the calibration cannot know all errors of the robot."
        yield detail(more if known and self.lower_bound else "", expected_is_lower_bound=self.lower_bound)
        for file in self.files:
            yield detail(*file.left_unchanged)
        for split in self.splits:
            if split.moves:
                moves, added = split.moves, split.added
                yield say(f"  {moves} move{'s'[: moves > 1]} split by {added} more target{'s'[: added > 1]}")
        if self.notes:
            yield say(notes=self.notes)

    @property
    def lower_bound(self) -> bool:
        """Whether the errors to expect may be larger, for a reason that the calibration knows."""
        return self.robot.proof is not None and self.robot.proof.lower_bound

    @property
    def relative(self) -> str:
        """What the errors to expect are relative to, in words; empty where frames were measured."""
        if not self.result.relative:
            return ""
        each = "in each frame" if self.result.choice.was_taught("frames") else "of all programs together"
        sentence = f"These errors are of the targets relative to each other, {each}."
        if any(file.skipped for file in self.files):
            sentence += (
                " What is left unchanged is not in them: it now lies off the others by as much as those were moved."
            )
        return sentence

    @property
    def frame_words(self) -> list[str]:
        """What was taken for the real base and flange, in words."""
        return frame_words(self.result)

    def applied(self) -> dict[str, Any]:
        """Return what the records beside the programs say was applied, in mm and deg."""
        frames, choice = self.result.frames, self.result.choice
        content: dict[str, Any] = {
            "robot": self.robot.name,
            **({"simulated": True} if self.robot.simulated else {}),
            **({"notes": self.notes} if self.notes else {}),
            "history": list(self.robot.history),
            "proof": None if self.robot.proof is None else self.robot.proof.summary(),
            "payload_kg": self._masses(),
            **({"wrenches": self._wrenches()} if self.result.pushed else {}),
            "controller": controller_summary(self.robot.controller.kinematics),
            "inputs_sha256": self.hashes,
            "tools": frames.tools,
            "frames": frames.frames,
        }
        if choice.taught is not None:
            content["taught"] = sorted(choice.taught)
        if frames.tools == "assumed":
            content["flange_shift"] = _shift_summary(frames.flange)
        if frames.frames == "assumed":
            each = choice.was_taught("frames")
            content["base_shift"] = (
                {name: _shift_summary(shift) for name, shift in frames.bases.items()}
                if each
                else _shift_summary(frames.base)
            )
        return content

    def _masses(self) -> float | dict[str, float]:
        """Return what the robot carries [kg], by the tool where the programs say it."""
        own = self.robot.payload.mass
        return {tool: own if load is None else load.mass for tool, load in self.result.loads.items()} or own

    def _wrenches(self) -> list[dict[str, Any]]:
        """Return what acts on the tool at some targets [N, N m], each once."""
        acting = dict.fromkeys(arm.wrench for arm, _ in self.result.pushed if arm.wrench is not None)
        return [{"force_n": [*w.force], "moment_nm": [*w.moment], "frame": w.frame} for w in acting]

    def as_written(self) -> tuple[Program, ...]:
        """Return the programs as they are read again from their new texts."""
        language = language_called(self.files[0].language)
        return read_sources(language, [Source(file.file.path, file.text.decode("latin-1")) for file in self.files])

    def _written_targets(self) -> dict[Path, list[ProgramTarget]]:
        """Return the targets of the new texts, by their files."""
        programs: list[Program] = []
        for correction in self.result.corrections:
            # Long programs take long to read: where they have as many targets as before, what was written is known.
            targets = None if self.splits else after_edits(correction.program.targets, correction.edits)
            if targets is None:
                programs = [*self.as_written()]
                break
            programs.append(replace(correction.program, targets=tuple(targets)))
        return {path: targets for program in programs for path, targets in program.by_file().items()}

    def written_at(self, out: str) -> str:
        """Return the line that says where it was written."""
        return f"Written to {out}, with the report {REPORT}"

    def save(self, folder: str | Path, progress: Callable[[str], None] = lambda _: None) -> tuple[Path, ...]:
        """Write programs, their records and the report ``compensation.html`` into a folder, all or nothing.

        Returns:
            The files written.

        Raises:
            InputError: If a file would be overwritten that was read, or that truearm has not written.
        """
        from truearm.compensation.report import program_html

        folder = output_folder(folder)
        progress("drawing the report")
        files: dict[str, str | bytes] = {}
        entries = []
        written = self._written_targets()
        for file in self.files:
            path = file.file.path
            targets = corrected_digests(file.correction.program.by_file()[path], written[path])
            files[file.name] = file.text
            files[f"{file.name}.truearm.json"] = recorded(
                file.file, file.text, file.language, self.applied(), self.date, targets
            )
            entries.append(LedgerEntry(program=file.name, date=self.date, robot=self.robot.name, targets=targets))
        files[REPORT] = program_html(self)
        progress("writing the files")
        read = [*(file.file.path for file in self.files), *self.inputs]
        ledger = None if self.ledger is None else (self.ledger, entries)
        write_programs(folder, read, files, self.command, ledger)
        return tuple(folder / name for name in files)


@dataclass(frozen=True, eq=False, repr=False)
class RestoredPrograms(Record):
    """The originals of corrected programs, out of the records beside them."""

    files: tuple[ProgramFile, ...]  #: One a program, with its original.
    folder: Path | None = None  #: Where the originals were written; None if they were not.

    @property
    def paths(self) -> tuple[Path, ...]:
        """Where the originals were written, or their names if they were not."""
        return tuple((self.folder or Path()) / file.name for file in self.files)

    def blocks(self) -> Iterator[Block]:
        """Give the path of each program."""
        lines = (f"{path}: as it was before the correction" for path in self.paths)
        yield say(*lines, reverted=[str(path) for path in self.paths])

    def save(self, folder: str | Path) -> tuple[Path, ...]:
        """Write the originals into a folder, all or nothing.

        Returns:
            The files written.

        Raises:
            InputError: If a file would be overwritten that was read, or that truearm has not written.
        """
        folder = output_folder(folder)
        write_programs(folder, [file.path for file in self.files], {file.name: file.original for file in self.files})
        return tuple(folder / file.name for file in self.files)
