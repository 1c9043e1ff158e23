"""The log of readings survives a kill at any moment, and takes nothing that was not written by it.

What a campaign was measured with is read and shown, and what is missing is said.
"""

from __future__ import annotations

import errno
import os
import shutil
import zlib
from pathlib import Path

import numpy as np
import pytest
from tests.killing import killed, operations

from truearm.engine.base.errors import InputError
from truearm.measuring.reading_log import LOG, About, ReadingLog, read_about
from truearm.measuring.session import Entry, Reading


def entry(number: int, *, reason: str = "") -> Entry:
    rng = np.random.default_rng(number)
    quaternion = rng.standard_normal(4)
    reading = Reading(
        name='smr "1", left',
        time=1e9 * float(rng.random()),
        position=rng.standard_normal(3),
        quaternion=quaternion / np.linalg.norm(quaternion) if number % 2 else None,
        label=f"P{number}",
        sigma=None if number % 3 else 1.2345e-5,
        sigma_rot=None if number % 3 else 1e-4,
        samples=number,
        deviation=float(rng.random()) * 1e-5,
        settling=None,
        breaks=number % 2,
        origin="points, all.csv, line 3",
        mark="0123abc",
    )
    return Entry(number, "reading", f"P{number}", reading.name, bool(number % 2), reading, reason, "Träger; 0.1 mm")


def same(first: Entry, other: Entry) -> bool:
    """Return whether two entries hold the same to the last digit."""
    a, b = dict(first.__dict__), dict(other.__dict__)
    x, y = a.pop("reading"), b.pop("reading")
    if a != b or (x is None) != (y is None):
        return False
    if x is None:
        return True
    fields = [field for field in x.__dict__ if field not in ("position", "quaternion")]
    turned = np.array_equal(x.quaternion, y.quaternion) if x.quaternion is not None else y.quaternion is None
    return (
        np.array_equal(x.position, y.position, equal_nan=True)
        and turned
        and all(getattr(x, field) == getattr(y, field) for field in fields)
    )


ENTRIES = (
    *(entry(number, reason=reason) for number, reason in enumerate(("", "scatter", "beam-break"), 1)),
    Entry(4, "aside", "P1", 'smr "1", left', True, None, "operator", "bumped", 1),
    Entry(5, "left", "P2", "b", False, None, "left-out", ""),
)


def write(folder: Path, entries: tuple[Entry, ...] = ENTRIES) -> None:
    log = ReadingLog(folder)
    for one in entries[len(log.entries) :]:
        log.append(one)
    log.close()


def read(folder: Path) -> tuple[Entry, ...]:
    log = ReadingLog(folder)
    log.close()
    return log.entries


def test_what_is_written_is_read_again_to_the_last_digit(tmp_path: Path) -> None:
    write(tmp_path)
    result = read(tmp_path)
    assert len(result) == len(ENTRIES)
    assert all(same(a, b) for a, b in zip(result, ENTRIES, strict=True))


def test_a_part_of_a_line_at_the_end_is_cut_off(tmp_path: Path) -> None:
    write(tmp_path)
    path = tmp_path / LOG
    whole = path.read_bytes()
    for lost in (1, 9, 10, 60):
        path.write_bytes(whole[:-lost])
        log = ReadingLog(tmp_path)
        log.close()
        assert log.torn > 0, lost
        assert len(log.entries) in (len(ENTRIES) - 1, len(ENTRIES) - 2)
        write(tmp_path)
        assert path.read_bytes() == whole


def test_a_line_that_is_missing_changed_or_says_nothing_is_refused_with_its_number(tmp_path: Path) -> None:
    write(tmp_path)
    path = tmp_path / LOG
    lines = path.read_text().splitlines(keepends=True)
    body = "6,guess,,P1,a,target,,,,,,,,,,,,,,,,,,"
    for changed, words in (
        ([*lines[:2], lines[2].replace("P2", "P3", 1), *lines[3:]], "line 3: this line is not as it was written"),
        ([*lines[:2], *lines[3:]], "line 3: lines before this one are missing.*; got 'number 3'; allowed: number 2"),
        ([*lines[:3], *lines[2:]], "line 4: .* or stand there twice; got 'number 2'; allowed: number 3"),
        ([*lines, f"{body},{zlib.crc32(body.encode()):08x}\n"], "line 7: this line cannot be understood"),
    ):
        path.write_text("".join(changed))
        with pytest.raises(InputError, match=words):
            ReadingLog(tmp_path)


