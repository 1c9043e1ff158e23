"""Rows that an instrument's software writes: whole lines alone, broken ones named, the others kept."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from truearm.engine.base.errors import InputError
from truearm.measuring.campaign import Campaign
from truearm.measuring.session import Quality, Session
from truearm.measuring.watched_folder import WatchedFolder

LABELS = ("P1", "P2", "P3")
MAPPING = """\
truearm: truearm-mapping/1
configuration: {column: Pose}
length_unit: mm
readings: [{target_column: Point, x: X, y: Y, z: Z}]
references: [n1]
order: {column: When, time: iso}
dwell: {deviation: RMS, unit: mm, samples: N, breaks: Lost}
joints: {file: plan.csv}
"""
HEADER = "Pose,Point,X,Y,Z,When,RMS,N,Lost\n"


def row(pose: str, point: str, x: float | str = 1.0, *, at: int = 0, rms: float = 0.01, lost: int = 0) -> str:
    return f"{pose},{point},{x},2.5,3.5,2026-11-23 10:00:{at:02},{rms},20,{lost}\n"


class Folder:
    """A watched folder with its session."""

    def __init__(self, place: Path, mapping: str = MAPPING, targets: tuple[str, ...] = ("a",)) -> None:
        self.place, self.targets = place, targets
        self.inside, self.out = place / "in", place / "out"
        for folder in (self.inside, self.out):
            folder.mkdir(exist_ok=True)
        (place / "map.yaml").write_text(mapping)
        self.campaign = self.opened()

    def opened(self) -> Campaign:
        source = WatchedFolder(self.inside, self.place / "map.yaml", LABELS, clock=lambda: 7.0)
        quality = Quality(deviation=5e-5, samples=5)
        return Campaign(Session(LABELS, self.targets, ("n1",), 2, quality), source, self.out)

    def again(self) -> None:
        self.campaign.close()
        self.campaign = self.opened()

    def write(self, text: str, name: str = "points.csv", *, mode: str = "a") -> None:
        with (self.inside / name).open(mode, encoding="utf-8", newline="") as stream:
            stream.write(text)

    def step(self) -> list[str]:
        return [f"{e.label}/{e.name}{f' {e.reason}' if e.reason else ''}" for e in self.campaign.step()]

    @property
    def codes(self) -> list[str]:
        return [notice.code for notice in self.campaign.source.notices]


@pytest.fixture
def make_folder(tmp_path: Path) -> Iterator[Callable[..., Folder]]:
    """Make watched folders, and let go of their logs at the end."""
    folders: list[Folder] = []

    def make(*given: Any) -> Folder:
        folders.append(Folder(tmp_path, *given))
        return folders[-1]

    yield make
    for folder in folders:
        folder.campaign.close()


@pytest.fixture
def watched(make_folder: Callable[..., Folder]) -> Folder:
    return make_folder()


def test_rows_are_read_as_they_come_and_half_a_line_waits(watched: Folder) -> None:
    assert watched.step() == []
    watched.write(HEADER + row("P1", "n1") + row("P1", "a")[:9])
    assert watched.step() == ["P1/n1"]
    assert watched.codes == ["line-without-end"]
    watched.write(row("P1", "a")[9:])
    assert watched.step() == ["P1/a"]
    assert watched.codes == []
    assert watched.step() == []
    reading = watched.campaign.session.entries[1].reading
    assert reading is not None
    assert (reading.position * 1e3).tolist() == pytest.approx([1.0, 2.5, 3.5])
    assert reading.deviation == pytest.approx(1e-5)
    assert (reading.samples, reading.breaks) == (20, 0)
    assert reading.origin == "points.csv, line 3"


def test_a_mapping_needs_no_joints_where_the_plan_has_them(make_folder: Callable[..., Folder], tmp_path: Path) -> None:
    watched = make_folder(MAPPING.replace("joints: {file: plan.csv}\n", ""))
    watched.write(HEADER + row("P1", "n1") + row("P1", "a"))
    assert watched.step() == ["P1/n1", "P1/a"]
    # But other joints, or a sheet, do not go with a plan and with text.
    watched.campaign.close()
    for old, new, where in (
        ("joints: {file: plan.csv}", "joints: {columns: [X], unit: deg}", "joints"),
        ("length_unit: mm", "length_unit: mm\nlayout: {sheet: Points}", "layout.sheet"),
    ):
        with pytest.raises(InputError) as refusal:
            Folder(tmp_path, MAPPING.replace(old, new).replace("x: X", "x: XX"))
        assert str(refusal.value.where).endswith(where)


def test_a_thread_that_writes_is_followed_to_the_end(watched: Folder) -> None:
    text = HEADER + "".join(row(label, name, at=k) for k, label in enumerate(LABELS) for name in ("n1", "a"))

    def write() -> None:
        for start in range(0, len(text), 7):
            watched.write(text[start : start + 7])

    writer = threading.Thread(target=write)
    writer.start()
    found: list[str] = []
    for _ in range(200):
        found += [entry.name for entry in watched.campaign.step(0.05)]
        if not writer.is_alive() and len(found) >= 6:
            break
    writer.join()
    assert found == ["n1", "a"] * 3
    assert [e.reason for e in watched.campaign.session.entries if not e.is_nest] == ["", "copy", "copy"]


def test_a_broken_row_is_named_and_the_others_are_kept(watched: Folder) -> None:
    broken = ("P2,a,oops,2,3,2026-11-23 10:00:01,0.01,20,0\n", 'P2,"a,1,2\n', "P2,a,1\n", row("P2", "a", "nan"))
    watched.write(HEADER + row("P1", "a") + "".join(broken) + row("P3", "a", 4.0))
    assert watched.step() == ["P1/a", "P3/a"]
    messages = watched.campaign.source.messages()
    assert [f"points.csv, line {n}" in text for n, text in zip((3, 4, 5, 6), messages, strict=True)] == [True] * 4
    (notice,) = watched.campaign.source.notices
    assert notice.code == "rows-broken"
    assert "4 rows could not be read" in notice.message
    assert watched.campaign.source.messages() == []


def test_every_fault_that_the_table_tells_sets_its_row_aside(watched: Folder) -> None:
    watched.write(HEADER + row("P1", "a", lost=1) + row("P1", "a", 2.0, rms=0.06) + row("P9", "a") + row("P1", "b"))
    assert watched.step() == ["P1/a beam-break", "P1/a scatter", "P9/a unknown-configuration", "P1/b unknown-name"]
    assert not watched.campaign.session.kept


def test_old_ends_of_lines_and_windows_ones_are_lines(watched: Folder) -> None:
    text = HEADER + row("P1", "a") + row("P2", "a", 2.0)
    watched.write(text.replace("\n", "\r"), "old.csv")
    assert sorted(watched.step()) == ["P1/a", "P2/a"]
    # A break of two characters may come in two pieces.
    watched.write(HEADER.replace("\n", "\r\n") + row("P3", "a", 3.0).rstrip("\n") + "\r", "windows.csv")
    assert watched.step() == ["P3/a"]
    watched.write("\n" + row("P3", "n1", 2.0).replace("\n", "\r\n"), "windows.csv")
    assert watched.step() == ["P3/n1"]
    assert watched.codes == []


def test_going_on_passes_over_what_the_log_holds(watched: Folder) -> None:
    watched.write(HEADER + row("P1", "a") + row("P2", "a", 2.0))
    watched.step()
    watched.again()
    watched.write(row("P3", "a", 3.0))
    assert watched.step() == ["P3/a"]
    assert len(watched.campaign.session) == 3
    watched.campaign.close()
    other = Session(("Q1", "Q2"), ("a",), ("n1",), 2, Quality())
    with pytest.raises(InputError, match="does not belong to this plan"):
        Campaign(other, watched.campaign.source, watched.out)


def test_a_file_that_shrinks_or_is_replaced_is_told_and_what_was_read_stays(watched: Folder) -> None:
    watched.write(HEADER + row("P1", "a") + row("P2", "a", 2.0))
    watched.step()
    watched.write(HEADER + row("P2", "a", 2.0), mode="w")
    assert watched.step() == []
    assert watched.codes == ["file-replaced"]
    watched.write(HEADER + row("P1", "a", 9.0) + row("P3", "a", 5.0), mode="w")
    assert watched.step() == ["P1/a measured-already", "P3/a"]
    assert len(watched.campaign.session.kept) == 3


def test_several_files_in_the_order_of_their_times(watched: Folder) -> None:
    for number, label in enumerate(("P2", "P1")):
        name = f"point-{label}.txt"
        watched.write(HEADER + row(label, "a", number), name)
        os.utime(watched.inside / name, (1000.0 + number, 1000.0 + number))
    assert watched.step() == ["P2/a", "P1/a"]


def test_links_folders_and_other_files_are_told_and_not_read(watched: Folder) -> None:
    (watched.place / "secret.csv").write_text(HEADER + row("P1", "a"))
    (watched.inside / "link.csv").symlink_to(watched.place / "secret.csv")
    (watched.inside / "folder.csv").mkdir()
    watched.write("x", "points.csv.tmp")
    watched.write("x", ".hidden.csv")
    assert watched.step() == []
    (notice,) = watched.campaign.source.notices
    assert (notice.code, notice.level) == ("not-read", "note")
    for word in ("link.csv: a link", "folder.csv: no file", "points.csv.tmp: ends with none of .csv"):
        assert word in notice.message
    assert ".hidden" not in notice.message


def test_a_file_of_another_encoding_or_with_other_columns_is_told_until_it_is_right(watched: Folder) -> None:
    (watched.inside / "points.csv").write_bytes(HEADER.encode("utf-16"))
    (watched.inside / "other.csv").write_text("Pose,Name,X,Y,Z\nP1,a,1,2,3\n")
    assert watched.step() == []
    (notice,) = watched.campaign.source.notices
    assert (notice.code, notice.level) == ("not-read", "note")
    assert "not utf-8 text" in notice.message
    assert "no such column" in notice.message
    (watched.inside / "other.csv").unlink()
    watched.write(row("P1", "a") + row("P2", "a", 2.0), mode="w")  # without a header
    assert watched.step() == []
    assert ".." not in watched.campaign.source.notices[0].message
    watched.write(HEADER + row("P1", "a"), mode="w")
    assert watched.step() == ["P1/a"]
    assert "utf-8" not in "".join(n.message for n in watched.campaign.source.notices)


def test_a_folder_that_goes_away_is_told_and_one_that_is_not_there_is_refused(watched: Folder) -> None:
    watched.inside.rmdir()
    assert watched.step() == []
    assert "the folder is gone" in watched.campaign.source.notices[0].message
    with pytest.raises(InputError, match="no such folder") as refusal:
        WatchedFolder(watched.place / "nowhere", watched.place / "map.yaml", LABELS)
    assert refusal.value.parameter == "watch"


def test_wide_tables_without_labels_count_their_rows(make_folder: Callable[..., Folder]) -> None:
    mapping = """\
