"""The page Jog and its scene, without a browser: what a user does, and what is then drawn and written."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tests.studio.arms import SCARA
from tests.studio.conftest import Serving
from tests.studio.pressing import below

from truearm.calibration.calibrate import calibrate
from truearm.engine.base.errors import InputError, Notice
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.transform import Transform, quaternion_from_rotation, rotation_from_quaternion
from truearm.planning.plan import plan
from truearm.simulation.jobs import simulate
from truearm.studio import words
from truearm.studio.arrows import Arrows, coloured, error_arrows
from truearm.studio.pages.jog import JogPage
from truearm.studio.pages.plan import PlanPage
from truearm.studio.pages.proof import ProofPage
from truearm.studio.recorded import Recorded
from truearm.studio.serving import Studio

#: An event of a user; those of the studio itself have no client.
BY_A_USER = SimpleNamespace(client=object())


@pytest.fixture
def studio(serving: Serving) -> Studio:
    return serving()


@pytest.fixture
def page(studio: Studio) -> JogPage:
    return next(page for page in studio.window.pages if isinstance(page, JogPage))


def act(element: Any, value: Any = None) -> None:
    """Do with an element what a user does: give it a value, or press it."""
    if value is not None:
        element._impl.value = value
    for callback in element._impl.update_cb:
        callback(SimpleNamespace(client=object(), target=element))


def drag(page: JogPage, position: Any, rotation: Any) -> None:
    page._handle._impl.position = np.asarray(position, float)
    page._handle._impl.wxyz = quaternion_from_rotation(rotation)
    for callback in page._handle._impl_aux.update_cb:
        callback(BY_A_USER)


def eventually(true: Callable[[], bool]) -> bool:
    end = time.monotonic() + 30.0
    while time.monotonic() < end:
        if true():
            return True
        time.sleep(0.02)
    return False


def flange_drawn(page: JogPage) -> tuple[Any, Any]:
    assert page.scene.solid is not None
    names = [link._impl.name for link in page.scene.solid._links]
    link = page.scene.solid._links[names.index("/nominal/flange")]
    return link.position, rotation_from_quaternion(link.wxyz)


def test_it_says_that_no_real_robot_moves(serving: Serving, monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[str] = []

    def noted(notice: Notice) -> str:
        shown.append(f"{notice.code}: {notice.message}")
        return ""

    monkeypatch.setattr(words, "notice", noted)
    serving()
    assert any(text.startswith("no-real-robot: ") and "none moves" in text for text in shown)


def test_a_slider_moves_the_arm_its_numbers_and_its_handle(page: JogPage) -> None:
    act(page._sliders[0], 40.0)
    act(page._sliders[2], -20.0)
    joints = np.deg2rad([40.0, 0.0, -20.0, 0.0, 0.0, 0.0])
    assert page.jogging is not None
    assert page.jogging.joints == pytest.approx(joints)
    p, R = load_robot("irb120").forward(joints, frame="world")
    drawn, turned = flange_drawn(page)
    assert drawn == pytest.approx(p[0], abs=1e-12)
    assert turned == pytest.approx(R[0], abs=1e-9)
    assert page._handle.position == pytest.approx(p[0])
    assert page._place.value == pytest.approx((p[0] * 1e3).tolist(), abs=1e-5)


def test_a_slider_that_is_moved_while_the_arm_moves_is_not_set_back(page: JogPage) -> None:
    page._sliders[1]._impl.value = 25.0  # has come, and waits for what the other slider does
    act(page._sliders[0], 40.0)
    assert page._sliders[1].value == 25.0
    page._sliders[0]._impl.value = 41.0
    act(page._sliders[1])
    assert page._sliders[0].value == 41.0
    act(page._sliders[0])
    assert page.jogging is not None
    assert np.rad2deg(page.jogging.joints[:2]) == pytest.approx([41.0, 25.0])


def test_sliders_show_rounded_numbers_and_the_arm_stands_exactly(page: JogPage, studio: Studio) -> None:
    joints = np.deg2rad([12.345678901234, -7.777777777, 20.000000001, 110.123456, 77.8280976765121, -113.8955578452884])
    page.go_to_joints(joints)
    shown = [slider.value for slider in page._sliders]
    assert shown == [12.35, -7.78, 20.0, 110.12, 77.83, -113.9]
    assert [slider.precision for slider in page._sliders] == [2] * 6
    ends = [end for slider in page._sliders for end in (slider.min, slider.max)]
    assert ends == [round(end, 2) for end in ends]
    act(page._sliders[0])  # what is shown is not taken as typed
    assert page.jogging is not None
    assert page.jogging.joints == pytest.approx(joints, abs=0.0, rel=0.0)
    act(page._sliders[4], 50.0)  # the others stay where they are
    moved = page.jogging.joints
    assert np.delete(moved, 4) == pytest.approx(np.delete(joints, 4), abs=1e-15)
    assert np.rad2deg(moved[4]) == pytest.approx(50.0)
    page.go_to_joints(joints)
    act(page._record, "record")
    file = studio.window.project.folder / "recorded-irb120.csv"
    written = file.read_text().splitlines()[1].split(",")[1:7]
    assert [float(one) for one in written] == pytest.approx(np.rad2deg(joints), abs=1e-12)


def test_meshes_are_sent_once(page: JogPage, studio: Studio, monkeypatch: pytest.MonkeyPatch) -> None:
    sent: list[str] = []
    monkeypatch.setattr(
        studio.window.server.scene, "_queue_scene_message", lambda message: sent.append(type(message).__name__)
    )
    for k in range(6):
        act(page._sliders[k], 10.0 + k)
    assert "SetPositionMessage" in sent
    assert not [name for name in sent if "Mesh" in name]


def test_a_slider_beyond_a_limit_stops_there(page: JogPage) -> None:
    act(page._sliders[2], 500.0)
    assert page.jogging is not None
    assert np.rad2deg(page.jogging.joints[2]) == pytest.approx(70.0)
    assert page._sliders[2].value == pytest.approx(70.0)
    assert "axis_3 is at its limit" in page._said.content


def test_a_pose_in_numbers_and_by_the_handle(page: JogPage) -> None:
    page._place._impl.value, page._turns._impl.value = (350.0, 50.0, 600.0), (0.0, 90.0, 0.0)
    act(page._go)
    drawn, _ = flange_drawn(page)
    assert drawn == pytest.approx([0.35, 0.05, 0.6], abs=1e-9)
    _, turned = flange_drawn(page)
    drag(page, drawn + np.array([0.01, -0.02, 0.0]), turned)
    assert flange_drawn(page)[0] == pytest.approx([0.36, 0.03, 0.6], abs=1e-9)
    act(page._frame, "tool")
    assert page._place.value == (0.0, 0.0, 0.0)
    page._place._impl.value = (0.0, 0.0, 10.0)
    act(page._go)
    assert np.linalg.norm(flange_drawn(page)[0] - [0.36, 0.03, 0.6]) == pytest.approx(0.01)


def test_out_of_reach_is_said_where_the_user_drags_and_the_arm_stays(page: JogPage) -> None:
    before, turned = flange_drawn(page)
    drag(page, [4.0, 0.0, 0.0], turned)
    assert "cannot go to this pose" in page._said.content
    assert flange_drawn(page)[0] == pytest.approx(before)


def test_branches_are_offered_and_taken(page: JogPage) -> None:
    for slider, value in zip(page._sliders, (10.0, 20.0, -15.0, 30.0, 40.0, -50.0), strict=True):
        act(slider, value)
    before, _ = flange_drawn(page)
    act(page._find)
    offered = page._branch.options
    assert len(offered) == 9
    assert offered[1] == "front-up-noflip (reached)"
    other = next(name for name in offered[2:] if name.endswith("(reached)"))
    act(page._branch, other)
    assert page.jogging is not None
    assert np.abs(np.rad2deg(page.jogging.joints) - [10.0, 20.0, -15.0, 30.0, 40.0, -50.0]).max() > 20.0
    assert flange_drawn(page)[0] == pytest.approx(before, abs=1e-9)
    act(page._sliders[0], 0.0)
    assert page._branch.options == ("nearest",)


def test_a_branch_that_is_refused_is_not_shown_as_chosen(page: JogPage, studio: Studio) -> None:
    for slider, value in zip(page._sliders, (10.0, 20.0, -15.0, 30.0, 40.0, -50.0), strict=True):
        act(slider, value)
    act(page._find)
    refused = next(name for name in page._branch.options if "(beyond-limit)" in name)
    taken = next(name for name in page._branch.options[2:] if name.endswith("(reached)"))
    for before in ("nearest", taken):
        act(page._branch, before)
        act(page._branch, refused)
        assert "the arm cannot go there" in below(studio.window, page._branch)
        assert page._branch.value == before


def test_numbers_of_the_controller(serving: Serving, tmp_path: Path) -> None:
    folder = tmp_path / "fanuc"
    folder.mkdir()
    (folder / "truearm-studio.yaml").write_text("truearm: truearm-studio/1\nrobot: lrmate200ic\n")
    page = next(p for p in serving(folder).window.pages if isinstance(p, JogPage))
    assert page._whose.value == "controller"
    act(page._sliders[1], 30.0)
    assert page.jogging is not None
    assert np.rad2deg(page.jogging.joints[1:3]) == pytest.approx([30.0, -30.0])
    act(page._whose, "model")
    assert page._sliders[2].value == pytest.approx(-30.0)


def test_poses_are_those_of_the_pendant_where_joints_are(studio: Studio, page: JogPage) -> None:
    assert page._frame.options == ("base", "world", "tool")
    act(page._frame, "world")
    studio.window.edit(robot="lrmate200id")  # its controller's base is 330 mm above the model's
    assert page._frame.options == ("base", "world", "controller", "tool")
    assert (page._whose.value, page._frame.value) == ("controller", "controller")
    height = page._place.value[2]
    act(page._frame, "base")
    assert page._place.value[2] - height == pytest.approx(330.0)
    studio.window.edit(payload="2kg,0mm,0mm,50mm")
    assert page._frame.value == "base"  # the arm is the same
    act(page._frame, "controller")
    studio.window.edit(robot="irb120")
    assert page._frame.value == "base"


def test_configurations_are_recorded_and_played(page: JogPage, studio: Studio) -> None:
    file = studio.window.project.folder / "recorded-irb120.csv"
    act(page._sliders[0], 40.0)
    act(page._record, "record")
    act(page._sliders[0], -40.0)
    act(page._record, "record")
    assert file.read_text().splitlines()[1:] == ["P1,40.0,0.0,0.0,0.0,0.0,0.0", "P2,-40.0,0.0,0.0,0.0,0.0,0.0"]
    assert studio.window.project.changes() == ()
    assert "P1, P2" in page._recorded.content
    page._speed._impl.value = 1000.0
    act(page._play, "play")
    assert page.jogging is not None
    arm, playing = page.jogging, page._playing
    assert playing is not None
    assert eventually(playing.is_set)
    assert np.rad2deg(arm.joints[0]) == pytest.approx(-40.0)
    act(page._record, "remove last")
    assert len(file.read_text().splitlines()) == 2


def test_another_robot_has_its_own_list_and_its_own_numbers(page: JogPage, studio: Studio) -> None:
    """Joint positions do not say of which arm they are."""
    act(page._whose, "model")
    act(page._record, "record")
    studio.window.edit(robot="lrmate200id")
    assert page._whose.value == "controller"
    assert page._list.value == "recorded-lrmate200id.csv"
    assert "Nothing recorded yet" in page._recorded.content
    act(page._record, "record")
    act(page._whose, "model")
    act(page._list, "mine.csv")
    studio.window.edit(payload="2kg,0mm,0mm,50mm")
    assert (page._whose.value, page._list.value) == ("model", "mine.csv")  # the arm is the same
    studio.window.edit(robot="irb120")
    assert page._list.value == "recorded-irb120.csv"
    assert "Recorded: P1" in page._recorded.content
    files = sorted(path.name for path in studio.window.project.folder.glob("*.csv"))
    assert files == ["recorded-irb120.csv", "recorded-lrmate200id.csv"]


def test_what_is_recorded_is_undone_and_done_again(page: JogPage, studio: Studio) -> None:
    window, file = studio.window, studio.window.project.folder / "recorded-irb120.csv"
    window.edit(seed=7)
    texts: list[str | None] = [None]
    for angle in (10.0, 20.0, 30.0):
        act(page._sliders[0], angle)
        act(page._record, "record")
        texts.append(file.read_text())
    act(page._record, "remove last")
    assert file.read_text() == texts[2]
    window._undo_edit()
    assert "P1, P2, P3" in page._recorded.content
    assert file.read_text() == texts[3]
    assert "Undone: recorded-irb120.csv." in _notices(studio)
    assert window.project.settings.seed == 7
    for text in texts[2::-1]:
        window._undo_edit()
        assert (file.read_text() if file.exists() else None) == text
    assert "Nothing recorded yet" in page._recorded.content
    for text in texts[1:]:
        window._redo_edit()
        assert file.read_text() == text
    assert "Done again: recorded-irb120.csv." in _notices(studio)
    assert window.project.changes() == ()
    assert window.project.settings.seed == 7


def test_it_says_what_is_undone_and_where_there_is_nothing(page: JogPage, studio: Studio) -> None:
    studio.window._undo_edit()
    assert "There is nothing to undo." in _notices(studio)
    studio.window.edit(seed=7, loss="huber")
    studio.window._undo_edit()
    assert "Undone: seed, loss." in _notices(studio)
    studio.window._redo_edit()
    assert "Done again: seed, loss." in _notices(studio)
    studio.window._redo_edit()
    assert "There is nothing to redo." in _notices(studio)


def test_a_motion_ends_where_the_user_moves_the_arm(page: JogPage) -> None:
    act(page._sliders[0], 40.0)
    act(page._record, "record")
    act(page._sliders[0], -40.0)
    page._speed._impl.value = 5.0
    act(page._play, "play")
    playing = page._playing
    act(page._sliders[1], 10.0)
    assert playing is not None
    assert playing.is_set()
    assert page.jogging is not None
    where = page.jogging.joints
    time.sleep(0.2)
    assert np.array_equal(page.jogging.joints, where)


@pytest.mark.parametrize("name", ["../recorded.csv", "/etc/passwd.csv", "recorded.txt", "a\nb.csv"])
def test_no_other_file_is_recorded_into(page: JogPage, studio: Studio, name: str, tmp_path: Path) -> None:
    page._list._impl.value = name
    act(page._record, "record")
    assert "Refused" in _notices(studio) or "refused" in _notices(studio)
    assert sorted(p.name for p in studio.window.project.folder.iterdir()) == ["truearm-studio.yaml"]


def test_files_of_others_are_not_recorded_into(page: JogPage, studio: Studio) -> None:
    file = studio.window.project.folder / "plan.csv"
    headings = ",".join(f"joint_{k} [deg]" for k in range(1, 7))
    file.write_text(f"configuration,{headings},reads\nc1,1,2,3,4,5,6,x\n")
    before = file.read_text()
    act(page._list, "plan.csv")
    act(page._record, "record")
    assert "was not recorded here" in _notices(studio)
    assert file.read_text() == before
    act(page._play, "play")
    assert page._playing is not None


def test_what_another_program_writes_while_a_pose_is_recorded_is_not_overwritten(
    page: JogPage, studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It writes once the page has looked at the file: a new one first, then one that was recorded here."""
    file, with_one = studio.window.project.folder / "recorded-irb120.csv", Recorded.with_one

    def late(known: Recorded, joints: Any) -> Recorded:
        file.write_text("theirs")
        return with_one(known, joints)

    for there in (False, True):
        file.unlink(missing_ok=True)
        if there:
            act(page._record, "record")
        with monkeypatch.context() as meanwhile:
            meanwhile.setattr(Recorded, "with_one", late)
            act(page._record, "record")
        assert "another program has changed this file" in below(studio.window, page._record)
        assert file.read_text() == "theirs"


