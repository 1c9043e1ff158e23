"""Tests of a robot by ISO 9283, evaluated."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, get_args

from truearm.errors import InputError, refusals_of
from truearm.files import noted_reads, path_argument
from truearm.jobs.arguments import (
    command_argument,
    deviation_argument,
    files_of,
    folder_beside,
    numbers_argument,
    progress_argument,
    python_call,
)
from truearm.manifest import written_differently
from truearm.measurement.readers.performance_poses import read_attained_poses, read_pushes
from truearm.measurement.readers.performance_samples import read_path_samples, read_settling_samples
from truearm.notices import Notice
from truearm.planning.iso9283.plan_file import read_plan
from truearm.planning.iso9283.planned import PerformancePlan
from truearm.planning.poses.iso9283 import Cube
from truearm.results.iso9283_evaluation import EVALUATION_FILES, RESULT, Iso9283Evaluation
from truearm.results.iso9283_notices import copied_notices, cube_notices, cycle_notices, row_notices
from truearm.validation.iso9283.alignment import Alignment, read_alignment, refuse_implausible
from truearm.validation.iso9283.comparison import compared
from truearm.validation.iso9283.copied import copied_blocks
from truearm.validation.iso9283.evaluation import Evaluation, Measurements, evaluated
from truearm.validation.iso9283.result_file import ReadFile
from truearm.validation.iso9283.said_of_drift import said_of_drift
from truearm.validation.iso9283.said_of_pushes import said_of_pushes
from truearm.validation.iso9283.said_of_rounding import said_of_rounding
from truearm.validation.iso9283.said_of_streams import said_of_streams
from truearm.validation.iso9283.values import Component, Instrument


def iso9283_evaluate(
    plan: str | Path,
    *,
    poses: str | Path | None = None,
    paths: str | Path | None = None,
    settling: str | Path | None = None,
    forces: str | Path | None = None,
    alignment: str | Path | None = None,
    noise: float = 0.01e-3,
    noise_rot: float = 1e-4,
    compare: str | Path | None = None,
    out: str | Path | None = None,
    command: str | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Iso9283Evaluation:
    """Evaluate the tests of a plan by ISO 9283, each value with a 95 % interval or the range of its cycles.

    Parameters
    ----------
    plan
        ``plan.yaml`` of :func:`truearm.iso9283_plan`, with ``robot.yaml`` beside it.
    poses, paths, settling, forces
        Files of what was measured, in the instrument's frame; None for what was not.
    alignment
        How the instrument was tied to the robot's base, a file (schema ``truearm-alignment/1``); None for the best fit
        of the attained poses to the commanded ones, which hides what pose accuracy measures.
    noise, noise_rot
        Standard deviation of the instrument: of each coordinate [m], of each angle [rad].
    compare
        ``iso9283.json`` of another evaluation, set beside this one.
    out
        Folder for ``iso9283.json`` and ``report.html``; None writes nothing.
    command
        How to run it again, for the report; None writes the call in Python.
    progress
        Called with a few words at each step.

    Raises
    ------
    InputError
        If a file cannot be used or does not fit the plan; the message names the row.
    """
    progress_argument(progress)
    given = {"poses": poses, "paths": paths, "settling": settling, "forces": forces}
    files = {name: None if file is None else path_argument(file, name) for name, file in given.items()}
    plan_path = path_argument(plan, "plan")
    tie_path = None if alignment is None else path_argument(alignment, "alignment")
    other = None if compare is None else path_argument(compare, "compare")
    sigma = deviation_argument(noise, "noise")
    (sigma_rot,) = numbers_argument([noise_rot], "noise_rot", 1, "a standard deviation above 0 [rad]")
    inputs = files_of(plan_path, *files.values(), tie_path, other)
    folder = None if out is None else folder_beside(EVALUATION_FILES, RESULT, out, *inputs)
    call = command_argument(command) or python_call(
        "iso9283_evaluate",
        plan,
        **given,
        alignment=alignment,
        noise=noise,
        noise_rot=noise_rot,
        compare=compare,
    )
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
            progress(f"reading {file.name}")
            with refusals_of(name):
                read[name] = _READERS[name](file)
        if tie is not None and read:
            _refuse_far_files(tie, planned.cube, read, str(tie_path))
        instrument = Instrument(sigma, sigma_rot)
        found = evaluated(planned, Measurements(**read), tie, instrument, progress)
        warnings = (
            *_warnings(planned, found, read, instrument),
            *_of_plan(plan_path),
            *said_of_pushes(planned, found.pushes, instrument),
            *said_of_drift(planned, found.drift),
        )
        made = Iso9283Evaluation(planned, found, instrument, None, call, warnings, inputs)
        if other is not None:
            with refusals_of("compare"):
                made = replace(made, comparison=compared(made.summary(), other))
            made = replace(made, warnings=(*made.warnings, *_warnings_of_comparison(made)))
    named = {"plan": plan_path, **files, "alignment": tie_path, "compare": other}
    made = replace(made, read=_read_files(named, noted))
    if folder is not None:
        progress("writing the report")
        made.save(folder)
    return made


def _read_files(named: Mapping[str, Path | None], noted: Mapping[Path, Sequence[str]]) -> dict[str, ReadFile]:
    """Return the files that were read, by their parameters; the one beside the plan that nobody named is the robot."""
    given = {name: path for name, path in named.items() if path is not None}
    beside = next(path.name for path in noted if path not in {one.absolute() for one in given.values()})
    given["robot"] = given["plan"].parent / beside
    return {name: ReadFile(file=str(path), sha256=noted[path.absolute()][0]) for name, path in given.items()}


def _refuse_far_files(tie: Alignment, cube: Cube, read: Mapping[str, Any], where: str) -> None:
    """Refuse a tie with which every file lies far from the cube, and a file that alone does so."""
    far: dict[str, InputError] = {}
    for name, one in read.items():
        try:
            with refusals_of("alignment"):
                refuse_implausible(tie, cube, one.position, where)
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


def _warnings(
    plan: PerformancePlan, found: Evaluation, read: Mapping[str, Any], instrument: Instrument
) -> tuple[Notice, ...]:
    notices: list[Notice] = []
    if not found.alignment.is_standard:
        notices.append(
            Notice(
                "best-fit-alignment",
                "The frame of the instrument was fitted to the attained poses. That hides a part of the error that "
                "pose and path accuracy shall tell, and is not what the standard asks for: AP and AT are too small. "
                "Tie the instrument to the base and give `alignment`.",
            )
        )
    notices += row_notices(found)
    copied = [block for name in ("paths", "settling") if name in read for block in copied_blocks(read[name])]
    notices += copied_notices(copied)
    notices += cycle_notices(plan, found)
    notices += cube_notices(plan, found)
    coarse: dict[str, list[str]] = {}
    for value in found.values:
        if value.status == "instrument-too-coarse" and value.component not in coarse.setdefault(value.id, []):
            coarse[value.id].append(value.component)
    if coarse:
        names = [
            name if components == ["position"] else f"{name} ({', '.join(sorted(components, key=_COMPONENTS.index))})"
            for name, components in coarse.items()
        ]
        notices.append(
            Notice(
                "instrument-too-coarse",
                f"What instrument and tie leave open is more than a quarter of some values of {', '.join(names)}. "
                "They say more about the measurement than about the robot.",
            )
        )
    return (*notices, *said_of_streams(found), *said_of_rounding(found, instrument))


def _of_plan(path: Path) -> tuple[Notice, ...]:
    """Return that a plan was changed since truearm wrote it, where its manifest says so."""
    try:
        if not written_differently(path):
            return ()
    except InputError:  # what stands beside it is no manifest of truearm
        return ()
    return (
        Notice(
            "plan-changed",
            f"{path.name} was changed since truearm wrote it, and programs and sheet beside it are not those of this "
            "plan. Values are held against what it says now.",
            "note",
        ),
    )


def _warnings_of_comparison(made: Iso9283Evaluation) -> tuple[Notice, ...]:
    beside = made.comparison
    if beside is None:
        return ()
    notices = []
    if beside.left_out:
        notices.append(
            Notice(
                "alignment-differs",
                f"The two results were tied to the base in different ways: {', '.join(beside.left_out)} are not "
                "compared.",
            )
        )
    if beside.unlike:
        told = "; ".join(f"{', '.join(ids)}: {why}" for why, ids in beside.unlike.items())
        notices.append(Notice("plan-differs", f"Values that are not alike are not compared. {told}."))
    if beside.unknown_plan:
        notices.append(
            Notice(
                "plan-unknown",
                "The other result does not say what was planned, as it was written by an older version: whether poses, "
                "paths, tip and limit band were the same cannot be told. Evaluate its files again.",
            )
        )
    return tuple(notices)
