"""Targets that are corrected already: known as they are written, by whatever program, and nothing else is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.engine.programs.reading import samples, shifted, texts
from tests.engine.programs.test_every_language import languages

from truearm.engine.base.errors import InputError
from truearm.engine.programs.corrected_targets import KnownCorrection, corrected_digests, refuse_corrected
from truearm.engine.programs.correction import Correction
from truearm.engine.programs.program import Form, Language, Program, ProgramTarget, Source
from truearm.engine.programs.program_poses import edits_of
from truearm.engine.robot.transform import QUATERNION

POSE = Form("robtarget", "pose", orientation=QUATERNION, decimals=(3, 7))
JOINTS = Form("jointtarget", "joints", angle=np.pi / 180.0)
PULSES = Form("pulses", "pulses", decimals=(0, 0))
UPRIGHT = (0.0, 0.0, 1.0, 0.0)


def targets(values: np.ndarray, form: Form = POSE) -> tuple[ProgramTarget, ...]:
    more = UPRIGHT if form is POSE else ()
    return tuple(ProgramTarget(0, line, "", form, (*map(float, row), *more), ()) for line, row in enumerate(values, 1))


def correction(program: Program) -> Correction:
    count = len(program.targets)
    tips = np.zeros((count, 4, 4))
    return Correction(program, (), np.ones(count, dtype=bool), (), tips, tips, tips, np.zeros((count, 6)), ())


def refused(given: tuple[ProgramTarget, ...], digests: str) -> bool:
    program = Program("RAPID", (Source(Path("given.mod"), ""),), given)
    known = KnownCorrection("p.mod", "2026-11-27", digests, Path("ledger"))
    try:
        refuse_corrected([correction(program)], [known])
    except InputError:
        return True
    return False


def places(count: int, seed: int = 1) -> np.ndarray:
    """Return positions of a drawing [mm], ``(count, 3)``."""
    return np.asarray(np.random.default_rng(seed).uniform(-900.0, 900.0, (count, 3)).round(1))


def moved(values: np.ndarray, decimals: int = 3) -> np.ndarray:
    return np.asarray((values + np.random.default_rng(2).normal(0.0, 0.8, values.shape)).round(decimals))


def test_numbers_are_known_however_a_controller_stores_them() -> None:
    original = places(400)
    corrected = moved(original, 5)
    known = corrected_digests(targets(original), targets(corrected))
    for how, stored in {
        "as written": corrected,
        "single precision": corrected.astype(np.float32).astype(float),
        "two decimals": corrected.round(2),
        "rounded up": corrected + 4e-4,
    }.items():
        assert np.mean([refused((one,), known) for one in targets(stored)]) > 0.97, how
    assert not any(refused((one,), known) for one in targets(original))


def test_joints_and_pulses_are_known() -> None:
    degrees, pulses = np.random.default_rng(3).uniform(-170.0, 170.0, (2, 50, 6))
    for form, original, corrected in (
        (JOINTS, degrees.round(2), (degrees + 0.05).round(4)),
        (PULSES, (pulses * 1000.0).round(), (pulses * 1000.0 + 40.0).round()),
    ):
        known = corrected_digests(targets(original, form), targets(corrected, form))
        assert all(refused((one,), known) for one in targets(corrected, form))
        assert not any(refused((one,), known) for one in targets(original, form))


def test_what_a_correction_left_as_it_was_is_no_evidence() -> None:
    """Nor is a target that moves to where another one of the original is, as along a dense path."""
    original = places(40)
    corrected = moved(original)
    corrected[:20] = original[:20]
    known = corrected_digests(targets(original), targets(corrected))
    assert not refused(targets(original), known)
    assert not refused(targets(original[:20]), known)
    assert refused(targets(corrected[20:]), known)
    along = np.column_stack([np.arange(200) * 0.5, np.zeros(200), np.zeros(200)])
    known = corrected_digests(targets(along), targets(along + np.array([0.5, 0.0, 0.0])))
    assert not refused(targets(along), known)
    offsets = tuple(replace(one, parent=0) for one in targets(corrected))
    assert corrected_digests((), offsets) == ""


def test_one_of_twenty_is_enough() -> None:
    original = places(200)
    corrected = moved(original)
    known = corrected_digests(targets(original), targets(corrected))
    for taken, says in ((0, False), (9, False), (10, True), (200, True)):
        assert refused(targets(np.vstack([corrected[:taken], original[taken:]])), known) is says, taken


def test_of_a_long_program_a_sample_is_kept_by_which_parts_of_it_are_known() -> None:
    original = places(20_000)
    corrected = moved(original)
    known = corrected_digests(targets(original), targets(corrected))
    assert len(known) == 8 * 1000
    assert refused(targets(corrected), known)
    assert refused(targets(corrected[7000:8000]), known)
    assert not refused(targets(original), known)
    few = np.vstack([corrected[:200], original[200:]])
    assert not refused(targets(few), known)
    many = np.vstack([corrected[:3000], original[3000:]])
    assert refused(targets(many), known)


@languages
def test_programs_of_every_language_are_known(language: Language) -> None:
    seen = 0
    for sources in samples(language):
        program = language.read(sources)
        numbers = {row: np.array(one.values) + shifted(one) for row, one in enumerate(program.targets)}
        new = texts(program, edits_of(program, numbers))
        after = language.read([replace(source, text=text) for source, text in zip(sources, new, strict=True)])
        known = KnownCorrection("p", "", corrected_digests(program.targets, after.targets), Path("ledger"))
        refuse_corrected([correction(program)], [known])
        if known.targets:
            seen += 1
            with pytest.raises(InputError, match=r"line \d+: this program was corrected already; got 'targets of p as"):
                refuse_corrected([correction(after)], [known])
    assert seen
