"""Import of a vehicle from URDF (Unified Robot Description Format).

Mass, inertia, collision shape, appearance, places of rotors.

All links are one rigid body in the zero position of the joints. Frames of URDF are x forward, y
left, z up, in m, kg and rad.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cosim.core.errors import InputError, Problem, did_you_mean

from ..catalogue import NAMED_LISTS
from ..vehicles.common.shapes import inertia_problems
from ..vehicles.common.vehicle_reader import QuantityReader
from . import mesh_import
from .mesh_import import ImportedVehicle, box_triangles, cylinder_triangles, sphere_triangles
from .urdf_file import UrdfFile

_AXES = np.eye(3)


class Pose(NamedTuple):
    """Rotation matrix (3, 3) and position (m, shape (3,)) of a frame in another one."""

    rotation: np.ndarray
    position: np.ndarray

    def __matmul__(self, other: Pose) -> Pose:
        """Return the pose `other`, which is given in this frame, in the outer frame."""
        return Pose(self.rotation @ other.rotation, self.rotation @ other.position + self.position)

    def transformed(self, points: np.ndarray) -> np.ndarray:
        """Return points of this frame, shape (..., 3), in the outer frame."""
        result: np.ndarray = points @ self.rotation.T + self.position
        return result


class RigidLinks(NamedTuple):
    """Rigid body of all links.

    Mass (kg), centre of mass (m, root frame) and inertia about it (kg m2).
    """

    mass: float
    centre: np.ndarray
    inertia: np.ndarray


def vehicle_from_urdf(path: Path, data: Mapping[str, Any]) -> ImportedVehicle:
    """Return the data of a vehicle (`vehicles/data/README.md`).

    Args:
        path: URDF file.
        data: Further data of the vehicle. Mass, inertia and boxes are those of the URDF unless
            `data` have them. A rotor or thruster or propeller may have the key "link" in place of
            position and axis: it is at the origin of this link, and its thrust points along the z
            axis of the link (rotor) or the x axis (thruster, propeller). Given positions are in the
            root frame of the URDF and become relative to the centre of mass. The origin of a vessel
            is the root frame.

    Raises:
        InputError: The URDF cannot be read or does not describe a rigid body: with file, line and
            link. Or `data` name a link that does not exist: the subject begins with "arguments" and
            continues with the path in `data`.
    """
    urdf = UrdfFile(path)
    poses = link_poses(urdf)
    body = _rigid_body(urdf, poses)
    source = f"URDF file {path.name}"
    is_vessel = data.get("family") in ("surface_vessel", "planar_vessel")
    origin = np.zeros(3) if is_vessel else body.centre
    frames = [
        (link, Pose(poses[name].rotation, poses[name].position - origin))
        for name, link in urdf.links.items()
    ]
    boxes: list[dict[str, Any]] = []
    for link, pose in frames:
        boxes += _collision_shape(urdf, link, pose)
    if not boxes and "boxes" not in data:
        raise InputError(
            Problem(
                'no link has a collision shape; expected one, or "boxes" in the accompanying file',
                str(path),
            )
        )
    result: dict[str, Any] = {
        **data,
        "mass": data.get("mass", {"value": body.mass, "unit": "kg", "source": source}),
        "boxes": data.get("boxes", [{**box, "source": source} for box in boxes]),
    }
    if data.get("family") == "planar_vessel":
        result.setdefault(
            "yaw_inertia", {"value": float(body.inertia[2, 2]), "unit": "kg.m2", "source": source}
        )
    else:
        result.setdefault(
            "inertia", {"value": body.inertia.tolist(), "unit": "kg.m2", "source": source}
        )
    if is_vessel:
        result.setdefault(
            "centre_of_mass", {"value": body.centre.tolist(), "unit": "m", "source": source}
        )
    if "visual" not in data and any(
        link.find("visual") is not None for link in urdf.links.values()
    ):
        triangles: list[np.ndarray] = []
        for link, pose in frames:
            triangles += _drawn_shapes(urdf, link, pose)
        result["visual"] = mesh_import.visual_data(np.concatenate(triangles), source)
    for key in NAMED_LISTS:
        if isinstance(elements := data.get(key), list):
            result[key] = _placed_elements(elements, poses, origin, key)
    return ImportedVehicle(
        result, body.centre.tolist(), [*_link_warnings(urdf), *_angle_warnings(urdf)]
    )


def link_poses(urdf: UrdfFile) -> dict[str, Pose]:
    """Return the pose of each link in the frame of the root link.

    Raises:
        InputError: The joints do not connect all links to one tree.
    """
    joints = [
        (_link_of(urdf, joint, "parent"), _link_of(urdf, joint, "child"), joint)
        for joint in urdf.root.findall("joint")
    ]
    children: dict[str, str] = {}
    for _, child, joint in joints:
        if child in children:
            raise urdf.error(
                joint, f'the link "{child}" is the child of the joint "{children[child]}" too'
            )
        children[child] = joint.get("name", "")
    roots = [link for link in urdf.links if link not in children]
    if len(roots) != 1:
        raise InputError(
            Problem(
                f"found the root links {roots}, expected one that is the child of no joint",
                str(urdf.path),
            )
        )
    poses = {roots[0]: Pose(_AXES, np.zeros(3))}
    for _ in joints:
        poses |= {
            child: poses[parent] @ _origin(urdf, joint)
            for parent, child, joint in joints
            if parent in poses
        }
    if missing := [link for link in urdf.links if link not in poses]:
        raise urdf.error(
            urdf.links[missing[0]], f"no joints connect it to the root link {roots[0]}"
        )
    return poses


def _link_of(urdf: UrdfFile, joint: ET.Element, side: str) -> str:
    """Return the name of the parent or child link of a joint."""
    element = urdf.child(joint, side)
    if (name := element.get("link", "")) not in urdf.links:
        raise urdf.error(element, f'no link "{name}"{did_you_mean(name, urdf.links)}')
    return name


def _rigid_body(urdf: UrdfFile, poses: Mapping[str, Pose]) -> RigidLinks:
    """Compose mass and inertia of all links."""
    masses, centres, tensors, problems = [], [], [], []
    for name, link in urdf.links.items():
        if (inertial := link.find("inertial")) is not None:
            frame = poses[name] @ _origin(urdf, inertial)
            tensor, element = _inertia(urdf, inertial), urdf.child(inertial, "inertia")
            problems += [urdf.error(element, text).problems[0] for text in inertia_problems(tensor)]
            masses.append(urdf.number(urdf.child(inertial, "mass"), "value", low=0.0))
            centres.append(frame.position)
            tensors.append(frame.rotation @ tensor @ frame.rotation.T)
    total = sum(masses)
    if not total > 0:
        raise InputError(
            Problem(
                f"found the mass {total:g}, expected links with <inertial> and a mass above 0",
                str(urdf.path),
            )
        )
    centre = np.average(centres, axis=0, weights=masses)
    composed = np.zeros((3, 3))
    for weight, place, tensor in zip(masses, centres, tensors, strict=True):
        arm = place - centre
        composed += tensor + weight * (arm @ arm * _AXES - np.outer(arm, arm))
    composed = (composed + composed.T) / 2
    if impossible := [f"inertia of all links: {text}" for text in inertia_problems(composed)]:
        raise InputError(problems or [Problem(text, str(urdf.path)) for text in impossible])
    return RigidLinks(total, centre, composed)


def _inertia(urdf: UrdfFile, inertial: ET.Element) -> np.ndarray:
    """Return the inertia tensor (kg m2) of <inertial>, shape (3, 3).

    Missing products of inertia are 0.
    """
    element = urdf.child(inertial, "inertia")
    xx, yy, zz = (urdf.number(element, name) for name in ("ixx", "iyy", "izz"))
    xy, xz, yz = (urdf.number(element, name, "0") for name in ("ixy", "ixz", "iyz"))
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _link_warnings(urdf: UrdfFile) -> Iterator[str]:
    """Yield a warning for each link with a shape and no mass, or with a mass and no inertia."""
    for name, link in urdf.links.items():
        inertial, has_shape = (
            link.find("inertial"),
            link.find("visual") is not None or link.find("collision") is not None,
        )
        if inertial is None and has_shape:
            yield f'{urdf.where(link)}: link "{name}" has a shape but no <inertial>: its mass is 0'
        if (
            inertial is not None
            and urdf.number(urdf.child(inertial, "mass"), "value")
            and not _inertia(urdf, inertial).any()
        ):
            yield (
                f'{urdf.where(inertial)}: link "{name}" has a mass but the inertia 0: it is a point'
            )


def _angle_warnings(urdf: UrdfFile) -> Iterator[str]:
    """Yield a warning about the first angles of more than a turn, with the number of the others."""
    origins: list[ET.Element] = []
    for part in urdf.root:
        if part.tag in ("link", "joint"):
            origins += part.iter("origin")
    angles = [(origin, urdf.numbers(origin, "rpy", 3, "0 0 0")) for origin in origins]
    large = [(origin, numbers) for origin, numbers in angles if max(abs(numbers)) > 2 * np.pi]
    if large:
        origin, numbers = large[0]
        found = " ".join(f"{number:g}" for number in numbers)
        more = f" ({len(large) - 1} more such origins)" if len(large) > 1 else ""
        text = f"rpy: found {found}, radians expected; in degrees? A right angle is 1.5708{more}"
        yield str(urdf.error(origin, text))


def _collision_shape(urdf: UrdfFile, link: ET.Element, pose: Pose) -> Iterator[dict[str, Any]]:
    """Yield the collision shapes of a link.

    What is not an upright box or a mesh becomes the level box around it.
    """
    for collision in link.findall("collision"):
        frame, shape = pose @ _origin(urdf, collision), urdf.child(collision, "geometry/*")
        if shape.tag == "mesh":
            for points in mesh_import.convex_pieces(_mesh(urdf, shape)):
                yield mesh_import.piece_data(frame.transformed(points), "")
            continue
        edges = _edges(urdf, shape)
        upright = abs(frame.rotation[2, 2]) > 1 - 1e-9
        size = edges if upright else np.abs(frame.rotation) @ edges
        yaw = float(np.arctan2(frame.rotation[1, 0], frame.rotation[0, 0])) if upright else 0.0
        yield {"size": size.tolist(), "position": frame.position.tolist(), "yaw": yaw}


def _edges(urdf: UrdfFile, shape: ET.Element) -> np.ndarray:
    """Return the edges (m) of the box around a primitive shape, shape (3,)."""
    match shape.tag:
        case "box":
            return urdf.edges(shape, urdf.numbers(shape, "size", 3).tolist())
        case "cylinder":
            diameter = 2 * urdf.number(shape, "radius")
            return urdf.edges(shape, (diameter, diameter, urdf.number(shape, "length")))
        case "sphere":
            return urdf.edges(shape, (2 * urdf.number(shape, "radius"),) * 3)
    raise urdf.error(
        shape, f"found the geometry {shape.tag}, expected box, cylinder, sphere or mesh"
    )


def _drawn_shapes(urdf: UrdfFile, link: ET.Element, pose: Pose) -> Iterator[np.ndarray]:
    """Yield the triangles of the visual or else collision shapes of a link, shape (n, 3, 3)."""
    for element in link.findall("visual") or link.findall("collision"):
        yield (pose @ _origin(urdf, element)).transformed(
            _triangles(urdf, urdf.child(element, "geometry/*"))
        )


def _triangles(urdf: UrdfFile, shape: ET.Element) -> np.ndarray:
    if shape.tag == "mesh":
        return np.asarray(_mesh(urdf, shape).triangles)
    length, _, height = edges = _edges(urdf, shape)
    match shape.tag:
        case "cylinder":
            return cylinder_triangles(length / 2, height)
        case "sphere":
            return sphere_triangles(length / 2)
    return box_triangles(edges.tolist())


def _mesh(urdf: UrdfFile, shape: ET.Element) -> Any:
    """Return the mesh of <mesh>.

    The path of "package://NAME/path" starts from a folder NAME above the URDF file.
    """
    name = shape.get("filename", "")
    folders = [urdf.path.parent]
    if name.startswith("package://"):
        package, _, name = name.removeprefix("package://").partition("/")
        folders = [
            folder for folder in urdf.path.resolve().parents if folder.name == package
        ] or folders
    scale = urdf.numbers(shape, "scale", 3, "1 1 1").tolist()
    try:
        return mesh_import.load_mesh(folders[0] / name.removeprefix("file://"), scale)
    except InputError as error:
        raise urdf.error(shape, str(error)) from None


def _placed_elements(
    elements: list[Any], poses: Mapping[str, Pose], origin: np.ndarray, key: str
) -> list[Any]:
    """Return actuators with positions relative to the origin of the vehicle file."""
    used: dict[str, int] = {}
    for i, element in enumerate(elements):
        if isinstance(element, Mapping) and "link" in element:
            path, name = ("arguments", key, str(i)), str(element["link"])
            if name not in poses:
                raise InputError(
                    Problem(f'no link "{name}"{did_you_mean(name, poses)}', "", (*path, "link"))
                )
            if name in used:
                raise InputError(
                    Problem(
                        f'found the link "{name}" of {key}[{used[name]}] again', "", (*path, "link")
                    )
                )
            if "position" in element:
                raise InputError(
                    Problem(
                        'found "link" and "position", expected one of them', "", (*path, "position")
                    )
                )
            used[name] = i
    reader = QuantityReader()
    placed = [_placed(element, poses, key) for element in elements]
    for i, element in enumerate(placed):
        if isinstance(element, dict) and "position" in element:
            position = reader.vector_quantity(
                element["position"], (key, str(i), "position"), "m", "xyz"
            )
            element["position"] = (position - origin).tolist()
    if reader.problems:
        raise InputError(reader.problems)
    return placed


def _placed(element: Any, poses: Mapping[str, Pose], key: str) -> Any:
    """Return a rotor, thruster or propeller with position and axis in place of a link."""
    if not isinstance(element, Mapping) or "link" not in element:
        return dict(element) if isinstance(element, Mapping) else element
    pose, column = poses[name := str(element["link"])], 2 if key == "rotors" else 0
    place = {
        "position": pose.position.tolist(),
        "axis": pose.rotation[:, column].tolist(),
        "label": name,
    }
    return {**place, **{other: value for other, value in element.items() if other != "link"}}


def _origin(urdf: UrdfFile, element: ET.Element) -> Pose:
    """Return the pose of <origin>, whose angles are rotations about the fixed axes x, y and z."""
    origin = element.find("origin")
    if origin is None:
        return Pose(_AXES, np.zeros(3))
    rotation = _AXES
    for axis, angle in enumerate(urdf.numbers(origin, "rpy", 3, "0 0 0")):
        first, second = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(3)
        turn[first, first] = turn[second, second] = np.cos(angle)
        turn[second, first], turn[first, second] = np.sin(angle), -np.sin(angle)
        rotation = turn @ rotation
    return Pose(rotation, urdf.numbers(origin, "xyz", 3, "0 0 0"))
