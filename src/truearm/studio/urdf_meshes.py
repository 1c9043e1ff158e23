"""What a URDF says its links look like: meshes of the project's folder, boxes, cylinders and balls.

A mesh is read only where it lies in the project. ``package://NAME/rest`` is looked for as ``NAME/rest`` and as ``rest``
in the folder, and beside the URDF, and by its bare name last, as files that were taken in one by one have no folders.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any, Final

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.base.files import exists, read_bytes
from truearm.engine.base.limits import refuse_beyond
from truearm.engine.robot.library import load_robot, urdf_source
from truearm.engine.robot.urdf_tree import Tag, Tree, child_tag, numbers, origin, placement, read_tree
from truearm.studio.solids import Mesh, ball, box, drum, together

#: What meshes are read, by the ends of their names.
_KINDS: Final = {".stl": "stl", ".obj": "obj"}
_PACKAGE: Final = "package://"


@dataclass(frozen=True, eq=False)
class Looks:
    """What the links of a URDF's chain look like."""

    joints: tuple[str, ...]  #: Names of the joints, by which the chain is known.
    #: Of each link that has any, in the link's own frame [m], by the names of
    #: :class:`truearm.studio.robot_shape.LinkShape`.
    meshes: Mapping[str, Mesh]
    left_out: tuple[str, ...]  #: Why others have none, in words.


def urdf_meshes(path: Path, inside: Callable[[str], Path], relative: str) -> Looks:
    """Return what the links of a URDF's chain look like.

    Args:
        path: The URDF; a link to end at behind ``#`` counts, as :func:`truearm.load_robot` takes it.
        inside: Returns the path of a name in the project, and refuses what is no place in it.
        relative: The folder of the URDF in the project; empty for the project's own.

    Raises:
        InputError: If the URDF cannot be read, or all of them have too many triangles.
    """
    named = urdf_source(path)
    if named is None:
        raise InputError("this is no URDF", where=path.name, allowed="a file that ends in .urdf")
    source = named[0].name
    tree, robot = read_tree(read_bytes(named[0]), source), load_robot(path)
    found: dict[str, Mesh] = {}
    left_out: list[str] = []
    names = ["base", *(f"link_{number}" for number in range(1, len(robot.joints) + 1))]
    links = [tree.root, *(tree.joints[joint.name].child for joint in robot.joints)]
    loaded: dict[str, Mesh] = {}
    count = 0
    for name, link in zip(names, links, strict=True):
        parts = []
        for carried, frame in tree.fixed_behind(link):
            drawn, why = _drawn(tree, carried, loaded, inside, relative)
            left_out += why
            parts += [mesh.moved(frame[:3, :3], frame[:3, 3]) for mesh in drawn]
        count += sum(len(part.faces) for part in parts)
        refuse_beyond("triangles", count, where=source)
        if parts:
            found[name] = together(parts)
    return Looks(tuple(joint.name for joint in robot.joints), found, tuple(dict.fromkeys(left_out)))


def _drawn(
    tree: Tree, link: str, loaded: dict[str, Mesh], inside: Callable[[str], Path], relative: str
) -> tuple[list[Mesh], list[str]]:
    """Return the visual meshes of one link in its frame; those for collisions where the visual ones cannot be read."""
    why: list[str] = []
    for kind in ("visual", "collision"):
        made, failed = [], []
        for tag in tree.links[link].children:
            if tag.name != kind:
                continue
            where = f"{tree.where}, line {tag.line}, link {link}"
            try:
                made.append(_shape(tag, where, loaded, inside, relative))
            except InputError as error:
                failed.append(error.message(str))
        if made and not failed:
            return made, []
        why += failed if kind == "visual" else []
        if not failed:
            break
    return [], why


