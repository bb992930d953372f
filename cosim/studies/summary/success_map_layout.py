"""Where the parts of a map of success go, and its texts as they fit there; lengths in in, sizes of texts in pt."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

from .success_map import SuccessMap

#: sizes of texts: levels along the axes, panels, names of the axes
TICK, PANEL, AXIS = 7.0, 7.5, 8.0
#: the panels together are at most so large: the page of a two-column paper
_LARGEST = 6.3, 8.2
_LARGEST_CELL = 0.9, 0.46
_GAP = 0.12
#: between a text and the next thing; the colours' scale with its numbers
_PAD, _SCALE = 0.06, 0.46


class Margins(NamedTuple):
    """Around the panels."""

    left: float
    right: float
    bottom: float
    top: float


_LEAST = Margins(0.62, 0.78, 0.5, 0.42)


@dataclass(frozen=True)
class Layout:
    """Sizes and texts of a map's figure."""

    map_: SuccessMap

    @cached_property
    def levels(self) -> tuple[Sequence[Any], Sequence[Any], Sequence[Any], Sequence[Any]]:
        """Of rows, columns, y and x."""
        spec = self.map_.spec
        return self.map_.along(spec.rows), self.map_.along(spec.columns), self.map_.along(spec.y), self.map_.along(spec.x)

    @cached_property
    def cell(self) -> tuple[float, float]:
        rows, columns, ys, xs = map(len, self.levels)
        return min(_LARGEST_CELL[0], _LARGEST[0] / (columns * xs)), min(_LARGEST_CELL[1], _LARGEST[1] / (rows * ys))

    @cached_property
    def panel(self) -> tuple[float, float]:
        return len(self.levels[3]) * self.cell[0], len(self.levels[2]) * self.cell[1]

    @cached_property
    def panels(self) -> tuple[float, float]:
        """All of them with the gaps between them."""
        return len(self.levels[1]) * (self.panel[0] + _GAP), len(self.levels[0]) * (self.panel[1] + _GAP)

    @cached_property
    def total(self) -> tuple[float, float]:
        margins = self.margins
        return self.panels[0] + margins.left + margins.right, self.panels[1] + margins.bottom + margins.top

    @property
    def places(self) -> dict[str, float]:
        """Of the panels in the figure, as matplotlib wants them: shares of the figure, and of a panel."""
        (width, height), margins = self.total, self.margins
        return {
            "left": margins.left / width,
            "right": 1 - margins.right / width,
            "bottom": margins.bottom / height,
            "top": 1 - margins.top / height,
            "wspace": _GAP / self.panel[0],
            "hspace": _GAP / self.panel[1],
        }

    @property
    def centre(self) -> tuple[float, float]:
        """Of the panels, as shares of the figure."""
        (width, height), margins = self.total, self.margins
        return (margins.left + self.panels[0] / 2) / width, (margins.bottom + self.panels[1] / 2) / height

    @property
    def scale(self) -> tuple[float, float, float, float]:
        """Left, bottom, width and height of the colours' scale, as shares of the figure."""
        width, height = self.total
        long = min(1.6, self.panels[1])
        return 1 - _SCALE / width, self.centre[1] - long / 2 / height, 0.08 / width, long / height

    # -- texts ---------------------------------------------------------------------------------------------------------

    @cached_property
    def titles(self) -> tuple[str, str]:
        """Names of the axes x and y."""
        spec, (width, height) = self.map_.spec, self.panels
        x = _wrapped(self.map_.title(spec.x), width + 2 * _LEAST.left, AXIS)
        return x, _wrapped(self.map_.title(spec.y), height + _LEAST.bottom, AXIS)

    @cached_property
    def above(self) -> list[str]:
        """What stands above each column of panels."""
        columns = self.map_.spec.columns
        if columns is None:
            return []
        title = self.map_.title(columns)
        texts = (f"{title}: {_text(label)}" if title else _text(label) for label in self.levels[1])
        return [_fitted(text, self.panel[0] + _GAP - _PAD, PANEL) for text in texts]

    @cached_property
    def beside(self) -> list[str]:
        """What stands beside each row of panels."""
        if self.map_.spec.rows is None:
            return []
        return [_fitted(_text(label), self.panel[1] + _GAP - _PAD, AXIS, "bold") for label in self.levels[0]]

    @cached_property
    def y_ticks(self) -> dict[int, str]:
        """Levels along y by their number; only every second, third, ... where cells are lower than a line."""
        return _thinned(list(map(_text, self.levels[2])), self.cell[1])

    @cached_property
    def x_ticks(self) -> dict[int, str]:
        """Levels along x by their number, as y's; turned where they are wider than cells."""
        texts = list(map(_text, self.levels[3]))
        return _thinned(texts, self.cell[0]) if self.turned else dict(enumerate(map(self._in_cell, texts)))

    @cached_property
    def turned(self) -> bool:
        """Whether levels along x are read from below: their words are wider than a cell."""
        return _width(map(self._in_cell, map(_text, self.levels[3])), TICK) > self.cell[0] - _PAD

    def _in_cell(self, text: str) -> str:
        return _wrapped(text, self.cell[0] - _PAD, TICK)

    @cached_property
    def margins(self) -> Margins:
        """As wide as the texts in them."""
        x, y = self.titles
        below = _width(self.x_ticks.values(), TICK) if self.turned else _height(self.x_ticks.values(), TICK)
        needed = Margins(
            left=_height([y], AXIS) + _width(self.y_ticks.values(), TICK) + 4 * _PAD,
            right=_height(self.beside, AXIS) + 0.02 * self.panel[0] + _SCALE + _PAD,
            bottom=_height([x], AXIS) + below + 3 * _PAD,
            top=_height(self.above, PANEL) + 3 * _PAD,
        )
        return Margins(*map(max, needed, _LEAST))


def _text(label: Any) -> str:
    return f"{label:g}" if isinstance(label, float) else str(label)


def _width(texts: Iterable[str], size: float, weight: str = "normal") -> float:
    """Of the widest line."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextPath

    font = FontProperties(size=size, weight=weight)
    lines = (line for text in texts for line in text.split("\n") if line.strip())
    return max((float(TextPath((0, 0), line, prop=font).get_extents().x1) / 72 for line in lines), default=0.0)


def _height(texts: Iterable[str], size: float) -> float:
    """Of the text with the most lines."""
    return max((text.count("\n") + 1 for text in texts), default=0) * _line(size)


def _line(size: float) -> float:
    return 1.2 * size / 72


def _wrapped(text: str, width: float, size: float, weight: str = "normal") -> str:
    """In lines of at most `width`, broken between words."""
    lines: list[str] = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and _width([longer], size, weight) <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    return "\n".join(lines)


def _fitted(text: str, width: float, size: float, weight: str = "normal") -> str:
    """As `_wrapped`, but words that are wider are broken too."""
    lines = _wrapped(text, width, size, weight).split("\n")
    return "\n".join(piece for line in lines for piece in _pieces(line, width, size, weight))


def _pieces(word: str, width: float, size: float, weight: str) -> Iterator[str]:
    while word:
        length = next((n for n in range(len(word), 1, -1) if _width([word[:n]], size, weight) <= width), 1)
        yield word[:length]
        word = word[length:]


def _thinned(texts: Sequence[str], space: float) -> dict[int, str]:
    """Every n-th text by its number, so that lines that are `space` apart do not touch."""
    every = math.ceil(_line(TICK) / space)
    return {i: text for i, text in enumerate(texts) if i % every == 0}
