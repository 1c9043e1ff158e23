"""What was found of a fleet: how accurate its robots are, and which could not be calibrated."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

from truearm.engine.base.errors import Notice, Rule, counted, listed
from truearm.engine.base.files import exists
from truearm.engine.base.units import Marked
from truearm.engine.base.writing import output_folder, write_files
from truearm.engine.document.document import Block, detail, json_of, say
from truearm.engine.document.records import Record
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.fleets.analysis import ACCURACIES, Analysis, analysed, with_proposed
from truearm.fleets.recorded import ROBOTS, Recorded
from truearm.fleets.series import Accuracy, Row
from truearm.fleets.words import PRIORS_FILE, analysis_blocks, analysis_notices, outcome_words

#: What a fleet writes into its folder beside its parts.
FLEET_FILES: Final = ("fleet.json", "robots.csv", "report.html", PRIORS_FILE)


@dataclass(frozen=True)
class Run:
    """How the parts of a fleet were computed this time; no result depends on it."""

    parts: int  #: parts, before: how many there are, and how many were on disk already.
    before: int
    told: tuple[str, ...] = ()  #: What happened to workers, in plain words.
    lost: tuple[str, ...] = ()  #: Robots of parts that were given up, because their workers died of them.


WORKERS_DIED: Final = Rule(
    "workers-died",
    "error",
    "workers died again and again of some parts, whose robots are not in the result",
    cure="Run it again with more memory, or leave these robots out.",
)
ROBOTS_FAILED: Final = Rule(
    "robots-failed", "warning", "some robots could not be calibrated; each says why in `robots.csv`", gravity=2
)
ROBOTS_IN_ERROR: Final = Rule(
    "robots-in-error",
    "warning",
    "results of some robots end with an error, as `calibrate` alone would say; no figure of the series contains them",
    cure="Look at their reports first, fix their data or options, and run this again.",
)
NO_RESULT: Final = Rule(
    "no-result",
    "error",
    "no robot has a result that can be used",
    cure="Fix what their messages name, and run this again.",
)
ROBOTS_OUTDATED: Final = Rule(
    "robots-outdated", "warning", "a robot failed, and `robots/NAME` holds what an earlier run found of it"
)


@dataclass(frozen=True, eq=False, repr=False)
class Fleet(Record):
    """A fleet of robots."""

    recorded: Recorded  #: Its parts on disk.
    run: Run  #: How they were computed.
    command: str = ""  #: How to make it again; empty if that is not known.

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What to know about the result, in plain words."""
        notices = []
        if self.run.lost:
            notices.append(
                WORKERS_DIED(
                    f"Workers died again and again of parts with {counted(len(self.run.lost), 'robot')} "
                    f"({listed(self.run.lost)}), and these are not in the result."
                )
            )
        failed = self.analysis.failed
        if failed:
            names = listed([name for name, _ in failed])
            notices.append(
                ROBOTS_FAILED(
                    f"{len(failed)} of {counted(self.analysis.measurements, 'robot')} could not be calibrated "
                    f"({names}); the first: {failed[0][1]}"
                )
            )
        wrong = [look for look in self.analysis.looks if any(reason.why == "error" for reason in look.reasons)]
        if wrong:
            notices.append(
                ROBOTS_IN_ERROR(
                    f"The {'result' if len(wrong) == 1 else 'results'} of {counted(len(wrong), 'robot')} "
                    f"({listed([look.robot for look in wrong])}) should not be used: calibrated alone, each ends "
                    "with an error. No figure of the series contains them."
                )
            )
        if self.analysis.usable == 0:
            notices.append(
                NO_RESULT(f"None of {counted(self.analysis.measurements, 'robot')} has a result that can be used.")
            )
        outdated = self._outdated()
        if outdated:
            notices.append(
                ROBOTS_OUTDATED(
                    f"{listed(outdated)} could not be calibrated, and what an earlier run wrote of it stands below "
                    f"{ROBOTS}: remove these folders, or do not use them."
                )
            )
        return (*notices, *analysis_notices(self.analysis))

    def _outdated(self) -> list[str]:
        """Return the robots that could not be calibrated and have a folder from before."""
        if self.recorded.manifest.experiment is not None:
            return []
        folder = self.recorded.folder / ROBOTS
        return [name for name, _ in self.analysis.failed if exists(folder / name)]

    @property
    def simulated_from(self) -> tuple[Marked, ...]:
        """``data``, if the series is simulated, or the measurements of any robot are."""
        simulated = self.recorded.manifest.experiment is not None or any(line.simulated for line in self._read[1])
        return ("data",) if simulated else ()

    @cached_property
    def analysis(self) -> Analysis:
        """What the fleet says, of all rows."""
        return self._read[0]

    @cached_property
    def _read(self) -> tuple[Analysis, list[_Line]]:
        """What the fleet says, and what its table has of each robot: the parts are read once."""
        lines: list[_Line] = []

        def rows() -> Iterator[Row]:
            for row in self.recorded.rows():
                lines.append(_Line.of(row))
                yield row

        return analysed(rows()), lines

    @cached_property
    def proposed(self) -> tuple[Robot, tuple[str, ...]] | None:
        """The nominal robot with the priors that follow from the kind with most robots, and which; None if none do."""
        if not self.analysis.kinds or all(spread.proposed is None for spread in self.analysis.kinds[0].spreads):
            return None
        asked, first = self.recorded.manifest, self.analysis.kinds[0].kind.names[0]
        if asked.experiment is not None:
            source = asked.experiment.robot
        else:
            source = next(entry.robot for entry in asked.robots if entry.name == first)
        robot, names = with_proposed(load_robot(source), self.analysis.kinds[0].spreads)
        return (robot.marked(bool(self.simulated_from)), names) if names else None

    @property
    def files(self) -> tuple[str, ...]:
        """Names of the files that are written beside the parts."""
        return FLEET_FILES if self.proposed is not None else tuple(n for n in FLEET_FILES if n != PRIORS_FILE)

    @property
    def written(self) -> tuple[str, ...]:
        """The files, and that the parts are beside them."""
        return (*self.files, "and the parts")

    def content(self) -> dict[str, Any]:
        """Return what ``fleet.json`` holds, in mm: the same however the parts were computed."""
        summary = json_of(self.blocks())
        del summary["run"]
        return {"truearm": summary["truearm"], **({"simulated": True} if self.simulated_from else {}), **summary}

    def blocks(self) -> Iterator[Block]:
        """Give how many were calibrated, how, and what the fleet says, in mm and deg."""
        analysis, run = self.analysis, self.run
        yield say(
            f"{self._robots()}{self._outcome()}.",
            truearm="truearm-fleet-result/1",
            digest=self.recorded.manifest.digest,
            robots=self.recorded.manifest.count,
            calibrated=analysis.measurements - len(analysis.failed),
            failed=[{"name": name, "message": message} for name, message in analysis.failed],
            missing=[*run.lost],
        )
        before = [f"{counted(run.before, 'part')} of {run.parts} on disk already."] if run.before else []
        messages = (f"{words[0].upper()}{words[1:]}." for words in run.told)
        yield detail(*before, *messages, run={"parts": run.parts, "on_disk_before": run.before, "told": [*run.told]})
        yield from analysis_blocks(analysis, None if self.draw is None else f"{self.draw}.")
        if self.proposed is not None:
            yield say(f"Priors proposed: {counted(len(self.proposed[1]), 'parameter')} in {PRIORS_FILE}.")

    def _outcome(self) -> str:
        """Return how many have a result, and of how many of these it should not be used."""
        analysis = self.analysis
        if not analysis.left_out:
            return f", {analysis.usable} calibrated, {len(analysis.failed)} failed"
        return f": {outcome_words(analysis)}"

    @property
    def draw(self) -> str | None:
        """What the intervals of a simulated series hold for; None of robots that were measured."""
        asked = self.recorded.manifest.experiment
        if asked is None:
            return None
        drawn = "configurations" if isinstance(asked.configurations, int) else "configurations that judge"
        return (
            f"Figures and intervals hold for the {drawn} drawn with the seed {asked.seed}; another draw can change "
            "them by more than the intervals say: run other seeds"
        )

    def _robots(self) -> str:
        count, machines = self.recorded.manifest.count, self.analysis.machines
        if self.analysis.measurements != machines:
            return f"{counted(count, 'measurement')} of {counted(machines, 'robot')}"
        return counted(count, "robot")

    def csv_text(self) -> str:
        """Return the robots as a table, one row each."""
        stream = io.StringIO()
        table = csv.writer(stream, lineterminator="\n")
        kinds = [*self.analysis.errors]
        figures = [f"{kind} {figure} [mm]" for kind in kinds for figure in ("mean", "max")]
        table.writerow(["name", "of", "date", "status", "fit", *figures, "errors", "look", "message"])
        looks = {look.robot: look.reasons for look in self.analysis.looks}
        for line in self._read[1]:
            reasons = " ".join(reason.why.replace(" ", "-") for reason in looks.get(line.name, ()))
            errors = [_mean_and_max(line.errors.get(kind)) for kind in kinds]
            figures = [f"{v * 1e3:.6f}" if v is not None else "" for pair in errors for v in pair]
            table.writerow([*line.begin, *figures, line.codes, reasons, line.message])
        return stream.getvalue()

    def write(self) -> tuple[Path, ...]:
        """Write ``fleet.json``, ``robots.csv`` and ``report.html`` beside the parts, and ``priors.yaml`` if any follow.

        Returns:
            The files written.
        """
        from truearm.fleets.report import fleet_html

        folder = output_folder(self.recorded.folder, FLEET_FILES, self.recorded.manifest.inputs, ours=True)
        files: dict[str, str | bytes] = {
            "fleet.json": json.dumps(self.content(), indent=2, allow_nan=False) + "\n",
            "robots.csv": self.csv_text(),
            "report.html": fleet_html(self),
            **({} if self.proposed is None else {PRIORS_FILE: robot_text(self.proposed[0])}),
        }
        write_files(folder, files, self.command or None)
        return tuple(folder / name for name in files)


def _mean_and_max(errors: Accuracy | None) -> tuple[float | None, float | None]:
    return (None, None) if errors is None else (errors.mean, errors.max)


@dataclass(frozen=True)
class _Line:
    """What the table has of a robot."""

    begin: tuple[str, ...]
    errors: Mapping[str, Accuracy]
    codes: str
    message: str
    simulated: bool

    @property
    def name(self) -> str:
        """Of the robot."""
        return self.begin[0]

    @classmethod
    def of(cls, row: Row) -> _Line:
        """Take it from what was found."""
        return cls(
            (row.name, row.of or "", row.date or "", row.status, row.fit_status or ""),
            {kind: accuracy for kind in ACCURACIES if (accuracy := getattr(row, kind)) is not None},
            " ".join(row.errors),
            row.message,
            row.simulated,
        )
