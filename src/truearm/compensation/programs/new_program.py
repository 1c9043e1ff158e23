"""A new program: the targets of a motion, one after the other, for every robot language to write down.

The first target is gone to by a joint motion, and says in which posture the arm begins. The others follow by joint
motions, or in straight lines.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date
from typing import Final

from truearm.compensation.programs.marks import correction_comment
from truearm.compensation.programs.new_targets import NewTargets, ascii_only
from truearm.modeling.chain import Array
from truearm.simulated import IN_PROGRAMS

#: What a program may be called in every language: FANUC's controllers allow the fewest characters.
NAME: Final = r"[A-Za-z][A-Za-z0-9_]{0,31}"
#: Languages that have no words for the time of a joint motion.
_UNTIMED: Final = ("KRL", "INFORM", "VAL3")
#: Controllers take no shorter time than this for a move [s], and no lower speed [m/s].
_SHORTEST: Final = 1e-3
_SLOWEST: Final = 1e-4


@dataclass(frozen=True, eq=False)
class NewProgram(NewTargets):
    """The targets of a program to write, of :class:`.new_targets.NewTargets`, and how the robot goes to them.

    If it has poses, targets are these; else joint positions.
    """

    durations: Array  #: Time of the move to each target [s], ``(n,)``; that to the first is of no meaning.
    speeds: Array  #: Mean speed of the tip in that move [m/s], ``(n,)``.
    spacing: Array  #: Distance of the tip from the target before [m], ``(n,)``.
    corrected: bool  #: Whether the targets are corrected for one robot, which then must not be done again.
    beside: float  #: How far the tip leaves the path between the targets [m].
    simulated: bool = False  #: Whether that robot was calibrated with simulated measurements.

    def __len__(self) -> int:
        return len(self.joints)

    def untimed(self, language: str) -> bool:
        """Return whether a language has no words for the time of these moves."""
        return self.poses is None and language in _UNTIMED

    @property
    def comments(self) -> tuple[str, ...]:
        """What a person should know who opens the program, in ASCII, 32 characters at most."""
        kind = "joint positions" if self.poses is None else "poses of the flange"
        text = [f"Path for {ascii_only(self.robot)[:20]}", f"{len(self)} targets: {kind}"]
        corrected = (*correction_comment(date.today()), "do not correct it again") if self.corrected else ()
        return (*((IN_PROGRAMS,) if self.simulated else ()), *text, *corrected)

    def seconds(self, row: int) -> float:
        """Return the time of the move to a target [s]."""
        return max(float(self.durations[row]), _SHORTEST)

    def speed(self, row: int) -> float:
        """Return the speed of the tip in the move to a target [m/s]."""
        return max(float(self.speeds[row]), _SLOWEST)

    def blend(self, row: int) -> float:
        """Return how far from a target its neighbours' moves may be rounded off into each other [m]; 0 at the ends."""
        if row == 0 or row == len(self) - 1:
            return 0.0
        return float(min(1e-3, 0.4 * min(self.spacing[row], self.spacing[row + 1])))
