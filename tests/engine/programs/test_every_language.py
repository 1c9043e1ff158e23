"""What holds for every robot language: only the numbers of targets change, and nothing that is read makes it fall."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tests.engine.programs.reading import samples, shifted, split, texts

from truearm.engine.base.errors import InputError
from truearm.engine.base.version import __version__
from truearm.engine.programs import LANGUAGES
from truearm.engine.programs.program import (
    ANY_POSTURE,
    BYTE_ORDER_MARK,
    MARK,
    NUMBER,
    Language,
    Lines,
    Program,
    Source,
    Split,
    correction_comment,
)
from truearm.engine.programs.program_files import language_called
from truearm.engine.programs.program_poses import after_edits, edits_of, numbers_of, pose_numbers, poses_of

splitting = pytest.mark.parametrize("language", [one for one in LANGUAGES if one.split], ids=lambda one: one.name)
languages = pytest.mark.parametrize("language", LANGUAGES, ids=lambda one: one.name)
LINE_ENDS = ("\n", "\r\n", "\r")


def with_ends(sources: Sequence[Source], end: str, mark: str = "") -> list[Source]:
    return [
        Source(source.path, mark + re.sub(r"\r\n?|\n", end, source.text.removeprefix(BYTE_ORDER_MARK)))
        for source in sources
    ]


@languages
def test_there_are_samples_that_hold_poses_and_moves(language: Language) -> None:
    read = [language.read(sources) for sources in samples(language)]
    assert sum(len(program.targets) for program in read) >= 8
    assert {move.kind for program in read for move in program.moves} >= {"joint", "linear", "circular"}
    assert {target.form.kind for program in read for target in program.targets} >= {"pose"}


@languages
def test_places_hold_the_values(language: Language) -> None:
    for sources in samples(language):
        program = language.read(sources)
        taken: set[tuple[int, int, int]] = set()
        for target in program.targets:
            text = program.sources[target.source].text
            assert len(target.values) == len(target.places)
            for value, span in zip(target.values, target.places, strict=True):
                if span is not None:
                    assert float(text[span[0] : span[1]] or "0") == value
                    assert span[0] < span[1] or target.form.absent
                    assert (target.source, *span) not in taken or span[0] == span[1]
                    taken.add((target.source, *span))
            # The line is where the target begins, its first number may be a few further down.
            first = Lines(text).number(next(s[0] for s in target.places if s))
            assert first - 6 <= target.line <= first


@languages
def test_a_correction_of_nothing_leaves_every_byte(language: Language) -> None:
    for sources in samples(language):
        program = language.read(sources)
        poses = poses_of(program)
        rows = np.array([i for i, t in enumerate(program.targets) if t.form.kind == "pose"], dtype=int)
        # As if computed: off by less than a nanometre and a billionth of a turn.
        noisy = poses.copy()
        noisy[:, :3, 3] += 1e-10
        assert edits_of(program, pose_numbers(program, poses, noisy, rows)) == []


@languages
def test_a_comment_is_a_few_lines_and_changes_nothing_that_is_read(language: Language) -> None:
    """Names that end a comment in some language are made harmless."""
    lines = correction_comment(date(2026, 11, 27), "IRB --> *) ]]>; 'é' \"", "2f3a9c1d" * 8)
    assert lines[:2] == (f"{MARK} {__version__}", "2026-11-27, calibration 2f3a9c1d")
    assert all(len(line) <= 32 and line.isascii() for line in lines)
    for sources in samples(language):
        new = [Source(source.path, language.comment(source.text, lines)) for source in sources]
        for source, one in zip(sources, new, strict=True):
            old_rows, rows = (
                text.removeprefix(BYTE_ORDER_MARK).splitlines(keepends=True) for text in (source.text, one.text)
            )
            assert source.text.startswith(BYTE_ORDER_MARK) == one.text.startswith(BYTE_ORDER_MARK)
            first = next(number for number, row in enumerate(rows) if lines[0] in row)
            assert all(said in row for said, row in zip(lines, rows[first:], strict=False))
            assert {row[len(row.rstrip("\r\n")) :] for row in rows} <= {
                row[len(row.rstrip("\r\n")) :] for row in old_rows
            }
            left = [re.sub(r"(LINE_COUNT\s*= )\d+", r"\g<1>", row) for row in rows[:first] + rows[first + len(lines) :]]
            assert left == [re.sub(r"(LINE_COUNT\s*= )\d+", r"\g<1>", row) for row in old_rows]
            assert language.recognizes(one.text)
        before, after = language.read(sources), language.read(new)
        assert [replace(t, line=0, places=()) for t in after.targets] == [
            replace(t, line=0, places=()) for t in before.targets
        ]
        for target in after.targets:
            text = new[target.source].text
            assert tuple(float(text[slice(*span)] or 0) for span in target.places if span) == tuple(
                value for value, span in zip(target.values, target.places, strict=True) if span
            )
        assert [(m.kind, m.target, m.via, m.routine) for m in after.moves] == [
            (m.kind, m.target, m.via, m.routine) for m in before.moves
        ]
        assert len(after.skipped) == len(before.skipped)
        assert after.unknown == before.unknown


def test_where_a_comment_stands() -> None:
    for name, text, commented in (
        (
            "RAPID",
            "MODULE m (SYSMODULE) CONST num n:=1;\nENDMODULE",
            "MODULE m (SYSMODULE)\n  ! a\n CONST num n:=1;\nENDMODULE",
        ),
        ("RAPID", "%%%\r\nMODULE m ! of\r\nENDMODULE", "%%%\r\nMODULE m ! of\r\n  ! a\r\nENDMODULE"),
        (
            "KRL",
            "&ACCESS RVP\n&REL 1\nDEF m( )\n;FOLD INI\n;ENDFOLD\nEND",
            "&ACCESS RVP\n&REL 1\nDEF m( )\n; a\n;FOLD INI\n;ENDFOLD\nEND",
        ),
        ("INFORM", "/JOB\n//INST\n///DATE 2000\nNOP\nEND", "/JOB\n//INST\n///DATE 2000\nNOP\n'a\nEND"),
        ("INFORM", "/JOB\n//INST\nMOVJ C1\nEND", "/JOB\n//INST\n'a\nMOVJ C1\nEND"),
        ("URScript", "def m():\r\nend", "# a\r\ndef m():\r\nend"),
        ("VAL3", "<?xml version='1.0'?><Database/>", "<?xml version='1.0'?>\n<!-- a -->\n<Database/>"),
        ("VAL3", "<Code><![CDATA[begin put(1)\nend]]></Code>", "<Code><![CDATA[begin\n  // a\n put(1)\nend]]></Code>"),
        ("FANUC LS", "/PROG M\n/MN\n/POS\n/END\n", "/PROG M\n/MN\n   1:  !a    ;\n/POS\n/END\n"),
        (
            "FANUC LS",
            "/PROG M\r\nLINE_COUNT = 2;\r\n/MN\r\n   1:  UTOOL_NUM=0 ;\r\n  12:J P[1] 5% FINE ;\r\n/POS\r\n/END\r\n",
            "/PROG M\r\nLINE_COUNT = 3;\r\n/MN\r\n   1:  UTOOL_NUM=0 ;\r\n  12:J P[1] 5% FINE ;\r\n  13:  !a    ;\r\n"
            "/POS\r\n/END\r\n",
        ),
        ("RAPID", "CONST num n:=1;", "CONST num n:=1;"),
    ):
        assert language_called(name).comment(text, ["a"]) == commented, name


@languages
def test_a_correction_changes_numbers_of_targets_and_nothing_else(language: Language) -> None:
    for sources in samples(language):
        program = language.read(sources)
        numbers = {i: np.array(t.values) + shifted(t) for i, t in enumerate(program.targets)}
        edits = edits_of(program, numbers)
        after = texts(program, edits)
        places = [
            [s for t in program.targets if t.source == n for s in t.places if s and s[0] < s[1]]
            for n in range(len(after))
        ]
        for source, text, spans in zip(program.sources, after, places, strict=True):
            assert without(source.text, spans) == skeleton(text, source.text, spans)
        again = language.read([Source(s.path, text) for s, text in zip(program.sources, after, strict=True)])
        assert [(t.name, t.tool, t.frame, t.configuration) for t in again.targets] == [
            (t.name, t.tool, t.frame, t.configuration) for t in program.targets
        ]
        known = after_edits(program.targets, edits)
        assert known is None or [t.values for t in known] == [t.values for t in again.targets]
        assert known is not None or language.name in ("URScript", "VAL3", "RAPID")
        for index, target in enumerate(again.targets):
            written = [i for i, span in enumerate(target.places) if span is not None and span[0] < span[1]]
            np.testing.assert_allclose(
                np.array(target.values)[written], numbers[index][written], atol=0.6 * 10.0 ** -min(target.form.decimals)
            )


def without(text: str, spans: Sequence[tuple[int, int]]) -> list[str]:
    """Return what stands between numbers."""
    ends = [0, *(stop for _, stop in sorted(spans))]
    starts = [*(start for start, _ in sorted(spans)), len(text)]
    return [text[a:b] for a, b in zip(ends, starts, strict=True)]


def skeleton(text: str, before: str, spans: Sequence[tuple[int, int]]) -> list[str]:
    """Return what stands between numbers in a text whose numbers differ from those of another one."""
    parts, at = [], 0
    for between in without(before, spans)[:-1]:
        assert text.startswith(between, at)
        parts.append(between)
        number = re.compile(NUMBER).match(text, at + len(between))
        assert number is not None
        at = number.end()
    return [*parts, text[at:]]


@splitting
@pytest.mark.parametrize("end", LINE_ENDS, ids=["LF", "CRLF", "CR"])
def test_split_moves_read_back(language: Language, end: str) -> None:
    """Moves split at made-up places: the added targets come before the move's own, with the same tool and frame."""
    assert language.split is not None
    tried = 0
    for sources in samples(language):
        program = language.read(with_ends(sources, end))
        whole = [i for i, move in enumerate(program.moves) if move.target_text == (0, 0)]
        assert language.split(program, [Split(i, (((0.0,) * 7, None),)) for i in whole]) == ([], [*whole])
        for index, move in enumerate(program.moves):
            target = program.targets[move.target]
            fit = target.form.kind == "pose" and target.form.orientation is not None and target.parent is None
            if move.kind == "joint" or index in whole or not fit:
                continue
            pose = poses_of(program)[move.target][None].repeat(3, axis=0)
            pose[:, :3, 3] += np.array([[0.01], [0.02], [0.03]])
            near = np.tile(target.values, (3, 1))
            one, two, three = (tuple(row) for row in numbers_of(target.form, pose, near).tolist())
            circle = move.via is not None
            cut = Split(index, ((one, two if circle else None),), three if circle else None)
            edits, left = language.split(program, [cut])
            assert left == ([] if edits else [index])
            if not edits:  # segments of this one would mean something else
                continue
            tried += 1
            again = split(language, program, cut)
            assert {*re.findall(r"\r\n|\r|\n", "".join(source.text for source in again.sources))} == {end}
            # Between two circles some languages want a step of no length.
            count = len(again.moves) - len(program.moves)
            assert count == 1 or (circle and count > 1)
            added, last = again.moves[index], again.moves[index + count]
            if circle:
                added = next(m for m in again.moves[index:] if m.kind == "circular")
            assert added.kind == last.kind == move.kind
            new, to = again.targets[added.target], again.targets[last.target]
            assert (new.tool, new.frame, to.tool, to.frame) == (target.tool, target.frame, target.tool, target.frame)
            assert new.configuration in (target.configuration, ANY_POSTURE)
            assert to.values == target.values
            np.testing.assert_allclose(new.values, one, atol=6e-4)
            if circle:
                assert added.via is not None
                assert last.via is not None
                np.testing.assert_allclose(again.targets[added.via].values, two, atol=6e-4)
                np.testing.assert_allclose(again.targets[last.via].values, three, atol=6e-4)
    assert tried


