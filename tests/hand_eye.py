"""A camera and a board on twins: configurations that see it, corners with noise, poses from them, and pictures.

The camera is a pinhole of 2448 x 2048 dots whose lens is 2300 dots long (8 mm before dots of 3.45 um); the board has
14 x 10 squares of 25 mm and is seen from 350 to 750 mm.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from truearm.board.pictures import Charuco
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform, quaternion_from_rotation, rotation_from_vector, rotation_vector
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin

BOARD: Final = Charuco(14, 10, 0.025, 0.018, "5X5_250")
#: What small pictures show: larger squares.
PICTURED: Final = Charuco(8, 6, 0.04, 0.03, "4X4_50")
PICTURED_TEXT: Final = "8x6,40mm,30mm,4X4_50"
LENS: Final = 2300.0
SIZE: Final = (2448, 2048)
#: How the camera sits on the flange, or the board where the camera stands beside the robot.
MOUNT: Final = Transform(
    (0.05, 0.02, 0.06), tuple(quaternion_from_rotation(rotation_from_vector(np.array([0.1, -0.15, 0.4]))).tolist())
)
#: Where the other one stands in front of a UR5e: the board flat, with its z into the table as OpenCV has it.
BOARD_PLACE: Final = np.array([[1.0, 0, 0, 0.45], [0, -1, 0, 0.05], [0, 0, -1, 0.05], [0, 0, 0, 1]])
CAMERA_PLACE: Final = np.array([[0, 1.0, 0, 0.5], [1, 0, 0, 0.05], [0, 0, -1, 0.95], [0, 0, 0, 1]])

#: What a UR5e reaches with its flange, roughly: farther places only take time.
_SHOULDER: Final = np.array([0.0, 0.0, 0.16])
_REACH: Final = 0.75


@dataclass(frozen=True, eq=False)
class Cell:
    """A robot drawn from its priors, as it is and as it is known, with a camera or a board on its flange.

    Attributes
    ----------
    nominal, twin
        The base frame is the world.
    on_flange
        ``camera`` or ``board``.
    """

    nominal: Robot
    twin: Twin
    on_flange: str

    @property
    def beside(self) -> Array:
        """Where the other one stands, ``(4, 4)``."""
        return BOARD_PLACE if self.on_flange == "camera" else CAMERA_PLACE

    def views(self, joints: Array) -> Array:
        """Return the true ``T_camera_board``, ``(n, 4, 4)``."""
        moving = self.twin.frames(joints)[self.on_flange]
        if self.on_flange == "camera":
            return np.asarray(np.linalg.inv(moving) @ self.beside)
        return np.asarray(np.linalg.inv(self.beside) @ moving)


def cell(seed: int, on_flange: str = "camera", robot: str = "ur5e") -> Cell:
    nominal = load_robot(robot).with_frames(Transform(), {on_flange: MOUNT})
    drawn = truth_twin(nominal, "random", np.random.default_rng(seed))
    return Cell(nominal, replace(drawn, robot=drawn.robot.with_frames(Transform(), {on_flange: MOUNT})), on_flange)


def configurations(cell: Cell, count: int, rng: np.random.Generator) -> Array:
    """Return joint positions at which the whole board is in the picture, from all sides, ``(count, joints)``."""
    found: list[Array] = []
    while sum(map(len, found)) < count:
        n = 12 * count
        z, around, roll = 1 - rng.uniform(0, 0.36, n), rng.uniform(0, 2 * np.pi, n), rng.uniform(-np.pi, np.pi, n)
        flat = np.sqrt(1 - z * z)
        out = np.column_stack([flat * np.cos(around), flat * np.sin(around), -z])  # towards the camera, in the board
        aside = np.column_stack([rng.uniform(-0.07, 0.07, n), rng.uniform(-0.05, 0.05, n), np.zeros(n)])
        eye = aside + rng.uniform(0.35, 0.75, n)[:, None] * out
        x = np.cross([0.3, 1.0, 0.2], -out)
        x /= np.linalg.norm(x, axis=1, keepdims=True)
        R = np.stack([x, np.cross(-out, x), -out], axis=2) @ rotation_from_vector(roll[:, None] * np.array([0, 0, 1.0]))
        board_from_camera = np.zeros((n, 4, 4))
        board_from_camera[:, :3, :3], board_from_camera[:, :3, 3], board_from_camera[:, 3, 3] = R, eye, 1.0
        views: Array = np.asarray(np.linalg.inv(board_from_camera), float)
        views = views[_inside(views, 60.0)][: 2 * count]
        goal = cell.beside @ (np.linalg.inv(views) if cell.on_flange == "camera" else views)
        flange = goal @ np.linalg.inv(_matrix(MOUNT))
        goal = goal[np.linalg.norm(flange[:, :3, 3] - _SHOULDER, axis=1) < _REACH]
        q = inverse(cell.nominal, goal[:, :3, 3], goal[:, :3, :3], target=cell.on_flange).joints
        q = q[np.isfinite(q).all(axis=1)]
        found.append(q[_inside(cell.views(q), 20.0)])
    return np.concatenate(found)[:count]


def _matrix(place: Transform) -> Array:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = place.rotation, place.translation
    return T


def _inside(views: Array, margin: float) -> NDArray[np.bool_]:
    """Return in which views every corner is in the picture, so many dots from its edge."""
    at = np.abs(projected(views) - np.array(SIZE) / 2)
    return np.asarray((at < np.array(SIZE) / 2 - margin).all(axis=(1, 2)))


def projected(views: Array, scale: float = 1.0) -> Array:
    """Return where the corners are in the picture [px], ``(n, corners, 2)``; the board is `scale` times as large."""
    X = scale * BOARD.places @ np.swapaxes(views[:, :3, :3], 1, 2) + views[:, None, :3, 3]
    return np.asarray(LENS * X[..., :2] / X[..., 2:] + np.array(SIZE) / 2)


def poses_of(corners: Array, start: Array, noise: float) -> tuple[Array, Array, Array]:
    """Return poses from corners by Newton's steps, and the deviations of their places and turns, ``(n,)`` each."""
    found, sigma, sigma_rot = start.copy(), [], []
    for T, seen in zip(found, corners, strict=True):
        for _ in range(4):
            arm = BOARD.places @ T[:3, :3].T
            x, y, z = (arm + T[:3, 3]).T
            zero = np.zeros_like(x)
            by_place = (
                LENS
                / z[:, None, None]
                * np.stack([np.stack([zero + 1, zero, -x / z], 1), np.stack([zero, zero + 1, -y / z], 1)], 1)
            )
            J = np.concatenate([np.cross(arm[:, None, :], by_place), by_place], axis=2).reshape(-1, 6)
            off = (seen - projected(T[None])[0]).ravel()
            step = np.linalg.lstsq(J, off, rcond=None)[0]
            T[:3, :3] = rotation_from_vector(step[:3]) @ T[:3, :3]
            T[:3, 3] += step[3:]
        spread = noise**2 * np.diag(np.linalg.inv(J.T @ J))
        sigma_rot.append(np.sqrt(spread[:3].mean()))
        sigma.append(np.sqrt(spread[3:].mean()))
    return found, np.array(sigma), np.array(sigma_rot)


