"""Tests of a robot by ISO 9283, evaluated."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, get_args

from truearm.engine.base.errors import InputError, Notice, Rule, counted, refusals_of
from truearm.engine.base.files import noted_reads
from truearm.engine.base.manifest import written_differently
from truearm.engine.base.writing import output_folder, write_files
from truearm.engine.command.arguments import (
    files_of,
    folder_beside,
)
from truearm.engine.document.document import Block, detail, say, under
from truearm.engine.document.records import Record
from truearm.engine.motion.cube import Cube
from truearm.engine.robot.chain import Array
from truearm.iso9283.criteria.alignment import Alignment, read_alignment, refuse_implausible
from truearm.iso9283.criteria.rows import Component, Conditions, Instrument, Value, copied_blocks
from truearm.iso9283.evaluating.comparison import Comparison, ReadFile, compared, plan_summary
from truearm.iso9283.evaluating.data_notices import drift_notices, push_notices, rounding_notices, stream_notices
from truearm.iso9283.evaluating.evaluation import Evaluation, Measurements, evaluated
from truearm.iso9283.evaluating.reading import read_attained_poses, read_pushes
from truearm.iso9283.evaluating.samples import read_path_samples, read_settling_samples
from truearm.iso9283.evaluating.table import (
    UNITS,
    conditions_summary,
    copied_notices,
    cube_notices,
    cycle_notices,
    row_notices,
    uncovered_tests,
    worst_places,
)
from truearm.iso9283.planning.criteria import TEST_OF, TESTS, PerformancePlan
from truearm.iso9283.planning.plan_file import read_plan

if TYPE_CHECKING:
    from truearm.iso9283.jobs import EvaluateTests

RESULT: Final = "iso9283.json"
REPORT: Final = "report.html"
EVALUATION_FILES: Final = (RESULT, REPORT)
SCHEMA: Final = "truearm-iso9283-result/1"


@dataclass(frozen=True, eq=False, repr=False)
class Iso9283Evaluation(Record):
    """Tests of a robot's performance, evaluated."""

    plan: PerformancePlan  #: What was commanded.
    evaluation: Evaluation  #: All values, and what they come from.
    instrument: Instrument  #: What is not known of its readings.
    comparison: Comparison | None  #: Beside another result; None without one.
    command: str  #: How to run it again.
    warnings: tuple[Notice, ...] = ()  #: What to know about it.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.
    #: Their names and hashes, by the parameters that named them; ``robot`` is the robot file of the plan.
    read: Mapping[str, ReadFile] = field(default_factory=dict)

    @property
    def values(self) -> tuple[Value, ...]:
        """All values, in the order of the standard's table."""
        return self.evaluation.values

    def blocks(self) -> Iterator[Block]:
        """Give each criterion at its worst place, at the fastest velocity and at others; the rest is in the files."""
        tie, sigma_rot = self.evaluation.alignment, self.instrument.sigma_rot
        measured = [value for value in self.values if value.status != "not-measured"]
        tests = {TEST_OF[value.id] for value in measured}
        yield say(
            f"{self.plan.robot.title}: {counted(len(measured), 'value')} from {len(tests)} of {len(TESTS)} tests.",
            truearm=SCHEMA,
            robot=self.plan.robot.name,
            inputs={name: file.model_dump() for name, file in self.read.items()},
            rated={"load_kg": self.plan.rated_load, "velocity_mm_s": self.plan.rated_velocity * 1e3},
            plan=plan_summary(self.plan),
        )
        yield detail(
            self.tied,
            alignment={
                "kind": tie.kind,
                "standard": tie.is_standard,
                "sigma_mm": tie.sigma * 1e3,
                "sigma_rot_deg": math.degrees(tie.sigma_rot),
            },
            instrument={
                "sigma_mm": self.instrument.sigma * 1e3,
                "sigma_rot_deg": None if sigma_rot is None else math.degrees(sigma_rot),
            },
        )
        rows = [worst.cells for worst in worst_places(self.values)]
        wide = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = ["  " + "  ".join(map(str.ljust, row, wide)).rstrip() for row in rows]
        if lines:
            tell = say if self.comparison is None else detail
            words = "Each at its worst place and fastest velocity, with its 95 % interval or the range of its cycles."
            yield tell(words, *lines)
            yield detail(f"All places, axes and angles are in the report and in {RESULT}.")
        yield say(criteria=[value_summary(value) for value in self.values], **self._drawn())
        absent = uncovered_tests(self.values)
        yield say(f"Not measured: {'; '.join(absent)}." if absent else "", not_measured=[*absent])
        if self.comparison is not None:
            yield under("comparison", self.comparison.blocks())

    def _drawn(self) -> dict[str, Any]:
        """Return what another result draws beside its own: deviations along paths, and barycentres from commands."""
        curves = [
            {
                "id": course.run.test,
                "where": course.path,
                "conditions": conditions_summary(course.run.conditions),
                "along_mm": _millimetres(course.along),
                "distance_mm": _millimetres(course.distance),
            }
            for course in self.evaluation.deviations
        ]
        offsets = [
            {
                "id": cloud.test,
                "where": cloud.pose,
                "conditions": conditions_summary(Conditions(cloud.velocity, cloud.load, cloud.robot)),
                "offset_mm": _millimetres(cloud.barycentre - cloud.command),
            }
            for cloud in self.evaluation.clouds
            if cloud.test == "AP"
        ]
        return {**({"curves": curves} if curves else {}), **({"offsets": offsets} if offsets else {})}

    @property
    def tied(self) -> str:
        """How the instrument was tied to the robot's base, in words."""
        tie = self.evaluation.alignment
        method = {
            "base-features": "measured features of the base",
            "controller-frame": "a frame of the controller",
            "best-fit": "a best fit of the attained poses to the commanded ones, which the standard does not allow",
        }[tie.kind]
        known = f", known to {tie.sigma * 1e3:.3f} mm and {math.degrees(tie.sigma_rot):.4f} deg" if tie.sigma else ""
        return f"The instrument was tied to the robot's base by {method}{known}."

    @property
    def written(self) -> tuple[str, ...]:
        """Names of the files."""
        return EVALUATION_FILES

    def contents(self) -> dict[str, str]:
        """Return the texts of all files by their names."""
        from truearm.iso9283.evaluating.report import iso9283_report

        return {RESULT: json.dumps(self.summary(), indent=1) + "\n", REPORT: iso9283_report(self)}

    def save(self, folder: str | Path) -> tuple[Path, ...]:
        """Write all files into a folder; return them."""
        contents = self.contents()
        out = output_folder(folder, contents, self.inputs, "folder")
        write_files(out, contents, self.command)
        return tuple(out / name for name in contents)


