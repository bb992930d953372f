"""Where the parts of a map of success go, and its texts as they fit there; lengths in in, sizes of texts in pt."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

from .success_map import SuccessMap

#: sizes of texts: levels along the axes, panels, names of the axes
TICK_FONT_SIZE, PANEL_FONT_SIZE, AXIS_FONT_SIZE = 7.0, 7.5, 8.0
#: the panels together are at most so large: the page of a two-column paper
_MAX_SIZE = 6.3, 8.2
_MAX_CELL_SIZE = 0.9, 0.46
_GAP = 0.12
#: between a text and the next thing; the colours' scale with its numbers
_PAD, _COLOUR_BAR_WIDTH = 0.06, 0.46


class Margins(NamedTuple):
    """Around the panels."""

    left: float
    right: float
    bottom: float
    top: float


_MIN_MARGINS = Margins(0.62, 0.78, 0.5, 0.42)


@dataclass(frozen=True)
class MapLayout:
    """Sizes and texts of a map's figure."""

    map_: SuccessMap

    @cached_property
    def levels(self) -> tuple[Sequence[Any], Sequence[Any], Sequence[Any], Sequence[Any]]:
        """Of rows, columns, y and x."""
        spec = self.map_.spec
        return (
            self.map_.axis_labels(spec.rows),
            self.map_.axis_labels(spec.columns),
            self.map_.axis_labels(spec.y),
            self.map_.axis_labels(spec.x),
        )

    @cached_property
    def cell(self) -> tuple[float, float]:
        rows, columns, ys, xs = map(len, self.levels)
        return min(_MAX_CELL_SIZE[0], _MAX_SIZE[0] / (columns * xs)), min(_MAX_CELL_SIZE[1], _MAX_SIZE[1] / (rows * ys))

    @cached_property
    def panel(self) -> tuple[float, float]:
        return len(self.levels[3]) * self.cell[0], len(self.levels[2]) * self.cell[1]

    @cached_property
    def panels_size(self) -> tuple[float, float]:
        """All of them with the gaps between them."""
        return len(self.levels[1]) * (self.panel[0] + _GAP), len(self.levels[0]) * (self.panel[1] + _GAP)

    @cached_property
    def figure_size(self) -> tuple[float, float]:
        margins = self.margins
        return self.panels_size[0] + margins.left + margins.right, self.panels_size[1] + margins.bottom + margins.top

    @property
    def subplot_parameters(self) -> dict[str, float]:
        """Of the panels in the figure, as matplotlib wants them: shares of the figure, and of a panel."""
        (width, height), margins = self.figure_size, self.margins
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
        (width, height), margins = self.figure_size, self.margins
        return (margins.left + self.panels_size[0] / 2) / width, (margins.bottom + self.panels_size[1] / 2) / height

    @property
    def colour_bar(self) -> tuple[float, float, float, float]:
        """Left, bottom, width and height of the colours' scale, as shares of the figure."""
        width, height = self.figure_size
        long = min(1.6, self.panels_size[1])
        return 1 - _COLOUR_BAR_WIDTH / width, self.centre[1] - long / 2 / height, 0.08 / width, long / height

    # -- texts ---------------------------------------------------------------------------------------------------------

    @cached_property
    def titles(self) -> tuple[str, str]:
        """Names of the axes x and y."""
        spec, (width, height) = self.map_.spec, self.panels_size
        x = _wrap_words(self.map_.title(spec.x), width + 2 * _MIN_MARGINS.left, AXIS_FONT_SIZE)
        return x, _wrap_words(self.map_.title(spec.y), height + _MIN_MARGINS.bottom, AXIS_FONT_SIZE)

    @cached_property
    def column_titles(self) -> list[str]:
        """What stands above each column of panels."""
        columns = self.map_.spec.columns
        if columns is None:
            return []
        title = self.map_.title(columns)
        texts = (f"{title}: {_label_text(label)}" if title else _label_text(label) for label in self.levels[1])
        return [_wrap_characters(text, self.panel[0] + _GAP - _PAD, PANEL_FONT_SIZE) for text in texts]

    @cached_property
    def row_titles(self) -> list[str]:
        """What stands beside each row of panels."""
        if self.map_.spec.rows is None:
            return []
        return [
            _wrap_characters(_label_text(label), self.panel[1] + _GAP - _PAD, AXIS_FONT_SIZE, "bold") for label in self.levels[0]
        ]

    @cached_property
    def y_ticks(self) -> dict[int, str]:
        """Levels along y by their number; only every second, third, ... where cells are lower than a line."""
        return _every_nth_label(list(map(_label_text, self.levels[2])), self.cell[1])

    @cached_property
    def x_ticks(self) -> dict[int, str]:
        """Levels along x by their number, as y's; turned where they are wider than cells."""
        texts = list(map(_label_text, self.levels[3]))
        return _every_nth_label(texts, self.cell[0]) if self.rotate_x_labels else dict(enumerate(map(self._wrap_in_cell, texts)))

    @cached_property
    def rotate_x_labels(self) -> bool:
        """Whether levels along x are read from below: their words are wider than a cell."""
        return _text_width(map(self._wrap_in_cell, map(_label_text, self.levels[3])), TICK_FONT_SIZE) > self.cell[0] - _PAD

    def _wrap_in_cell(self, text: str) -> str:
        return _wrap_words(text, self.cell[0] - _PAD, TICK_FONT_SIZE)

    @cached_property
    def margins(self) -> Margins:
        """As wide as the texts in them."""
        x, y = self.titles
        below = (
            _text_width(self.x_ticks.values(), TICK_FONT_SIZE)
            if self.rotate_x_labels
            else _text_height(self.x_ticks.values(), TICK_FONT_SIZE)
        )
        needed = Margins(
            left=_text_height([y], AXIS_FONT_SIZE) + _text_width(self.y_ticks.values(), TICK_FONT_SIZE) + 4 * _PAD,
            right=_text_height(self.row_titles, AXIS_FONT_SIZE) + 0.02 * self.panel[0] + _COLOUR_BAR_WIDTH + _PAD,
            bottom=_text_height([x], AXIS_FONT_SIZE) + below + 3 * _PAD,
            top=_text_height(self.column_titles, PANEL_FONT_SIZE) + 3 * _PAD,
        )
        return Margins(*map(max, needed, _MIN_MARGINS))


