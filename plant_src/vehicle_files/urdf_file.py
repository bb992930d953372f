"""URDF file as XML elements with their lines, so that an error names file, line and link."""

import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path
from xml.parsers import expat

import numpy as np

from cosim.core.errors import InputError, Problem


class UrdfFile:
    """URDF file (Unified Robot Description Format).

    Args:
        path: The file.

    Attributes:
        root: The element <robot>.
        links: The elements <link> by name.

    Raises:
        InputError: The file cannot be read, contains elements of xacro, or uses a name twice.
    """

    def __init__(self, path: Path):
        self.path = path
        self._lines: dict[ET.Element, int] = {}
        self.root = self._parse()
        self._owners: dict[ET.Element, ET.Element] = {}
        for child in self.root:
            self._owners |= dict.fromkeys(child.iter(), child)
        if self.root.tag != "robot":
            raise self.error(self.root, f"found <{self.root.tag}>, expected <robot>")
        for element in self.root.iter():
            if element.tag.startswith("xacro:"):
                text = f"found <{element.tag}>; expand the file with xacro first"
                raise InputError(Problem(text, self.where(element)))
        self.links = self._by_name("link")
        self._by_name("joint")

    def _parse(self) -> ET.Element:
        builder, parser = ET.TreeBuilder(), expat.ParserCreate()

        def start(tag: str, attributes: dict[str, str]) -> None:
            self._lines[builder.start(tag, attributes)] = parser.CurrentLineNumber

        parser.StartElementHandler, parser.EndElementHandler = start, builder.end
        try:
            parser.Parse(self.path.read_bytes(), True)
        except OSError as error:
            raise InputError(Problem(f"cannot be read: {error.strerror}", str(self.path))) from None
        except expat.ExpatError as error:
            raise InputError(Problem(f"cannot be read as XML: {error}", str(self.path))) from None
        return builder.close()

    def _by_name(self, tag: str) -> dict[str, ET.Element]:
        """Return the elements with this tag by name."""
        found: dict[str, ET.Element] = {}
        for element in self.root.findall(tag):
            name = element.get("name", "")
            if name in found:
                raise self.error(
                    element, f"the name is used twice, first in line {self._lines[found[name]]}"
                )
            found[name] = element
        return found

    def error(self, element: ET.Element, text: str) -> InputError:
        """Return the error for an element."""
        owner = self._owners.get(element)
        parts = [] if owner is None else [f'{owner.tag} "{owner.get("name", "")}"']
        parts += [element.tag] if owner is not None and element is not owner else []
        return InputError(
            Problem(": ".join([", ".join(parts), text] if parts else [text]), self.where(element))
        )

    def where(self, element: ET.Element) -> str:
        """Return "file:line" of an element."""
        return f"{self.path}:{self._lines[element]}"

    def child(self, element: ET.Element, path: str) -> ET.Element:
        """Return the part of an element, for example "geometry/*"."""
        if (found := element.find(path)) is None:
            raise self.error(element, f"<{path.partition('/')[0]}> is missing")
        return found

    def number(
        self, element: ET.Element, name: str, default: str | None = None, low: float = -math.inf
    ) -> float:
        """Return the number in an attribute; without `default` the attribute is required."""
        (number,) = self.numbers(element, name, 1, default)
        if number < low:
            raise self.error(element, f"{_prefix(name)}found {number:g}, expected at least {low:g}")
        return float(number)

    def numbers(
        self, element: ET.Element, name: str, count: int, default: str | None = None
    ) -> np.ndarray:
        """Return the numbers in an attribute, shape (count,).

        Without `default` the attribute is required.
        """
        if (text := element.get(name, default)) is None:
            raise self.error(element, f'"{name}" is missing')
        try:
            numbers = np.array([float(word) for word in text.split()])
        except ValueError:
            numbers = np.zeros(0)
        if len(numbers) != count or not np.isfinite(numbers).all():
            hint = "; expand it with xacro first" if "${" in text else ""
            expected = "a number" if count == 1 else f"{count} numbers"
            raise self.error(element, f"{_prefix(name)}found {text!r}, expected {expected}{hint}")
        return numbers

    def edges(self, element: ET.Element, lengths: Sequence[float]) -> np.ndarray:
        """Return the edges (m) of the box around a shape with these lengths, shape (3,)."""
        if not min(lengths) > 0:
            raise self.error(
                element,
                (
                    f"found the edges {[float(length) for length in lengths]} m, expected all "
                    "greater than 0"
                ),
            )
        return np.array(lengths)


def _prefix(name: str) -> str:
    return "" if name == "value" else f"{name}: "