def _notices(studio: Studio) -> str:
    return "".join(studio.window._told)


def test_nominal_and_calibrated_stand_where_the_instrument_saw_the_robot(studio: Studio, page: JogPage) -> None:
    base = Transform((1.0, 2.0, 0.5), (0.0, 0.0, 0.0, 1.0))
    robot = load_robot("irb120").with_frames(base, {"b'><i>": (0.0, 0.0, 0.1)})
    found = robot.with_values({"a_3": 0.2712, "theta_offset_2": -1.565})
    folder = studio.window.project.folder / "result"
    folder.mkdir()
    (folder / "calibrated.yaml").write_text(robot_text(found))
    studio.window.refresh()
    assert page.scene.ghost is not None
    assert np.linalg.norm(studio.window.server.initial_camera.look_at - np.array([1.0, 2.0, 0.5])) < 0.3
    assert page._arm.options == ("nominal", "calibrated")
    q = np.deg2rad([10.0, 20.0, 0.0, 0.0, 30.0, 0.0])
    for slider, value in zip(page._sliders, np.rad2deg(q), strict=True):
        act(slider, float(value))
    for drawn, arm in ((page.scene.solid, robot), (page.scene.ghost, found)):
        assert drawn is not None
        assert drawn._links[-1].position == pytest.approx(arm.forward(q, frame="world")[0][0], abs=1e-9)
    act(page._arm, "calibrated")
    assert page.jogging is not None
    assert page.jogging.joints == pytest.approx(q)
    act(page._tip, "b'><i>")
    assert page._handle.position == pytest.approx(found.forward(q, frame="world", target="b'><i>")[0][0], abs=1e-9)
    act(page._ghost, False)
    assert not page.scene.ghost._root.visible