@languages
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_nothing_that_is_read_makes_it_fall(language: Language, data: st.DataObject) -> None:
    """Programs cut off, with pieces swapped, doubled or replaced by anything: read, or refused in words.

    What is read can be corrected, and nothing but the numbers of targets changes.
    """
    sources = list(data.draw(st.sampled_from(samples(language))))
    which = data.draw(st.integers(0, len(sources) - 1))
    text = sources[which].text
    a, b = sorted(data.draw(st.tuples(st.integers(0, len(text)), st.integers(0, len(text)))))
    piece = data.draw(
        st.one_of(
            st.just(""),
            st.binary(max_size=40).map(lambda raw: raw.decode("latin-1")),
            st.sampled_from([*"\"'{}[]();!\r\ne-<&", "9E9", "1e999"]),
            st.just(text[a:b]),
        )
    )
    b = data.draw(st.sampled_from([a, b, len(text), min(a + 1, len(text))]))
    broken = text[:a] + piece + text[b:]
    sources[which] = Source(sources[which].path, broken)
    program = read_or_refused(language, sources)
    if program is None:
        return
    assert [source.text for source in program.sources] == [source.text for source in sources]
    for target in program.targets:
        whole = program.sources[target.source].text
        assert 0 <= target.source < len(sources)
        for value, span in zip(target.values, target.places, strict=True):
            assert np.isfinite(value)
            assert span is None or float(whole[span[0] : span[1]] or "0") == value
    poses_of(program)
    language.recognizes(broken)
    same = {i: np.array(target.values) for i, target in enumerate(program.targets)}
    assert edits_of(program, same) == []
    # No two targets have the same number, and what stands between numbers stays.
    after = texts(program, edits_of(program, {i: v + shifted(program.targets[i]) for i, v in same.items()}))
    for number, (source, text_after) in enumerate(zip(program.sources, after, strict=True)):
        spans = [s for t in program.targets if t.source == number for s in t.places if s and s[0] < s[1]]
        assert without(source.text, spans) == skeleton(text_after, source.text, spans)


