"""The scene: robots, frames, fixtures, boxes, points and arrows, drawn with viser.

Everything is uploaded once. What moves is moved by the places of its links.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import viser
from numpy.typing import NDArray

from truearm.engine.base.errors import printable
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parts import Fixture
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform, quaternion_from_rotation
from truearm.studio.arrows import Arrows
from truearm.studio.robot_shape import link_poses, robot_shape
from truearm.studio.solids import Mesh, frame_about

Colour = tuple[int, int, int]
#: One colour for all, or one each.
Colours = NDArray[np.uint8] | Colour
#: Links and joints of the solid robot, and of the ghost.
_SOLID: Final[tuple[Colour, Colour]] = ((222, 225, 230), (84, 96, 114))
_GHOST: Final[tuple[Colour, Colour]] = ((70, 130, 180), (40, 90, 140))
_SEE_THROUGH: Final = 0.35
#: Light from above and from below, and how strong it is.
_SKY: Final[Colour] = (255, 255, 255)
_GROUND: Final[Colour] = (150, 155, 165)
_ALL_ROUND, _SIDEWAYS = 2.1, 0.7
_BOX: Final[Colour] = (214, 140, 60)
_FIXTURE: Final[Colour] = (46, 139, 87)
#: Lines of the floor on white, and on dark grey.
_LINES: Final[dict[bool, tuple[Colour, Colour]]] = {
    False: ((222, 226, 230), (173, 181, 189)),
    True: ((52, 58, 64), (90, 98, 106)),
}
#: Of a triad and of the half of a plane that is drawn, by the length of the arm.
_TRIAD, _PLANE = 0.12, 0.25
_FLOOR: Final = 4.0


class DrawnRobot:
    """A robot whose links can be moved.

    Attributes:
        robot: As it is drawn.
        length: Of the arm along its links [m].
        floor: Where it stands in its base frame: 0, or below where its base frame is in its shoulder [m].
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        robot: Robot,
        meshes: Mapping[str, Mesh] | None = None,
        *,
        ghost: bool = False,
    ) -> None:
        self.robot = robot
        shape = robot_shape(robot, meshes)
        self.length, self.floor = shape.layout.length, -shape.layout.pedestal
        self._root = scene.add_frame(name, show_axes=False)
        self._links: list[Any] = []
        colours, opacity = (_GHOST, _SEE_THROUGH) if ghost else (_SOLID, None)
        for link in shape.links:
            self._links.append(placed(scene.add_frame(f"{name}/{link.name}", show_axes=False)))
            for part, mesh, colour in zip(("body", "joints"), (link.bodies, link.joints), colours, strict=True):
                if len(mesh.faces):
                    scene.add_mesh_simple(
                        f"{name}/{link.name}/{part}",
                        mesh.vertices,
                        mesh.faces,
                        color=colour,
                        opacity=opacity,
                    )

    def move(self, at: Array | Postures) -> None:
        """Show it at joint positions ``(1, joints)`` [rad or m], or a posture, bent as it would be."""
        positions, quaternions = link_poses(self.robot, at)
        for link, position, quaternion in zip(self._links, positions[0], quaternions[0], strict=True):
            link.position, link.wxyz = position, quaternion

    def show(self, visible: bool) -> None:
        """Show or hide it."""
        self._root.visible = visible

    def remove(self) -> None:
        """Take it away."""
        self._root.remove()