def table_of(joints: Array, views: Array, sigma: Array, sigma_rot: Array) -> str:
    """Return a table of poses, as ``truearm import hand-eye`` reads it."""
    names = [f"joint_{number} [deg]" for number in range(1, joints.shape[1] + 1)]
    places = ["x [mm]", "y [mm]", "z [mm]", "qw", "qx", "qy", "qz", "sigma [mm]", "sigma_rot [mrad]"]
    rows = [",".join(["configuration", *names, *places])]
    for k, (q, T) in enumerate(zip(joints, views, strict=True)):
        turned = quaternion_from_rotation(T[:3, :3])
        numbers = [*np.degrees(q), *(1e3 * T[:3, 3]), *turned, 1e3 * sigma[k], 1e3 * sigma_rot[k]]
        rows.append(",".join([str(k + 1), *(repr(float(number)) for number in numbers)]))
    return "\n".join(rows) + "\n"


def errors(predicted: Array, true: Array) -> tuple[float, float]:
    """Return the mean distance [m] and angle [rad] of frames ``(n, 4, 4)`` from true ones."""
    turned = predicted[:, :3, :3] @ np.swapaxes(true[:, :3, :3], 1, 2)
    apart = np.linalg.norm(predicted[:, :3, 3] - true[:, :3, 3], axis=1)
    return float(apart.mean()), float(np.linalg.norm(rotation_vector(turned), axis=1).mean())


def frames(robot: Robot, joints: Array, target: str, behind: float = 0.0) -> Array:
    """Return where a target of a robot is in the world, moved back along its z, ``(n, 4, 4)``."""
    p, R = robot.world_poses(joints, target)
    made = np.zeros((len(joints), 4, 4))
    made[:, :3, :3], made[:, :3, 3], made[:, 3, 3] = R, p - behind * R[:, :, 2], 1.0
    return made


def pictures(
    folder: Path, views: Array, rng: np.random.Generator, size: tuple[int, int], lens: Array, k: Array
) -> None:
    """Render the board, through a lens ``(3, 3)`` with distortion ``(5,)``, as 1.png, 2.png and so on."""
    import cv2

    dots = 30
    board = PICTURED
    markers = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    made: Any = cv2.aruco.CharucoBoard((board.columns, board.rows), board.square, board.marker, markers)
    flat = cv2.GaussianBlur(made.generateImage((board.columns * dots, board.rows * dots)), (0, 0), 1.0)
    u, v = np.meshgrid(np.arange(size[0], dtype=float), np.arange(size[1], dtype=float))
    rays = cv2.undistortPoints(np.column_stack([u.ravel(), v.ravel()])[:, None], lens, k)[:, 0]
    rays = np.column_stack([rays, np.ones(len(rays))])
    for number, T in enumerate(views, 1):
        far = (T[:3, 3] @ T[:3, 2]) / (rays @ T[:3, 2])
        on_board = (rays * far[:, None] - T[:3, 3]) @ T[:3, :2] / board.square
        at = [
            ((on_board[:, axis] + count / 2) * dots - 0.5).reshape(size[1], size[0]).astype(np.float32)
            for axis, count in ((0, board.columns), (1, board.rows))
        ]
        grey = cv2.remap(flat, at[0], at[1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=180.0)
        shown = cv2.GaussianBlur(0.7 * grey.astype(float) + 30, (0, 0), 0.7) + rng.normal(0, 2.0, grey.shape)
        cv2.imwrite(str(folder / f"{number}.png"), np.clip(shown, 0, 255).astype(np.uint8))


def table_of_pictures(joints: Array) -> str:
    """Return a table that names pictures 1.png, 2.png and so on."""
    names = ",".join(f"joint_{number} [deg]" for number in range(1, joints.shape[1] + 1))
    rows = [f"configuration,{names},picture"]
    rows += [",".join([str(k), *(repr(float(a)) for a in np.degrees(q)), f"{k}.png"]) for k, q in enumerate(joints, 1)]
    return "\n".join(rows) + "\n"
