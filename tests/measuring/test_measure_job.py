"""A plan measured from the first reading to a calibration, stopped and gone on with, by every source.

And the command that measures: what it prints, its JSON, its exit codes, and what a kill leaves.
"""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.commanding import Truearm
from tests.house.examples import MEASURED_PLAN

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.data.readers.canonical import read_csv
from truearm.engine.twin.devices import DEVICES
from truearm.measuring.begun import BEGUN
from truearm.measuring.measure import open_campaign
from truearm.measuring.open_campaign import sight
from truearm.measuring.reading_log import LOG
from truearm.measuring.result import DATA, PAGE
from truearm.measuring.session import Reading
from truearm.measuring.virtual_instrument import VIRTUAL, VirtualInstrument

MAPPING = """\
truearm: truearm-mapping/1
configuration: {column: Pose}
length_unit: mm
readings: [{target_column: Point, x: X, y: Y, z: Z}]
joints: {file: plan.csv}
"""


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A plan of configurations at which the tracker sees a reflector."""
    return seen_by("tracker", 24, tmp_path_factory.mktemp("planned"))


def seen_by(device: str, poses: int, folder: Path) -> Path:
    """Write a plan of configurations that a device can measure."""
    data = truearm.simulate("irb120", truth="nominal", poses=poses, device=device).data
    return plan_of(folder, *(",".join(map(repr, row)) for row in np.degrees(data.joints).tolist()))


def plan_of(folder: Path, *rows: str) -> Path:
    path = folder / "few.csv"
    path.write_text("\n".join([MEASURED_PLAN.splitlines()[0], *(f"{k},{row}" for k, row in enumerate(rows, 1))]) + "\n")
    return path


def with_reads(planned: Path, path: Path, reads: list[str]) -> Path:
    """Write a plan that says what is read at each configuration."""
    head, *rows = planned.read_text().splitlines()
    path.write_text("\n".join([f"{head},reads", *map(",".join, zip(rows, reads, strict=True))]) + "\n")
    return path


@pytest.fixture
def plan(tmp_path: Path) -> Path:
    path = tmp_path / "plan.csv"
    path.write_text(MEASURED_PLAN)
    return path


def arm(plan: Path, out: Path, **more: Any) -> Any:
    options: dict[str, Any] = {"device": "measurement-arm", "nests": ["n"], "every": 2} | more
    return truearm.measure(plan, "irb120", out=out, **options)


def test_a_plan_that_is_measured_calibrates_the_robot_as_well_as_its_instrument(planned: Path, tmp_path: Path) -> None:
    messages: list[str] = []
    options: dict[str, Any] = {
        "device": "tracker",
        "seed": 3,
        "disturbed": 0.2,
        "nests": ["n1", "n2", "n3"],
        "every": 6,
    }
    result = truearm.measure(planned, "irb120", out=tmp_path, tell=messages.append, **options)
    assert result.finished
    assert len(messages) == len(result.session.entries)
    reasons = result.session.aside_by_reason
    assert {*reasons} == {"beam-break", "not-settled", "scatter"}
    assert sum(reasons.values()) > 3
    assert [(notice.code, notice.level) for notice in result.warnings] == [("not-seen", "note"), ("not-said", "note")]
    assert {p.name for p in tmp_path.iterdir()} == {BEGUN, DATA, LOG, PAGE, "truearm.manifest.json"}
    data = read_csv(tmp_path / DATA)
    assert data.sigma is not None
    assert set(data.sigma[data.has_reading].tolist()) == {VIRTUAL["tracker"].sigma}
    assert data.references is not None
    calibration = truearm.calibrate("irb120", tmp_path / DATA, train=18, model="geometric")
    assert calibration.validation is not None
    assert calibration.validation.position is not None
    assert calibration.validation.position.mean < 1e-4
    page = (tmp_path / PAGE).read_text()
    for word in ("beam-break", "n1", "how well it fits", "not said"):
        assert word in page


def test_what_was_stopped_goes_on_to_the_same_files(plan: Path, tmp_path: Path) -> None:
    whole, options = tmp_path / "whole", {"seed": 1, "disturbed": 0.3}
    arm(plan, whole, **options)
    for stopped in (1, 4, 7):
        part = tmp_path / f"part-{stopped}"
        more: dict[str, Any] = {"device": "measurement-arm", "nests": ["n"], "every": 2, **options}
        with open_campaign(plan, "irb120", part, **more) as campaign:
            assert isinstance(campaign.source, VirtualInstrument)
            assert not any(campaign.source.hides)  # what an arm touches needs no line of sight
            for _ in range(stopped):
                campaign.step()
            step = campaign.session.next
            unfinished = campaign.finish()
        assert step is not None
        assert f"next is {step.label}, {step.names[0]}" in unfinished.warnings[0].message
        messages: list[str] = []
        arm(plan, part, tell=messages.append, **options)
        assert messages[0].startswith(f"Going on after {stopped} entries")
        for name in (LOG, DATA):
            assert (part / name).read_bytes() == (whole / name).read_bytes()
    # What is finished stays as it is, and a torn line is said and measured again.
    log, before = (whole / LOG).read_bytes(), (whole / DATA).read_bytes()
    assert arm(plan, whole, **options).finished
    (whole / LOG).write_bytes(log[:-7])
    (notice,) = [notice for notice in arm(plan, whole, **options).warnings if notice.code == "torn-line"]
    assert notice.level == "note"
    assert ((whole / LOG).read_bytes(), (whole / DATA).read_bytes()) == (log, before)


def test_a_folder_that_began_otherwise_is_refused(plan: Path, tmp_path: Path) -> None:
    out, about = tmp_path / "out", tmp_path / "about.yaml"
    words = "truearm: truearm-about/1\nunits: {}\ninstrument: {serial: %s}\n"
    about.write_text(words % "A")
    arm(plan, out, about=about)
    changes: tuple[tuple[dict[str, Any], str], ...] = (
        ({"targets": ["nest"], "nests": ["m"]}, "nests"),
        ({"every": 3}, "every"),
        ({"seed": 2}, "source of readings"),
        ({"most_deviation": 1e-3}, "limit of what is kept"),
        ({"payload": "1kg,0mm,0mm,50mm"}, "source of readings"),
    )
    for change, word in changes:
        with pytest.raises(InputError, match=f"began with another {word}") as refusal:
            arm(plan, out, about=about, **change)
        assert refusal.value.parameter == "out"
    about.write_text(words % "B")
    with pytest.raises(InputError, match="another instrument or robot"):
        arm(plan, out, about=about)
    changed = truearm.load_robot("irb120").with_values({"a_3": 0.271})
    for robot, got in (("irb1600", "'irb1600'; allowed: irb120."), (changed, "with other values'; allowed: irb120 as")):
        with pytest.raises(InputError, match="began with another robot") as refusal:
            truearm.measure(plan, robot, out=out, device="measurement-arm", nests=["n"], every=2)
        assert got in str(refusal.value)
    plan.write_text(MEASURED_PLAN.replace("P2,20", "P2,21"))
    with pytest.raises(InputError, match="another plan"):
        arm(plan, out)
    (out / BEGUN).unlink()
    with pytest.raises(InputError, match="nothing says of which plan"):
        arm(plan, out)
    (out / BEGUN).write_text("{}")
    with pytest.raises(InputError, match="how a measuring began"):
        arm(plan, out)


@pytest.fixture
def watching(tmp_path: Path) -> dict[str, Any]:
    """What is given for a folder that is watched, with a first row in it."""
    inside, mapping = tmp_path / "in", tmp_path / "map.yaml"
    inside.mkdir()
    mapping.write_text(MAPPING)
    (inside / "p.csv").write_text("Pose,Point,X,Y,Z\nP1,a,1,2,3\n")
    return {"watch": inside, "mapping": mapping, "targets": ["a"], "out": tmp_path / "out"}


def test_rows_of_a_folder_become_the_same_file_as_the_import_of_the_table(
    plan: Path, watching: dict[str, Any], tmp_path: Path
) -> None:
    rows = "".join(f"P{k},{name},{k}.5,{n},3\n" for k in (1, 2, 3) for n, name in enumerate("ab"))
    (watching["watch"] / "p.csv").write_text(f"Pose,Point,X,Y,Z\n{rows}")
    assert truearm.measure(plan, "irb120", **watching | {"targets": ["a", "b"]}).finished
    imported = truearm.import_table(watching["watch"] / "p.csv", watching["mapping"]).data
    data = read_csv(tmp_path / "out" / DATA)
    assert (data.labels, data.targets) == (imported.labels, imported.targets)
    np.testing.assert_array_equal(data.position, imported.position)
    np.testing.assert_array_equal(data.joints, imported.joints)
    assert data.number is not None


def test_a_folder_into_which_nothing_comes_is_left_after_a_while(plan: Path, watching: dict[str, Any]) -> None:
    row = (watching["watch"] / "p.csv").rename(watching["out"].with_name("later.csv"))
    result = truearm.measure(plan, "irb120", timeout=0.0, **watching)
    assert (result.files, result.data) == ((), None)
    assert "unfinished" in {notice.code for notice in result.warnings}
    row.rename(watching["watch"] / "p.csv")
    assert truearm.measure(plan, "irb120", timeout=0.0, **watching).files == (DATA, PAGE)


def test_ctrl_c_ends_with_what_is_there(plan: Path, watching: dict[str, Any]) -> None:
    messages: list[str] = []

    def tell(line: str) -> None:
        messages.append(line)
        threading.Timer(0.05, os.kill, (os.getpid(), signal.SIGINT)).start()

    result = truearm.measure(plan, "irb120", tell=tell, **watching)
    assert len(messages) == 1
    assert result.files == (DATA, PAGE)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_program_sends_readings_to_a_port(plan: Path, tmp_path: Path) -> None:
    def talk(line: str) -> None:
        if not line.startswith("Listening"):
            return
        words = line.replace(",", "").split()
        number, token = int(words[words.index("port") + 1]), words[words.index("token") + 1]

        def send() -> None:
            with socket.create_connection(("127.0.0.1", number), timeout=5.0) as stream:
                stream.sendall(f"token {token}\n".encode())
                for k in range(3):
                    stream.sendall(f"reading a {k} 2 3 mm\n".encode())
                while stream.recv(4096):
                    pass

        threading.Thread(target=send, daemon=True).start()

    result = truearm.measure(plan, "irb120", out=tmp_path / "out", listen=0, targets=["a"], timeout=10.0, tell=talk)
    assert result.finished
    assert len(result.session.kept) == 3
    assert "token" not in result.command


@pytest.mark.parametrize("device", VIRTUAL)
def test_every_virtual_instrument_reads_what_its_device_reads(device: str, tmp_path: Path) -> None:
    assert VIRTUAL[device].reads_where
    plan = seen_by(device, 12, tmp_path)
    with open_campaign(plan, "irb120", tmp_path / "out", device=device, truth="nominal", noise=1e-9) as campaign:
        source = campaign.source
        assert isinstance(source, VirtualInstrument)
        seen = sight(campaign)
        assert seen is not None
        assert campaign.placed is not None
        while not campaign.session.done:
            campaign.step()
        for entry in campaign.session.kept:
            assert entry.reading is not None
            k = campaign.session.labels.index(entry.label)
            place, _ = campaign.placed.world_poses(campaign.joints[k : k + 1], entry.name)
            np.testing.assert_allclose(entry.reading.position, place[0], atol=1e-7)
            assert (entry.reading.quaternion is None) == (device in ("tracker", "measurement-arm"))
        result = campaign.measured()
        assert len(result.session.kept) >= 12
        assert sight(campaign) is None


MORE_ROWS = "".join(f"Q{k},{5 * k},10,20,{k},30,40\n" for k in range(9))


def test_what_an_instrument_that_drifts_does_to_the_nests_is_said(plan: Path, tmp_path: Path) -> None:
    plan.write_text(MEASURED_PLAN + MORE_ROWS)
    options: dict[str, Any] = {"nests": ["n1", "n2", "n3"], "noise": 1e-5}
    result = arm(plan, tmp_path / "out", drift=3e-4, **options)
    (notice,) = [n for n in result.warnings if n.code == "nests-moved"]
    assert notice.level == "warning"
    drift = result.drift
    assert drift is not None
    assert drift.largest == pytest.approx(3e-4, rel=0.2)
    assert np.isfinite(drift.moved).all()
    assert json.loads(json.dumps(result.summary()))["nests"]["rounds"] == len(drift.rounds)
    assert "nests-moved" not in {n.code for n in arm(plan, tmp_path / "calm", **options).warnings}


def test_a_drift_of_one_nest_is_told_where_nothing_states_a_deviation(plan: Path, tmp_path: Path) -> None:
    plan.write_text(MEASURED_PLAN + MORE_ROWS)
    rng = np.random.default_rng(0)
    codes = []
    for number, drift in enumerate((0.0, 0.5)):
        with open_campaign(plan, "irb120", tmp_path / str(number), listen=0, targets=["a"], nests=["n"], every=1) as c:
            while (step := c.session.next) is not None:
                x, y, z = (1e-2 * rng.standard_normal(3) + 2.0).tolist()
                x += drift * step.configuration / 11 if step.kind == "nests" else 100.0 * step.configuration
                position = np.array([x, y, z]) * 1e-3
                c._written(c.session.judged(Reading(step.names[0], 1.0, position, label=step.label)))
            result = c.measured()
        codes.append("nests-moved" in {notice.code for notice in result.warnings})
        assert "No reading is corrected for it." in "\n".join(result.lines())
    assert codes == [False, True]


def test_a_nest_behind_the_arm_or_a_box_is_left_out_and_told(planned: Path, tmp_path: Path) -> None:
    options: dict[str, Any] = {"device": "tracker", "nests": ["n1", "n2", "n3"], "every": 2, "truth": "nominal"}
    with open_campaign(planned, "irb120", tmp_path / "open", **options) as campaign:
        assert isinstance(campaign.source, VirtualInstrument)
        behind = [(k, name) for k, names in enumerate(campaign.source.hides) for name in names]
        assert behind
        seen = sight(campaign)
        assert seen is not None
        assert seen.names == ("n1", "n2", "n3")
        assert seen.visible.tolist() == [name not in campaign.source.hides[0] for name in seen.names]
        assert seen.outstanding.all()
    result = truearm.measure(planned, "irb120", out=tmp_path / "open", **options)
    left = [e for e in result.session.entries if e.event == "left" and e.is_nest]
    for entry in left:
        assert entry.words == "the arm is in the line of sight"
    boxes = tmp_path / "boxes.yaml"
    boxes.write_text(
        "truearm: truearm-constraints/1\nunits: {length: mm, angle: deg}\n"
        "keep_out: {wall: {x: [-2000, 2000], y: [-3000, 3000], z: [-2000, -1900]}, shed: {z: [-1, 2000]}}\n"
    )
    hidden = truearm.measure(planned, "irb120", out=tmp_path / "shed", constraints=boxes, **options)
    assert hidden.drift is None
    (notice,) = [n for n in hidden.warnings if n.code == "nests-missed"]
    assert "the box 'shed' is in the line of sight" in notice.message
    with pytest.raises(InputError, match="another source of readings"):
        truearm.measure(planned, "irb120", out=tmp_path / "shed", **options)


#: Joint positions [deg] of an IRB 120 at which a device reads its target, at which it reads none, and why not.
SEEN_AND_BLIND: dict[str, tuple[str, str, str]] = {
    "measurement-arm": ("0,0,0,0,0,0", "-160,90,-90,0,0,0", "a target must be within 3000 mm of the base of the arm"),
    "optical-cmm-planar": ("0,0,0,0,0,0", "180,0,0,0,0,0", "9 targets of the artefact or more must look at the"),
    "markers": ("10,10,5,20,29,40", "180,0,0,0,0,0", "must look at the cameras within 60 deg"),
}


def test_a_plan_of_which_an_instrument_sees_nothing_is_refused_before_anything_is_logged(tmp_path: Path) -> None:
    tracker = ("", "180,0,0,0,0,0", "a reflector must look at the tracker within 30 deg")
    for device, (_, blind, why) in {"tracker": tracker, **SEEN_AND_BLIND}.items():
        few, pairs = plan_of(tmp_path, blind, blind.replace("0,0,0", "0,0,9")), 6 if device == "tracker" else 2
        with pytest.raises(InputError, match=f"nothing of this plan can be read with the {device}") as refusal:
            truearm.measure(few, "irb120", out=tmp_path / "out", device=device, truth="nominal", nests=["n"])
        assert refusal.value.parameter == "plan"
        assert why in str(refusal.value)
        assert f"got 0 of {pairs} pairs of configuration and target" in str(refusal.value)
        assert f"`truearm plan` with `device={device}`" in str(refusal.value)
        assert not (tmp_path / "out").exists()


def test_what_an_instrument_does_not_see_of_a_plan_is_counted_before_the_first_reading(tmp_path: Path) -> None:
    for device, (seen, blind, why) in SEEN_AND_BLIND.items():
        few = plan_of(tmp_path, blind, seen, blind.replace("0,0,0", "0,0,9"))
        with open_campaign(few, "irb120", tmp_path / device, device=device, truth="nominal") as campaign:
            assert len(campaign.session) == 0
            (notice,) = [one for one in campaign.notices if one.code == "not-seen"]
            assert notice.level == "warning"
            assert f"{device} 1 of 3 pairs of configuration and target can be read, none at 2 of 3" in notice.message
            assert why in notice.message
            while not campaign.session.done:
                campaign.step()
            assert len(campaign.session.kept) == 1
            codes = [one.code for one in campaign.measured().warnings]
        assert "not-seen" in codes
        assert "many-left-out" not in codes  # it would say the same again


def test_a_plan_that_says_what_is_read_asks_for_no_more_and_a_real_instrument_is_not_judged(
    planned: Path, tmp_path: Path
) -> None:
    options: dict[str, Any] = {"device": "tracker", "truth": "nominal"}
    with open_campaign(planned, "irb120", tmp_path / "all", **options) as campaign:
        (notice,) = [one for one in campaign.notices if one.code == "not-seen"]
        assert isinstance(campaign.source, VirtualInstrument)
        names = np.array(campaign.session.targets)
        seen = [names[campaign.source.visible(k)] for k in range(24)]
    assert notice.level == "note"
    assert f"{sum(map(len, seen))} of 72 pairs of configuration and target can be read, some at every" in notice.message
    path = with_reads(planned, tmp_path / "reads.csv", ["; ".join(at) for at in seen])
    with open_campaign(path, "irb120", tmp_path / "reads", **options) as campaign:
        assert "not-seen" not in {one.code for one in campaign.notices}
    few = plan_of(tmp_path, "180,0,0,0,0,0")
    with open_campaign(few, "irb120", tmp_path / "port", listen=0, targets=["1"]) as campaign:
        assert "not-seen" not in {one.code for one in campaign.notices}


def test_the_column_reads_of_a_plan_says_what_is_asked_for(planned: Path, tmp_path: Path) -> None:
    path = with_reads(planned, tmp_path / "reads.csv", ["2", *["1; 3"] * 23])
    for targets, count in ((["1", "2", "3"], 1 + 2 * 23), (["smr"], 24), (["2", "smr"], 25)):
        with open_campaign(path, "irb120", tmp_path / targets[0] / str(count), listen=0, targets=targets) as campaign:
            assert campaign.session.outstanding == count
    result = truearm.measure(path, "irb120", out=tmp_path / "virtual", device="tracker", targets=["1", "2", "3"])
    first = result.session.labels[0]
    assert not [e for e in result.session.kept if e.name == "2" and e.label != first]  # nobody asked for it


def test_lengths_that_cannot_be_meant_are_told(plan: Path, tmp_path: Path) -> None:
    for unit, metres, told in (("mm", 1e-3, False), ("m", 1.0, True), ("um", 1e-6, True)):
        with open_campaign(plan, "irb120", tmp_path / unit, listen=0, targets=["a"]) as campaign:
            places = campaign.robot.world_poses(campaign.joints)[0] * 1e3  # as a number, in mm
            for label, place in zip(campaign.session.labels, places, strict=True):
                campaign._written(campaign.session.judged(Reading("a", 1.0, place * metres, label=label)))
            warnings = [n for n in campaign.measured().warnings if n.code == "units-unlikely"]
        assert bool(warnings) == told, unit
        assert all(n.level == "warning" and "Check the unit of lengths" in n.message for n in warnings)


def test_an_instrument_without_noise_reads_the_twin_that_is_simulated(planned: Path, tmp_path: Path) -> None:
    result = truearm.measure(planned, "irb120", out=tmp_path, device="tracker", seed=5, noise=0.0).data
    simulated = truearm.simulate("irb120", truth="random", seed=5, poses=planned, noise=0.0).data
    assert result is not None
    places = {
        (simulated.labels[c], simulated.targets[t]): place
        for c, t, place in zip(simulated.configuration, simulated.target, simulated.position, strict=True)
    }
    assert result.has_position.sum() >= 24
    for c, t, place in zip(result.configuration, result.target, result.position, strict=True):
        if np.isfinite(place).all():
            np.testing.assert_allclose(place, places[result.labels[c], result.targets[t]], atol=1e-12)


def test_the_page_says_the_whole_call_and_no_token(plan: Path, tmp_path: Path) -> None:
    result = arm(plan, tmp_path / "out", seed=3, disturbed=0.2, most_deviation=1e-3)
    assert result.command == (
        f"truearm.measure({str(plan)!r}, 'irb120', out={str(tmp_path / 'out')!r}, device='measurement-arm', seed=3, "
        "disturbed=0.2, nests=['n'], every=2, most_deviation=0.001)"
    )
    again = eval(result.command.replace(str(tmp_path / "out"), str(tmp_path / "again")), {"truearm": truearm})
    assert (tmp_path / "again" / DATA).read_bytes() == (tmp_path / "out" / DATA).read_bytes()
    assert again.finished
    with open_campaign(plan, "irb120", tmp_path / "port", listen=0, token="x" * 20, targets=["a"]) as campaign:
        assert "x" * 20 not in campaign.measured().command


def test_a_point_of_which_no_reading_can_be_kept_is_left_out_after_twenty(plan: Path, tmp_path: Path) -> None:
    result = arm(plan, tmp_path / "out", most_settling=0.0, nests=[])
    assert result.session.aside_by_reason == {"not-settled": 60}
    assert len(result.session.left_out) == 3
    assert result.files == ()


REFUSED: tuple[tuple[dict[str, Any], str, str], ...] = (
    ({"device": None}, "device, watch, listen", "nobody says"),
    ({"device": None, "mapping": "m.yaml"}, "watch", "no folder is given, and `mapping` belongs to one"),
    ({"device": None, "token": "x" * 20}, "listen", "no port is given, and `token` belongs to one"),
    ({"device": None, "seed": 1}, "device", "no virtual device is given, and `seed` belongs to one"),
    ({"device": None, "watch": "", "mapping": "m.yaml"}, "watch", "no folder is given; got ''"),
    ({"listen": 0}, "device, listen", "one source"),
    ({"device": "traker"}, "device", "Did you mean tracker"),
    ({"mapping": "m.yaml"}, "mapping", "belongs to `watch`"),
    ({"token": "x" * 20}, "token", "belongs to `listen`"),
    ({"device": None, "listen": 0, "seed": 1}, "seed", "belongs to `device`"),
    ({"device": None, "listen": 0}, "targets", "which targets"),
    ({"device": None, "listen": 0, "targets": ["a"], "token": "short"}, "token", "keeps others out"),
    ({"device": None, "listen": 0, "targets": ["n"]}, "targets, nests", "a target and for a nest"),
    ({"device": None, "watch": "nowhere", "targets": ["a"]}, "mapping", "what the columns"),
    ({"nests": [" "]}, "nests", "a name belongs here"),
    ({"nests": ["n1", "n2", "n1"]}, "nests", "named twice; got 'n1'"),
    ({"targets": ["1", 1]}, "targets", "named twice; got '1'"),
    ({"targets": ["x"]}, "targets", "no such target"),
    ({"command": ""}, "command", ""),
)


def test_what_cannot_be_measured_is_refused_before_anything_is_begun(plan: Path, tmp_path: Path) -> None:
    for value, parameter, word in REFUSED:
        with pytest.raises(InputError) as refusal:
            arm(plan, tmp_path / "out", **value)
        assert word in str(refusal.value)
        assert refusal.value.parameter == parameter
        assert not (tmp_path / "out").exists()
    with socket.create_server(("127.0.0.1", 0)) as taken:
        with pytest.raises(InputError, match=r"another program listens on this port.*which is free") as refusal:
            truearm.measure(plan, "irb120", out=tmp_path / "out", listen=taken.getsockname()[1], targets=["a"])
        assert refusal.value.parameter == "listen"
    assert not (tmp_path / "out" / LOG).exists()
    plan.write_text(MEASURED_PLAN + MEASURED_PLAN.splitlines()[1] + "\n")
    with pytest.raises(InputError, match="appears twice") as refusal:
        arm(plan, tmp_path / "out")
    assert refusal.value.parameter == "plan"


def test_a_device_that_goes_through_no_plan_says_why_and_what_to_do(plan: Path, tmp_path: Path) -> None:
    for device in (one for one in DEVICES if one.name not in VIRTUAL):
        with pytest.raises(InputError, match=device.no_plan) as refusal:
            arm(plan, tmp_path / "out", device=device.name)
        assert refusal.value.parameter == "device"
        assert f"'truearm simulate' finds the postures of {device.name}" in str(refusal.value)
        assert not (tmp_path / "out").exists()


def test_folders_that_cannot_be_watched_are_refused(plan: Path, watching: dict[str, Any]) -> None:
    out = watching["out"]
    out.mkdir()
    with pytest.raises(InputError, match="is written to") as refusal:
        truearm.measure(plan, "irb120", **watching | {"watch": out})
    assert refusal.value.parameter == "out"
    inside = watching["mapping"].rename(out / DATA)
    with pytest.raises(InputError, match="would be overwritten"):
        truearm.measure(plan, "irb120", **watching | {"mapping": inside})


def test_a_virtual_robot_comes_from_the_stops_of_the_plan(plan: Path, tmp_path: Path) -> None:
    lag = 1e-3
    robot = truearm.load_robot("irb120").with_effects(["approach"])
    truth = robot.with_values({f"approach_{k}": lag for k in range(1, 7)})
    header, *rows = plan.read_text().splitlines()
    table = [row.split(",") for row in rows]
    stops = [",".join(str(float(cell) - 2.0) for cell in row[1:]) for row in table]
    names = ",".join(f"approach_{k} [deg]" for k in range(1, 7))
    plan.write_text("\n".join([f"{header},{names}", *(f"{a},{b}" for a, b in zip(rows, stops, strict=True))]) + "\n")
    came = arm(plan, tmp_path / "stopped", truth=truth, noise=1e-9, nests=[])
    ahead = [",".join([row[0], *(repr(float(cell) + float(np.degrees(lag))) for cell in row[1:])]) for row in table]
    plan.write_text("\n".join([header, *ahead]) + "\n")
    there = arm(plan, tmp_path / "ahead", truth="nominal", noise=1e-9, nests=[])
    places = [[e.reading.position for e in result.session.kept if e.reading] for result in (came, there)]
    np.testing.assert_allclose(places[0], places[1], atol=1e-12)
    assert came.data is not None
    assert came.data.number.tolist() == list(range(1, 2 * len(table), 2))


@pytest.fixture
def command(truearm: Truearm) -> Truearm:
    return truearm


def test_one_line_a_reading_then_what_came_of_it(command: Truearm, plan: Path, tmp_path: Path) -> None:
    words = ("measure", plan, "irb120", "--device", "measurement-arm", "--out", tmp_path / "out")
    run = command(*words, "--most-deviation", "0.5")
    assert run.code == 0
    first, *_, last = run.out.splitlines()
    assert first.startswith("   1  P1 nest  ")
    assert " mm  deviation 0.0" in first
    assert last == f"Written to {tmp_path / 'out'}: measurements.csv, measure.html, and the log readings.csv"
    again = command(*words, "--most-deviation", "0.5", "--json")
    summary = json.loads(again.out)
    assert list(summary)[2:6] == ["finished", "configurations", "targets", "kept"]
    assert (summary["finished"], summary["kept"]) == (True, {"targets": 3, "nests": 0})
    assert "Going on after 3 entries" in again.err
    other = command(*words)
    assert other.code == 2
    assert "limit of what is kept" in other.err


def test_the_token_that_is_given_stands_in_no_file_and_no_line(command: Truearm, plan: Path, tmp_path: Path) -> None:
    token = "this-is-the-secret-of-the-test"
    given = ("--listen", 0, "--token", token, "--target", "a", "--timeout", 0)
    run = command("measure", plan, "irb120", *given, "--out", tmp_path / "out")
    assert run.code == 0
    assert "Listening on 127.0.0.1 port" in run.out
    assert token not in run.out + run.err
    assert all(token.encode() not in path.read_bytes() for path in (tmp_path / "out").iterdir())


@pytest.mark.skipif(sys.platform == "win32", reason="another kind of signals")
@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGKILL])
def test_a_process_that_is_stopped_leaves_its_log_and_goes_on(
    command: Truearm, plan: Path, watching: dict[str, Any], stop: signal.Signals
) -> None:
    inside, out = watching["watch"], watching["out"]
    (inside / "p.csv").write_text("Pose,Point,X,Y,Z\nP1,a,1,2,3\nP2,a,1,2,4\n")
    words = ["measure", plan, "irb120", "--watch", inside, "--map", watching["mapping"], "--out", out, "--target", "a"]
    process = subprocess.Popen(
        [sys.executable, "-m", "truearm", *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    log, until = out / LOG, time.monotonic() + 60.0
    while time.monotonic() < until and not (log.exists() and log.read_text().count("\n") == 3):
        time.sleep(0.05)
    os.kill(process.pid, stop)
    printed, _ = process.communicate(timeout=60.0)
    assert log.read_text().count("\n") == 3
    if stop == signal.SIGINT:
        assert process.returncode == 0
        assert "Warning (unfinished)" in printed
        assert (out / DATA).exists()
    (inside / "q.csv").write_text("Pose,Point,X,Y,Z\nP3,a,1,2,5\n")
    run = command(*words)
    assert run.code == 0
    assert "3 of 3 configurations measured" in run.out
