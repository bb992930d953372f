"""Layout of the system diagram.

Components in the order of their stages from left to right, and their connections.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Any, NamedTuple

from ..core.text import count_noun

WIDTH, HEIGHT, GAP_X, GAP_Y, MARGIN, LANE = 152.0, 52.0, 70.0, 34.0, 44.0, 14.0  # px
FRAME_GAP = 12.0  # px between a frame and its components
FRAME_ROWS = 0.2  # rows above and below a nested system, for its frame
TEXT_WIDTH = WIDTH - 16.0  # px, of the texts in a box
TITLE_SIZE, ORIGIN_SIZE = 13.0 * 1.1, 11.0  # px; semi-bold letters are a tenth wider
MAX_TOOLTIP_LINES = 40
_NARROW_LETTERS, _WIDE_LETTERS = frozenset("fijlrtIJ.,:;'|!()[]/\\ -"), frozenset("mwMW@%&+=<>#~^")


@dataclass(frozen=True)
class Box:
    """Box of a component: the position of its upper left corner (px) and its texts."""

    name: str
    x: float
    y: float
    title: str
    origin: str
    tooltip: str


class Frame(NamedTuple):
    """Frame of a nested system around its components (px)."""

    name: str
    x: float
    y: float
    width: float
    height: float


class Wire(NamedTuple):
    """Line for all connections from one component to another.

    SVG path, position (px) of the number of connections, texts.
    """

    path: str
    x: float
    y: float
    connections: int
    tooltip: str


@dataclass(frozen=True)
class Diagram:
    """All elements of the diagram and its size (px), for the page template."""

    width: float
    height: float
    boxes: Sequence[Box]
    frames: Sequence[Frame]
    wires: Sequence[Wire]


def build_diagram(system: Mapping[str, Any]) -> Diagram:
    """Return the diagram of a system that `scenario.overview.describe_system` has described."""
    known = {component["name"]: component for component in system["components"]}
    layout = _lay_out(system["stages"])
    boxes = {
        name: _build_box(known[name], *position) for name, position in layout.positions.items()
    }
    connections = _connections_by_pair(system["connections"], boxes)
    feedbacks = sum(boxes[target].x <= boxes[source].x for source, target in connections)
    bottom = MARGIN + layout.rows * (HEIGHT + GAP_Y)
    width = 2 * MARGIN + layout.columns * (WIDTH + GAP_X) - GAP_X
    wires = list(_wires(connections, boxes, bottom))
    return Diagram(
        width,
        bottom + LANE * feedbacks + MARGIN / 2,
        list(boxes.values()),
        list(_frames(boxes.values())),
        wires,
    )


class _GridLayout(NamedTuple):
    """Positions (column, row) of components by name, and the size of the grid."""

    positions: dict[str, tuple[float, float]]
    columns: int
    rows: float


def _lay_out(stages: Sequence[Sequence[Any]]) -> _GridLayout:
    """Lay out stages from left to right, each centred vertically.

    The members of a stage lie one below the other, a nested system with space for its frame.
    """
    blocks = []
    for stage in stages:
        block = _GridLayout({}, 0, 0.0)
        for member in stage:
            if isinstance(member, str):
                inner, height = _GridLayout({member: (0, 0)}, 1, 1), 1.0
            else:
                inner = _lay_out(member["stages"])
                inner = inner._replace(positions=_shifted(inner, 0, FRAME_ROWS))
                height = inner.rows + 2 * FRAME_ROWS
            block = _GridLayout(
                block.positions | _shifted(inner, 0, block.rows),
                max(block.columns, inner.columns),
                block.rows + height,
            )
        blocks.append(block)
    rows = max((block.rows for block in blocks), default=0)
    positions: dict[str, tuple[float, float]] = {}
    columns = 0
    for block in blocks:
        positions |= _shifted(block, columns, (rows - block.rows) / 2)
        columns += block.columns
    return _GridLayout(positions, columns, rows)


def _shifted(block: _GridLayout, columns: float, rows: float) -> dict[str, tuple[float, float]]:
    return {name: (x + columns, y + rows) for name, (x, y) in block.positions.items()}


def _build_box(component: Mapping[str, Any], column: float, row: float) -> Box:
    position = (MARGIN + column * (WIDTH + GAP_X), MARGIN + row * (HEIGHT + GAP_Y))
    name, origin = component["name"], component["origin"]
    every = f", every {component['period']:g} s" if component["period"] else ""
    tooltip = (
        f"{name}\n{origin}\n{count_noun(component['inputs'], 'input')}, "
        f"{count_noun(component['outputs'], 'output')}{every}"
    )
    file = origin.rpartition("/")[2]
    return Box(name, *position, _fit(name, TITLE_SIZE), _fit(file, ORIGIN_SIZE), tooltip)


def _fit(text: str, size: float) -> str:
    """Return a text that fits into a box in letters of `size` (px), shortened if necessary."""
    widths = list(accumulate(map(_letter_width, text), initial=1.0))  # with an ellipsis
    if (widths[-1] - 1.0) * size <= TEXT_WIDTH:
        return text
    return f"{text[: sum(width * size <= TEXT_WIDTH for width in widths) - 1]}…"


def _letter_width(letter: str) -> float:
    """Return the width of a letter (em) in a wide sans-serif font, DejaVu Sans.

    The reader's font is at most as wide.
    """
    if letter in _NARROW_LETTERS:
        return 0.41
    if letter in _WIDE_LETTERS or not letter.isascii():
        return 1.0
    return 0.78 if letter.isupper() else 0.64


def _connections_by_pair(
    connections: Sequence[Sequence[str]], boxes: Mapping[str, Box]
) -> dict[tuple[str, str], list[str]]:
    """Return a line of text for each connection, by (source component, target component)."""
    lines: dict[tuple[str, str], list[str]] = {}
    for source, target, unit, note in connections:
        ends = _component_of(source, boxes), _component_of(target, boxes)
        text = f"{source} → {target}"
        text += f"  [{unit}]" if unit else ""
        text += f"  ({note})" if note else ""
        if all(ends):
            lines.setdefault(ends, []).append(text)
    return lines


def _component_of(name: str, boxes: Mapping[str, Box]) -> str:
    """Return the component that a variable belongs to, or ""."""
    return max((box for box in boxes if name.startswith(f"{box}.")), key=len, default="")


def _wires(
    connections: Mapping[tuple[str, str], list[str]], boxes: Mapping[str, Box], bottom: float
) -> Iterator[Wire]:
    feedbacks = 0
    for (source, target), lines in connections.items():
        start, end = boxes[source], boxes[target]
        tooltip = "\n".join(lines[:MAX_TOOLTIP_LINES])
        if len(lines) > MAX_TOOLTIP_LINES:
            tooltip += f"\nand {len(lines) - MAX_TOOLTIP_LINES} more"
        if end.x > start.x:
            path, x, y = _forward_path(start, end)
        else:
            path, x, y = _feedback_path(start, end, feedbacks, bottom)
            feedbacks += 1
        yield Wire(path, x, y, len(lines), tooltip)


def _forward_path(start: Box, end: Box) -> tuple[str, float, float]:
    """Return a curve from a box to one further right, and its middle (px).

    It bends around the boxes between them.
    """
    x1, y1, x2, y2 = start.x + WIDTH, start.y + HEIGHT / 2, end.x, end.y + HEIGHT / 2
    bend = (x2 - x1) / 2
    passes_boxes = x2 - x1 > GAP_X + 1 and abs(y1 - y2) < HEIGHT
    lift = -(HEIGHT + GAP_Y) * 0.8 if passes_boxes else 0.0
    path = f"M{x1:g} {y1:g}C{x1 + bend:g} {y1 + lift:g} {x2 - bend:g} {y2 + lift:g} {x2:g} {y2:g}"
    return path, (x1 + x2) / 2, (y1 + y2) / 2 + 0.75 * lift


def _feedback_path(start: Box, end: Box, number: int, bottom: float) -> tuple[str, float, float]:
    """Return a path from a box to one further left, and its middle (px).

    It runs along a separate lane below all boxes.
    """
    aside, lane = 12 + 4 * (number % 6), bottom - GAP_Y / 2 + LANE * (number + 1)
    x1, y1, x2, y2 = start.x + WIDTH, start.y + 0.75 * HEIGHT, end.x, end.y + 0.75 * HEIGHT
    right, left = x1 + aside, x2 - aside
    return (
        _rounded_path([(x1, y1), (right, y1), (right, lane), (left, lane), (left, y2), (x2, y2)]),
        (left + right) / 2,
        lane,
    )


def _rounded_path(points: Sequence[tuple[float, float]], radius: float = 6.0) -> str:
    """Return a path along lines through `points`, with round corners of `radius` (px)."""
    path = "M{:g} {:g}".format(*points[0])
    for before, corner, after in zip(points, points[1:], points[2:], strict=False):
        (x1, y1), (x2, y2) = (_point_towards(corner, other, radius) for other in (before, after))
        path += f"L{x1:g} {y1:g}Q{corner[0]:g} {corner[1]:g} {x2:g} {y2:g}"
    return path + "L{:g} {:g}".format(*points[-1])


def _point_towards(
    corner: tuple[float, float], other: tuple[float, float], distance: float
) -> tuple[float, float]:
    share = min(0.5, distance / max(math.dist(corner, other), 1e-9))
    return corner[0] + share * (other[0] - corner[0]), corner[1] + share * (other[1] - corner[1])


def _frames(boxes: Iterable[Box]) -> Iterator[Frame]:
    """Yield a frame for each outermost nested system."""
    groups: dict[str, list[Box]] = {}
    for box in boxes:
        outer, dot, _ = box.name.partition(".")
        if dot:
            groups.setdefault(outer, []).append(box)
    for name, members in groups.items():
        x, y = min(box.x for box in members) - FRAME_GAP, min(box.y for box in members) - FRAME_GAP
        right = max(box.x for box in members) + WIDTH + FRAME_GAP
        low = max(box.y for box in members) + HEIGHT + FRAME_GAP
        yield Frame(name, x, y, right - x, low - y)
