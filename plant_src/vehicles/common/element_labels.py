"""Labels of the elements of arrays of rotors, thrusters, propellers and rudders."""

from __future__ import annotations

from collections.abc import Sequence


def element_labels(labels: Sequence[str], slots: int, count: str) -> str:
    """Return the labels of all elements of an array, or which elements are in use if it has more elements than labels.

    Args:
        labels: Place of each part in words.
        slots: Number of elements of the array.
        count: Name of the parameter that is the number of parts, or the largest number.

    >>> element_labels(["port", "starboard"], 2, "rudder_count"), element_labels(["port", "starboard"], 16, "rudder_count")
    ('port, starboard', '1 to rudder_count')
    """
    return ", ".join(labels) if len(labels) == slots else f"1 to {count}"
