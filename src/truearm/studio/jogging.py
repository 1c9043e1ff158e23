"""An arm that is jogged: joint by joint, by poses of its tip, on other branches, within its limits."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.base.units import from_si, to_si
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import Controller, JointsOf
from truearm.engine.robot.frames import Frame, frame_and_tip
from truearm.engine.robot.inverse.branch_search import REACHED, Candidates
from truearm.engine.robot.inverse.branches import branch_rule
from truearm.engine.robot.inverse.kinematics import NEAR_SINGULAR, reach
from truearm.engine.robot.inverse.pose_solver import Orientation, PoseStatus, PoseTask
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import FIXED_XYZ_ANGLES, IDENTITY
from truearm.engine.robot.urdf_writing import counting
from truearm.robot_files.jobs import inverse

#: In whose axes a pose is given: those of the base, of the instrument, of the controller's base, or of the tip as it
#: stands now.
JogFrame = Literal["base", "world", "controller", "tool"]
#: What counts of a pose for arms of few joints.
_FREEDOM: Final[dict[int, Orientation]] = {3: "free", 4: "free", 5: "axis"}
#: Rounding that is no way beyond a limit [rad or m].
_ROUNDING: Final = 1e-9
#: A pose that is dragged to may turn a joint by so much in one step [rad or m]; further away all branches are tried.
_A_LITTLE: Final = 0.3
#: Where branches have no names: from so many postures others are looked for, so many are offered, and two differ by so
#: much in a joint [rad or m].
_SEEDS, _MOST, _APART = 48, 8, 0.35


@dataclass(frozen=True, eq=False)
class Branch:
    """A way to reach a pose."""

    name: str  #: As ``ik`` calls it.
    joints: Array  #: Joint positions of the model [rad or m], ``(joints,)``.
    status: PoseStatus  #: Whether the arm can go there.


class Jogging:
    """An arm at joint positions, which are kept within its limits.

    Attributes:
        robot: The arm: what poses mean is computed with its parameters and joint effects.
        joints: Of the model [rad or m], ``(joints,)``.
        tip: Name of the target that is moved; None for the flange.
        whose: Whose numbers joint positions are given in.
        orientation: How much of the orientation of poses counts.
    """

    def __init__(self, robot: Robot, joints: Array | None = None) -> None:
        self.robot = robot
        self.low, self.high = np.array([joint.limits or (-np.inf, np.inf) for joint in robot.joints]).T
        self.tip: str | None = None
        self.whose: JointsOf = "controller" if robot.controller.counts_otherwise else "model"
        self.orientation: Orientation = _FREEDOM.get(len(robot.joints), "full")
        fits = joints is not None and joints.shape == self.low.shape and np.isfinite(joints).all()
        self.joints: Array = np.clip(joints if fits and joints is not None else _start(robot), self.low, self.high)
        self._angles = np.zeros((1, 3))
        self._bent: Postures | None = None
        self._pose: tuple[Postures, str | None, Array, Array] | None = None
        self._reaches: dict[str | None, float] = {}

    @property
    def at(self) -> Postures:
        """The arm at its joint positions with the loads there, which are found once."""
        if self._bent is None or not np.array_equal(self._bent.joints[0], self.joints):
            self._bent = self.robot.loaded(self.joints[None].copy())
        return self._bent

    @property
    def frames(self) -> tuple[JogFrame, ...]:
        """In whose axes poses can be given: the controller's where its frames stand elsewhere than the model's."""
        controller = self.robot.controller
        elsewhere = controller.base != IDENTITY or controller.flange != IDENTITY
        return ("base", "world", *(("controller",) if elsewhere else ()), "tool")

    @property
    def units(self) -> list[str]:
        """``deg`` or ``mm`` of each joint."""
        return ["deg" if joint.kind == "revolute" else "mm" for joint in self.robot.joints]

    @property
    def numbers(self) -> list[float]:
        """Joint positions in the numbers of `whose` [deg or mm]."""
        shown = self._shown(self.joints)
        return [float(from_si(float(value), unit)) + 0.0 for value, unit in zip(shown, self.units, strict=True)]

    def ranges(self) -> list[tuple[float, float]]:
        """Return from where to where each number can go while the others stay [deg or mm].

        A controller that counts joints together moves two of them with one number, and both have limits.
        """
        found = []
        rates = self._rates()
        for number, unit, rate in zip(self.numbers, self.units, rates.T, strict=True):
            with np.errstate(divide="ignore", invalid="ignore"):
                ways = np.stack([(self.low - self.joints) / rate, (self.high - self.joints) / rate])
            ways = np.sort(ways[:, np.abs(rate) > 0.0], axis=0)
            # Where a joint has no limits a number shows two turns, or 2 m, to either side.
            free = 4.0 * math.pi if unit == "deg" else 2.0
            least, most = float(ways[0].max()), float(ways[1].min())
            least, most = (least if math.isfinite(least) else -free), (most if math.isfinite(most) else free)
            low, high = (float(from_si(way, unit)) for way in (min(least, 0.0), max(most, 0.0)))
            found.append((number + low, number + high))
        return found

    def set_number(self, joint: int, number: float) -> None:
        """Move one joint, from 0, to a number of `whose` [deg or mm], as far as the limits allow.

        Raises:
            InputError: If it is no finite number.
        """
        if not math.isfinite(number):
            raise InputError("a number belongs here", where=self.robot.joints[joint].name, came=number)
        low, high = self.ranges()[joint]
        way = to_si(min(max(number, low), high) - self.numbers[joint], self.units[joint])
        self.joints = np.clip(self.joints + way * self._rates()[:, joint], self.low, self.high)

    def go(self, joints: Array) -> None:
        """Go to joint positions of the model ``(joints,)`` [rad or m].

        Raises:
            InputError: If one is beyond its limits, with those that are.
        """
        beyond = (joints < self.low - _ROUNDING) | (joints > self.high + _ROUNDING) | ~np.isfinite(joints)
        if beyond.any():
            k = int(np.argmax(beyond))
            unit = self.units[k]
            low, high, came = (from_si(float(v), unit) for v in (self.low[k], self.high[k], joints[k]))
            raise InputError(
                "a joint would be beyond its limits",
                where=self.robot.joints[k].name,
                came=f"{came:.6g} {unit}",
                allowed=f"{low:.6g} to {high:.6g} {unit}",
            )
        self.joints = np.clip(joints, self.low, self.high)

    def pose(self, frame: Frame = "base") -> tuple[Array, Array]:
        """Return the tip's position ``(3,)`` [m] and rotation ``(3, 3)`` in the axes of a frame that stands still."""
        at, known = self.at, self._pose
        if known is None or known[0] is not at or known[1] != self.tip:
            p, R = self.robot.forward(at, frame="world", target=self.tip)
            known = self._pose = (at, self.tip, p[0], R[0])
        _, _, position, rotation = known
        if frame == "world":
            return position, rotation
        base, behind = frame_and_tip(self.robot, frame, self.tip)
        position, rotation = position + rotation @ np.array(behind.translation), rotation @ behind.rotation
        return (position - np.array(base.translation)) @ base.rotation, base.rotation.T @ rotation

    def pose_numbers(self, frame: JogFrame) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Return x, y, z [mm] and turns about the fixed axes x, y and z, one after the other [deg].

        In the tool they are zero: there numbers say by how much to move.
        """
        if frame == "tool":
            return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        p, R = self.pose(frame)
        self._angles = FIXED_XYZ_ANGLES.numbers(R[None], self._angles)
        # Rounded to what nobody measures, so that no -0 and no 89.99999999 is shown.
        x, y, z = (np.round(p * 1e3, 6) + 0.0).tolist()
        a, b, c = (np.round(np.rad2deg(self._angles[0]), 6) + 0.0).tolist()
        return (x, y, z), (a, b, c)

    def go_to_numbers(self, frame: JogFrame, position: tuple[float, ...], turns: tuple[float, ...]) -> PoseStatus:
        """Go to a pose as :meth:`pose_numbers` writes it, or in the tool by so much.

        Raises:
            InputError: If a number is not finite, or as :meth:`go_to`.
        """
        if not all(math.isfinite(v) for v in (*position, *turns)):
            raise InputError("a pose is six numbers", came=", ".join(f"{v:g}" for v in (*position, *turns)))
        p = np.array(position) / 1e3
        R = FIXED_XYZ_ANGLES.matrices(np.deg2rad([turns]))[0]
        if frame == "tool":
            from_p, from_R = self.pose("base")
            return self.go_to(from_p + from_R @ p, from_R @ R)
        return self.go_to(p, R, frame)

    def go_to(self, position: Array, rotation: Array, frame: Frame = "base") -> PoseStatus:
        """Go to a pose of the tip, on the branch nearest to where the arm is.

        Raises:
            InputError: If the arm cannot be there, with what is missing; it stays where it is.
        """
        joint_solutions = inverse(
            self.robot,
            position[None],
            None if self.orientation == "free" else rotation[None],
            target=self.tip,
            frame=frame,
            seed_joints=self.joints,
            orientation=self.orientation,
        ).solutions
        if not joint_solutions.usable[0]:
            raise InputError(
                "the arm cannot go to this pose", where=self.tip or "flange", cure=joint_solutions.advice(0)
            )
        self.joints = np.clip(joint_solutions.joints[0], self.low, self.high)
        return joint_solutions.status[0]

    def drag_to(self, position: Array, rotation: Array) -> PoseStatus:
        """Go to a pose of the tip in the world, as :meth:`go_to`, a little way from where it is in less time.

        Steps from where the arm is lead to the nearest joint positions, if they lead there at all.
        """
        if self._near(position, rotation):
            return PoseStatus.REACHED
        return self.go_to(position, rotation, "world")

    def _near(self, position: Array, rotation: Array) -> bool:
        """Go to a pose in the world by steps from where the arm is; return whether that was possible."""
        x, y, z = rotation.T[:, :, None]
        length = self._reach()
        task = PoseTask(self.robot, self.tip, self.orientation, position[:, None], (x, y, z), length)
        pool = Candidates(task, self.joints[None], None)
        pool.add(np.zeros(1, np.intp), self.robot.variables(self.at, self.robot.values)[: len(self.joints)].T)
        found = pool.joints[0]
        if not pool.satisfied(None)[0] or np.abs(found - self.joints).max() > _A_LITTLE:
            return False
        before, self.joints = self.joints, np.clip(found, self.low, self.high)
        # Where a joint is all but balanced it may come to rest at the other end of its play, and the arm elsewhere.
        if max(task.distances(task.error(self.robot.forward_kinematics(self.at, self.tip)))).item() <= REACHED:
            return True
        self.joints = before
        return False

    def branches(self) -> list[Branch]:
        """Return the ways to the pose where the tip is now.

        Of an arm whose branches have names these are all. Of any other arm they are what is found from many postures,
        the nearest first: some of endlessly many, where the arm has more joints than the pose needs.
        """
        p, R = self.pose()
        if self.orientation == "full" and branch_rule(self.robot) is not None:
            joint_solutions = inverse(
                self.robot, p[None], R[None], target=self.tip, branch="all", seed_joints=self.joints
            ).solutions
            return [
                Branch(name, joints, status)
                for name, joints, status in zip(
                    joint_solutions.branch, joint_solutions.joints, joint_solutions.status, strict=True
                )
            ]
        seeds = self.robot.random_configurations(_SEEDS, np.random.default_rng(0))
        count = len(seeds)
        joint_solutions = inverse(
            self.robot,
            np.repeat(p[None], count, axis=0),
            None if self.orientation == "free" else np.repeat(R[None], count, axis=0),
            target=self.tip,
            seed_joints=seeds,
            orientation=self.orientation,
        ).solutions
        far = np.abs(joint_solutions.joints - self.joints).max(axis=1)
        kept: list[int] = []
        for k in np.argsort(far, kind="stable").tolist():
            others = [self.joints, *(joint_solutions.joints[other] for other in kept)]
            if joint_solutions.usable[k] and all(
                np.abs(joint_solutions.joints[k] - other).max() > _APART for other in others
            ):
                kept.append(k)
        return [
            Branch(f"posture {n}", joint_solutions.joints[k], joint_solutions.status[k])
            for n, k in enumerate(kept[:_MOST], 1)
        ]

    def singular_value(self) -> float:
        """Return how little the tip moves with a joint motion of norm 1, positions in reach lengths.

        It is 0 in a singular posture, and as ``ik`` has it for a whole pose.
        """
        jacobian = self.robot.joint_jacobian(self.at, self.tip)[0].copy()
        length = self._reach()
        if length == 0.0:  # all in one point: nothing moves it
            return 0.0
        jacobian[:3] /= length
        if self.orientation == "free":
            jacobian = jacobian[:3]
        elif self.orientation == "axis":
            # Turns about the tip's z do not count.
            rotation = self.pose("world")[1]
            jacobian = np.concatenate([jacobian[:3], rotation.T[:2] @ jacobian[3:]])
        return float(np.linalg.svd(jacobian, compute_uv=False)[-1])

    def words(self) -> list[str]:
        """Say what to know of where the arm stands: joints at a limit, and how near to a singular posture it is."""
        told = []
        for joint, value, low, high in zip(self.robot.joints, self.joints, self.low, self.high, strict=True):
            if value <= low + _ROUNDING or value >= high - _ROUNDING:
                told.append(f"{joint.name} is at its limit.")
        value = self.singular_value()
        near = ", near a singular posture" if value < NEAR_SINGULAR else ""
        told.append(f"Smallest singular value: {value:.4f}{near}.")
        return told

    def _reach(self) -> float:
        if self.tip not in self._reaches:
            self._reaches[self.tip] = reach(self.robot, self.tip)
        return self._reaches[self.tip]

    def _controller(self) -> Controller | None:
        return counting(self.robot, self.whose)

    def _shown(self, joints: Array) -> Array:
        controller = self._controller()
        return joints if controller is None else controller.from_model(joints[None])[0]

    def _rates(self) -> Array:
        """Return how the model's joints follow the numbers, ``(joints, numbers)``."""
        count = len(self.joints)
        controller = self._controller()
        if controller is None:
            return np.eye(count)
        none = np.zeros((1, count))
        return np.asarray((controller.to_model(np.eye(count)) - controller.to_model(none)).T)


def _start(robot: Robot) -> Array:
    """Return the configuration of zeros, or the middle of a joint's range where zero is beyond it."""
    low, high = np.array([joint.range for joint in robot.joints]).T
    return np.where((low <= 0.0) & (high >= 0.0), 0.0, (low + high) / 2.0)