@languages
@settings(max_examples=40, deadline=None)
@given(raw=st.binary(max_size=400))
def test_any_bytes_are_read_or_refused(language: Language, raw: bytes) -> None:
    text = raw.decode("latin-1")
    language.recognizes(text)
    program = read_or_refused(language, [Source(Path(f"any{language.suffixes[0]}"), text)])
    assert program is None or program.sources[0].text == text


def read_or_refused(language: Language, sources: Sequence[Source]) -> Program | None:
    """Return the program, or None where it is refused with the place of the fault."""
    try:
        return language.read(sources)
    except InputError as refusal:
        if not refusal.where:
            raise
        return None


@languages
def test_languages_are_told_apart(language: Language) -> None:
    for sources in samples(language):
        for source in sources:
            assert language.recognizes(source.text), source.path
            others = [one.name for one in LANGUAGES if one is not language and one.recognizes(source.text)]
            assert not others, source.path


def test_a_text_is_of_one_language_or_of_none() -> None:
    for text, names in (
        ("", []),
        ("default", []),
        ("! the MODULE is elsewhere\n", []),
        ("<html><body>VAL3</body></html>", []),
        ('<?xml version="1.0"?><Database><a/></Database>', []),
        ("%%%\r\n  VERSION:1\r\n%%%\r\nMODULE a\r\nENDMODULE\r\n", ["RAPID"]),
        ("DEF main( )\nPTP HOME Vel=100 % DEFAULT\nEND\n", ["KRL"]),
        ("DEF WELD()\n;/JOB\nEND", ["KRL"]),
        ("&ACCESS RVP\nSTRUC A INT B", ["KRL"]),
        ("\xef\xbb\xbf; made by hand\r\n&REL 3\r\ndefdat Points public\r\nENDDAT", ["KRL"]),
        ("/PROG MAIN\n/MN\n   1:J P[1] 100% FINE    ;\n/END\n", ["FANUC LS"]),
        ("def prog():\n  movej([0,0,0,0,0,0])\nend\n", ["URScript"]),
        ("/JOB\n//NAME MAIN\nNOP\nMOVJ C00000 VJ=50.00\nEND\n", ["INFORM"]),
    ):
        assert [language.name for language in LANGUAGES if language.recognizes(text)] == names, text