def _label_text(label: Any) -> str:
    return f"{label:g}" if isinstance(label, float) else str(label)


def _text_width(texts: Iterable[str], size: float, weight: str = "normal") -> float:
    """Of the widest line."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextPath

    font = FontProperties(size=size, weight=weight)
    lines = (line for text in texts for line in text.split("\n") if line.strip())
    return max((float(TextPath((0, 0), line, prop=font).get_extents().x1) / 72 for line in lines), default=0.0)


def _text_height(texts: Iterable[str], size: float) -> float:
    """Of the text with the most lines."""
    return max((text.count("\n") + 1 for text in texts), default=0) * _line_height(size)


def _line_height(size: float) -> float:
    return 1.2 * size / 72


def _wrap_words(text: str, width: float, size: float, weight: str = "normal") -> str:
    """In lines of at most `width`, broken between words."""
    lines: list[str] = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and _text_width([longer], size, weight) <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    return "\n".join(lines)


def _wrap_characters(text: str, width: float, size: float, weight: str = "normal") -> str:
    """As `_wrapped`, but words that are wider are broken too."""
    lines = _wrap_words(text, width, size, weight).split("\n")
    return "\n".join(piece for line in lines for piece in _split_word(line, width, size, weight))


def _split_word(word: str, width: float, size: float, weight: str) -> Iterator[str]:
    while word:
        length = next((n for n in range(len(word), 1, -1) if _text_width([word[:n]], size, weight) <= width), 1)
        yield word[:length]
        word = word[length:]


def _every_nth_label(texts: Sequence[str], space: float) -> dict[int, str]:
    """Every n-th text by its number, so that lines that are `space` apart do not touch."""
    every = math.ceil(_line_height(TICK_FONT_SIZE) / space)
    return {i: text for i, text in enumerate(texts) if i % every == 0}
