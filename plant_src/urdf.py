"""Import of a vehicle from URDF (Unified Robot Description Format): mass, inertia, collision shape, meshes, places of rotors.

All links are one rigid body in the zero position of the joints. Frames of URDF are x forward, y left, z up, in m, kg and rad.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cosim.core.errors import InputError, Problem, did_you_mean

from . import mesh_import

#: lists of a vehicle file whose elements may name a link in place of position and axis
_NAMED_LISTS = ("rotors", "thrusters", "propellers")

_AXES = np.eye(3)


class Pose(NamedTuple):
    """Rotation matrix (3, 3) and position (m, shape (3,)) of a frame in another one."""

    rotation: np.ndarray
    position: np.ndarray

    def __matmul__(self, other: Pose) -> Pose:
        """Return the pose `other`, which is given in this frame, in the outer frame."""
        return Pose(self.rotation @ other.rotation, self.rotation @ other.position + self.position)


class RigidLinks(NamedTuple):
    """Rigid body of all links: mass (kg), centre of mass (m, root frame) and inertia about it (kg m2)."""

    mass: float
    centre: np.ndarray
    inertia: np.ndarray


def vehicle_from_urdf(urdf: Path, data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the data of a vehicle (`vehicles/data/README.md`).

    Args:
        urdf: URDF file.
        data: Further data of the vehicle. Mass, inertia and boxes are those of the URDF unless `data` have them. A rotor or
            thruster or propeller may have the key "link" in place of position and axis: it is at the origin of this link, and its
            thrust points along the z axis of the link (rotor) or the x axis (thruster, propeller). Given positions are in the
            root frame of the URDF and become relative to the centre of mass. The origin of a vessel is the root frame.

    Raises:
        InputError: With file and element, if the URDF cannot be read or does not describe a rigid body.
    """
    try:
        robot = ET.parse(urdf).getroot()  # noqa: S314 (the user's own file; expat limits the expansion of entities)
    except (OSError, ET.ParseError) as error:
        raise InputError(Problem(f"cannot be read: {error}", str(urdf))) from None
    poses = link_poses(robot, urdf)
    body = _rigid_body(robot, urdf, poses)
    source = f"URDF file {urdf.name}"
    is_vessel = data.get("family") in ("surface_vessel", "planar_vessel")
    origin = np.zeros(3) if is_vessel else body.centre
    frames = [(link, Pose(poses[_name(link)].rotation, poses[_name(link)].position - origin)) for link in robot.findall("link")]
    boxes = [box for link, pose in frames for box in _collision_shape(link, pose, urdf)]
    if not boxes and "boxes" not in data:
        raise InputError(Problem('no link has a collision shape; expected one, or "boxes" in the accompanying file', str(urdf)))
    result: dict[str, Any] = {
        **data,
        "mass": data.get("mass", {"value": body.mass, "unit": "kg", "source": source}),
        "boxes": data.get("boxes", [{**box, "source": source} for box in boxes]),
    }
    if data.get("family") == "planar_vessel":
        result.setdefault("yaw_inertia", {"value": float(body.inertia[2, 2]), "unit": "kg.m2", "source": source})
    else:
        result.setdefault("inertia", {"value": body.inertia.tolist(), "unit": "kg.m2", "source": source})
    if is_vessel:
        result.setdefault("centre_of_mass", {"value": body.centre.tolist(), "unit": "m", "source": source})
    triangles = [mesh for link, pose in frames for mesh in _visual_meshes(link, pose, urdf)]
    if triangles and "visual" not in data:
        result["visual"] = mesh_import.visual_data(np.concatenate(triangles), source)
    for key in _NAMED_LISTS:
        if key in data:
            result[key] = [_place(each, poses, origin, urdf, key) for each in data[key]]
    return result


def link_poses(robot: ET.Element, urdf: Path) -> dict[str, Pose]:
    """Return the pose of each link in the frame of the root link.

    Raises:
        InputError: The joints do not connect all links to one tree.
    """
    joints = [(_link(joint, "parent"), _link(joint, "child"), _origin(joint)) for joint in robot.findall("joint")]
    links = [_name(link) for link in robot.findall("link")]
    roots = [link for link in links if link not in {child for _, child, _ in joints}]
    if len(roots) != 1:
        raise InputError(Problem(f"found the root links {roots}, expected one", str(urdf)))
    poses = {roots[0]: Pose(_AXES, np.zeros(3))}
    for _ in joints:
        poses |= {child: poses[parent] @ origin for parent, child, origin in joints if parent in poses}
    if missing := [link for link in links if link not in poses]:
        raise InputError(Problem(f"no joints connect the links {missing} to {roots[0]}", str(urdf)))
    return poses


