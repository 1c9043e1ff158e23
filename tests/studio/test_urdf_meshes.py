"""Meshes of URDFs: drawn where they are in the project, and read nowhere else."""

from __future__ import annotations

import re
import struct
from pathlib import Path

import numpy as np
import pytest
from tests.studio.conftest import Serving
from tests.studio.test_jog_page import act
from tests.studio.typing_in import typed

from truearm.engine.base.errors import InputError
from truearm.engine.base.files import confined_reads
from truearm.engine.robot.library import load_robot
from truearm.studio.jogging import Jogging
from truearm.studio.pages.cell import CellPage
from truearm.studio.pages.jog import JogPage
from truearm.studio.project import Project, open_project
from truearm.studio.urdf_meshes import Looks, urdf_meshes

#: A tetrahedron.
_POINTS = ((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 0.3))
_FACES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))


def stl() -> bytes:
    triangles = b"".join(
        struct.pack("<12fH", 0.0, 0.0, 0.0, *(value for corner in face for value in _POINTS[corner]), 0)
        for face in _FACES
    )
    return bytes(80) + struct.pack("<I", len(_FACES)) + triangles


def obj() -> bytes:
    lines = ["mtllib /etc/passwd", *(f"v {x} {y} {z}" for x, y, z in _POINTS), "usemtl a"]
    return "\n".join([*lines, *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in _FACES)]).encode()


def urdf(*visuals: str) -> str:
    """Return an arm of three links; of each link what it looks like is given, the root's first."""
    links = [f"<link name='l{k}'>{visual}</link>" for k, visual in enumerate(visuals)]
    joints = [
        f"<joint name='j{k}' type='revolute'><parent link='l{k - 1}'/><child link='l{k}'/><origin xyz='0 0 0.3'/>"
        f"<axis xyz='0 {k % 2} {(k + 1) % 2}'/><limit lower='-2' upper='2' effort='1' velocity='1'/></joint>"
        for k in range(1, len(visuals))
    ]
    hand = "<link name='hand'/><joint name='f' type='fixed'><parent link='l3'/><child link='hand'/></joint>"
    return f"<robot name='arm'>{''.join(links)}{''.join(joints)}{hand}</robot>"


def mesh(name: str, more: str = "", kind: str = "visual", origin: str = "") -> str:
    return f"<{kind}>{origin}<geometry><mesh filename='{name}' {more}/></geometry></{kind}>"


@pytest.fixture
def project(tmp_path: Path) -> Project:
    return open_project(tmp_path / "cell")


def looks(project: Project, text: str, name: str = "arm.urdf") -> Looks:
    file = project.folder / name
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)
    folder = Path(name).parent.as_posix()
    with confined_reads(project.folder):
        return urdf_meshes(project.path(name), project.path, "" if folder == "." else folder)


def test_meshes_boxes_and_cylinders_stand_in_the_frames_of_their_links(project: Project) -> None:
    (project.folder / "part.stl").write_bytes(stl())
    (project.folder / "part.obj").write_bytes(obj())
    found = looks(
        project,
        urdf(
            "<visual><geometry><box size='0.2 0.4 0.6'/></geometry></visual>",
            mesh("part.stl", "scale='2 2 2'", origin="<origin xyz='0 0 1'/>"),
            mesh("part.obj", origin="<origin rpy='0 0 1.5707963267948966'/>"),
            "<visual><geometry><cylinder radius='0.1' length='0.5'/></geometry></visual>"
            "<visual><geometry><sphere radius='0.2'/></geometry></visual>",
        ),
    )
    assert found.left_out == ()
    assert found.joints == ("j1", "j2", "j3")
    assert list(found.meshes) == ["base", "link_1", "link_2", "link_3"]
    assert found.meshes["base"].vertices.max(axis=0) == pytest.approx([0.1, 0.2, 0.3])
    assert found.meshes["link_1"].vertices.max(axis=0) == pytest.approx([0.2, 0.4, 1.6], abs=1e-6)
    assert found.meshes["link_2"].vertices.min(axis=0) == pytest.approx([-0.2, 0.0, 0.0], abs=1e-6)
    assert found.meshes["link_3"].vertices[:, 2].max() == pytest.approx(0.25)