class Scene:
    """What all windows of a project see.

    Attributes:
        solid, ghost: The nominal and the calibrated robot, at the place of the latter; None where there is none.
        joints: Joint positions of both, of the model [rad or m], ``(joints,)``.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._server, self._scene = server, server.scene
        self._scene.set_up_direction("+z")
        self._scene.world_axes.visible = False
        self._light()
        self.solid: DrawnRobot | None = None
        self.ghost: DrawnRobot | None = None
        self.joints: Array = np.zeros(0)
        self._tip: Any = None
        self._parts: dict[str, list[Any]] = {}
        self._dark = False
        self._looked: Array | None = None
        self._meshes: Mapping[str, Mesh] | None = None
        self._boxes: dict[str, tuple[Array, Array]] = {}

    @property
    def length(self) -> float:
        """Of the arm along its links [m]; 1 m without one."""
        return 1.0 if self.solid is None else self.solid.length

    def show(
        self,
        nominal: Robot | None,
        calibrated: Robot | None,
        meshes: Mapping[str, Mesh] | None = None,
        *,
        dark: bool,
    ) -> bool:
        """Draw robots; return whether they are others than before.

        A calibrated robot stands where the instrument has found it. The nominal one is put there, too, so that they
        can be compared and both stand right to what was measured.

        Args:
            meshes: What their links look like, as :func:`truearm.studio.robot_shape.robot_shape` takes it.
        """
        if nominal is not None and calibrated is not None:
            nominal = standing_at(nominal, calibrated)
        before = [None if one is None else one.robot for one in (self.solid, self.ghost)]
        other_arm = before != [nominal, calibrated] or meshes is not self._meshes
        self._meshes = meshes
        if not other_arm and dark == self._dark:
            return False
        self._dark = dark
        with self._server.atomic():
            if other_arm:
                self._draw_robots(nominal, calibrated)
            if nominal is not None:
                self._surroundings(nominal if calibrated is None else calibrated)
                self.show_boxes(self._boxes)
        return other_arm

    def move(self, at: Postures, of: Robot) -> None:
        """Show the robots at joint positions.

        Args:
            at, of: A posture, and the robot whose loads are known there; another robot bends in its own way.
        """
        self.joints = at.joints[0].copy()
        with self._server.atomic():
            for robot in (self.solid, self.ghost):
                if robot is not None:
                    robot.move(at if robot.robot is of else at.joints)
        self._server.flush()  # it would wait for others

    def show_tip(self, position: Array, rotation: Array) -> None:
        """Show the frame of the tip that is moved, in the world [m]."""
        if self._tip is None:
            size = _TRIAD * self.length
            self._tip = placed(self._scene.add_frame("/tip", axes_length=size, axes_radius=0.04 * size))
        self._tip.position, self._tip.wxyz = position, quaternion_from_rotation(rotation)

    def show_ghost(self, visible: bool) -> None:
        """Show or hide the calibrated robot."""
        if self.ghost is not None:
            self.ghost.show(visible)

    def show_boxes(self, boxes: Mapping[str, tuple[Array, Array]]) -> None:
        """Draw boxes to keep clear of: lowest and highest corners in the base frame [m], by name."""
        self._boxes = dict(boxes)
        self._clear("boxes")
        if self.solid is None:
            return
        base = self.solid.robot.base
        far = 2.0 * self.length
        for number, (name, corners) in enumerate(self._boxes.items()):
            low, high = (np.clip(corner, -far, far) for corner in corners)
            middle = (low + high) / 2.0
            box = self._scene.add_box(
                f"/boxes/{number}",
                color=_BOX,
                dimensions=tuple((high - low).tolist()),
                opacity=_SEE_THROUGH,
                position=base.rotation @ middle + base.translation,
                wxyz=base.quaternion,
            )
            above = (0.0, 0.0, float(high[2] - middle[2]))
            label = self._scene.add_label(f"/boxes/{number}/name", printable(name), position=above)
            self._parts["boxes"] += [placed(box), placed(label)]

    def show_arrows(self, name: str, arrows: Arrows | None) -> None:
        """Draw arrows in one upload, with the words that say how much they are magnified; None takes them away."""
        self._clear(name)
        if arrows is None or not len(arrows.segments):
            return
        width = 0.004 * self.length
        shown = self._scene.add_arrows(
            f"/{name}/arrows",
            arrows.segments.astype(np.float32),
            arrows.colours,
            shaft_radius=width,
            head_radius=2.4 * width,
            head_length=6.0 * width,
        )
        top = arrows.segments.reshape(-1, 3).max(axis=0)
        middle = arrows.segments[:, 0].mean(axis=0)
        place = (float(middle[0]), float(middle[1]), float(top[2]) + 0.1 * self.length)
        self._parts[name] = [shown, placed(self._scene.add_label(f"/{name}/words", arrows.words, position=place))]

    def show_points(
        self, name: str, points: Array | None, colours: Colours = (70, 130, 180), size: float = 0.012
    ) -> None:
        """Draw points ``(n, 3)`` [m] in the world in one upload; None takes them away.

        Args:
            colours: One for all, or one each ``(n, 3)`` from 0 to 255.
            size: By the length of the arm.
        """
        if points is None or not len(points):
            self._clear(name)
            return
        if known := self._parts.get(name):  # one that is taken away and drawn again flickers
            with self._server.atomic():
                known[0].points, known[0].colors = points.astype(np.float32), np.asarray(colours, np.uint8)
                known[0].point_size = size * self.length
            return
        shown = self._scene.add_point_cloud(
            f"/{name}",
            points.astype(np.float32),
            np.asarray(colours, np.uint8),
            point_size=size * self.length,
            point_shape="circle",
            precision="float32",
        )
        self._parts[name] = [shown]

    def show_lines(self, name: str, segments: Array | None, colours: Colours = (90, 98, 106)) -> None:
        """Draw straight lines ``(n, 2, 3)`` [m] in the world in one upload; None takes them away.

        Args:
            colours: One for all, or one each ``(n, 3)`` from 0 to 255.
        """
        if segments is None or not len(segments):
            self._clear(name)
            return
        # What viser takes for the colour of a line is proportional to its light.
        light = (255.0 * (np.asarray(colours, float) / 255.0) ** 2.2).astype(np.uint8)
        each = np.ascontiguousarray(np.broadcast_to(light.reshape(-1, 1, 3), (len(segments), 2, 3)))
        if (known := self._parts.get(name)) and known[0].points.shape == segments.shape:
            with self._server.atomic():
                known[0].points, known[0].colors = segments.astype(np.float32), each
            return
        self._clear(name)
        shown = self._scene.add_line_segments(
            f"/{name}", segments.astype(np.float32), each, thickness=0.005 * self.length
        )
        self._parts[name] = [shown]

    def show_balls(self, name: str, centres: Array | None, radii: Array, colour: Colour = _FIXTURE) -> None:
        """Draw a few transparent balls about centres ``(n, 3)`` with radii ``(n,)`` [m]; None takes them away."""
        self._clear(name)
        for number, (centre, radius) in enumerate(zip(() if centres is None else centres, radii, strict=False)):
            if np.isfinite(radius) and radius > 0.0:
                ball = self._scene.add_icosphere(
                    f"/{name}/{number}",
                    radius=float(radius),
                    color=colour,
                    opacity=_SEE_THROUGH,
                    position=centre,
                )
                self._parts[name].append(placed(ball))

    def show_names(self, name: str, places: Mapping[str, Array]) -> None:
        """Write words at places [m] in the world; none take them away."""
        if len(known := self._parts.get(name, [])) == len(places):
            with self._server.atomic():
                for label, (words, place) in zip(known, places.items(), strict=True):
                    label.text, label.position = words, place
            return
        self._clear(name)
        for number, (words, place) in enumerate(places.items()):
            self._parts[name].append(placed(self._scene.add_label(f"/{name}/{number}", words, position=place)))

    # -- parts ---------------------------------------------------------------------------------------------

    def _draw_robots(self, nominal: Robot | None, calibrated: Robot | None) -> None:
        for robot in (self.solid, self.ghost):
            if robot is not None:
                robot.remove()
        if self._tip is not None:
            self._tip.remove()
            self._tip = None
        self.solid = None if nominal is None else DrawnRobot(self._scene, "/nominal", nominal, self._meshes)
        self.ghost = (
            None if calibrated is None else DrawnRobot(self._scene, "/calibrated", calibrated, self._meshes, ghost=True)
        )

    def _surroundings(self, robot: Robot) -> None:
        """Draw frames, floor and fixtures around a robot, and say from where it is looked at first."""
        assert self.solid is not None
        self._clear("frames")
        base, size = robot.base, _TRIAD * self.length
        for name, place in (("world", Transform()), ("base", base)):
            if name == "world" and place == base:
                continue
            triad = self._scene.add_frame(
                f"/frames/{name}",
                axes_length=1.6 * size,
                axes_radius=0.05 * size,
                position=place.translation,
                wxyz=place.quaternion,
            )
            self._parts["frames"] += [placed(triad), self._scene.add_label(f"/frames/{name}/name", name)]
        thin, thick = _LINES[self._dark]
        floor = np.array(base.translation) + base.rotation @ np.array([0.0, 0.0, self.solid.floor])
        wide = _FLOOR * self.length
        grid = self._scene.add_grid(
            "/frames/floor",
            width=wide,
            height=wide,
            cell_size=0.1,
            section_size=0.5,
            cell_color=thin,
            section_color=thick,
            position=floor,
            wxyz=base.quaternion,
        )
        self._parts["frames"].append(placed(grid))
        self._clear("fixtures")
        for number, fixture in enumerate(robot.fixtures):
            self._parts["fixtures"] += map(placed, self._fixture(robot, fixture, f"/fixtures/{number}"))
        # The arm stands a little right of the middle and above it: notices float over the corner below on the left.
        look = np.array(base.translation) + base.rotation @ (self.length * np.array([0.02, -0.05, 0.08]))
        look += base.rotation @ np.array([0.0, 0.0, 0.6 * self.solid.floor])
        self._look_at(look, look + base.rotation @ (self.length * np.array([0.85, -1.15, 0.6])))

    def _light(self) -> None:
        """Light the scene from above and all around, without shadows.

        Where the processor draws, viser's picture of a room takes half a minute, and shadows half of the pictures.
        """
        self._scene.configure_environment_map(None)
        self._scene.configure_default_lights(cast_shadow=False)
        self._scene.add_light_hemisphere("/light/sky", sky_color=_SKY, ground_color=_GROUND, intensity=_ALL_ROUND)
        self._scene.add_light_directional("/light/side", intensity=_SIDEWAYS, position=(1.0, -2.0, 0.6))

    def _look_at(self, look: Array, place: Array) -> None:
        """Say from where windows look at first; those that are open follow the robot to another place."""
        start = self._server.initial_camera
        start.look_at, start.position = look, place
        if self._looked is not None and not np.allclose(self._looked, [look, place]):
            for client in self._server.get_clients().values():
                with client.atomic():
                    client.camera.position = place
                    client.camera.look_at = look
        self._looked = np.array([look, place])

    def _fixture(self, robot: Robot, fixture: Fixture, name: str) -> list[Any]:
        kinematics = robot.fixture_kinematics(fixture.name)
        position, turned = kinematics.position[:, 0], kinematics.matrix()[0]
        size = _TRIAD * self.length
        # Not below the fixture's own name: it would be moved with that once more.
        label = self._scene.add_label(f"{name}-name", printable(fixture.name), position=position)
        if fixture.kind == "frame":
            quaternion = quaternion_from_rotation(turned)
            return [
                self._scene.add_frame(
                    name, axes_length=size, axes_radius=0.05 * size, position=position, wxyz=quaternion
                ),
                label,
            ]
        if fixture.kind == "point":
            return [self._scene.add_icosphere(name, radius=0.15 * size, color=_FIXTURE, position=position), label]
        half = _PLANE * self.length
        plane = self._scene.add_box(
            name,
            color=_FIXTURE,
            dimensions=(2.0 * half, 2.0 * half, 0.002),
            opacity=_SEE_THROUGH,
            position=position,
            wxyz=quaternion_from_rotation(frame_about(turned[:, 2])),
        )
        return [plane, label]

    def show_line(self, name: str, points: Array | None, colour: Colour = (214, 140, 60)) -> None:
        """Draw a line through points ``(n, 3)`` [m] in the world in one upload; None takes it away."""
        self._clear(name)
        if points is not None and len(points) > 1:
            segments = np.stack([points[:-1], points[1:]], axis=1).astype(np.float32)
            self._parts[name] = [
                self._scene.add_line_segments(f"/{name}", segments, colour, thickness=2.0, thickness_units="screen")
            ]

    def _clear(self, name: str) -> None:
        for part in reversed(self._parts.get(name, [])):
            part.remove()
        self._parts[name] = []


def placed(node: Any) -> Any:
    """Return a new node of the scene, after telling its place to the windows.

    viser tells no place where all new nodes begin. Where one of the same name has gone a moment before, it tells the
    windows nothing of that either: they take the new node for the former one, and keep its place.
    """
    tell = node._impl.api._queue_scene_message
    tell(viser._messages.SetPositionMessage(node.name, tuple(node.position.tolist())))
    tell(viser._messages.SetOrientationMessage(node.name, tuple(node.wxyz.tolist())))
    return node


def standing_at(nominal: Robot, calibrated: Robot) -> Robot:
    """Return the nominal robot at the place and with the targets of a calibrated one."""
    targets: dict[str, Any] = {}
    for target in calibrated.targets:
        place = calibrated.tool_place(target.name)
        targets[target.name] = place if target.quaternion is not None else place.translation
    return nominal.with_frames(calibrated.base, targets)
