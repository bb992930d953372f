"""MCAP files of recordings for Foxglove, PlotJuggler and the tools of ROS 2 (extra `mcap`).

Topics:

- /tf (foxglove.FrameTransforms): pose of everything that was recorded with `position.x|y|z` and
  `orientation.w|x|y|z`, in the frame "world" (z up, m); the frame of a body has its name
  ("plant.uav")
- /scene (foxglove.SceneUpdate): shapes of the bodies, logged once, see `write_mcap`
- /signals/NAME (JSON): all signals of a component, nested by the dots of their names; NaN and
  infinities are null, units are in the schema

Simulation time 0 s is 1970-01-01 00:00 in the file. A run that starts before 0 s is shifted to
start there.
"""

import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import accumulate, chain
from pathlib import Path
from typing import Any

import numpy as np
import pydantic_core

from ..core.errors import InputError
from ..core.json_values import JsonObject
from ..core.recording import Recording
from .files import iterate_chunks, to_json_types, writing_atomically

ROWS_PER_CHUNK = 2000
_POSE_SIGNALS = [
    *(f"position.{axis}" for axis in "xyz"),
    *(f"orientation.{axis}" for axis in "wxyz"),
]
_ELEMENT_PATTERN = re.compile(r"(.*)\[[\d,]+\]")
#: maps each part of a name to an index of a column, indices of the elements of an array, or a
#: subtree
SignalTree = dict[str, "int | list[int] | SignalTree"]


def require_mcap() -> None:
    """Raise InputError if the package foxglove-sdk is not installed."""
    try:
        import foxglove  # noqa: F401
    except ImportError:
        raise InputError(
            'MCAP files need the package foxglove-sdk: pip install "fmi-cosim[mcap]"'
        ) from None


def write_mcap(
    recording: Recording,
    path: str | Path,
    scene: JsonObject | None = None,
    metadata: Mapping[str, Any] | None = None,
) -> None:
    """Write an MCAP file; an existing file is replaced only when the new one is complete.

    Args:
        recording: The recording.
        path: The MCAP file.
        scene: "bodies", "fixed" and "markers" of the scene, in the format of `cosim.report.scene`;
            None for no scene.
        metadata: Description of the run, written as metadata record "run".

    Raises:
        InputError: The file cannot be written, or the package foxglove-sdk is not installed.
        OutputError: The disk is full or defective.
    """
    require_mcap()
    import foxglove
    from foxglove.mcap import MCAPWriteOptions

    context = foxglove.Context()
    options = MCAPWriteOptions(compression_threads=0)
    with (
        writing_atomically(path) as temporary,
        foxglove.open_mcap(temporary, context=context, writer_options=options) as writer,
    ):
        if metadata:
            writer.write_metadata(
                "run", {key: json.dumps(to_json_types(value)) for key, value in metadata.items()}
            )
        time = recording.time
        shifted = time - min(float(time[0]), 0.0) if len(time) else time
        times = [round(1e9 * second) for second in shifted.tolist()]
        if scene and len(times):
            log_scene(scene, times[0], context)
        _log_poses(recording, times, context)
        _log_signals(recording, times, context)


def _log_poses(recording: Recording, times: list[int], context: Any) -> None:
    from foxglove.channels import FrameTransformsChannel
    from foxglove.messages import FrameTransform, FrameTransforms, Quaternion, Timestamp, Vector3

    names = find_poses(recording)
    if not names:
        return
    channel = FrameTransformsChannel("/tf", context=context)
    signals = chain.from_iterable(map(_pose_signals, names))
    columns = [recording.columns[signal] for signal in signals]
    for now, row in zip(times, _iterate_rows(columns), strict=True):
        stamp = Timestamp(*divmod(now, 10**9))
        numbers = (
            row[first : first + len(_POSE_SIGNALS)]
            for first in range(0, len(row), len(_POSE_SIGNALS))
        )
        transforms = [
            FrameTransform(
                timestamp=stamp,
                parent_frame_id="world",
                child_frame_id=name,
                translation=Vector3(x=x, y=y, z=z),
                rotation=Quaternion(w=qw, x=qx, y=qy, z=qz),
            )
            for name, (x, y, z, qw, qx, qy, qz) in zip(names, numbers, strict=True)
        ]
        channel.log(FrameTransforms(transforms=transforms), log_time=now)


def find_poses(recording: Recording) -> list[str]:
    """Return the prefixes of everything that was recorded with position and orientation."""
    prefixes = (
        name.removesuffix(".position.x")
        for name in recording.columns
        if name.endswith(".position.x")
    )
    recorded = recording.columns.keys()
    return [each for each in prefixes if recorded >= set(_pose_signals(each))]