@pytest.mark.parametrize("place", ["arm_description/meshes/part.stl", "meshes/part.stl", "part.stl"])
def test_packages_are_looked_for_in_the_project(project: Project, place: str) -> None:
    file = project.folder / place
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(stl())
    text = urdf(mesh("package://arm_description/meshes/part.stl"), "", "", "")
    assert list(looks(project, text, "arm_description/urdf/arm.urdf").meshes) == ["base"]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("/etc/part.stl", "from the project's folder alone"),
        ("file:///etc/part.stl", "from the project's folder alone"),
        ("http://example.org/part.stl", "from the project's folder alone"),
        ("../part.stl", "no place in the project's folder"),
        ("package://arm/../../part.stl", "no place in the project's folder"),
        ("link.stl", "no place in the project's folder"),
        ("missing.stl", "there is no such mesh"),
        ("part.dae", "meshes of this kind are not read"),
        ("broken.stl", "cannot be read|no triangles"),
        ("empty.obj", "cannot be read|no triangles"),
        ("points.obj", "cannot be read|no triangles"),
        ("beyond.obj", "cannot be read|no triangles"),
    ],
)
def test_no_other_mesh_is_read_and_it_is_said_why(project: Project, tmp_path: Path, name: str, said: str) -> None:
    (tmp_path / "part.stl").write_bytes(stl())
    (project.folder / "link.stl").symlink_to(tmp_path / "part.stl")
    (project.folder / "part.dae").write_text("<!DOCTYPE x [<!ENTITY a SYSTEM '/etc/passwd'>]><x>&a;</x>")
    (project.folder / "broken.stl").write_bytes(b"\x00" * 100 + b"no")
    (project.folder / "empty.obj").write_text("# nothing\n")
    (project.folder / "points.obj").write_text("v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (project.folder / "beyond.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n")
    found = looks(project, urdf(mesh(name), "", "", ""))
    assert found.meshes == {}
    assert re.search(said, found.left_out[0]), found.left_out


def test_where_a_visual_mesh_cannot_be_read_that_for_collisions_is_taken(project: Project) -> None:
    (project.folder / "part.stl").write_bytes(stl())
    (project.folder / "part.dae").write_text("<x/>")
    found = looks(project, urdf(mesh("part.dae") + mesh("part.stl", kind="collision"), "", "", ""))
    assert list(found.meshes) == ["base"]
    assert found.left_out == ()


def test_entities_and_too_much_are_refused(project: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    (project.folder / "part.stl").write_bytes(stl())
    with pytest.raises(InputError, match="DOCTYPE"):
        looks(project, "<!DOCTYPE x [<!ENTITY a 'b'>]>" + urdf("", "", "", ""))
    monkeypatch.setenv("TRUEARM_LIMITS", "triangles=7")
    with pytest.raises(InputError, match="too many triangles"):
        looks(project, urdf(mesh("part.stl"), mesh("part.stl"), "", ""))
    monkeypatch.setenv("TRUEARM_LIMITS", "mesh_size=100")
    assert "the mesh is too large" in looks(project, urdf(mesh("part.stl"), "", "", "")).left_out[0]


def test_the_robot_is_drawn_with_its_meshes_and_moves_with_them(
    serving: Serving, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("truearm.studio.typing_at_rest._REST", 0.01)
    studio = serving()
    window, folder = studio.window, studio.window.project.folder
    (folder / "arm.urdf").write_text(urdf(mesh("part.stl"), mesh("part.stl"), mesh("part.dae"), mesh("part.stl")))
    (folder / "part.stl").write_bytes(stl())
    window.edit(robot="arm.urdf")
    page = next(page for page in window.pages if isinstance(page, JogPage))
    assert "without-meshes" in "".join(window._told)
    assert page.scene.solid is not None
    names = [name for name in window.server.scene._handle_from_node_name if name.endswith("/body")]
    assert sorted(names) == ["/nominal/base/body", "/nominal/link_1/body", "/nominal/link_3/body"]
    act(page._sliders[0], 45.0)
    link = page.scene.solid._links[1]
    assert link.position == pytest.approx([0.0, 0.0, 0.3])
    told = len(window._told)
    window.refresh()
    assert len(window._told) == told
    cell = next(page for page in window.pages if isinstance(page, CellPage))
    typed(studio, cell.places._base, (500.0, 0.0, 0.0))
    assert window.project.settings.robot == "arm-cell.yaml"
    assert window.project.settings.meshes == "arm.urdf"
    drawn = [name for name in window.server.scene._handle_from_node_name if name.endswith("/body")]
    assert sorted(drawn) == sorted(names)
    arm = Jogging(load_robot(folder / "arm-cell.yaml"))
    assert arm.pose("world")[0][0] == pytest.approx(0.5)
    assert np.isfinite(page.scene.length)
