"""Forces at the targets of programs: which acts where, and what a correction that knows them gains."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.calibration.test_external_force import elastic_twin
from tests.compensation.test_program_on_twin import EVERY, HIGH, LOW, given, missed, original, plate

from truearm.calibration.calibrate import calibrate
from truearm.calibration.result import Calibration
from truearm.compensation.program_correction import CorrectedPrograms, corrected_programs
from truearm.engine.base.errors import InputError
from truearm.engine.programs.cell import TargetWrench, read_wrenches
from truearm.engine.programs.chosen_targets import wrenches_of_targets
from truearm.engine.programs.program_files import edited
from truearm.engine.robot.wrench import Wrench
from truearm.engine.twin.twin import Twin, measure

#: Half the rated load of the IRB 120.
HALF = 0.5 * 3.0 * 9.80665
HEAD = "truearm: truearm-cell/1\nunits: {length: mm, angle: deg, force: N, moment: N m}\nwrenches:\n"


@pytest.fixture(scope="module")
def campaign() -> tuple[Twin, Calibration]:
    """An elastic IRB 120, measured with a force to all sides in half of the configurations."""
    twin, rng = elastic_twin(), np.random.default_rng(5)
    wrench = np.zeros((100, 6))
    wrench[::2, :3] = 10.0 * rng.standard_normal((50, 3))
    data = measure(twin, rng.uniform(LOW, HIGH, (100, 6)), 0.03e-3, rng, wrench=wrench)
    return twin, calibrate("irb120", data, model="elastic", payload=twin.robot.payload)


def with_forces(
    campaign: tuple[Twin, Calibration], wrenches: tuple[TargetWrench, ...], frames: bool = True
) -> CorrectedPrograms:
    twin, calibration = campaign
    cell = given(twin, calibration, plate(original()))[1]
    cell = cell if frames else replace(cell, frames={})
    return corrected_programs(
        calibration.robot, [plate(original())], cell, choice=EVERY, wrenches=wrenches, weigh_tools=False
    )


@pytest.mark.parametrize(
    "wrench", [Wrench((0.0, HALF, 0.0)), Wrench((HALF, 0.0, 0.0)), Wrench((0.0, 0.0, -HALF), frame="tool")]
)
def test_a_correction_that_knows_the_force_is_five_times_better_under_it(
    campaign: tuple[Twin, Calibration], wrench: Wrench
) -> None:
    twin, calibration = campaign
    pushed = replace(twin, robot=twin.robot.with_wrench(wrench, "1"))
    stands, _ = given(twin, calibration, plate(original()))
    errors = []
    for wrenches in ((), (TargetWrench((), (), wrench),)):
        found = with_forces(campaign, wrenches).corrections[0]
        rows = np.array([i for i, target in enumerate(found.program.targets) if target.form.kind == "pose"])
        after = plate(edited(found.program.sources[0].text, found.edits))
        errors.append(missed(pushed, calibration, after, (stands @ found.before)[:, :3, 3], rows).mean())
    assert errors[0] > 5 * errors[1]
    assert errors[1] < 0.05e-3


def test_only_the_targets_that_are_pushed_change(campaign: tuple[Twin, Calibration]) -> None:
    wrench = TargetWrench(("pHole1*",), (), Wrench((0.0, HALF, 0.0)))
    free, pushed = (with_forces(campaign, some).corrections[0] for some in ((), (wrench,)))
    other = np.abs(free.after - pushed.after).max(axis=(1, 2)) > 1e-6
    names = [target.name for target in free.program.targets]
    assert {names[i] for i in np.flatnonzero(other)} >= {"pHole1", "pHole10", "pHole11", "pHole12"}
    assert all(names[i].startswith("pHole1") for i in np.flatnonzero(other))


def test_the_force_does_not_move_the_frame(campaign: tuple[Twin, Calibration]) -> None:
    """Where the place of the frame is assumed, the bending that all targets share is corrected all the same."""
    wrench = TargetWrench((), (), Wrench((0.0, HALF, 0.0)))
    free, pushed = (with_forces(campaign, some, frames=False) for some in ((), (wrench,)))
    assert np.abs(free.frames.base - pushed.frames.base).max() < 1e-9
    shift = (pushed.corrections[0].after - free.corrections[0].after)[:, :3, 3]
    assert np.linalg.norm(shift.mean(axis=0)) > 0.1e-3


def test_the_error_to_expect_grows_by_what_the_data_did_not_see(campaign: tuple[Twin, Calibration]) -> None:
    twin, _ = campaign
    rng = np.random.default_rng(6)
    data = measure(twin, rng.uniform(LOW, HIGH, (60, 6)), 0.03e-3, rng)
    by_gravity = twin, calibrate("irb120", data, model="elastic", payload=twin.robot.payload)
    wrench = TargetWrench((), (), Wrench((0.0, HALF, 0.0)))
    for frames in (True, False):
        free, pushed = (with_forces(by_gravity, some, frames).corrections[0].expected for some in ((), (wrench,)))
        assert free is not None
        assert pushed is not None
        assert np.nanmean(pushed.after) > 10 * np.nanmean(free.after)


# -- which acts where ------------------------------------------------------------------------------------


def read(tmp_path: Path, entries: str, head: str = HEAD) -> tuple[TargetWrench, ...]:
    file = tmp_path / "cell.yaml"
    file.write_text(head + entries)
    return read_wrenches(file)


def test_targets_count_before_tools_and_tools_before_all(tmp_path: Path) -> None:
    some = read(
        tmp_path,
        "  - {targets: [pHole1, 'pHole2*'], force: [0, 0, 80], moment: [0, 0, 1.5], frame: tool}\n"
        "  - {tools: [tProbe], force: [5, 0, 0]}\n",
    )
    program = plate(original())
    (found,) = wrenches_of_targets([program], [*some, TargetWrench((), (), Wrench((1.0, 0.0, 0.0)))])
    by_name = dict(zip([target.name for target in program.targets], found, strict=True))
    assert by_name["pHole1"] == by_name["pHole2"] == Wrench((0.0, 0.0, 80.0), (0.0, 0.0, 1.5), "tool")
    tools = {target.name: target.tool for target in program.targets}
    assert by_name["pHole3"] == Wrench((5.0, 0.0, 0.0))
    assert all(by_name[n] == Wrench((1.0, 0.0, 0.0)) for n, tool in tools.items() if tool.lower() != "tprobe")
    assert wrenches_of_targets([program], []) == [(None,) * len(program.targets)]


def test_units_are_those_of_the_file(tmp_path: Path) -> None:
    head = "truearm: truearm-cell/1\nunits: {length: mm, angle: deg, force: kN, moment: N mm}\nwrenches:\n"
    (one,) = read(tmp_path, "  - {tools: [tProbe], force: [0, 0, 0.08], moment: [0, 0, 1500]}\n", head)
    assert one.wrench.force[2] == pytest.approx(80.0)
    assert one.wrench.moment[2] == pytest.approx(1.5)


PLAIN = "truearm: truearm-cell/1\nunits: {length: mm, angle: deg}\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (PLAIN, "the file has no wrenches"),
        (PLAIN + "wrenches:\n  - {tools: [t], force: [0, 0, 8]}\n", "units.force: no unit of a force is given"),
        (PLAIN + "wrenches:\n  - {tools: [t], moment: [0, 0, 8]}\n", "units.moment: no unit of a moment is given"),
        (HEAD + "  - {force: [0, 0, 8]}\n", "wrenches[1]: targets or tools belong here"),
        (HEAD + "  - {tools: [t], force: [0, 8]}\n", "wrenches[1].force"),
        (HEAD + "  - {tools: [t], force: [0, 0, .nan]}\n", "wrenches[1].force[3]: this is not a number"),
        (HEAD + "  - {tools: [t], force: [0, 0, 8N]}\n", "a number belongs here"),
        (HEAD + "  - {tools: [t], force: [0, 0, 8], frame: flange}\n", "wrenches[1]: there is no frame of this name"),
        (HEAD + "  - {tools: [t], force: [0, 0, 1e7]}\n", "too large to be plausible"),
        (HEAD + "  - {tool: [t], force: [0, 0, 8]}\n", "this entry is not known here"),
    ],
)
def test_what_is_no_wrench_is_refused(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(InputError) as refusal:
        read(tmp_path, text, "")
    assert said in str(refusal.value)
    assert "cell.yaml" in str(refusal.value)


@pytest.mark.parametrize(
    ("entries", "said"),
    [
        ("  - {targets: [pHole99], force: [0, 0, 8]}\n", "wrenches[1]: no target of the programs has this name"),
        ("  - {tools: [tProb], force: [0, 0, 8]}\n", "no target of the programs has this tool; got 'tProb'"),
        (
            "  - {targets: [pHole1], force: [0, 0, 8]}\n  - {targets: ['pHole*'], force: [0, 0, 9]}\n",
            "two forces are given for one target; got 'pHole1'. It is in",
        ),
    ],
)
def test_names_that_fit_nothing_or_twice_are_refused(tmp_path: Path, entries: str, said: str) -> None:
    with pytest.raises(InputError) as refusal:
        wrenches_of_targets([plate(original())], read(tmp_path, entries))
    assert said in str(refusal.value)
    assert "cell.yaml, wrenches[" in str(refusal.value)


def test_too_many_different_forces_are_refused(
    campaign: tuple[Twin, Calibration], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every one is another robot, and takes a tenth of a second."""
    monkeypatch.setenv("TRUEARM_LIMITS", "wrenches=1")
    one, other = (TargetWrench((name,), (), Wrench((0.0, y, 0.0))) for name, y in (("pHole1", 5.0), ("pHole2", 6.0)))
    assert with_forces(campaign, (one,)).pushed
    with pytest.raises(InputError, match="there are too many different forces for one run; got '2 forces'"):
        with_forces(campaign, (one, other))