def test_another_robot_is_drawn_anew_and_fixtures_beside_it(studio: Studio, page: JogPage) -> None:
    robot = load_robot("katana450").with_fixtures(
        {
            "ball": ("point", Transform((0.2, 0.0, 0.1))),
            "wall": ("plane", Transform((0.3, 0.0, 0.0), (0.7071067811865476, 0.0, 0.7071067811865476, 0.0))),
            "nest": ("frame", Transform((0.1, 0.2, 0.0))),
        }
    )
    (studio.window.project.folder / "arm.yaml").write_text(robot_text(robot))
    studio.window.edit(robot="arm.yaml")
    assert len(page._sliders) == 5
    assert len(page.scene._parts["fixtures"]) == 6
    page.scene.show_boxes({"table": (np.array([-np.inf, 0.1, -0.2]), np.array([np.inf, 0.5, 0.0]))})
    assert len(page.scene._parts["boxes"]) == 2  # and its name
    studio.window.edit(dark=True)
    assert page.scene.solid is not None
    assert page.scene.solid.robot.name == "katana450"


def test_the_result_of_another_robot_is_neither_drawn_nor_moved(studio: Studio, page: JogPage) -> None:
    placed = Transform((1.0, 2.0, 0.5), (0.0, 0.0, 0.0, 1.0))
    found = load_robot("irb120").with_frames(placed, {"1": (0.0, 0.0, 0.1)}).with_values({"a_3": 0.2712})
    folder = studio.window.project.folder / "result"
    folder.mkdir()
    (folder / "calibrated.yaml").write_text(robot_text(found))
    studio.window.refresh()
    assert page.scene.ghost is not None
    assert page._other.content == ""
    act(page._arm, "calibrated")
    act(page._ghost, False)
    studio.window.edit(payload="2kg,0mm,0mm,50mm")
    assert not page.scene.ghost._root.visible  # what is drawn anew is hidden as before
    studio.window.edit(robot="kr5")
    assert page.scene.ghost is None
    assert page._arm.options == ("nominal",)
    assert page._tip.options == ("flange",)
    assert page.scene.solid is not None
    assert page.scene.solid.robot.base == Transform()
    assert page.jogging is not None
    assert page.jogging.robot.name == "kr5"
    assert "(other-robot)" in page._other.content
    assert "irb120" in page._other.content
    studio.window.edit(robot="irb120")
    assert page._arm.options == ("nominal", "calibrated")
    assert page._other.content == ""


