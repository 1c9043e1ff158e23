"""Inputs that once did what no input may do, small enough to be read; the fuzzer found most of them."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Final

from tests.fuzz import samples


def _rows(count: int, name: Callable[[int], str]) -> bytes:
    head = "configuration,joint_1 [deg],target,x [mm],y [mm],z [mm]\n"
    return (head + "".join(f"{n},{n % 90},{name(n)},{n},{n % 7},{n % 5}\n" for n in range(1, count + 1))).encode()


def _sample(name: str, old: bytes, new: bytes) -> bytes:
    content = samples.content(name)
    assert old in content
    return content.replace(old, new, 1)


#: Content of the first file of a reader, by reader and by what it is.
CONTENTS: Final[dict[tuple[str, str], Callable[[], bytes]]] = {
    ("canonical", "a target a reading"): lambda: _rows(1500, lambda n: f"t{n}"),
    ("canonical", "a column joint_1 with 5000 zeros"): lambda: _rows(3, str).replace(
        b"joint_1", b"joint_1" + b"0" * 5000
    ),
    ("canonical", "names of control characters"): lambda: _rows(3, lambda n: "\x1b[31m\u202e" + str(n)),
    ("canonical", "a number of very many digits"): lambda: _rows(3, str).replace(
        b"\n1,1,", b"\n1," + b"1" * 5000 + b","
    ),
    ("canonical", "utf-16"): lambda: _rows(3, str).decode().encode("utf-16"),
    ("canonical", "nothing but a mark"): lambda: b"\xef\xbb\xbf",
    ("robot-new", "only remarks"): lambda: b"# a file of comments\n---\n",
    ("robot-new", "a title that is a list"): lambda: _sample("robot.yaml", b"title: My six-axis robot", b"title: [1]"),
    ("robot-new", "a name with a blank"): lambda: _sample("robot.yaml", b"name: ", b"name: my "),
    ("robot-new", "brackets"): lambda: b"[" * 100_000,
    ("robot-new", "an entry that holds itself"): lambda: b"truearm: &a [*a]\n",
    ("robot-new", "aliases of aliases"): lambda: (
        b"a0: &a0 [x]\n"
        + b"".join(b"a%d: &a%d [%s]\n" % (n, n, b",".join([b"*a%d" % (n - 1)] * 9)) for n in range(1, 12))
    ),
    ("robot-calibrated", "a proof without errors of joints"): lambda: re.sub(
        rb"\n  joint_error:[^\n]*(?:\n   [^\n]*)*", b"", samples.content("calibrated.yaml")
    ),
    ("bounds", "a list as a name"): lambda: b"truearm: truearm-bounds/1\n? [a, b]\n: 1\n",
    ("bounds", "a list as a name in brackets"): lambda: b"{truearm: truearm-bounds/1, {a: 1}: 2}\n",
    ("bounds", "a date that there is not"): lambda: b"truearm: 2026-02-30\n",
    ("constraints", "a mark between documents"): lambda: b"a: 1\n---\nb: 2\n",
    ("poses", "a quaternion of nothing"): lambda: b"pose,x [mm],y [mm],z [mm],qw,qx,qy,qz\na,0,0,0,0,0,0,0\n",
    ("fanuc", "a configuration with a control character"): lambda: _sample(
        "fanuc_ls/bracket.ls", b"CONFIG : 'N", b"CONFIG : '\x01"
    ),
    ("rapid", "a module without an end"): lambda: samples.content("rapid/polish.mod")[:1500],
    ("rapid", "brackets"): lambda: b"MODULE m\nCONST robtarget p:=" + b"[" * 50_000,
    ("krl", "brackets"): lambda: b"DEF m()\nPTP {" + b"{" * 50_000,
    ("urscript", "brackets"): lambda: b"movel(" + b"(" * 50_000,
    ("jbi", "a pulse of very many digits"): lambda: _sample("jbi/weld.jbi", b"C00000=", b"C00000=" + b"9" * 5000),
    ("ur-conf", "blank lines"): lambda: b"\n" * 300_000 + b"x: 1\n",
    ("urdf", "entities of entities"): lambda: (
        b'<!DOCTYPE r [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;">]><robot name=\'&b;\'/>'
    ),
}
