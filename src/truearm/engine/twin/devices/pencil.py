"""A circle drawn on a sloping page with a pencil on a spring, whose travel a potentiometer reads (Patel, 5.5.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parts import Tool
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.devices.device import Arm, Device, recorded
from truearm.engine.twin.devices.jogging import followed, postures_at, site

#: Points that the arm goes through on its way round, at least.
_LEAST_POINTS_ROUND: Final = 48
#: Postures that a circle is begun in until one goes all the way round.
_MOST_STARTS: Final = 6
_ROUNDS: Final = 8
#: How far the pencil leans at the start, and anywhere.
_LARGEST_LEAN_AT_START: Final = np.deg2rad(60.0)
_LARGEST_LEAN: Final = np.deg2rad(75.0)
#: Points of a circle, at least, before another is drawn.
_LEAST_POINTS: Final = 12
#: The middle of a circle lies in its page [m].
_PAPER_DEVIATION: Final = 1e-5


@dataclass(frozen=True)
class PencilCircle(Device):
    """A pencil that the robot leads round a circle on pages of several slopes that face it.

    The arm is commanded by the nominal robot and draws where it draws: nothing is jogged. The scanned page says how far
    the line is from its middle, the potentiometer how high the tool is over the paper. The pencil leans, so both are
    taken along it to the tip of the unsprung pencil; that its direction is only known to a tenth of a degree costs
    micrometres. Together they say how far that tip is from the middle of the circle, and over the page; where these
    are is not known.
    """

    no_plan: ClassVar[str] = "its pages are scanned when all circles are drawn: it reads nothing where the arm stands"

    radius: float = 0.1  #: Of the circles [m].
    #: Of the pages against the horizontal [rad], rising away from the robot.
    slopes: tuple[float, ...] = (float(np.deg2rad(45.0)), float(np.deg2rad(25.0)), float(np.deg2rad(65.0)))
    circles: int = 2  #: How many are drawn on each page, each in another posture of the arm.
    #: Of all circles in the base frame [m]; the middle of the robot's reach if None.
    centre: tuple[float, float, float] | None = None

    def campaign(self, nominal: Robot, arm: Arm, count: int, sigma: float, rng: np.random.Generator) -> Dataset:
        """Return distances from the middle and heights over the page at even steps round all circles, one by one."""
        base = nominal.base
        middle = site(nominal) if self.centre is None else base.rotation @ np.array(self.centre) + base.translation
        out = (middle - base.translation) @ base.rotation
        pages = np.array([base.rotation @ _page(slope, out) for slope in self.slopes])
        drawn = max(1, min(len(pages) * self.circles, count // _LEAST_POINTS))
        pages = pages[:drawn]
        each = -(-count // drawn)
        page = np.arange(drawn) % len(pages)
        joints = self._drawn(nominal, middle, pages[page], each, rng)
        circle = np.repeat(np.arange(drawn), each)[:count]
        joints, page = joints.reshape(-1, joints.shape[2])[:count], page[circle]
        place = arm.frames(joints)[nominal.targets[0].name][:, :3, 3] - middle
        on_page = np.einsum("nij,ni->nj", pages[page], place)
        radius = np.hypot(on_page[:, 0], on_page[:, 1]) + sigma * rng.standard_normal(count)
        height = on_page[:, 2] + sigma * rng.standard_normal(count)
        none = np.full(count, np.nan)
        centres = tuple(f"centre_{k + 1}" for k in range(drawn))
        fixtures = (*centres, *(f"paper_{k + 1}" for k in range(len(pages))))
        return recorded(
            nominal,
            self.name,
            joints,
            np.repeat(np.arange(count), 2),
            [nominal.targets[0].name] * (2 * count),
            distance=np.column_stack([np.hypot(radius, height), none]).reshape(-1),
            height=np.column_stack([none, height]).reshape(-1),
            fixtures=fixtures,
            fixture=np.column_stack([circle, drawn + page]).reshape(-1),
            setup=recorded(
                nominal,
                self.name,
                np.zeros((1, joints.shape[1])),
                [0] * drawn,
                centres,
                height=np.zeros(drawn),
                fixtures=fixtures,
                fixture=drawn + np.arange(drawn) % len(pages),
                sigma=_PAPER_DEVIATION,
            ),
            sigma=sigma,
        )

    def _drawn(self, nominal: Robot, middle: Array, pages: Array, each: int, rng: np.random.Generator) -> Array:
        """Return the joint positions ``(circles, each, joints)`` of circles on given pages ``(circles, 3, 3)``."""
        name = nominal.targets[0].name
        fine = -(-_LEAST_POINTS_ROUND // each)
        around = 2 * np.pi * np.arange(each * fine) / (each * fine)
        path = self.radius * np.column_stack([np.cos(around), np.sin(around), np.zeros(len(around))])
        places = middle + np.einsum("pij,nj->pni", pages, path)
        joints = np.full((len(pages), each, len(nominal.joints)), np.nan)
        for _ in range(_ROUNDS):
            missing = np.flatnonzero(np.isnan(joints[:, 0, 0]))
            begun = np.tile(missing, 2 * _MOST_STARTS)
            facing = -pages[begun, :, 2]
            starts = places[begun, 0]
            reached, q = postures_at(
                nominal,
                name,
                starts,
                _MOST_STARTS * len(missing),
                rng,
                self.name,
                facing=facing,
                within=_LARGEST_LEAN_AT_START,
            )
            begun, facing = begun[reached], facing[reached]
            q, whole = followed(nominal, name, q, np.moveaxis(places[begun], 0, 1))
            pencil = np.array([nominal.world_poses(at)[1][:, :, 2] for at in q])
            whole &= (np.einsum("kni,ni->kn", pencil, facing) > np.cos(_LARGEST_LEAN)).all(axis=0)
            for k in np.flatnonzero(whole).tolist():
                joints[begun[k]] = q[::fine, k]
            if np.isfinite(joints).all():
                return joints
        raise InputError(
            f"{nominal.name} cannot follow the whole circle",
            where=self.name,
            came=f"{int(np.isfinite(joints[:, 0, 0]).sum())} of {len(pages)} circles drawn",
            cure="Take a smaller circle, pages that are less steep, or another device.",
        )


def _page(slope: float, middle: Array) -> Array:
    """Return the axes of a page that rises away from the robot: x up the slope, z out of the paper."""
    turn = np.arctan2(middle[1], middle[0])
    c, s = np.cos(turn), np.sin(turn)
    upright = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    k, m = np.cos(slope), np.sin(slope)
    return np.asarray(upright @ np.array([[k, 0.0, -m], [0.0, 1.0, 0.0], [m, 0.0, k]]))


DRAWN_CIRCLE: Final = PencilCircle(
    "drawn-circle",
    "pencil on a spring led round circles on pages of three slopes, the pages scanned, its travel read",
    "Patel, section 5.5.2: circle on a plane at 45 deg, pencil and potentiometer; the other slopes and deviation ours",
    sigma=2e-5,
    tool=Tool({"pencil": (0.02, 0.01, 0.15)}),
)