class OpenWindow:
    """Where a window has the things of the scene: it keeps the place of what is drawn anew under the same name."""

    def __init__(self, studio: Studio) -> None:
        self._buffer = studio.window.server.scene._websock_interface.get_message_buffer()
        self._seen, self._places = -1, dict[str, Any]()

    def places(self) -> dict[str, Any]:
        for number, message in sorted(self._buffer.message_from_id.items()):
            name = getattr(message, "name", "")
            if number <= self._seen or message.entity_type != "scene":
                continue
            known = self._places.setdefault(name, {"position": (0.0, 0.0, 0.0), "wxyz": (1.0, 0.0, 0.0, 0.0)})
            known |= {part: value for part, value in vars(message).items() if part in known}
            if message.lifecycle_phase == "remove":
                del self._places[name]
        self._seen = self._buffer.message_counter - 1
        return self._places


def test_an_open_window_draws_another_robot_where_a_new_window_does(studio: Studio, page: JogPage) -> None:
    """Also what stands turned as all begins: of that viser tells a window nothing."""
    folder, window = studio.window.project.folder, OpenWindow(studio)
    turned = Transform((0.3, 0.2, 0.4), (0.5, 0.5, 0.5, 0.5))
    robots = {
        "turned.yaml": load_robot("irb120").with_frames(turned, {}).with_fixtures({"nest": ("frame", turned)}),
        "upright.yaml": load_robot("irb120").with_fixtures({"nest": ("frame", Transform())}),
        "scara.yaml": SCARA,
    }
    for name, robot in robots.items():
        (folder / name).write_text(robot_text(robot))
    for name in ("irb120", "scara.yaml", "irb120", "panda", "irb1200_5_0.9", "irb120", "turned.yaml", "upright.yaml"):
        studio.window.edit(robot=name)
        page.scene.show_balls("tests", np.zeros((1, 3)), np.full(1, 0.1))
        drawn = dict(window.places())
        assert drawn == OpenWindow(studio).places()
        assert {"/handle", "/tip", "/nominal/flange", "/frames/floor"} <= drawn.keys()
        act(page._sliders[0], 60.0)