def _shape(tag: Tag, where: str, loaded: dict[str, Mesh], inside: Callable[[str], Path], relative: str) -> Mesh:
    geometry = child_tag(tag, "geometry", where)
    shape = None if geometry is None or not geometry.children else geometry.children[0]
    if shape is None:
        raise InputError("there is no geometry", where=where)
    frame = placement(*origin(tag, where))
    if shape.name == "mesh":
        name = shape.attributes.get("filename", "")
        scale = np.array(numbers(shape, "scale", 3, where) or (1.0, 1.0, 1.0))
        if name not in loaded:
            loaded[name] = _read(_place(name, where, inside, relative), where)
        mesh = Mesh(loaded[name].vertices * scale, loaded[name].faces)
    else:
        mesh = _solid(shape, where)
    return mesh.moved(frame[:3, :3], frame[:3, 3])


def _solid(shape: Tag, where: str) -> Mesh:
    """Return a box, a cylinder or a ball."""

    def sizes(attribute: str, count: int) -> tuple[float, ...]:
        given = numbers(shape, attribute, count, where)
        if given is None or min(given) <= 0.0:
            raise InputError(f"a <{shape.name}> needs {attribute}", where=where, allowed="lengths above 0 in m")
        return given

    if shape.name == "box":
        return box(np.zeros(3), np.eye(3), [size / 2.0 for size in sizes("size", 3)])
    if shape.name == "cylinder":
        (radius,), (length,) = sizes("radius", 1), sizes("length", 1)
        half = np.array([0.0, 0.0, length / 2.0])
        return drum(-half, half, radius)
    if shape.name == "sphere":
        return ball(np.zeros(3), sizes("radius", 1)[0])
    raise InputError("this geometry is not known", where=where, came=shape.name, allowed="mesh, box, cylinder, sphere")


def _place(name: str, where: str, inside: Callable[[str], Path], relative: str) -> Path:
    """Return where a mesh lies in the project; any place outside is refused."""
    rest = name.removeprefix(_PACKAGE)
    if "://" in rest or not rest or rest.startswith("/"):
        raise InputError(
            "a mesh is read from the project's folder alone",
            where=where,
            came=name,
            allowed=f"a name in the folder, or {_PACKAGE}NAME/.. that lies in it",
        )
    beside = f"{relative}/" if relative else ""
    tried = [f"{beside}{rest}"]
    if name != rest:
        short = "/".join(PurePosixPath(rest).parts[1:])
        tried = [rest, f"{beside}{rest}", f"{beside}{short}", short]
    tried.append(PurePosixPath(rest).name)
    for one in dict.fromkeys(tried):
        path = inside(one)
        if exists(path):
            return path
    raise InputError(
        "there is no such mesh in the project's folder",
        where=where,
        came=name,
        cure="Take it in under its own name, or copy it there with its folders.",
    )


def _read(path: Path, where: str) -> Mesh:
    """Read a mesh; nothing that it names, such as materials, is read."""
    import trimesh

    kind = _KINDS.get(path.suffix.lower())
    if kind is None:
        raise InputError(
            "meshes of this kind are not read",
            where=where,
            came=path.name,
            allowed=", ".join(_KINDS),
            cure="Convert it.",
        )
    content = read_bytes(path, "mesh_size")
    given: Mapping[str, Any] = {"skip_materials": True} if kind == "obj" else {}
    try:
        made = trimesh.load_mesh(io.BytesIO(content), file_type=kind, process=False, resolver=None, **given)
        parts: Iterable[Any] = made.geometry.values() if hasattr(made, "geometry") else [made]
        meshes = [Mesh(np.asarray(part.vertices, float), np.asarray(part.faces, np.int32)) for part in parts]
    except Exception as error:  # whatever a reader of foreign files may raise
        raise InputError(f"this mesh cannot be read ({type(error).__name__})", where=str(path.name)) from error
    mesh = together(meshes)
    refuse_beyond("triangles", len(mesh.faces), where=path.name)
    corners = len(mesh.vertices)
    whole = len(mesh.faces) and mesh.faces.min() >= 0 and mesh.faces.max() < corners
    if not whole or not np.isfinite(mesh.vertices).all():
        raise InputError("this mesh has no triangles, or points that are no numbers", where=path.name)
    return mesh
