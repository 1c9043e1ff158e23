"""The circle of section 5.5.1 that the Katana of the study katana-devices draws on a page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from papers.katana.circle import PENCIL, motions, paths
from papers.katana.robot import TIP, katana, published
from papers.katana.tilting import twin
from papers.katana_devices.setup import PLACE, POINT, RADIUS
from truearm.compensation.corrected_path import corrected
from truearm.engine.data.circles import fit_circle
from truearm.engine.fit.fit import Fit
from truearm.engine.motion.joint_motion import JointMotion
from truearm.engine.motion.paths import Trajectory
from truearm.engine.robot.chain import Array
from truearm.engine.robot.transform import IDENTITY, rigid_motion
from truearm.engine.twin.devices.pencil import DRAWN_CIRCLE
from truearm.engine.twin.twin import Twin

_TIME: Final = 0.2  # s, between points of the circle that are looked at


@dataclass(frozen=True, eq=False)
class OnPage:
    """The circle of section 5.5.1 as the twin went round it."""

    along: Array  #: Angle round the circle [deg], ``(n,)``.
    #: outward, height: what the page shows beside a circle of the right size about the line's own middle, in its own
    #: plane [mm].
    outward: Array
    height: Array
    distance: Array  #: How far the tip truly was from where it should be at that moment [mm].
    moved: Array  #: Likewise after the best rigid motion.

    @property
    def shown(self) -> float:
        """Mean distance from the circle as the page shows it [mm]."""
        return float(np.hypot(self.outward, self.height).mean())


def drawn_pages(fits: Mapping[str, Fit], rng: np.random.Generator) -> dict[str, OnPage]:
    """Let the twin draw the circle of section 5.5.1, by the nominal robot, "before", and by calibrated ones."""
    circle, line = paths(_TIME)
    motion = motions(katana(PENCIL), circle, line, rng)[0]
    truth = twin(published("standard").with_frames(IDENTITY, POINT.targets))
    pages = {"before": _drawn(truth, motion.joints, motion, circle, rng)}
    for name, fit in fits.items():
        commanded = corrected(fit.robot, motion, _in_base(fit, circle.position), TIP).joints
        pages[name] = _drawn(truth, commanded, motion, circle, rng)
    return pages


def _in_base(fit: Fit, path: Array) -> Array:
    """Return a path of the true base in the base that was found; without an anchor the base is taken as found."""
    if not any(p.group == "base" for p in fit.free.parameters):
        return path
    base = fit.robot.base
    in_world = path @ PLACE.rotation.T + PLACE.translation
    return np.asarray((in_world - np.array(base.translation)) @ base.rotation)


def _drawn(truth: Twin, joints: Array, motion: JointMotion, circle: Trajectory, rng: np.random.Generator) -> OnPage:
    went = truth.postures(joints, velocity=motion.velocity, acceleration=motion.acceleration)
    tip = np.array([posture.targets[TIP][:3, 3] for posture in went])
    line = fit_circle(tip)
    outward, height = (
        1e3 * (v + DRAWN_CIRCLE.sigma * rng.standard_normal(len(tip)))
        for v in (line.radius - RADIUS + line.radial, line.axial)
    )
    R, p = rigid_motion(tip, circle.position)
    return OnPage(
        along=360 * circle.distance / circle.distance[-1],
        outward=outward,
        height=height,
        distance=1e3 * np.linalg.norm(tip - circle.position, axis=1),
        moved=1e3 * np.linalg.norm(tip @ R.T + p - circle.position, axis=1),
    )