def test_errors_are_magnified_and_the_factor_is_said(page: JogPage) -> None:
    points = np.array([[0.1, 0.0, 0.2], [0.3, 0.1, 0.2], [np.nan, 0.0, 0.0]])
    errors = np.array([[1e-4, 0.0, 0.0], [0.0, -5e-4, 0.0], [0.0, 0.0, 0.0]])
    made = error_arrows(points, errors, 500.0)
    assert made.segments[:, 1] - made.segments[:, 0] == pytest.approx(500.0 * errors[:2])
    assert made.words == "errors x 500, largest 0.5 mm"
    assert made.colours.shape == (2, 3)
    page.scene.show_arrows("proof", made)
    assert page.scene._parts["proof"][1].text == "errors x 500, largest 0.5 mm"
    page.scene.show_arrows("proof", None)
    assert page.scene._parts["proof"] == []
    page.scene.show_arrows("none", error_arrows(points[2:], errors[2:], 1.0))
    assert page.scene._parts["none"] == []
    for factor in (0.5, 2001.0, float("nan")):
        with pytest.raises(InputError):
            error_arrows(points, errors, factor)


def test_many_points_go_in_one_upload(page: JogPage, studio: Studio, monkeypatch: pytest.MonkeyPatch) -> None:
    sent: list[str] = []
    queue = studio.window.server.scene._queue_scene_message

    def noted(message: Any) -> None:
        sent.append(type(message).__name__)
        queue(message)

    monkeypatch.setattr(studio.window.server.scene, "_queue_scene_message", noted)
    rng = np.random.default_rng(0)
    cloud = rng.normal(size=(5000, 3))
    page.scene.show_points("candidates", cloud, coloured(cloud[:, 2], -1.0, 1.0))
    page.scene.show_arrows("errors", error_arrows(cloud[:500], 1e-4 * cloud[:500], 1000.0))
    assert sent.count("PointCloudMessage") == 1
    assert sent.count("ArrowMessage") == 1
    assert isinstance(page.scene._parts["candidates"], list)
    assert isinstance(error_arrows(cloud, cloud, 1.0), Arrows)