def _millimetres(metres: Array) -> list[float | None]:
    """Return lengths as JSON holds them, None where there is none."""
    return [round(1e3 * value, 6) if math.isfinite(value) else None for value in metres.tolist()]


def value_summary(value: Value) -> dict[str, Any]:
    """Return a value as JSON holds it."""
    unit, per_si = UNITS[value.quantity]

    def shown(number: float | None) -> float | None:
        return None if number is None or not math.isfinite(number) else number * per_si

    least, largest = shown(value.least), shown(value.largest)
    return {
        "id": value.id,
        "component": value.component,
        "where": value.where,
        "value": shown(value.value),
        "unit": unit,
        "interval_95": None if value.interval is None else [shown(end) for end in value.interval],
        "cycles": value.cycles,
        "conditions": conditions_summary(value.conditions),
        "status": value.status,
        **({} if least is None else {"range": [least, largest]}),
        **({} if value.bandwidth is None else {"bandwidth_hz": value.bandwidth}),
    }


def evaluation(asked: EvaluateTests) -> Iso9283Evaluation:
    """Evaluate the tests of a plan, and write values and report."""
    plan_path = Path(asked.plan)
    files = {name: _path(getattr(asked, name)) for name in _READERS}
    tie_path, other = _path(asked.alignment), _path(asked.compare)
    inputs = files_of(plan_path, *files.values(), tie_path, other)
    folder = None if asked.out is None else folder_beside(EVALUATION_FILES, RESULT, asked.out, *inputs)
    with noted_reads() as noted:
        with refusals_of("plan"):
            planned = read_plan(plan_path)
        tie: Alignment | None = None
        if tie_path is not None:
            with refusals_of("alignment"):
                tie = read_alignment(tie_path)
        read: dict[str, Any] = {}
        for name, file in files.items():
            if file is None:
                continue
            asked.progress(f"reading {file.name}")
            with refusals_of(name):
                read[name] = _READERS[name](file)
        if tie is not None and read:
            _refuse_far_files(tie, planned.cube, read, str(tie_path))
        instrument = Instrument(asked.noise, asked.noise_rot)
        evaluation_of_tests = evaluated(planned, Measurements(**read), tie, instrument, asked.progress)
        warnings = (
            *_warnings(planned, evaluation_of_tests, read, instrument),
            *_of_plan(plan_path),
            *push_notices(planned, evaluation_of_tests.pushes, instrument),
            *drift_notices(planned, evaluation_of_tests.drift),
        )
        result = Iso9283Evaluation(planned, evaluation_of_tests, instrument, None, asked.again, warnings, inputs)
        if other is not None:
            with refusals_of("compare"):
                result = replace(result, comparison=compared(result.summary(), other))
            result = replace(result, warnings=(*result.warnings, *_warnings_of_comparison(result)))
    named = {"plan": plan_path, **files, "alignment": tie_path, "compare": other}
    result = replace(result, read=_read_files(named, noted))
    if folder is not None:
        asked.progress("writing the report")
        result.save(folder)
    return result


