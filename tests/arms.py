"""Arms of the library of every build, for tests that would find the same in arms that differ in their lengths alone.

Every arm is held against the contract in tests/engine/robot/library.
"""

from __future__ import annotations

from typing import Final

from truearm.engine.robot.library import library

ARMS: Final = (
    "crb15000_5_0.95",  # axis 6 beside axis 5
    "crx10ia",  # axis 6 at the end of axis 5
    "fr3",  # seven joints with offsets
    "irb120",
    "irb1600",
    "katana450",  # five joints
    "kr10_r1100",  # base axis downwards
    "kr5",  # another convention
    "lbr_iiwa_14",  # seven joints
    "li3",  # three joints
    "lrmate200ic",  # coupled joints
    "puma560",  # masses, no flange
    "ur10e",
    "ur5",  # three parallel axes
)
assert set(ARMS) <= set(library())
