"""Jogging: joints, poses, a handle in the scene, branches; configurations recorded and played."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Any, ClassVar, Final

import numpy as np

from truearm.engine.base.errors import InputError, Notice, Rule
from truearm.engine.base.files import exists, read_bytes
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import quaternion_from_rotation, rotation_from_quaternion
from truearm.studio import words
from truearm.studio.evaluated_with import OTHER_ROBOT
from truearm.studio.jogging import Branch, JogFrame, Jogging
from truearm.studio.pages.jog_path import JogPath
from truearm.studio.pages.jog_views import JogViews
from truearm.studio.pages.robot_looks import RobotLooks
from truearm.studio.recorded import Motion, Recorded, labels_text, list_of, read_recorded
from truearm.studio.scene import Scene, placed
from truearm.studio.window import Window

#: What the flange is called among the targets, and the branch that is taken if none is chosen.
_FLANGE: Final = "flange"
_NEAREST: Final = "nearest"
#: Who counts the joints, as the commands say it.
_WHOSE: Final = ("controller", "model")
#: Of a motion that is played, a picture so often [s].
_PICTURE: Final = 0.04
#: Sliders show so many decimals [deg or mm], and ends that differ by less are the same.
_DECIMALS: Final = 2
_ROUNDING: Final = 1e-6
_SAFE: Final = "This moves a drawing. No real robot is connected to this window, and none moves."


class JogPage:
    """Moves the drawn arm."""

    title: ClassVar[str] = "Jog"

    def __init__(self, window: Window) -> None:
        self._window = window
        self.scene = Scene(window.server)
        self._looks = RobotLooks(window)
        self.jogging: Jogging | None = None
        self._arms: dict[str, Robot] = {}
        self._branches: list[Branch] = []
        self._at_branch = _NEAREST  # what was chosen last, and not refused
        self._latest: dict[str, int] = {}
        self._playing: threading.Event | None = None
        gui = window.gui
        gui.add_html(words.notice(_no_robot()))
        self._arm: Any = gui.add_dropdown(
            "Arm", ("nominal",), hint="whose parameters and joint effects poses are found with"
        )
        self._other = gui.add_html("")
        self._ghost = gui.add_checkbox("Calibrated arm as a shadow", True)
        self._whose: Any = gui.add_dropdown(
            "Numbers of", _WHOSE, initial_value="model", hint="as the pendant shows joints, or the model's"
        )
        self._joints = gui.add_folder("Joints")
        self._sliders: list[Any] = []
        self._taken: list[float] = []  # of each slider: what it was set to here, or what was done with it last
        self._said = gui.add_html("")
        with gui.add_folder("Pose"):
            self._tip: Any = gui.add_dropdown("Tip", (_FLANGE,))
            self._frame: Any = gui.add_dropdown(
                "Axes of", ("base",), hint="controller: as the pendant shows poses; tool: by how much to move from here"
            )
            self._place: Any = gui.add_vector3("x, y, z [mm]", (0.0, 0.0, 0.0), step=0.1)
            self._turns: Any = gui.add_vector3(
                "rx, ry, rz [deg]",
                (0.0, 0.0, 0.0),
                step=0.1,
                hint="about the fixed axes x, y and z, one after the other",
            )
            self._go = gui.add_button("Go to this pose")
            self._handle_on = gui.add_checkbox("Handle to drag in the scene", True)
            self._find = gui.add_button("Find all branches")
            self._branch: Any = gui.add_dropdown("Branch", (_NEAREST,))
        with gui.add_folder("Recorded configurations"):
            self._list: Any = gui.add_text("File", "", hint="every robot has a list of its own, if you name no other")
            self._record = gui.add_button_group("Pose", ("record", "remove last"))
            self._recorded = gui.add_html("")
            self._speed = gui.add_number("Speed [deg/s, mm/s]", 45.0, min=0.1, max=1000.0, step=1.0)
            self._play = gui.add_button_group("Motion", ("play", "stop"))
        self.views = JogViews(window, self.scene)
        self.path = JogPath(window, self.scene, self._jogged, self.play, self.stop)
        self._handle: Any = None
        self._callbacks()

    # What the window asks for ------------------------------------------------------------------------------------

    def refresh(self) -> None:
        """Show the robots as they are now."""
        window = self._window
        nominal, other = window.robot(), window.result_of_another()
        ghost = None if other else window.calibrated()
        self._other.content = words.notice(_other_robot(other, nominal)) if other else ""
        meshes = self._looks.meshes(nominal)
        if self.scene.show(nominal, ghost, meshes, dark=window.project.settings.dark) or self.jogging is None:
            assert self.scene.solid is not None
            self.stop()
            self._arms = {"nominal": self.scene.solid.robot}
            if ghost is not None:
                self._arms["calibrated"] = ghost
            self._arm.options = tuple(self._arms)
            self._ghost.disabled = ghost is None
            self.scene.show_ghost(self._ghost.value)
            if self.jogging is None or self.jogging.robot.name != nominal.name:
                self._list.value = list_of(nominal)
            self._take("calibrated" if self._arm.value == "calibrated" and ghost is not None else "nominal")
        self._show_recorded()
        self.path.refresh()

    # Elements ----------------------------------------------------------------------------------------------------

    def _callbacks(self) -> None:
        window = self._window
        self._arm.on_update(window.action(lambda: self._take(self._arm.value)))
        self._ghost.on_update(window.action(lambda: self.scene.show_ghost(self._ghost.value)))
        self._whose.on_update(window.action(self._count_otherwise))
        self._tip.on_update(window.action(self._other_tip))
        self._frame.on_update(window.action(self._shown))
        self._go.on_click(window.action(self._go_to_numbers))
        self._handle_on.on_update(window.action(self._show_handle))
        self._find.on_click(window.action(self._find_branches))
        self._branch.on_update(window.action(self._take_branch))
        self._list.on_update(window.action(self._show_recorded))
        self._record.on_click(window.action(lambda: self._recording(self._record.value)))
        self._play.on_click(window.action(lambda: self._start() if self._play.value == "play" else self.stop()))

    def _newest(self, name: str, do: Callable[[], None]) -> Callable[[Any], None]:
        """Return a callback of an element that is dragged: of events that wait for each other the last is done."""
        act = self._window.action(do)

        def called(event: Any) -> None:
            if getattr(event, "client", None) is None:
                return
            number = self._latest[name] = self._latest.get(name, 0) + 1
            with self._window.lock:
                if self._latest[name] == number:
                    act(event)

        return called

    def _take(self, name: str) -> None:
        """Jog one of the arms, from where the other was."""
        before = self.jogging
        self.jogging = arm = Jogging(self._arms[name], None if before is None else before.joints)
        known = arm.robot.controller.counts_known
        self._whose.disabled = not known
        if before is not None and known and before.robot.name == arm.robot.name:
            arm.whose = before.whose
        self._arm.value, self._whose.value = name, arm.whose
        tips = (_FLANGE, *(target.name for target in arm.robot.targets))
        self._tip.options = tips
        if before is not None and before.tip in tips:
            arm.tip = before.tip
        self._tip.value = arm.tip or _FLANGE
        frame: JogFrame = self._frame.value
        if before is None or before.robot.name != arm.robot.name or frame not in arm.frames:
            frame = "controller" if arm.whose == "controller" and "controller" in arm.frames else "base"
        self._frame.options = arm.frames
        self._frame.value = frame
        for slider in self._sliders:
            slider.remove()
        self._sliders = []
        with self._joints:
            for k, (joint, unit) in enumerate(zip(arm.robot.joints, arm.units, strict=True)):
                low, high = _shown_range(*arm.ranges()[k])
                slider = self._window.gui.add_slider(f"{joint.name} [{unit}]", low, high, 10.0**-_DECIMALS, low)
                slider.on_update(self._newest(f"joint {k}", partial(self._slid, k)))
                self._sliders.append(slider)
        self._taken = [slider.value for slider in self._sliders]
        if self._handle is not None:
            self._handle.remove()
        handle = self._window.server.scene.add_transform_controls(
            "/handle", scale=0.22 * self.scene.length, line_width=3.0, depth_test=False, visible=self._handle_on.value
        )
        self._handle = placed(handle)
        self._handle.on_update(self._newest("handle", self._dragged))
        self._moved()

    def _slid(self, joint: int) -> None:
        arm = self._jogged()
        if self._sliders[joint].value == self._taken[joint]:
            return  # what is shown is rounded, and the arm stays exactly where it is
        self._taken[joint] = self._sliders[joint].value
        arm.set_number(joint, float(self._taken[joint]))
        self._moved()

    def _dragged(self) -> None:
        arm = self._jogged()
        try:
            arm.drag_to(np.array(self._handle.position), rotation_from_quaternion(np.array(self._handle.wxyz)))
        except InputError as error:
            self._said.content = words.paragraph(words.refusal(error))
            return
        self._moved(handle=False)

    def _go_to_numbers(self) -> None:
        frame: JogFrame = self._frame.value
        self._jogged().go_to_numbers(frame, self._place.value, self._turns.value)
        self._moved()

    def _find_branches(self) -> None:
        self._branches = self._jogged().branches()
        names = [f"{branch.name} ({branch.status.value})" for branch in self._branches]
        self._branch.options = (_NEAREST, *names)
        self._branch.value = self._at_branch = _NEAREST
        if not names:
            self._said.content += words.paragraph("No other way to this pose was found.")

    def _take_branch(self) -> None:
        names = [f"{branch.name} ({branch.status.value})" for branch in self._branches]
        if self._branch.value in names:
            branch = self._branches[names.index(self._branch.value)]
            if not branch.status.usable:
                self._branch.value = self._at_branch
                raise InputError("the arm cannot go there", came=branch.name, cure=branch.status.advice)
            self._jogged().go(branch.joints)
            self._moved(branches=False)
        self._at_branch = self._branch.value

    def _other_tip(self) -> None:
        self._jogged().tip = None if self._tip.value == _FLANGE else self._tip.value
        self._moved()

    def _count_otherwise(self) -> None:
        self._jogged().whose = self._whose.value
        self._shown()
        self._show_recorded()

    def go_to_joints(self, joints: Array, arm: str | None = None) -> None:
        """Move the drawn arm, ``nominal`` or ``calibrated``, to joint positions of the model [rad or m]."""
        if arm is not None and arm in self._arms and arm != self._arm.value:
            self._take(arm)
        self._jogged().go(joints)
        self._moved()

    # What follows from where the arm is --------------------------------------------------------------------------

    def _jogged(self) -> Jogging:
        self.stop()
        if self.jogging is None:
            raise InputError("there is no robot to move", cure="Choose one on the page Cell.")
        return self.jogging

    def _moved(self, *, handle: bool = True, branches: bool = True) -> None:
        """Draw the arm where it is, and everything that follows."""
        arm = self.jogging
        assert arm is not None
        self.scene.move(arm.at, arm.robot)
        if branches and self._branches:
            self._branches = []
            self._branch.options = (_NEAREST,)
            self._branch.value = self._at_branch = _NEAREST
        self._shown(handle=handle)

    def _shown(self, *, handle: bool = True) -> None:
        arm = self.jogging
        if arm is None:
            return
        position, rotation = arm.pose("world")
        with self._window.server.atomic():
            self.scene.show_tip(position, rotation)
            if handle and self._handle is not None:
                self._handle.position, self._handle.wxyz = position, quaternion_from_rotation(rotation)
            for k, (slider, number, (low, high)) in enumerate(
                zip(self._sliders, arm.numbers, arm.ranges(), strict=True)
            ):
                if slider.value != self._taken[k]:
                    continue  # somebody has moved it meanwhile, and that is done next
                low, high = _shown_range(low, high)
                shown = min(max(round(number, _DECIMALS), low), high)
                if abs(slider.min - low) > _ROUNDING or abs(slider.max - high) > _ROUNDING:
                    slider.min, slider.max = min(low, slider.value), max(high, slider.value)
                    slider.value = shown
                    slider.min, slider.max = low, high
                elif slider.value != shown:
                    slider.value = shown
                self._taken[k] = slider.value
            self._place.value, self._turns.value = arm.pose_numbers(self._frame.value)
            self._said.content = "".join(words.paragraph(text) for text in arm.words())
            self.views.moved(arm)

    def _show_handle(self) -> None:
        self._handle.visible = self._handle_on.value
        self._shown()

    # Recorded configurations -------------------------------------------------------------------------------------

    def _file(self) -> Any:
        name = self._list.value.strip()
        if not name.lower().endswith(".csv"):
            raise InputError(
                "a table of configurations belongs here", parameter="File", came=name, allowed="a CSV file"
            )
        return self._window.project.path(name, "File")

    def _read(self) -> Recorded | None:
        arm, file = self.jogging, self._file()
        if arm is None or not exists(file):
            return None
        return read_recorded(file, arm.robot)

    def _recording(self, what: str) -> None:
        arm, file = self._jogged(), self._file()
        there = read_bytes(file) if exists(file) else None
        known = self._read() or Recorded((), np.zeros((0, len(arm.joints))), arm.whose)
        before = None if there is None else known.text(arm.robot)
        if before is not None and there != before.encode():
            raise InputError(
                "this file was not recorded here, and is not changed", where=file.name, cure="Record into another one."
            )
        if what == "record":
            known = known.with_one(arm.joints)
        elif len(known.labels) > 1:
            known = known.without_last()
        else:
            raise InputError("the only configuration of a file is not removed", where=file.name)
        name = self._window.project.relative(file)
        self._window.edit({name: known.text(arm.robot)}, known={name: before})

    def _show_recorded(self) -> None:
        try:
            known = self._read()
        except InputError as error:
            self._recorded.content = words.paragraph(words.refusal(error))
            return
        text = "Nothing recorded yet." if known is None else f"Recorded: {labels_text(known.labels)}"
        self._recorded.content = words.paragraph(text)

    def _start(self) -> None:
        """Play the configurations of the file, from where the arm is."""
        self.play_file(self._window.project.relative(self._file()), float(self._speed.value))

    def play_file(self, name: str, speed: float, *, from_its_start: bool = False) -> Array:
        """Play the configurations of a file, from where the arm is or from the first of them.

        Args:
            speed: Of the fastest joint [deg/s, or mm/s for prismatic joints].

        Returns:
            Configurations on the way, ``(n, joints)`` [rad or m].
        """
        arm, file = self._jogged(), self._window.project.path(name)
        if not exists(file):
            raise InputError("there is nothing to play", parameter="File", came=name, cure="Record a pose.")
        joints = read_recorded(file, arm.robot).joints
        if not from_its_start:
            joints = np.concatenate([arm.joints[None], joints])
        motion = Motion.through(joints, speed, arm.robot)
        self.play(motion)
        return motion.on_the_way()

    def play(self, motion: Motion) -> None:
        """Play a motion.

        Raises:
            InputError: If it leads beyond the limits of a joint.
        """
        tried = Jogging(self._jogged().robot)
        for joints in motion.joints:
            tried.go(joints)
        self._playing = over = threading.Event()
        threading.Thread(target=self._run, args=(motion, over), daemon=True).start()

    def _run(self, motion: Motion, over: threading.Event) -> None:
        began = time.monotonic()
        while True:
            passed = time.monotonic() - began
            with self._window.lock:
                if over.is_set() or self._window.stopped or self.jogging is None:
                    return
                self.jogging.go(motion.at(passed))
                self._moved()
                if passed >= motion.duration:
                    over.set()
                    return
            over.wait(_PICTURE)

    def stop(self) -> None:
        """End a motion that is played."""
        if self._playing is not None:
            self._playing.set()
            self._playing = None


def _shown_range(low: float, high: float) -> tuple[float, float]:
    """Return the ends of a slider: within the range in which a number can go, with the decimals that are shown."""
    step = 10.0**_DECIMALS
    least = math.ceil((low - _ROUNDING) * step) / step
    most = math.floor((high + _ROUNDING) * step) / step
    return least, max(most, round(least + 1.0 / step, _DECIMALS))


def _other_robot(other: str, robot: Robot) -> Notice:
    text = f"The result is of {other} and not of {robot.name}: the calibrated arm is not drawn, and cannot be moved."
    return OTHER_ROBOT(text)


NO_REAL_ROBOT: Final = Rule("no-real-robot", "note", "jogging moves a drawing")


def _no_robot() -> Notice:
    return NO_REAL_ROBOT(_SAFE)
