"""Sizes of a success map's cells and panels, and its labels wrapped to fit.

Lengths in inches, font sizes in points.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

from .success_map import SuccessMap

#: font sizes of tick labels, titles of panels and titles of axes
TICK_FONT_SIZE, PANEL_FONT_SIZE, AXIS_FONT_SIZE = 7.0, 7.5, 8.0
#: distance between panels
GAP = 0.12
#: largest size of all panels together: the page of a two-column paper
_MAX_SIZE = 6.3, 8.2
_MAX_CELL_SIZE = 0.9, 0.46
#: smallest distance between two labels
_PAD = 0.06
#: length by which the titles of the axes x and y may exceed the panels; the margins have at least
#: this size
_TITLE_EXCESS = 0.6, 0.4
#: safety factor of the number of characters per line estimated from their average width
_WIDTH_VARIATION = 1.3


@dataclass(frozen=True)
class MapLayout:
    """Sizes and labels of a success map's figure.

    Margins are left to matplotlib's constrained layout.
    """

    map_: SuccessMap

    @cached_property
    def levels(self) -> tuple[Sequence[Any], Sequence[Any], Sequence[Any], Sequence[Any]]:
        """Labels of the levels along the rows of panels, the columns of panels, y and x."""
        spec, labels = self.map_.spec, self.map_.axis_labels
        return labels(spec.rows), labels(spec.columns), labels(spec.y), labels(spec.x)

    @cached_property
    def cell(self) -> tuple[float, float]:
        """Width and height of a cell."""
        rows, columns, ys, xs = map(len, self.levels)
        return min(_MAX_CELL_SIZE[0], _MAX_SIZE[0] / (columns * xs)), min(
            _MAX_CELL_SIZE[1], _MAX_SIZE[1] / (rows * ys)
        )

    @cached_property
    def panel(self) -> tuple[float, float]:
        """Width and height of a panel."""
        return len(self.levels[3]) * self.cell[0], len(self.levels[2]) * self.cell[1]

    @cached_property
    def panels_size(self) -> tuple[float, float]:
        """Width and height of all panels with the gaps between them."""
        return len(self.levels[1]) * (self.panel[0] + GAP), len(self.levels[0]) * (
            self.panel[1] + GAP
        )

    @cached_property
    def titles(self) -> tuple[str, str]:
        """Titles of the axes x and y."""
        lengths = (
            size + excess for size, excess in zip(self.panels_size, _TITLE_EXCESS, strict=True)
        )
        factors = (self.map_.spec.x, self.map_.spec.y)
        x, y = (
            _wrap(self.map_.title(factor), length, AXIS_FONT_SIZE)
            for factor, length in zip(factors, lengths, strict=True)
        )
        return x, y

    @cached_property
    def column_titles(self) -> list[str]:
        """Titles above the columns of panels."""
        columns = self.map_.spec.columns
        if columns is None:
            return []
        title = self.map_.title(columns)
        texts = (
            f"{title}: {_label_text(label)}" if title else _label_text(label)
            for label in self.levels[1]
        )
        return [
            _wrap_and_break(text, self.panel[0] + GAP - _PAD, PANEL_FONT_SIZE) for text in texts
        ]

    @cached_property
    def row_titles(self) -> list[str]:
        """Titles beside the rows of panels."""
        if self.map_.spec.rows is None:
            return []
        height = self.panel[1] + GAP - _PAD
        return [
            _wrap_and_break(_label_text(label), height, AXIS_FONT_SIZE, "bold")
            for label in self.levels[0]
        ]

    @cached_property
    def y_ticks(self) -> dict[int, str]:
        """Tick labels along y by index.

        Only every n-th where cells are lower than a line of text.
        """
        return _every_nth_label(list(map(_label_text, self.levels[2])), self.cell[1])

    @cached_property
    def x_ticks(self) -> dict[int, str]:
        """Tick labels of the x axis by index.

        Wrapped to the width of a cell, or rotated with every n-th label only.
        """
        if self.rotate_x_labels:
            return _every_nth_label(list(map(_label_text, self.levels[3])), self.cell[0])
        return dict(enumerate(self._wrapped_x_labels))

    @cached_property
    def rotate_x_labels(self) -> bool:
        """True if a word of the tick labels along x is wider than a cell, so that they must be rotated."""
        return (
            _text_width("\n".join(self._wrapped_x_labels).split("\n"), TICK_FONT_SIZE)
            > self.cell[0] - _PAD
        )

    @cached_property
    def _wrapped_x_labels(self) -> list[str]:
        return [
            _wrap(_label_text(label), self.cell[0] - _PAD, TICK_FONT_SIZE)
            for label in self.levels[3]
        ]


def _label_text(label: Any) -> str:
    return f"{label:g}" if isinstance(label, float) else str(label)


def _wrap(
    text: str, width: float, size: float, weight: str = "normal", break_words: bool = False
) -> str:
    """Break a text into lines of at most `width` between words, with `break_words` also between characters."""
    average = _text_width([text], size, weight) / max(1, len(text))
    longest = min(len(text), int(_WIDTH_VARIATION * width / average)) if average else 1
    lines = [text]
    for characters in range(longest, 0, -1):
        lines = textwrap.wrap(
            text, characters, break_long_words=break_words, break_on_hyphens=False
        )
        if _text_width(lines, size, weight) <= width:
            break
    return "\n".join(lines)


def _wrap_and_break(text: str, width: float, size: float, weight: str = "normal") -> str:
    """Break a text into lines between words, and then every line that is still too wide between characters."""
    lines = _wrap(text, width, size, weight).split("\n")
    return "\n".join(_wrap(line, width, size, weight, break_words=True) for line in lines)


def _text_width(lines: Iterable[str], size: float, weight: str = "normal") -> float:
    """Return the width of the widest line."""
    return max((_line_width(line, size, weight) for line in lines if line.strip()), default=0.0)


@lru_cache(4096)  # wrapping measures the same words again and again
def _line_width(line: str, size: float, weight: str) -> float:
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    font = FontProperties(size=size, weight=weight)
    return float(text_to_path.get_text_width_height_descent(line, font, ismath=False)[0]) / 72


def _every_nth_label(texts: Sequence[str], space: float) -> dict[int, str]:
    """Return every n-th text by index, with the smallest n for which lines of text `space` apart do not touch."""
    step = math.ceil(1.2 * TICK_FONT_SIZE / 72 / space)
    return dict(list(enumerate(texts))[::step])