@languages
def test_line_ends_and_a_byte_order_mark_do_not_matter(language: Language) -> None:
    for sources in samples(language):
        read = [language.read(with_ends(sources, end)) for end in LINE_ENDS]
        read.append(language.read(with_ends(sources, "\n", BYTE_ORDER_MARK)))
        assert all(language.recognizes(source.text) for program in read for source in program.sources)
        one, *others = [
            (
                [replace(target, places=()) for target in program.targets],
                [(m.source, m.line, m.kind, m.target, m.via, m.routine) for m in program.moves],
                program.skipped,
                program.unknown,
            )
            for program in read
        ]
        assert all(other == one for other in others), sources[0].path


@languages
def test_a_program_that_ends_in_the_middle_is_mostly_refused(language: Language) -> None:
    cut, refused = 0, 0
    for sources in samples(language):
        for which, source in enumerate(sources):
            for stop in range(0, len(source.text) - 20, 41):
                part = Source(source.path, source.text[:stop])
                cut += 1
                refused += read_or_refused(language, [*sources[:which], part, *sources[which + 1 :]]) is None
    assert refused > 0.9 * cut


#: What would take long, or too deep, where a text is read again from each of its places.
STRANGE = ("[" * 50_000, " " * 200_000, "1" * 200_000, "IF " * 50_000, "f(" * 20_000, '"' * 99_999, "a:" * 50_000)


@languages
def test_strange_texts_are_read_or_refused_at_once(language: Language) -> None:
    for sources in samples(language):
        text = sources[0].text
        for strange in STRANGE:
            for at in (len(text) // 3, len(text) // 2):
                broken = Source(sources[0].path, text[:at] + strange + text[at:])
                read_or_refused(language, [broken, *sources[1:]])