def test_colours_go_from_dark_to_light() -> None:
    colours = coloured(np.array([-1.0, 0.0, 0.5, 1.0, 2.0]), 0.0, 1.0).astype(int)
    assert np.array_equal(colours[0], colours[1])
    assert np.array_equal(colours[3], colours[4])
    assert (np.diff(colours[1:4] @ [0.2126, 0.7152, 0.0722]) > 0).all()
    assert np.array_equal(coloured(np.array([3.0]), 1.0, 1.0)[0], colours[0])


def test_colours_stand_out_from_a_light_and_from_a_dark_window() -> None:
    colours = coloured(np.linspace(0.0, 1.0, 61), 0.0, 1.0) / 255.0
    linear = np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
    # From linear sRGB (IEC 61966-2-1) to XYZ by its white D65, and to CIELAB.
    xyz = linear @ np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]).T
    root = np.cbrt(xyz / [0.9505, 1.0, 1.089])
    lab = np.stack([116 * root[:, 1] - 16, 500 * (root[:, 0] - root[:, 1]), 200 * (root[:, 1] - root[:, 2])], axis=1)
    dark = 0.011  # of the window's dark grey, (26, 27, 30)
    assert 1.05 / (xyz[:, 1].max() + 0.05) >= 3.0  # as WCAG 2.1 has contrasts
    assert (xyz[:, 1].min() + 0.05) / (dark + 0.05) >= 3.0
    assert (np.diff(lab[::10, 0]) > 1.0).all()
    steps = np.linalg.norm(np.diff(lab[::10], axis=0), axis=1)
    assert steps.max() < 1.1 * steps.min()