def _path(path: str | Path | None) -> Path | None:
    return None if path is None else Path(path)


def _read_files(named: Mapping[str, Path | None], noted: Mapping[Path, Sequence[str]]) -> dict[str, ReadFile]:
    """Return the files that were read, by their parameters; the one beside the plan that nobody named is the robot."""
    paths = {name: path for name, path in named.items() if path is not None}
    beside = next(path.name for path in noted if path not in {named_path.absolute() for named_path in paths.values()})
    paths["robot"] = paths["plan"].parent / beside
    return {name: ReadFile(file=str(path), sha256=noted[path.absolute()][0]) for name, path in paths.items()}


def _refuse_far_files(tie: Alignment, cube: Cube, read: Mapping[str, Any], place: str) -> None:
    """Refuse a tie with which every file lies far from the cube, and a file that alone does so."""
    far: dict[str, InputError] = {}
    for name, readings in read.items():
        try:
            with refusals_of("alignment"):
                refuse_implausible(tie, cube, readings.position, place)
        except InputError as refusal:
            far[name] = refusal
    if not far:
        return
    name, first = next(iter(far.items()))
    if len(far) == len(read):
        raise first
    raise InputError(
        "this file lies far from the cube of the tests, where others do not",
        parameter=name,
        where=read[name].source,
        came=first.came,
        allowed=first.allowed,
        cure="Check the units in its header, and that it was read in the same frame as the others.",
    )


_COMPONENTS: Final = get_args(Component)
_READERS: Final[Mapping[str, Callable[[Path], object]]] = {
    "poses": read_attained_poses,
    "paths": read_path_samples,
    "settling": read_settling_samples,
    "forces": read_pushes,
}