def _pose_signals(name: str) -> list[str]:
    return [f"{name}.{signal}" for signal in _POSE_SIGNALS]


def _log_signals(recording: Recording, times: list[int], context: Any) -> None:
    from foxglove import Channel, Schema

    columns, tree = list(recording.columns.values()), _build_tree(list(recording.columns))
    channels = {}
    for component, node in tree.items():
        data = json.dumps(_json_schema(node, columns, list(recording.units.values()))).encode()
        schema = Schema(name=f"cosim.{component}", encoding="jsonschema", data=data)
        channels[component] = Channel(
            f"/signals/{component}", schema=schema, message_encoding="json", context=context
        )
    for now, row in zip(times, _iterate_rows(columns), strict=True):
        for component, channel in channels.items():
            channel.log(
                pydantic_core.to_json(_nest_values(tree[component], row), inf_nan_mode="null"),
                log_time=now,
            )


def _iterate_rows(columns: list[np.ndarray]) -> Iterator[tuple[Any, ...]]:
    for piece in iterate_chunks(columns, ROWS_PER_CHUNK) if columns else ():
        yield from zip(*(column[piece].tolist() for column in columns), strict=True)


def _build_tree(names: list[str]) -> SignalTree:
    """Group columns by the parts of their names.

    A name that is also the prefix of others gets the part `value` appended.
    """
    inner: set[str] = set()
    for name in names:
        inner.update(accumulate(name.split(".")[:-1], "{}.{}".format))
    tree: SignalTree = {}
    for column, name in enumerate(names):
        *path, leaf = [*name.split("."), *(["value"] if name in inner or "." not in name else [])]
        node: Any = tree
        for part in path:
            node = node.setdefault(part, {})
        if element := _ELEMENT_PATTERN.fullmatch(leaf):
            node.setdefault(element[1], []).append(column)
        else:
            node[leaf] = column
    return tree


def _nest_values(node: Any, row: tuple[Any, ...]) -> Any:
    """Return the values of a row in the structure of a node of the tree."""
    if isinstance(node, dict):
        return {name: _nest_values(child, row) for name, child in node.items()}
    return [row[column] for column in node] if isinstance(node, list) else row[node]


def _json_schema(node: Any, columns: list[np.ndarray], units: list[str]) -> dict[str, Any]:
    """Return the JSON Schema of the messages that `_nest_values` returns for a node of the tree."""
    if isinstance(node, dict):
        return {
            "type": "object",
            "properties": {
                name: _json_schema(child, columns, units) for name, child in node.items()
            },
        }
    if isinstance(node, list):
        return {"type": "array", "items": _json_schema(node[0], columns, units)}
    kind = {"b": "boolean", "i": "integer", "u": "integer", "f": "number"}.get(
        columns[node].dtype.kind, "string"
    )
    return {"type": kind, **({"description": units[node]} if units[node] else {})}


#: number of corners of a polygon that approximates a ring
_RING_CORNERS = 32


def log_scene(scene: JsonObject, now: int, context: Any) -> None:
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


def _scene_entity(name: str, frame: str, parts: Sequence[JsonObject], now: int) -> Any:
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


def _cube_primitive(part: JsonObject) -> Any:
    from foxglove.messages import CubePrimitive

    return CubePrimitive(pose=_pose(part), size=_size(*part["size"]), color=_colour(part))


def _sphere_primitive(part: JsonObject) -> Any:
    from foxglove.messages import SpherePrimitive

    diameter = 2 * part["size"][0]
    return SpherePrimitive(
        pose=_pose(part), size=_size(diameter, diameter, diameter), color=_colour(part)
    )


def _cylinder_primitive(part: JsonObject) -> Any:
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


def _line_primitive(part: JsonObject) -> Any:
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


def _pose(part: JsonObject) -> Any:
    from foxglove.messages import Pose, Quaternion, Vector3

    (x, y, z), (qx, qy, qz, qw) = part["position"], part.get("orientation", (0.0, 0.0, 0.0, 1.0))
    return Pose(position=Vector3(x=x, y=y, z=z), orientation=Quaternion(x=qx, y=qy, z=qz, w=qw))


def _size(x: float, y: float, z: float) -> Any:
    from foxglove.messages import Vector3

    return Vector3(x=x, y=y, z=z)


def _colour(part: JsonObject) -> Any:
    from foxglove.messages import Color

    red, green, blue = part["colour"]
    return Color(r=red, g=green, b=blue, a=part.get("opacity", 1.0))
