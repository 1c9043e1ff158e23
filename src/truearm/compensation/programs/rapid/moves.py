"""The instructions of RAPID that move the robot, where their arguments are, and those that do not move it.

Sources: ABB, Technical reference manual, RAPID Instructions, Functions and Data types (3HAC050917-001), syntax of each
instruction; application manuals Arc and Arc Sensor, Spot options, Dispense, Paint and Continuous Application Platform.
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from truearm.compensation.programs.program import MoveKind


class Motion(NamedTuple):
    """An instruction that moves the robot."""

    kind: MoveKind  #: How the tip goes.
    target: int = 0  #: target, tool: which of the arguments that are not optional they are; -1 for the last one.
    tool: int = -1
    via: int | None = None  #: Which of them the circle passes, None for no circle.
    joints: bool = False  #: Whether the target is a jointtarget.
    searches: bool = False  #: Whether the robot may stop on the way.
    splittable: bool = False  #: Whether several of it after each other do what one does.


def _motions() -> dict[str, Motion]:
    found: dict[str, Motion] = {}
    for ending in ("", "do", "ao", "go", "sync"):
        found[f"movej{ending}"] = Motion("joint", tool=3)
        found[f"movel{ending}"] = Motion("linear", tool=3, splittable=not ending)
        found[f"movec{ending}"] = Motion("circular", target=1, tool=4, via=0, splittable=not ending)
    found["moveabsj"] = Motion("joint", tool=3, joints=True)
    found["triggabsj"] = found["arcmoveabsj"] = Motion("joint", joints=True)
    for word in ("triggj", "triggjios", "arcmovej", "spotj", "spotmj", "dispj", "nutj"):
        found[word] = Motion("joint")
    for word in ("triggl", "trigglios", "arcmovel", "spotl", "spotml", "displ", "capl", "paintl", "gluel", "nutl"):
        found[word] = Motion("linear")
    for word in ("triggc", "arcmovec", "dispc", "capc", "paintc", "gluec"):
        found[word] = Motion("circular", target=1, via=0)
    for number in ("", "1", "2"):
        for phase in ("", "start", "end"):
            found[f"arcl{number}{phase}"] = Motion("linear", splittable=not phase)
            found[f"arcc{number}{phase}"] = Motion("circular", target=1, via=0, splittable=not phase)
    found["searchl"] = Motion("linear", target=2, searches=True)
    found["searchc"] = Motion("circular", target=3, via=2, searches=True)
    found["contactl"] = Motion("linear", searches=True)
    return found


#: By first word, in lower case.
MOTIONS: Final = _motions()

#: Instructions after which the robot is where it was, by first word, in lower case.
QUIET: Final = frozenset(
    re.findall(
        r"\w+",
        """
        accset actunit bookerrno break cirpathmode clkreset clkstart clkstop close confj confl corrclear corrcon
        corrdiscon corrwrite deactunit eoffsoff eoffson eoffsset errlog errwrite gripload idelete idisable ienable
        invertdo iodisable ioenable isignalai isignalao isignaldi isignaldo isignalgi isignalgo isleep itimer iwatch
        load motionsup moveextj open paccset pathacclim pathresol pdispoff pulsedo reset save set setao setdo setgo
        setsysdata singarea socketaccept socketbind socketclose socketconnect socketcreate socketlisten socketreceive
        socketsend softact softdeact speedrefresh stop syncmoveoff syncmoveon tperase tpreaddnum tpreadfk tpreadnum
        tpshow tpwrite triggcheckio triggequip triggint triggio triggrampao triggspeed tunereset tuneservo uimsgbox
        uishow unload velset waitai waitao waitdi waitdo waitgi waitgo waitload waitrob waitsynctask waittime
        waituntil worldacclim write writebin writestrbin
        """,
    )
)
#: Instructions that move all targets after them.
DISPLACING: Final = frozenset(("pdispon", "pdispset"))