def test_errors_of_a_result_are_drawn_from_before_to_after(studio: Studio, page: JogPage) -> None:
    window, folder = studio.window, studio.window.project.folder
    simulate("irb120", truth="random", poses=60, noise=5e-5, seed=1, out=folder / "data.csv")
    found = calibrate("irb120", folder / "data.csv", model="geometric", seed=3, out=folder / "result")
    window.project.look()
    window.edit(data="data.csv", seed=3)
    arrows = next(page._arrows for page in window.pages if isinstance(page, ProofPage))
    act(arrows._draw)
    assert window.wait(60.0)
    assert eventually(lambda: bool(page.scene._parts.get("errors")))
    assert found.validation is not None
    largest = found.validation.position_norms.max() * 1e3
    assert page.scene._parts["errors"][1].text == f"errors x 200, largest {largest:.3g} mm"
    act(arrows._share, 0.0)
    act(arrows._factor, 50.0)
    largest = found.nominal.position_norms.max() * 1e3
    assert page.scene._parts["errors"][1].text == f"errors x 50, largest {largest:.3g} mm"
    # Of another split the figures would be others than those of the result.
    window.edit(seed=4)
    act(arrows._draw)
    assert window.wait(60.0)
    assert eventually(lambda: "split otherwise" in _notices(studio))
    act(arrows._hide)
    assert page.scene._parts["errors"] == []
    assert arrows._factor.disabled


def test_a_plan_is_the_commands_and_drawn_in_space(studio: Studio, page: JogPage, tmp_path: Path) -> None:
    window = studio.window
    planning = next(page for page in window.pages if isinstance(page, PlanPage))
    window.edit(plan={"poses": "30", "candidates": 60})
    act(planning._run)
    assert window.wait(60.0)
    assert eventually(lambda: bool(page.scene._parts.get("chosen")))
    made = plan("irb120", poses=30, candidates=60, noise=1e-4, out=tmp_path / "plan.csv")
    assert (window.project.folder / "plan.csv").read_bytes() == (tmp_path / "plan.csv").read_bytes()
    assert len(page.scene._parts["chosen"][0].points) == 30
    assert made.made.robot.forward(made.joints, frame="world")[0] == pytest.approx(
        page.scene._parts["chosen"][0].points, abs=1e-6
    )
    assert made.answer[0].split(".")[0] in planning._said.content
    act(planning._cloud, False)
    assert page.scene._parts["chosen"] == page.scene._parts["predicted"] == []
    window.edit(plan={"poses": "many"})
    act(planning._run)
    assert window.wait(60.0)
    assert eventually(lambda: "a number of poses belongs here" in _notices(studio))
    # What it wrote is a list of configurations that can be played.
    page._list._impl.value = "plan.csv"
    page._show_recorded()
    assert page._recorded.content.count(", ") == 6