BEST_FIT_ALIGNMENT: Final = Rule(
    "best-fit-alignment",
    "warning",
    "the instrument's frame was fitted to the attained poses: AP and AT are too small",
    cure="Tie the instrument to the base and give `alignment`.",
    gravity=2,
)
INSTRUMENT_TOO_COARSE: Final = Rule(
    "instrument-too-coarse",
    "warning",
    "what instrument and tie leave open is more than a quarter of some values",
)


def _warnings(
    plan: PerformancePlan, evaluation_of_tests: Evaluation, read: Mapping[str, Any], instrument: Instrument
) -> tuple[Notice, ...]:
    notices: list[Notice] = []
    if not evaluation_of_tests.alignment.is_standard:
        notices.append(
            BEST_FIT_ALIGNMENT(
                "The frame of the instrument was fitted to the attained poses. That hides a part of the error that "
                "pose and path accuracy shall tell, and is not what the standard asks for: AP and AT are too small."
            )
        )
    notices += row_notices(evaluation_of_tests)
    copied = [block for name in ("paths", "settling") if name in read for block in copied_blocks(read[name])]
    notices += copied_notices(copied)
    notices += cycle_notices(plan, evaluation_of_tests)
    notices += cube_notices(plan, evaluation_of_tests)
    coarse: dict[str, list[str]] = {}
    for value in evaluation_of_tests.values:
        if value.status == "instrument-too-coarse" and value.component not in coarse.setdefault(value.id, []):
            coarse[value.id].append(value.component)
    if coarse:
        names = [
            name if components == ["position"] else f"{name} ({', '.join(sorted(components, key=_COMPONENTS.index))})"
            for name, components in coarse.items()
        ]
        notices.append(
            INSTRUMENT_TOO_COARSE(
                f"What instrument and tie leave open is more than a quarter of some values of {', '.join(names)}. "
                "They say more about the measurement than about the robot."
            )
        )
    return (*notices, *stream_notices(evaluation_of_tests), *rounding_notices(evaluation_of_tests, instrument))


PLAN_CHANGED: Final = Rule(
    "plan-changed", "note", "`plan.yaml` was changed since truearm wrote it. Values are held against what it says now"
)


def _of_plan(path: Path) -> tuple[Notice, ...]:
    """Return that a plan was changed since truearm wrote it, where its manifest says so."""
    try:
        if not written_differently(path):
            return ()
    except InputError:  # what stands beside it is no manifest of truearm
        return ()
    return (
        PLAN_CHANGED(
            f"{path.name} was changed since truearm wrote it, and programs and sheet beside it are not those of this "
            "plan. Values are held against what it says now."
        ),
    )


ALIGNMENT_DIFFERS: Final = Rule(
    "alignment-differs",
    "warning",
    "the two results were tied to the base in different ways; AP and AT are not compared",
)
PLAN_DIFFERS: Final = Rule(
    "plan-differs",
    "warning",
    "some values of the other result were planned or read otherwise, and are not compared",
    gravity=2,
)
PLAN_UNKNOWN: Final = Rule(
    "plan-unknown",
    "warning",
    "the other result does not say what was planned: it was written by an older version",
    cure="Evaluate its files again.",
)


def _warnings_of_comparison(result: Iso9283Evaluation) -> tuple[Notice, ...]:
    beside = result.comparison
    if beside is None:
        return ()
    notices = []
    if beside.left_out:
        notices.append(
            ALIGNMENT_DIFFERS(
                f"The two results were tied to the base in different ways: {', '.join(beside.left_out)} are not "
                "compared."
            )
        )
    if beside.unlike:
        reasons = "; ".join(f"{', '.join(ids)}: {why}" for why, ids in beside.unlike.items())
        notices.append(PLAN_DIFFERS(f"Values that are not alike are not compared. {reasons}."))
    if beside.unknown_plan:
        notices.append(
            PLAN_UNKNOWN(
                "The other result does not say what was planned, as it was written by an older version: whether poses, "
                "paths, tip and limit band were the same cannot be told."
            )
        )
    return tuple(notices)
