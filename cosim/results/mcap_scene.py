"""Conversion of a scene to Foxglove messages."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

#: number of corners of a polygon that approximates a ring
_RING_CORNERS = 32


def log_scene(scene: Mapping[str, Any], now: int, context: Any) -> None:
    """Log a scene (see `cosim.report.scene`) once, at the time `now` (ns), on the topic /scene."""
    from foxglove.channels import SceneUpdateChannel
    from foxglove.messages import SceneUpdate

    markers = [
        {
            "shape": "ring",
            "size": (marker["radius"], 0.02),
            "position": marker["position"],
            "colour": (0.9, 0.6, 0.1),
        }
        for marker in scene.get("markers", ())
    ]
    parts = {body["name"]: body["parts"] for body in scene.get("bodies", ())}
    entities = [_scene_entity(name, name, shapes, now) for name, shapes in parts.items()]
    entities.append(_scene_entity("fixed", "world", [*scene.get("fixed", ()), *markers], now))
    SceneUpdateChannel("/scene", context=context).log(SceneUpdate(entities=entities), log_time=now)


def _scene_entity(name: str, frame: str, parts: Sequence[Mapping[str, Any]], now: int) -> Any:
    from foxglove.messages import SceneEntity, Timestamp

    def primitives(*shapes: str) -> list[Any]:
        return [_PRIMITIVES[part["shape"]](part) for part in parts if part["shape"] in shapes]

    return SceneEntity(
        timestamp=Timestamp(*divmod(now, 10**9)),
        frame_id=frame,
        id=name,
        frame_locked=True,
        cubes=primitives("box"),
        spheres=primitives("sphere"),
        cylinders=primitives("cylinder", "cone"),
        lines=primitives("ring"),
    )


def _cube_primitive(part: Mapping[str, Any]) -> Any:
    from foxglove.messages import CubePrimitive

    return CubePrimitive(pose=_pose(part), size=_size(*part["size"]), color=_colour(part))


def _sphere_primitive(part: Mapping[str, Any]) -> Any:
    from foxglove.messages import SpherePrimitive

    diameter = 2 * part["size"][0]
    return SpherePrimitive(
        pose=_pose(part), size=_size(diameter, diameter, diameter), color=_colour(part)
    )


def _cylinder_primitive(part: Mapping[str, Any]) -> Any:
    """Convert a cylinder (radius, length) or a cone (lower and upper radius, length)."""
    from foxglove.messages import CylinderPrimitive

    lower, upper, length = (
        part["size"] if part["shape"] == "cone" else (part["size"][0], *part["size"])
    )
    widest = max(lower, upper)
    return CylinderPrimitive(
        pose=_pose(part),
        size=_size(2 * widest, 2 * widest, length),
        bottom_scale=lower / widest,
        top_scale=upper / widest,
        color=_colour(part),
    )


def _line_primitive(part: Mapping[str, Any]) -> Any:
    from foxglove.messages import LinePrimitive, LinePrimitiveLineType, Point3

    radius, thickness = part["size"]
    angles = (2 * math.pi * corner / _RING_CORNERS for corner in range(_RING_CORNERS))
    return LinePrimitive(
        type=LinePrimitiveLineType.LineLoop,
        pose=_pose(part),
        thickness=thickness,
        points=[
            Point3(x=radius * math.cos(angle), y=radius * math.sin(angle), z=0.0)
            for angle in angles
        ],
        color=_colour(part),
    )


_PRIMITIVES = {
    "box": _cube_primitive,
    "sphere": _sphere_primitive,
    "cylinder": _cylinder_primitive,
    "cone": _cylinder_primitive,
    "ring": _line_primitive,
}


def _pose(part: Mapping[str, Any]) -> Any:
    from foxglove.messages import Pose, Quaternion, Vector3

    (x, y, z), (qx, qy, qz, qw) = part["position"], part.get("orientation", (0.0, 0.0, 0.0, 1.0))
    return Pose(position=Vector3(x=x, y=y, z=z), orientation=Quaternion(x=qx, y=qy, z=qz, w=qw))


def _size(x: float, y: float, z: float) -> Any:
    from foxglove.messages import Vector3

    return Vector3(x=x, y=y, z=z)


def _colour(part: Mapping[str, Any]) -> Any:
    from foxglove.messages import Color

    red, green, blue = part["colour"]
    return Color(r=red, g=green, b=blue, a=part.get("opacity", 1.0))