def _rigid_body(robot: ET.Element, urdf: Path, poses: Mapping[str, Pose]) -> RigidLinks:
    """Compose mass and inertia of all links."""
    masses, centres, tensors = [], [], []
    for link in robot.findall("link"):
        if (inertial := link.find("inertial")) is not None:
            frame = poses[_name(link)] @ _origin(inertial)
            mass, inertia = inertial.find("mass"), inertial.find("inertia")
            if mass is None or inertia is None:
                raise InputError(Problem(f'link "{_name(link)}": <inertial> needs <mass> and <inertia>', str(urdf)))
            values = {axes: float(inertia.get(f"i{axes}", 0)) for axes in ("xx", "xy", "xz", "yy", "yz", "zz")}
            element = np.array([[values["".join(sorted(row + column))] for column in "xyz"] for row in "xyz"])
            masses.append(float(mass.get("value", 0)))
            centres.append(frame.position)
            tensors.append(frame.rotation @ element @ frame.rotation.T)
    total = sum(masses)
    if not total > 0:
        raise InputError(Problem(f"found the mass {total:g}, expected links with <inertial> and a mass above 0", str(urdf)))
    centre = np.average(centres, axis=0, weights=masses)
    composed = np.zeros((3, 3))
    for weight, place, tensor in zip(masses, centres, tensors, strict=True):
        arm = place - centre
        composed += tensor + weight * (arm @ arm * _AXES - np.outer(arm, arm))
    return RigidLinks(total, centre, (composed + composed.T) / 2)


def _collision_shape(link: ET.Element, pose: Pose, urdf: Path) -> Iterator[dict[str, Any]]:
    """Yield the collision shapes of a link; what is not an upright box or a mesh becomes the level box around it."""
    for collision in link.findall("collision"):
        frame, shape = pose @ _origin(collision), collision.find("geometry/*")
        if shape is None:
            raise InputError(Problem(f'link "{_name(link)}": <collision> needs a <geometry>', str(urdf)))
        if shape.tag == "mesh":
            for points in mesh_import.convex_pieces(_mesh(shape, urdf)):
                yield mesh_import.piece_data(points @ frame.rotation.T + frame.position, "")
            continue
        match shape.tag:
            case "box":
                edges = _numbers(shape, "size")
            case "cylinder":
                edges = np.array([2 * _number(shape, "radius"), 2 * _number(shape, "radius"), _number(shape, "length")])
            case "sphere":
                edges = np.full(3, 2 * _number(shape, "radius"))
            case found:
                text = f'link "{_name(link)}": found the collision geometry {found}, expected box, cylinder, sphere or mesh'
                raise InputError(Problem(text, str(urdf)))
        upright = abs(frame.rotation[2, 2]) > 1 - 1e-9
        size = edges if upright else np.abs(frame.rotation) @ edges
        yaw = float(np.arctan2(frame.rotation[1, 0], frame.rotation[0, 0])) if upright else 0.0
        yield {"size": size.tolist(), "position": frame.position.tolist(), "yaw": yaw}


def _visual_meshes(link: ET.Element, pose: Pose, urdf: Path) -> Iterator[np.ndarray]:
    """Yield the triangles of the visual meshes of a link, each of shape (n, 3, 3)."""
    for visual in link.findall("visual"):
        if (shape := visual.find("geometry/mesh")) is not None:
            frame = pose @ _origin(visual)
            yield np.asarray(_mesh(shape, urdf).triangles) @ frame.rotation.T + frame.position


def _mesh(shape: ET.Element, urdf: Path) -> Any:
    """Return the mesh of <mesh>; the path of "package://NAME/path" starts from a folder NAME above the URDF file."""
    name = shape.get("filename", "")
    folders = [urdf.parent]
    if name.startswith("package://"):
        package, _, name = name.removeprefix("package://").partition("/")
        folders = [folder for folder in urdf.resolve().parents if folder.name == package] or folders
    return mesh_import.load_mesh(folders[0] / name.removeprefix("file://"), _numbers(shape, "scale", "1 1 1").tolist())


def _place(element: Mapping[str, Any], poses: Mapping[str, Pose], origin: np.ndarray, urdf: Path, key: str) -> dict[str, Any]:
    """Return a rotor, thruster or propeller with its position relative to the origin of the vehicle file."""
    placed = dict(element)
    if "link" in placed:
        name = str(placed.pop("link"))
        if name not in poses:
            raise InputError(Problem(f'{key}: no link "{name}"{did_you_mean(name, poses)}', str(urdf)))
        pose = poses[name]
        column = 2 if key == "rotors" else 0
        placed = {"position": pose.position.tolist(), "axis": pose.rotation[:, column].tolist(), "label": name, **placed}
    placed["position"] = (np.array(placed["position"], float) - origin).tolist()
    return placed


def _name(element: ET.Element) -> str:
    return element.get("name", "")


def _link(joint: ET.Element, side: str) -> str:
    element = joint.find(side)
    return "" if element is None else element.get("link", "")


def _number(element: ET.Element, name: str) -> float:
    return float(element.get(name, "nan"))


def _numbers(element: ET.Element, name: str, default: str = "nan nan nan") -> np.ndarray:
    return np.array([float(text) for text in element.get(name, default).split()])


def _origin(element: ET.Element) -> Pose:
    """Return the pose of <origin>, whose angles are rotations about the fixed axes x, y and z."""
    origin = element.find("origin")
    if origin is None:
        return Pose(_AXES, np.zeros(3))
    rotation = _AXES
    for axis, angle in enumerate(_numbers(origin, "rpy", "0 0 0")):
        first, second = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(3)
        turn[first, first] = turn[second, second] = np.cos(angle)
        turn[second, first], turn[first, second] = np.sin(angle), -np.sin(angle)
        rotation = turn @ rotation
    return Pose(rotation, _numbers(origin, "xyz", "0 0 0"))