def test_what_is_no_log_stays(tmp_path: Path) -> None:
    path = tmp_path / LOG
    for content in ("a,b\n1,2\n", "configuration\n"):
        path.write_text(content)
        with pytest.raises(InputError, match="no log of readings"):
            ReadingLog(tmp_path)
        assert path.read_text() == content
    path.unlink()
    (tmp_path / "elsewhere").write_text("")
    path.symlink_to(tmp_path / "elsewhere")
    for _ in ("a link", "a folder"):
        with pytest.raises(InputError, match="this is none"):
            ReadingLog(tmp_path)
        path.unlink(missing_ok=True) if path.is_symlink() else path.rmdir()
        path.mkdir()


def test_a_disk_that_does_not_take_a_line_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    log = ReadingLog(tmp_path)
    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(InputError, match="No space left on device"):
        log.append(ENTRIES[0])
    monkeypatch.undo()
    log.close()
    with pytest.raises(InputError, match="cannot be written"):
        ReadingLog(tmp_path / "nowhere")


def test_one_process_at_a_time_has_it_and_names_that_would_break_a_line_are_escaped(tmp_path: Path) -> None:
    log = ReadingLog(tmp_path)
    with pytest.raises(InputError, match="another process is measuring"):
        ReadingLog(tmp_path)
    odd = Reading("a\nb", 0.0, np.full(3, np.nan))
    log.append(Entry(1, "reading", "", odd.name, reading=odd, reason="unknown-name"))
    log.close()
    (result,) = read(tmp_path)
    assert (result.name, result.reason, result.label) == (r"a\nb", "unknown-name", "")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="a process cannot copy itself here")
def test_a_kill_at_any_of_twenty_moments_damages_nothing(tmp_path: Path) -> None:
    """A kill before an operation, in the middle of a line too: what is there is the beginning of the whole."""
    folder = tmp_path / "log"
    folder.mkdir()
    count = operations(lambda: write(folder), folder)
    write(folder)
    whole = (folder / LOG).read_bytes()
    lengths = set()
    moments = np.random.default_rng(0).choice(count, min(20, count), replace=False)
    for moment in sorted(moments.tolist()):
        shutil.rmtree(folder)
        folder.mkdir()
        killed(lambda: write(folder), folder, moment)
        there = (folder / LOG).read_bytes() if (folder / LOG).exists() else b""
        assert whole.startswith(there)
        log = ReadingLog(folder)
        lengths.add(len(log.entries))
        assert all(same(a, b) for a, b in zip(log.entries, ENTRIES, strict=False))
        log.close()
        write(folder)
        assert (folder / LOG).read_bytes() == whole
    assert len(lengths) > 2


WHOLE = """\
truearm: truearm-about/1
units: {length: mm, temperature: degC, pressure: hPa, humidity: percent}
instrument: {name: tracker of the hall, serial: "750123"}
robot: {serial: "120-501234"}
reflector: {radius: 19.05, offset: 0.0}
environment:
  - {at: start, temperature: 20.4, pressure: 1013.2, humidity: 45}
  - {at: end, temperature: 21.0}
"""


def test_everything_that_is_said_is_shown(tmp_path: Path) -> None:
    path = tmp_path / "about.yaml"
    path.write_text(WHOLE)
    about = read_about(path)
    assert about.missing == []
    assert about.notices() == []
    rows = dict(about.rows())
    assert rows["serial number of the robot"] == "120-501234"
    assert rows["radius of the reflector"] == "19.05 mm"
    assert rows["air, start"] == "20.4 degC, 1013.2 hPa, 45 percent"
    assert rows["air, end"] == "21 degC"


def test_what_nobody_said_is_named() -> None:
    (notice,) = About(instrument_serial="7").notices()
    assert (notice.code, notice.level) == ("not-said", "note")
    assert "serial number of the instrument" not in notice.message
    for word in ("serial number of the robot", "radius of the reflector", "temperature of the air"):
        assert word in notice.message


def test_what_cannot_be_meant_is_refused_with_its_place(tmp_path: Path) -> None:
    path = tmp_path / "about.yaml"
    for old, new, word in (
        ("radius: 19.05", "radius: 1905", "reflector.radius"),
        ("radius: 19.05", "radius: 0", "reflector.radius"),
        ("temperature: 20.4", "temperature: 293.5", r"environment\[1\].temperature"),
        ("pressure: 1013.2", "pressure: 101320", r"environment\[1\].pressure"),
        ("humidity: 45", "humidity: 145", r"environment\[1\].humidity"),
        ("length: mm", "length: furlong", "units.length"),
        ("serial:", "seriel:", "seriel"),
        ("at: start", 'at: "st\\x07art"', "one line of text"),
    ):
        path.write_text(WHOLE.replace(old, new))
        with pytest.raises(InputError, match=word):
            read_about(path)