truearm: truearm-mapping/1
layout: {delimiter: semicolon, decimal: comma, header: 2, comment: '#', encoding: utf-16}
missing: ['-']
configuration: {each: row}
length_unit: mm
readings:
  - {target: a, x: X1, y: Y1, z: Z1}
  - {target: b, x: X2, y: Y2, z: Z2}
joints: {file: plan.csv}
"""
    of = make_folder(mapping, ("a", "b"))
    text = "any\nX1;Y1;Z1;X2;Y2;Z2\n1,5;2;3;4;5;6\n# a remark\n1;2;x;4;5;7\n\n7;8;9;-;-;-\n8;8;9;1;1;1\n"
    (of.inside / "wide.csv").write_bytes(text.encode("utf-16"))
    beyond = [f"row 4/{name} unknown-configuration" for name in "ab"]
    assert of.step() == ["P1/a", "P1/b", "P3/a", "P3/b no-reading", *beyond]
    assert "line 5" in of.campaign.source.messages()[0]


def test_poses_are_read_and_wrong_quaternions_named(make_folder: Callable[..., Folder]) -> None:
    mapping = """\
truearm: truearm-mapping/1
configuration: {column: Pose}
length_unit: m
readings: [{target: a, x: X, y: Y, z: Z, qw: W, qx: I, qy: J, qz: K, sigma: {columns: [S], unit: mm}}]
joints: {file: plan.csv}
"""
    of = make_folder(mapping)
    of.write("Pose,X,Y,Z,W,I,J,K,S\nP1,1,2,3,0.6,0.8,0,0,0.02\nP2,1,2,4,0.5,0,0,0,0.02\n")
    assert of.step() == ["P1/a"]
    reading = of.campaign.session.entries[0].reading
    assert reading is not None
    assert reading.quaternion is not None
    assert reading.quaternion.tolist() == [0.6, 0.8, 0.0, 0.0]
    assert reading.sigma == pytest.approx(2e-5)
    assert reading.time == 7.0
    assert "length 1" in of.campaign.source.messages()[0]
